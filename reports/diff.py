"""Two runs of the same study compared frame by frame: what became worse than allowed.

Reads errors.csv of every case of both folders and nothing else, so a folder of golden tables is enough.
"""

import math
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pandas as pd

from reports.case_files import GOOD, counted, find_cases, listed, not_run, results_in
from reports.closing import BEFORE_COMPARE, how_many, is_error, told, worst_first
from reports.schema import ERRORS
from reports.tables import read_if_there
from reports.tolerance import allowed_of, columns_in

FITTED = "roll_fitted"
_LACKING = "in no frame"
_SCAN = ["case", "frame"]
"""What tells frames apart: those of several simulators are of one scan, and count once."""
CLOSING = ("regression", "moved")
"""Verdicts on a row for which a gate must close."""
_HEADER = ["case", "frame", "column", "before", "after", "change", "allowed", "verdict"]
Row = tuple[Any, ...]


@dataclass(frozen=True, eq=False)
class Difference:
    """Two runs compared. rows : (simulator, of scores,) case, frame, column, before, after, change, allowed, verdict.

    verdict : "same"; "within" what is allowed; "better"; "regression"; "moved", a value of which neither direction is
    better that changed by more than is allowed, or a column that the second run has in no frame; "new", what only the
    second run has (of a frame, ``after`` is its status).     empty : cases of which the first run has no number to
    compare with.     unscored : cases of role calibration that one run alone has: they count in no score of it.
    """

    rows: pd.DataFrame
    empty: tuple[str, ...] = ()
    unscored: tuple[str, ...] = ()

    @property
    def regressions(self) -> pd.DataFrame:
        """The rows that became worse, the worst first: what is missing, errors, then other columns."""
        return worst_first(self.rows[self.rows["verdict"] == "regression"])

    @property
    def beside_errors(self) -> bool:
        """Whether something became worse, and no error of a simulated wire did, nor went anything missing."""
        rows = self.regressions
        return bool(len(rows)) and not (rows["change"].isna() | rows["column"].map(is_error)).any()

    @property
    def closes(self) -> str:
        """The row that closes a gate, the worst where several do; empty without any."""
        bad, moved = self.regressions, self.moved
        if not len(bad) and not len(moved):
            return ""
        return told(bad.iloc[0] if len(bad) else moved.iloc[0])

    @property
    def lacking(self) -> list[str]:
        """Columns of which the first run has values and the second has none, in any frame."""
        return list(dict.fromkeys(self.rows["column"][self.rows["after"].eq(_LACKING)]))

    @property
    def judged(self) -> bool:
        """Whether any value that can become worse was compared. Equal statuses alone say nothing about errors."""
        directed = self.rows["column"].isin([column.name for column in ERRORS if column.better])
        return bool((directed & self.rows["change"].notna()).any())

    @property
    def moved(self) -> pd.DataFrame:
        """The rows that changed by more than is allowed and are neither better nor worse."""
        return self.rows[self.rows["verdict"] == "moved"]

    @property
    def new(self) -> pd.DataFrame:
        """Frames, and cases without frames, that only the second run has: nothing to compare them with."""
        return self.rows[(self.rows["verdict"] == "new") & self.rows["column"].isin(["frame", "case"])]

    @property
    def by_column(self) -> pd.DataFrame:
        """By column: pairs, median change, worst change (largest, if neither side is better), regressions, moved."""
        paired = self.rows[self.rows["change"].notna()]
        worse = paired["change"] * paired["column"].map(_sign)
        marks = {name: paired["verdict"] == verdict for name, verdict in (("bad", "regression"), ("moved", "moved"))}
        by = [name for name in ("simulator", "column") if name in paired]
        columns = paired.assign(worse=worse, **marks).groupby(by, sort=False)
        table = {
            "pairs": columns.size(),
            "median_change": columns["change"].median(),
            "worst": columns["worse"].max() * columns.size().index.get_level_values("column").map(_sign) + 0.0,
            "regressions": columns["bad"].sum(),
            "moved": columns["moved"].sum(),
        }
        return pd.DataFrame(table).reset_index()

    @property
    def sentence(self) -> str:
        """One line for the end of the command."""
        n_bad, head = len(self.regressions), self._compared()
        moved = self.moved[self.moved["after"].ne(_LACKING)]
        names = ", ".join(moved["column"].unique())
        have = "value has" if len(moved) == 1 else "values have"
        tail = f"; {len(moved)} {have} moved: {names}" if names else ""
        if self.lacking:
            tail += f"; the second run has no {', '.join(self.lacking)} in any frame"
        if self.empty:
            tail += f"; the first run has nothing to hold against in {', '.join(self.empty)}"
        if self.unscored:
            tail += f"; not compared, since one run alone has them and they count in no score: {listed(self.unscored)}"
        mended = self.rows[(self.rows["column"] == "status") & (self.rows["verdict"] == "better")]
        mended = mended[~mended["before"].isin(GOOD)].drop_duplicates(_SCAN)
        if len(mended):
            places = [f"{row['case']} frame {row['frame']}" for row in mended.to_dict("records")]
            tail += f"; {counted(len(mended), 'frame')} that failed {'is' if len(mended) == 1 else 'are'} ok now: "
            tail += listed(places)
        if len(self.new):
            new = self.new.drop_duplicates(_SCAN)
            failed = len(self.new[~self.new["after"].isin([*GOOD, "present"])].drop_duplicates(_SCAN))
            tail += f"; held against nothing, since only the second run has them: {counted(len(new), 'frame')}"
            tail += f", {failed} of which failed" * bool(failed)
        come = self.rows[(self.rows["verdict"] == "new") & (self.rows["column"] == "simulator")]
        if len(come):
            tail += f"; only the second run has the simulator {listed([*come['simulator']])}"
        if not n_bad:
            return f"{head}: no regression{tail}"
        alone = "; no error of a simulated wire is worse than is allowed" * self.beside_errors
        return f"{head}: {how_many(self.rows)}; the worst: {self.closes}{alone}{tail}"

    def _compared(self) -> str:
        """How many cases were compared, of how many."""
        rows = self.rows[self.rows["column"] != "simulator"]
        held = rows["case"][rows["column"] == "status"].nunique()
        cases = rows["case"].nunique()
        all_of_them = counted(cases, "case")
        return f"{all_of_them} compared" if held == cases else f"{held} of {all_of_them} compared"


def diff_folders(
    out_a: Path, out_b: Path, tolerance: Mapping[str, float], damaged: Mapping[str, str] = MappingProxyType({})
) -> Difference:
    """Compare errors.csv of every case of two output folders; ``out_a`` is the reference.

    A case without errors.csv counts as one without frames. damaged : cases of ``out_b`` whose files cannot be relied
    on, and why; each is a regression. A case of role calibration that one run alone has is named and not compared: a
    calibrated run leaves it out itself.

    Raises ValueError where ``out_a`` has no case or no number, since a gate without a reference would always be open.
    """
    before, after = (
        {
            folder.name: read_if_there(folder / ERRORS.file, ERRORS)
            for folder in find_cases(out)
            if folder.name not in bad
        }
        for out, bad in ((out_a, {}), (out_b, damaged))
    )
    if not before:
        raise ValueError(f"{out_a}: no cases/*/errors.csv; give a folder that `wireval run` wrote")
    beside = {*_unscored(out_a, before, out_b, after), *_unscored(out_b, after, out_a, before)} - {*damaged}
    before, after = ({n: table for n, table in of.items() if n not in beside} for of in (before, after))
    if not before:
        raise ValueError(f"{out_a}: nothing to hold against: all of it are calibration cases that {out_b} left out")
    empty = tuple(name for name, table in before.items() if not _has_numbers(table, tolerance))
    if len(empty) == len(before):
        what = "nothing to hold against: no frame of it is ok and has an error that the tolerance names"
        raise ValueError(f"{out_a}: {what}; a run that ended before frames are compared has none")
    return replace(diff_tables(before, after, tolerance, damaged), empty=empty, unscored=tuple(sorted(beside)))


def _unscored(out: Path, own: Container[str], other: Path, others: Container[str]) -> list[str]:
    """Cases of role calibration that are in one folder alone, where no run into the other was to compute them."""
    roles = {name: result.get("role") for name, result in results_in(out).items() if name in own and name not in others}
    awaited = not_run(other)
    return [name for name, role in roles.items() if role == "calibration" and name not in awaited]


def not_judged(tolerance: Mapping[str, float]) -> str:
    """A sentence where the tolerance names no error of the simulated wire, so that none is compared; else empty."""
    names = columns_in(tolerance)
    if any(is_error(name) and ERRORS[name].unit == "mm" for name in names):
        return ""
    return f"no error of the simulated wire is judged frame by frame: the tolerance names {', '.join(names)} alone"


def _has_numbers(table: pd.DataFrame, tolerance: Mapping[str, float]) -> bool:
    """Whether a frame is ok and has a value that could become worse: an error, where the tolerance names one."""
    names = columns_in(tolerance)
    directed = [name for name in names if ERRORS[name].better]
    names = [name for name in directed if name not in BEFORE_COMPARE] or directed or names
    good = table[table["status"].isin(GOOD)]
    return bool(good[names].notna().to_numpy().any() if names else len(good))


def diff_tables(
    before: Mapping[str, pd.DataFrame],
    after: Mapping[str, pd.DataFrame],
    tolerance: Mapping[str, float],
    damaged: Mapping[str, str] = MappingProxyType({}),
) -> Difference:
    """Compare tables of errors by case.

    Regressions, too, are a missing or damaged case, a missing frame, and a frame that fails only in the second run.
    """
    rows: list[Row] = []
    for case in dict.fromkeys([*before, *after, *damaged]):
        if case in damaged:
            rows.append((case, pd.NA, "status", "whole", damaged[case], math.nan, math.nan, "regression"))
        elif case in before and case in after:
            rows += [(case, *row) for row in _case_rows(before[case], after[case], tolerance)]
        elif case in before:
            rows.append((case, pd.NA, "case", "present", "missing", math.nan, math.nan, "regression"))
        else:
            new = [*_case_rows(after[case].iloc[:0], after[case], tolerance)]
            rows += [(case, *row) for row in new or [(pd.NA, "case", "missing", "present", math.nan, math.nan, "new")]]
    return Difference(pd.DataFrame(_lacking_once(rows), columns=_HEADER))


def _lacking_once(rows: list[Row]) -> list[Row]:
    """The rows, those of a column that the second run has in no frame as one for each case.

    It lacks the truth, or is of a simulator that has no push force: that is another thing, and not worse.
    """
    seen: dict[str, bool] = {}
    for _, _, column, before, after, *_, allowed, _ in rows:
        if not math.isnan(allowed) and not math.isnan(before):
            seen[column] = seen.get(column, False) or not math.isnan(after)
    lacking = {column for column, found in seen.items() if not found}
    kept = [row for row in rows if row[2] not in lacking]
    cases = dict.fromkeys((row[0], row[2]) for row in rows if row[2] in lacking and not math.isnan(row[3]))
    lost = [(case, pd.NA, column, "present", _LACKING, math.nan, math.nan, "moved") for case, column in cases]
    return [*kept, *lost]


def _case_rows(before: pd.DataFrame, after: pd.DataFrame, tolerance: Mapping[str, float]) -> Iterator[Row]:
    old, new = ({row["frame"]: row for row in table.to_dict("records")} for table in (before, after))
    for frame in sorted({*old, *new}):
        if frame in old and frame in new:
            was, now = old[frame]["status"], new[frame]["status"]
            verdict = _of_status(was, now)
            yield frame, "status", was, now, math.nan, math.nan, verdict
            if (was == FITTED) != (now == FITTED):  # an error of a frame that the roll was fitted on is no score
                continue
            for name in columns_in(tolerance):
                if verdict == "better" and not ERRORS[name].better:  # of a frame that failed, another depth was known
                    continue
                # of a frame that failed the error is in no score, whatever its refused trace was off by
                if ERRORS[name].better and not (was in GOOD and now in GOOD):
                    continue
                pair = (old[frame][name], new[frame][name])
                a, b = (math.nan if pd.isna(value) else float(value) for value in pair)
                # a frame that fails now counts once, though it may have errors
                if verdict in ("same", "better") or (verdict == "moved" and not math.isnan(b)):
                    allowed = allowed_of(tolerance, name, a)
                    yield frame, name, a, b, b - a, allowed, _verdict(name, a, b, allowed)
        elif frame in old:
            yield frame, "frame", "present", "missing", math.nan, math.nan, "regression"
        else:
            yield frame, "frame", "missing", new[frame]["status"], math.nan, math.nan, "new"


def _of_status(was: str, now: str) -> str:
    """Of one failure for another, and of a frame that is scored in one run alone, nobody knows whether it is worse."""
    if was == now:
        return "same"
    if now not in GOOD:
        return "regression" if was in GOOD else "moved"
    if FITTED in (was, now):
        return "moved" if was in GOOD else "better"
    return "regression" if was == "ok" else "better"


def _verdict(name: str, old: float, new: float, allowed: float) -> str:
    if old == new or math.isnan(old):
        return "same" if old == new or math.isnan(new) else "new"
    directed = bool(ERRORS[name].better)
    worse = (new - old) * _sign(name) if directed else abs(new - old)
    if math.isnan(new):
        return "regression"
    # a change of exactly the allowed size is allowed, whatever its last bit
    if worse > allowed * (1 + 1e-9):
        return "regression" if directed else "moved"
    return "better" if directed and worse < 0 else "within"


def _sign(name: str) -> float:
    """-1 where more is better, else 1."""
    return -1.0 if ERRORS[name].better == "high" else 1.0
