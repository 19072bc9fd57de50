"""How long the wire's segments are, and how far that choice still moves the wire.

The shape of a chain converges with the square of its segments' length. So every insertion is made at two lengths, one
half of the other, and the distance between the two wires bounds what the finer one is off: the grid convergence index
of two grids (Roache, J. Fluids Eng. 116, 1994), 3 |coarse - fine| / (2^2 - 1).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.arrays.polyline import at_arc
from pipeline.model import Array, Wire, arc_length
from pipeline.simulate.config import COARSEST_MM, Segment
from solver import Solution

FINEST_MM = 0.0625
FIRST_TURN_RAD = 0.1
"""Most that a joint of the first length may turn at rest: a wire that is coarser says nothing about the finer one."""
AGREED_MM = 0.06
"""Segments are short enough where halving them moved no wire by more: a third of it, 0.02 mm, is then left."""
SMALLEST_MM = 0.001
"""Below it contacts that open and close on the voxels of the wall hide the order of convergence."""

LARGEST_JOINT_TURN_DEG = 30.0
"""Beyond it the chain's bending energy, quadratic in the angle, is off by 2 % and more."""

Insert = Callable[[float], Sequence[Solution]]
"""The insertion with segments of a length, mm: the wire at every depth."""


@dataclass(frozen=True, eq=False)
class Resolved:
    """An insertion and its resolution.

    segment_mm : length of the segments.     wires : one for each depth.     reason : how the length was chosen.
    num_mm : (depths,) bound of the root mean square distance of each wire from the one of endlessly short segments; NaN
    where one of the two lengths did not reach the depth.
    """

    segment_mm: float
    wires: Sequence[Solution]
    num_mm: Array
    reason: str


def lengths_mm(asked: Segment, wire: Wire) -> list[float]:
    """Segment lengths in the order in which they are tried, each half of the one before."""
    rest = wire.rest_curvature_per_mm
    curvature = abs(rest) if isinstance(rest, (int, float)) else max(abs(value) for _, value in rest)
    if asked != "auto":
        # GuideWire takes no segment that turns by more than a right angle at rest
        return [2 * asked, asked] if 2 * asked * curvature < np.pi / 2 else [asked]
    first = COARSEST_MM
    while first > 2 * FINEST_MM and first * curvature > FIRST_TURN_RAD:
        first /= 2
    return [first / 2**n for n in range(round(np.log2(first / FINEST_MM)) + 1)]


def resolve(insert: Insert, lengths: Sequence[float]) -> Resolved:
    """Insert with shorter and shorter segments until halving them changes nothing.

    A length that loses depths which a longer one reached is not taken.
    """
    segment, wires, num = lengths[0], insert(lengths[0]), np.full(0, np.nan)
    reason = "no coarser segments can follow the wire's rest curvature: no estimate of their error"
    for shorter in lengths[1:]:
        finer = insert(shorter)
        moved = np.array([moved_mm(a, b) for a, b in zip(wires, finer, strict=True)])
        if len(lengths) > 2 and _reached(finer) < _reached(wires):
            reason = f"with {shorter:g} mm fewer depths are reached"
            break
        segment, wires, num = shorter, finer, moved
        if np.all(num <= AGREED_MM):
            reason = f"halving them moved no wire by more than {AGREED_MM} mm"
            break
        reason = f"at {int(np.sum(~(num <= AGREED_MM)))} of {len(num)} depths the wire still depends on it"
    return Resolved(segment, wires, num if num.size else np.full(len(wires), np.nan), reason)


def moved_mm(coarse: Solution, fine: Solution) -> float:
    """Root mean square distance between two wires at equal arc length, mm, not below SMALLEST_MM; NaN without rest."""
    if not (coarse.converged and fine.converged and len(coarse.joints_mm) > 1):
        return float("nan")
    apart = coarse.joints_mm - at_arc(fine.joints_mm, arc_length(coarse.joints_mm))
    return max(float(np.sqrt(np.mean(np.sum(apart**2, axis=1)))), SMALLEST_MM)


def _reached(wires: Sequence[Solution]) -> int:
    return sum(wire.converged for wire in wires)
