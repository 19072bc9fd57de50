"""Reads, writes and compares kept numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

FOLDER = Path(__file__).parent / "kept"
Numbers = Mapping[str, ArrayLike]
Scene = Callable[[], Numbers]
DIGITS = 9
ROUNDING = 1e-12
"""What is 0 but for rounding may be any number smaller than this, in mm, N or N mm."""


def digest(values: ArrayLike) -> list[float]:
    """What a large array is told by: its size, mean, deviation, and a sum with weights that no symmetry hides from.

    The size is a share of the largest value: as a number of its own it would be the largest of all, and what is allowed
    goes by that. 40,000 distances could each be 4 mm off.
    """
    row = np.asarray(values, float).ravel()
    row = row[np.isfinite(row)]
    if not len(row):
        return [0.0]
    size = (np.abs(row).max() or 1.0) * len(row) / 10 ** len(str(len(row)))
    weight = np.cos(np.arange(len(row)) ** 0.7)
    return [float(size), row.mean(), row.std(), float(weight @ row) / len(row) ** 0.5]


def lines_of(name: str, numbers: Numbers) -> list[str]:
    """A line for each quantity of a scene: its name and its values, arrays row after row."""
    rows = {f"{name}.{key}": np.asarray(values, float).ravel() for key, values in numbers.items()}
    return [" ".join([key, *(f"{value:.{DIGITS}g}" for value in row)]) for key, row in rows.items()]


def write(part: str, scenes: Mapping[str, Scene]) -> None:
    """Write the numbers of a part of the package anew."""
    lines = [line for name, scene in scenes.items() for line in lines_of(name, scene())]
    FOLDER.mkdir(exist_ok=True)
    (FOLDER / f"{part}.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")


def kept(part: str, name: str) -> dict[str, np.ndarray]:
    """The quantities of a scene as they were written."""
    words = [line.split() for line in (FOLDER / f"{part}.txt").read_text(encoding="utf-8").splitlines()]
    return {key: np.array(values, float) for key, *values in words if key.partition(".")[0] == name}


def different(part: str, name: str, numbers: Numbers, relative: float) -> str:
    """A line for each quantity that is not what it was, and then what to do; empty where all are.

    relative : allowed change, by the largest value of the quantity: a component that is small beside the others has
    their rounding.
    """
    was, found = kept(part, name), {f"{name}.{key}": np.asarray(v, float).ravel() for key, v in numbers.items()}
    lines = [f"{key}: only {'kept' if key in was else 'found'}" for key in sorted(was.keys() ^ found.keys())]
    for key in (key for key in found if key in was):
        old, new = was[key], found[key]
        if old.shape != new.shape or not np.array_equal(np.isfinite(old), np.isfinite(new)):
            lines.append(f"{key}: was {old}, is {new}")
            continue
        allowed = relative * np.abs(old[np.isfinite(old)]).max(initial=0.0) + ROUNDING
        if np.abs(np.nan_to_num(old - new)).max(initial=0.0) > allowed:
            lines.append(f"{key}: was {old}, is {new}, allowed {allowed:.2g}")
    return "\n".join([*lines, "was that meant? then `make numbers`, and say why: see tests/numbers"]) if lines else ""
