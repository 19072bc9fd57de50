"""How much a value may change between two runs before a gate closes: a TOML file, column = allowed change."""

import math
from collections.abc import Iterable
from pathlib import Path

from reports.schema import ERRORS
from reports.texts import read_toml, status_of

DEFAULT_TOLERANCE = Path(__file__).parent / "baseline" / "tolerance.toml"
RATIO = "rms_ratio"
"""In a tolerance: how far above 1 the whole interval of the ratio of two runs' errors may lie."""


def load_tolerance(path: Path = DEFAULT_TOLERANCE) -> dict[str, float]:
    """Read column = allowed change, with the shipped one of the ratio over all frames where the file has none.

    Raises ValueError for a file without columns, or without one of an error, an unknown column, and a negative,
    infinite or absent number.
    """
    if status_of(path) is None:
        raise ValueError(f"{path}: no such file; a tolerance is a TOML file of lines such as rms_mm = 0.03")
    table = read_toml(path)
    if not table:
        raise ValueError(f"{path}: it names no column, so that every change would be allowed")
    ERRORS.check(table.keys() - {RATIO}, str(path))
    for name, value in table.items():
        if name != RATIO and ERRORS[name].kind == "text":
            raise ValueError(f"{path}: {name} holds no number; a status that is worse always closes the gate")
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number or not 0 <= value < math.inf:
            raise ValueError(f"{path}: {name} = {value!r}; give the allowed change, a number from 0 up")
    _check_errors(table, path)
    shipped = {} if RATIO in table else {RATIO: load_tolerance()[RATIO]}
    return {name: float(value) for name, value in table.items()} | shipped


def _check_errors(given: Iterable[str], path: Path) -> None:
    """Refuse columns of which none is an error: a gate that no error closes would say "not worse" of any.

    The ratio alone is no gate either: it is withheld below three insertions.
    """
    errors = [column.name for column in ERRORS if column.unit == "mm" and column.better == "low"]
    if not set(given) & set(errors):
        raise ValueError(
            f"{path}: found {', '.join(given)}: no error, so that errors of any size would pass; name at least rms_mm, "
            f"as in rms_mm = 0.03; one is needed of {', '.join(errors)}"
        )
