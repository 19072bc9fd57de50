"""Values as a reader sees them: three significant digits, an en dash where a value does not apply."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import pandas as pd

NOTHING = "–"
_LEVEL = {"min", "median", "max"}


def number(value: Any, digits: int = 3) -> str:
    """A number with ``digits`` significant digits, no exponent between 0.0001 and a million; – for none."""
    if value is None or value is pd.NA or (isinstance(value, float) and math.isnan(value)):
        return NOTHING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if not isinstance(value, float):
        return str(value)
    if value == 0 or math.isinf(value):
        return f"{value:g}"
    exponent = math.floor(math.log10(abs(value)))
    if not -4 <= exponent < 6:
        return f"{value:.{digits}g}"
    return f"{value:.{max(digits - 1 - exponent, 0)}f}"


def interval(low: Any, high: Any) -> str:
    """``low to high``; empty where either is missing."""
    ends = (number(low), number(high))
    return "" if NOTHING in ends else f"{ends[0]} to {ends[1]}"


def flatten(tree: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Dotted keys and texts of a nested mapping, in its order; empty values are left out.

    A level (a mapping of min, median and max, such as the contrast over all frames) is one text.
    """
    for key, value in tree.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping) and value.keys() == _LEVEL:
            if value["median"] is not None:
                yield name, f"{number(value['median'])} ({interval(value['min'], value['max'])})"
        elif isinstance(value, Mapping):
            yield from flatten(value, f"{name}.")
        elif value not in (None, "", [], ()):
            yield name, _text(value)


def settings(config: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Rows (table.key, value, source) of a resolved configuration."""
    rows = []
    for table, keys in config.items():
        for key, entry in keys.items() if isinstance(keys, Mapping) else ():
            known = isinstance(entry, Mapping) and "value" in entry
            value, source = (entry["value"], str(entry.get("source", ""))) if known else (entry, "")
            rows.append((f"{table}.{key}", _text(value), source))
    return rows


def size(n_bytes: int) -> str:
    """A file's size in kB or MB."""
    return f"{n_bytes / 1e6:.1f} MB" if n_bytes >= 1e6 else f"{max(n_bytes / 1e3, 0.1):.1f} kB"


def _text(value: Any) -> str:
    if isinstance(value, (list, tuple)):
        parts = [_text(v) for v in value]
        return " ".join(parts) if all(isinstance(v, str) for v in value) else f"[{', '.join(parts)}]"
    # counts arrive as floats (16777216.0 voxels), directions with sixteen digits
    return f"{value:.9g}" if isinstance(value, float) else str(value)
