"""Doors: every argument from outside is checked once, where it comes in, and refused by name.

numpy turns much into numbers that is none: "12", a mask, a masked array (dropping its mask), [5.0] for three depths.
Such a number gives a wrong wire that is called converged, so only numbers are accepted as numbers.
"""

import math
from collections.abc import Iterable, Mapping, Sequence, Set
from numbers import Real
from types import EllipsisType
from typing import Any, NamedTuple, TypeGuard, TypeVar

import numpy as np
from numpy.typing import NDArray

from solver.errors import refuse

Array = NDArray[np.float64]
T = TypeVar("T")


Shape = tuple[int | EllipsisType | None, ...]


class Range(NamedTuple):
    """Least and largest value allowed, what to do where a value is beyond them, and what to write for other shapes."""

    least: float
    largest: float
    advice: str = "leave it out for the default"
    shape: str = "give plain numbers, in the unit of its name"


FAR_MM = 1e7
"""Largest coordinate and depth: rounding moves a joint by 2e-9 mm there."""
ANYWHERE_MM = Range(-FAR_MM, FAR_MM, "LPS, in mm")
ANGLE_DEG = Range(-1e6, 1e6, "a turn is 360")
LENGTH_MM = Range(1e-6, FAR_MM)
FORCE_N = Range(-1e6, 1e6, "a guide wire carries less than 10 N")


def number(what: str, name: str, value: object, allowed: Range) -> float:
    """A finite number within a range; no text, no truth value, no list."""
    taken = value if type(value) is float else _float(value)
    # written so that NaN fails
    if not allowed.least <= taken <= allowed.largest:
        refuse(what, name, value, f"a number from {allowed.least:g} to {allowed.largest:g}", allowed.advice)
    return taken


def _float(value: object) -> float:
    """A number as a float; NaN for anything that is not a number."""
    scalar = isinstance(value, np.ndarray) and value.ndim == 0 and value.dtype.kind in "iuf"
    if isinstance(value, (bool, np.ma.MaskedArray)) or not (scalar or isinstance(value, Real)):
        return math.nan
    try:
        return float(value)  # type: ignore[arg-type]
    except OverflowError:
        return math.nan


def whole(what: str, name: str, value: object, largest: int) -> int:
    """A whole number from 1 up."""
    taken = number(what, name, value, Range(1, largest))
    if taken != math.floor(taken):
        refuse(what, name, value, f"a whole number from 1 to {largest}", "round it")
    return int(taken)


def choice(what: str, name: str, value: object, allowed: Sequence[str]) -> str:
    """One of a few words."""
    if not (isinstance(value, str) and value in allowed):
        refuse(what, name, value, ", ".join(allowed), "choose one of these")
    return value


def instance(what: str, name: str, value: object, kind: type[T]) -> T:
    """An object of the class that is asked for."""
    if not isinstance(value, kind):
        refuse(what, name, value, f"a {kind.__name__}", f"make one with solver.{kind.__name__}(...)")
    return value


def numbers(what: str, name: str, value: object, shape: Shape, allowed: Range) -> Array:
    """Finite numbers within a range, as float64 in the shape that is asked for; perhaps the caller's own array.

    shape : None stands for any length, a leading ``...`` for any axes.
    """
    sizes = ["..." if n is ... else "n" if n is None else str(n) for n in shape]
    text = f"numbers of shape ({', '.join(sizes)}{',' * (len(sizes) == 1)})"
    try:
        raw = np.asarray(value)
    except (TypeError, ValueError, OverflowError):
        refuse(what, name, value, text, "rows must be equally long")
    masked = isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value)
    if raw.dtype.kind not in "iuf" or not _fits(raw.shape, shape) or masked:
        kind = "a masked array" if masked else f"{raw.dtype} of shape {raw.shape}"
        refuse(what, name, Found(f"{kind}, {value!r}"), text, allowed.shape)
    taken = np.asarray(raw, dtype=np.float64)
    # written so that NaN, which is its own minimum, fails too
    if taken.size and not (taken.min() >= allowed.least and taken.max() <= allowed.largest):
        where = np.argwhere(~((taken >= allowed.least) & (taken <= allowed.largest)))[0]
        found = Found(f"{taken[tuple(where)]} at {where.tolist()}")
        refuse(what, name, found, f"{text} from {allowed.least:g} to {allowed.largest:g}", allowed.advice)
    return taken


def _fits(found: tuple[int, ...], shape: Shape) -> bool:
    """Whether an array has the shape that is asked for."""
    wanted = shape[1:] if shape[:1] == (...,) else shape
    ends = found[max(len(found) - len(wanted), 0) :] if wanted is not shape else found
    return len(ends) == len(wanted) and all(n in (None, m) for n, m in zip(wanted, ends, strict=True))


class Found(str):
    """A text that a message shows without quotation marks."""

    __slots__ = ()
    __repr__ = str.__str__


def listed(value: object) -> TypeGuard[Iterable[Any]]:
    """Whether a value is a list of some kind: an array, a pandas Series, a range, a generator; no text, no set."""
    texts_and_sets = isinstance(value, (str, bytes, Mapping, Set))
    return isinstance(value, Iterable) and not texts_and_sets and getattr(value, "ndim", 1) > 0


def vector(what: str, name: str, value: object, allowed: Range = ANYWHERE_MM) -> Array:
    """A copy of three finite numbers (3,)."""
    return numbers(what, name, value, (3,), allowed).copy()


def unit(what: str, name: str, value: object) -> Array:
    """The direction (3,) of three numbers that are not all 0."""
    v = vector(what, name, value, Range(-1e100, 1e100, "give a direction in LPS"))
    size = float(np.linalg.norm(v))
    if not size > 1e-100:
        refuse(what, name, v.tolist(), "three finite numbers, not all 0", "give a direction in LPS")
    return np.asarray(v / size)
