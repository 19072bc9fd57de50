"""How long the wire's segments are, and how far that choice still moves the wire.

The shape of a chain converges with the square of its segments' length. So every insertion is made at two lengths, one
half of the other, and the distance between the two wires bounds what the finer one is off: the grid convergence index
of two grids (Roache, J. Fluids Eng. 116, 1994), 3 |coarse - fine| / (2^2 - 1).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.arrays.polyline import at_arc
from pipeline.model import Array, arc_length
from pipeline.simulate.config import COARSEST_MM, Segment
from solver import Solution
from solver.wire import SEGMENT_MM

FINEST_MM = 0.0625
FIRST_TURN_RAD = 0.1
"""Most that a joint of the first length may turn at rest: a wire that is coarser says nothing about the finer one."""
AGREED_MM = 0.06
"""Segments are short enough where halving them moved no wire by more, mm: a third of it, 0.02 mm, is then left."""
SMALLEST_MM = 0.001
"""Below it contacts that open and close on the voxels of the wall hide the order of convergence."""

LARGEST_JOINT_TURN_DEG = 30.0
"""Beyond it the chain's bending energy, quadratic in the angle, is off by 2 % and more."""

Insert = Callable[[float, bool], Sequence[Solution]]
"""Called with the segments' length, mm, and whether rough steps are repeated with shorter ones; returns the wire at
every depth."""


@dataclass(frozen=True, eq=False)
class Resolved:
    """An insertion and its resolution.

    segment_mm : length of the segments.     wires : one for each depth.     reason : how the length was chosen.
    num_mm : (depths,) bound of the root mean square distance of each wire from the one of endlessly short segments; NaN
    where one of the two lengths did not reach the depth.     num_push_N : (depths,) the same of the push.
    """

    segment_mm: float
    wires: Sequence[Solution]
    num_mm: Array
    num_push_N: Array
    reason: str


def lengths_mm(asked: Segment, rest_curvature_per_mm: ArrayLike) -> list[float]:
    """Segment lengths, mm, in the order in which they are tried, each half of the one before.

    rest_curvature_per_mm : a number or a profile, as of a wire.
    """
    rest = np.asarray(rest_curvature_per_mm, dtype=float)
    curvature = float(np.abs(rest if rest.ndim == 0 else rest[:, 1]).max())
    if asked != "auto":
        # GuideWire takes no segment that turns by more than a right angle at rest, or is longer than that
        return (
            [2 * asked, asked] if 2 * asked < min(0.5 * np.pi / max(curvature, 1e-9), SEGMENT_MM.largest) else [asked]
        )
    first = COARSEST_MM
    while first > 2 * FINEST_MM and first * curvature > FIRST_TURN_RAD:
        first /= 2
    return [first / 2**n for n in range(round(np.log2(first / FINEST_MM)) + 1)]


def resolve(insert: Insert, lengths: Sequence[float]) -> Resolved:
    """Insert with shorter and shorter segments until halving them changes no wire that is not about to snap.

    A length that loses depths which a longer one reached is not taken; a shorter one may reach them again.
    """
    # the first length only serves for comparison: where it snaps aside, the next pair of lengths is needed, too
    segment, wires = lengths[0], insert(lengths[0], len(lengths) == 1)
    num = push = np.full(len(wires), np.nan)
    refined = len(lengths) == 1
    reason, before = "no coarser segments can follow the wire's rest curvature: no estimate of their error", wires
    for shorter in lengths[1:]:
        finer = insert(shorter, True)
        moved, pushed = _moved(before, finer)
        here, before = _at_rest(before) | _at_rest(finer), finer
        if len(lengths) > 2 and _reached(finer) < _reached(wires) and not refined:
            wires, refined = insert(segment, True), True  # one depth too far, and 1 mm segments were left to all
        if len(lengths) > 2 and _reached(finer) < _reached(wires):
            reason = "with shorter ones fewer depths are reached"
            if np.isnan(num).all():  # of the longer ones, whose error is four times that of the shorter
                num, push = _bounds(*(4.0 * change for change in _moved(wires, finer)))
            continue
        # a wire that is about to snap goes one way or the other for tiny causes, with segments of any length
        away = here & ~(moved <= AGREED_MM) & np.array([not wire.uncertain for wire in finer], dtype=bool)
        segment, wires, refined = shorter, finer, True
        num, push = _bounds(moved, pushed)
        if not away.any():
            reason = f"halving them moved no wire by more than {AGREED_MM} mm, near snaps apart"
            break
        if np.isnan(moved[away]).all():
            reason = (
                f"at {int(away.sum())} of {len(num)} depths the wire came to rest with one length alone, or with none"
            )
        else:
            reason = f"at {int(away.sum())} of {len(num)} depths the wire still depends on their length"
    if not refined:
        wires = insert(segment, True)
    return Resolved(segment, wires, num, push, reason)


def moved_mm(coarse: Solution, fine: Solution) -> float:
    """Root mean square distance between two wires at equal arc length, mm, not below SMALLEST_MM; NaN without rest."""
    if not (coarse.converged and fine.converged and len(coarse.joints_mm) > 1):
        return float("nan")
    apart = coarse.joints_mm - at_arc(fine.joints_mm, arc_length(coarse.joints_mm))
    return max(float(np.sqrt(np.mean(np.sum(apart**2, axis=1)))), SMALLEST_MM)


def _moved(coarse: Sequence[Solution], fine: Sequence[Solution]) -> tuple[Array, Array]:
    """How far the wires, mm, and their pushes, N, moved at each depth; NaN where one of both is not at rest.

    In lumens with hardly any room the push is the slope of the voxels' waves in the wall, and wrong by all of it.
    """
    both = list(zip(coarse, fine, strict=True))
    moved = np.array([moved_mm(*pair) for pair in both])
    at_rest = [a.converged and b.converged for a, b in both]
    return moved, np.where(at_rest, [abs(a.push_force_N - b.push_force_N) for a, b in both], np.nan)


def _bounds(moved: Array, pushed: Array) -> tuple[Array, Array]:
    """What halving the segments changed of wires, mm, and pushes, N, or twice its root mean square where that is more.

    Errors change their sign along the way, so that one depth's change is small by chance: alone it covered 85 % of the
    errors in vessels drawn at random, the two together 97 %. Of wires the root mean square counts to AGREED_MM; those
    that moved further snapped aside, and say nothing of other depths.
    """
    alike = moved <= AGREED_MM
    if not alike.any():
        return moved, pushed
    near, typical = (2.0 * float(np.sqrt(np.mean(change[alike] ** 2))) for change in (moved, pushed))
    return np.maximum(moved, min(near, AGREED_MM)), np.maximum(pushed, typical)


def _at_rest(wires: Sequence[Solution]) -> NDArray[np.bool_]:
    return np.array([wire.converged for wire in wires], dtype=bool)


def _reached(wires: Sequence[Solution]) -> int:
    return int(np.count_nonzero(_at_rest(wires)))
