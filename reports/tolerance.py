"""How much a value may change between two runs before a gate closes: a TOML file, column = allowed change."""

import math
import tomllib
from pathlib import Path

from reports.schema import ERRORS

DEFAULT_TOLERANCE = Path(__file__).parent / "baseline" / "tolerance.toml"
RATIO = "rms_ratio"
"""In a tolerance: how far above 1 the whole interval of the ratio of two runs' errors may lie."""


def load_tolerance(path: Path = DEFAULT_TOLERANCE) -> dict[str, float]:
    """Read column = allowed change, with the shipped one of the ratio over all frames where the file has none.

    Raises ValueError for a file without columns, an unknown column, and a negative, infinite or absent number.
    """
    if not path.is_file():
        raise ValueError(f"{path}: no such file; a tolerance is a TOML file of lines such as rms_mm = 0.03")
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    if not table:
        raise ValueError(f"{path}: it names no column, so that every change would be allowed")
    ERRORS.check(table.keys() - {RATIO}, str(path))
    for name, value in table.items():
        if name != RATIO and ERRORS[name].kind == "text":
            raise ValueError(f"{path}: {name} holds no number; a status that is worse always closes the gate")
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number or not 0 <= value < math.inf:
            raise ValueError(f"{path}: {name} = {value!r}; give the allowed change, a number from 0 up")
    shipped = {} if RATIO in table else {RATIO: load_tolerance()[RATIO]}
    return {name: float(value) for name, value in table.items()} | shipped
