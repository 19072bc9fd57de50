"""What headers of several formats have in common: numbers in text, units of length, names of other files."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.polyline import UNITS_MM
from pipeline.load.geometry import LoadError, unusable
from reports.texts import NUMBER

MOST_PARTS = 100_000
PATTERN = re.compile(r"%0?\d{0,2}d")
"""The one pattern that a header may hold: a number. It goes to no printf of any library."""


def millimetres(what: object, unit: str) -> float:
    """Millimetres of a unit of length by its name."""
    name = unit.strip().strip('"').lower()
    if name not in UNITS_MM:
        allowed = "mm, um, cm, m, inch, nm"
        raise unusable(what, f"lengths in {unit!r}; allowed: {allowed}; convert the file")
    return UNITS_MM[name]


WRITTEN = re.compile(rf"{NUMBER}|[+-]?(?:nan|inf|infinity)", re.IGNORECASE)


def to_number(text: str) -> float:
    """A number of a table or a header; ValueError for anything else."""
    if not WRITTEN.fullmatch(text.strip()):
        raise ValueError(f"{text[:40]!r} is no number")
    return float(text)


def to_numbers(words: Sequence[bytes]) -> NDArray[np.float64]:
    """Numbers (n,) of a file's words, many at once; ValueError where ``to_number`` raises one."""
    # numpy reads a word as Python does: of what that takes beyond numbers as written, all has one of these
    if any(b"_" in word or not word.isascii() for word in words):
        raise ValueError("something else than numbers")
    return np.array(words, dtype=np.float64)


EXACT = 2**53
"""Whole numbers up to this one are read from text as they are."""


def misfits(values: NDArray[np.float64], kind: np.dtype[Any]) -> tuple[NDArray[np.bool_], str]:
    """Which of numbers (n,) that are written out a type cannot hold, and in words what it can."""
    whole = kind.kind in "iu"
    bounds = np.iinfo(kind) if whole else np.finfo(kind)
    low, high = (max(bounds.min, -EXACT), min(bounds.max, EXACT)) if whole else (bounds.min, bounds.max)
    bad = ~((values >= low) & (values <= high)) | (whole & (values != np.rint(values)))
    return bad, f"{'whole ' * whole}numbers from {low} to {high}, as its type says"


def to_whole(text: str) -> int:
    """A whole number of a header; ValueError for anything else."""
    if not text.isascii() or not text.lstrip("+-").isdigit():
        raise ValueError(f"{text[:40]!r} is no whole number")
    return int(text)


def numbers(
    what: object, tags: Mapping[str, str], name: str, count: int, *, whole: bool = False, missing: str | None = None
) -> NDArray[np.float64]:
    """``count`` finite numbers of a header's field."""
    text = tags.get(name, missing)
    words = (text or "").split()
    read = to_whole if whole else to_number
    try:
        values = np.array([read(word) for word in words], float)
    except (ValueError, OverflowError):
        values = np.zeros(0)
    if len(values) != count or not np.all(np.isfinite(values)) or (whole and np.abs(values).max(initial=0) > 2**53):
        kind = "whole numbers" if whole else "finite numbers"
        found = "nothing" if text is None else repr(text[:80])
        raise unusable(what, f"{name} of the header holds {found}; allowed: {count} {kind}; correct the header")
    return values


def said_twice(what: object, one: str, other: str) -> LoadError:
    """The error for a header that says two things."""
    return unusable(what, f"the header says {one} and {other}; allowed: one of them; correct the header")


def beside(header: Path, name: str) -> Path:
    """A file that a header names, in the header's own folder or below; LoadError for any other place."""
    part = Path(name)
    if not name or "\0" in name or part.is_absolute() or ".." in part.parts:
        why = f"its data are said to be in {name[:80]!r}; allowed: a file in the folder of the header, or below"
        raise unusable(header, f"{why}. Put both into one folder and correct the header.")
    return header.parent / part


def named_files(header: Path, text: str, below: str, planes: int) -> list[Path]:
    """The files that a header names: one, those of the list below it, or a pattern with its first and last number."""
    words = text.split()
    if words and words[0].upper() == "LIST":
        return [beside(header, line.strip()) for line in below.splitlines() if line.strip()]
    return numbered(header, words, planes) if "%" in text else [beside(header, text)]


def numbered(header: Path, words: list[str], count: int) -> list[Path]:
    """The files of a pattern as ``slice_%03d.raw 1 64 1``: their first number, last number and step."""
    name = words[0] if words else ""
    if len(PATTERN.findall(name)) != 1 or "%" in PATTERN.sub("", name):
        raise unusable(header, f"the pattern {name[:80]!r} of its data; allowed: one number, as in slice_%03d.raw")
    try:
        first, last, step = (*map(int, words[1:4]), *(1, count, 1)[len(words[1:4]) :])
    except ValueError:
        first, last, step = 1, 0, 0
    if step < 1 or not first <= last or (last - first) // step >= MOST_PARTS:
        raise unusable(header, f"the numbers {words[1:4]} of its data files; allowed: first, last and step")
    return [beside(header, name % number) for number in range(first, last + 1, step)]
