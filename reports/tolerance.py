"""How much a value may change between two runs before a gate closes: a TOML file, column = allowed change."""

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from reports.schema import ERRORS
from reports.texts import read_toml, status_of

DEFAULT_TOLERANCE = Path(__file__).parent / "baseline" / "tolerance.toml"
RATIO = "rms_ratio"
"""In a tolerance: how far above 1 the whole interval of the ratio of two runs' errors may lie."""


SHARE = "share"
"""Table of a tolerance with the change that is allowed as a share of the first run's value, where that is more."""


def columns_in(tolerance: Mapping[str, float]) -> list[str]:
    """The columns of errors.csv that a tolerance names."""
    return [name for name in tolerance if name != RATIO and not name.startswith(f"{SHARE}.")]


def allowed_of(tolerance: Mapping[str, float], column: str, before: float) -> float:
    """The allowed change of a column whose value was ``before`` (NaN: none), in its unit."""
    share = tolerance.get(f"{SHARE}.{column}", 0.0) * abs(before)
    return tolerance[column] if math.isnan(share) else max(tolerance[column], share)


def load_tolerance(path: Path = DEFAULT_TOLERANCE) -> dict[str, float]:
    """Read column = allowed change, with the shipped one of the ratio over all frames where the file has none.

    A share of the table ``share`` is under ``share.COLUMN``. Raises ValueError for a file without columns, or without
    one of an error, an unknown column, a share of a column that is not named, and a negative, infinite or absent
    number.
    """
    if status_of(path) is None:
        raise ValueError(f"{path}: no such file; a tolerance is a TOML file of lines such as rms_mm = 0.03")
    table = read_toml(path)
    if not table:
        raise ValueError(f"{path}: it names no column, so that every change would be allowed")
    shares = table.pop(SHARE, {})
    ERRORS.check(table.keys() - {RATIO}, str(path))
    for name, value in table.items():
        if name != RATIO and ERRORS[name].kind == "text":
            raise ValueError(f"{path}: {name} holds no number; a status that is worse always closes the gate")
        if not _is_change(value):
            raise ValueError(f"{path}: {name} = {value!r}; give the allowed change, a number from 0 up")
    _check_errors(table, path)
    _check_shares(shares, table, path)
    shipped = {} if RATIO in table else {RATIO: load_tolerance()[RATIO]}
    found = table | {f"{SHARE}.{name}": value for name, value in shares.items()}
    return {name: float(value) for name, value in found.items()} | shipped


def _is_change(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and 0 <= value < math.inf


def _check_shares(shares: Any, columns: Iterable[str], path: Path) -> None:
    """Refuse a share that would be ignored."""
    named = [name for name in columns if name != RATIO]
    for name, value in shares.items() if isinstance(shares, dict) else [("", shares)]:
        if name not in named or not _is_change(value):
            got = f"[{SHARE}] {name} = {value!r}" if name else f"{SHARE} = {value!r}"
            allowed = "a number from 0 up for a column that has a line above, as rms_mm = 0.1 for a tenth"
            raise ValueError(f"{path}: {got}; allowed: {allowed}")


def _check_errors(given: Iterable[str], path: Path) -> None:
    """Refuse columns of which none is an error: a gate that no error closes would say "not worse" of any.

    The ratio alone is no gate either: it is withheld below three insertions.
    """
    errors = [column.name for column in ERRORS if column.unit == "mm" and column.better == "low"]
    if not set(given) & set(errors):
        found = ", ".join(given) or f"[{SHARE}] alone"
        raise ValueError(
            f"{path}: found {found}: no error, so that errors of any size would pass; name at least rms_mm, as in "
            f"rms_mm = 0.03; one is needed of {', '.join(errors)}"
        )
