"""Two runs of the same study compared frame by frame: what became worse than allowed.

Reads errors.csv of every case of both folders and nothing else, so a folder of golden tables is enough.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from reports.case_files import GOOD, find_cases
from reports.schema import ERRORS_COLUMNS, check_names
from reports.tables import empty_table, read_errors

DEFAULT_TOLERANCE = Path(__file__).parent / "baseline" / "tolerance.toml"
_BETTER = {c.name: c.better for c in ERRORS_COLUMNS}
_HEADER = ("case", "frame", "column", "before", "after", "change", "allowed", "verdict")


@dataclass(frozen=True, eq=False)
class Difference:
    """rows: case, frame, column, before, after, change, allowed, verdict.

    verdict : same, within, better, regression, or new (only the second run has it).
    """

    rows: pd.DataFrame

    @property
    def regressions(self) -> pd.DataFrame:
        """The rows for which a gate must close."""
        return self.rows[self.rows["verdict"] == "regression"]

    @property
    def by_column(self) -> pd.DataFrame:
        """Per column: pairs, median change, worst change (in the bad direction), regressions."""
        paired = self.rows[self.rows["change"].notna()]
        worse = paired["change"] * paired["column"].map(_sign)
        table = paired.assign(worse=worse).groupby("column", sort=False)
        return pd.DataFrame(
            {
                "pairs": table.size(),
                "median_change": table["change"].median(),
                "worst": table["worse"].max(),
                "regressions": table["verdict"].agg(lambda v: int((v == "regression").sum())),
            }
        ).reset_index()

    @property
    def sentence(self) -> str:
        """One line for the end of the command."""
        n_cases = self.rows["case"].nunique()
        n_bad = len(self.regressions)
        if not n_bad:
            return f"{n_cases} cases compared: no regression"
        first = self.regressions.iloc[0]
        place = f"case {first['case']}" + ("" if pd.isna(first["frame"]) else f" frame {first['frame']}")
        return (
            f"{n_cases} cases compared: {n_bad} regressions; the first: {place}, {first['column']} "
            f"{_show(first['before'])} -> {_show(first['after'])} (allowed {_show(first['allowed'])})"
        )


def load_tolerance(path: Path = DEFAULT_TOLERANCE) -> dict[str, float]:
    """Read column = allowed change. Raises ValueError for an unknown column or a negative or absent number."""
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    check_names(table, ERRORS_COLUMNS, str(path))
    for name, value in table.items():
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number or not value >= 0:
            msg = f"{path}: {name} = {value!r}; give the allowed change, a number from 0 up"
            raise ValueError(msg)
    return {name: float(value) for name, value in table.items()}


def diff_folders(out_a: Path, out_b: Path, tolerance: Mapping[str, float]) -> Difference:
    """Compare the errors.csv of every case of two output folders, ``out_a`` being the one to hold against.

    Raises ValueError where ``out_a`` has no case: a gate without a reference would always be open.
    """
    before, after = _tables(out_a), _tables(out_b)
    if not before:
        msg = f"{out_a}: no cases/*/errors.csv; give a folder that `wireval run` wrote"
        raise ValueError(msg)
    return diff_tables(before, after, tolerance)


def diff_tables(
    before: Mapping[str, pd.DataFrame], after: Mapping[str, pd.DataFrame], tolerance: Mapping[str, float]
) -> Difference:
    """Compare errors tables by case. A missing case or frame, and a status that is no longer ok, regress."""
    rows: list[tuple[object, ...]] = []
    for case in dict.fromkeys([*before, *after]):
        if case not in after:
            rows.append((case, pd.NA, "case", "present", "missing", math.nan, math.nan, "regression"))
        elif case not in before:
            rows.append((case, pd.NA, "case", "missing", "present", math.nan, math.nan, "new"))
        else:
            rows += _case_rows(case, before[case], after[case], tolerance)
    return Difference(pd.DataFrame(rows, columns=list(_HEADER)))


def _case_rows(
    case: str, before: pd.DataFrame, after: pd.DataFrame, tolerance: Mapping[str, float]
) -> list[tuple[object, ...]]:
    old = {row["frame"]: row for row in before.to_dict("records")}
    new = {row["frame"]: row for row in after.to_dict("records")}
    rows: list[tuple[object, ...]] = []
    for frame in sorted({*old, *new}):
        if frame not in new:
            rows.append((case, frame, "frame", "present", "missing", math.nan, math.nan, "regression"))
        elif frame not in old:
            rows.append((case, frame, "frame", "missing", "present", math.nan, math.nan, "new"))
        else:
            rows.append((case, frame, *_status(old[frame]["status"], new[frame]["status"])))
            rows += [
                (case, frame, *_value(name, old[frame][name], new[frame][name], allowed))
                for name, allowed in tolerance.items()
            ]
    return rows


def _status(before: object, after: object) -> tuple[object, ...]:
    verdict = "same" if before == after else "better" if after in GOOD else "regression"
    return "status", before, after, math.nan, math.nan, verdict


def _value(name: str, before: object, after: object, allowed: float) -> tuple[object, ...]:
    old, new = _number(before), _number(after)
    change = new - old
    if math.isnan(old):
        verdict = "same" if math.isnan(new) else "new"
    elif math.isnan(new):
        verdict = "regression"
    else:
        verdict = _judge(name, change, allowed)
    return name, old, new, change, allowed, verdict


def _judge(name: str, change: float, allowed: float) -> str:
    if change == 0:
        return "same"
    worse = abs(change) if not _BETTER[name] else change * _sign(name)
    # a change of exactly the allowed size is allowed, whatever its last bit
    if worse > allowed * (1 + 1e-9):
        return "regression"
    return "better" if _BETTER[name] and worse < 0 else "within"


def _sign(name: str) -> float:
    return -1.0 if _BETTER.get(name) == "high" else 1.0


def _number(value: object) -> float:
    return (
        math.nan
        if value is None or value is pd.NA
        else float(str(value).replace("True", "1").replace("False", "0"))
    )


def _show(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _tables(out: Path) -> dict[str, pd.DataFrame]:
    """Tables by case; a case without errors.csv has no frames."""
    found = {folder.name: folder / "errors.csv" for folder in find_cases(out)}
    return {
        name: read_errors(path) if path.exists() else empty_table(ERRORS_COLUMNS)
        for name, path in found.items()
    }
