"""Wires that another simulator made: cut at the entry, and checked for wrong order, coordinates or units.

Their depth is counted as the solver's: along the wire, from the plane through the clamp across its direction.
"""

from collections.abc import Iterator
from itertools import pairwise, product

import numpy as np
from numpy.typing import ArrayLike

from pipeline.arrays.order import turned_back
from pipeline.arrays.polyline import UNITS_MM, angle_deg, at_arc, other_units, samples, turns_deg, unit_of
from pipeline.model import Array, arc_length
from solver import Grid

AT_ENTRY_MM = 5.0
"""Largest distance, mm, from the manifest's entry at which a wire may begin: more than the radius of any vessel that a
guide wire of 0.4 mm is used in blindly."""
LARGEST_TURN_DEG = 60.0
"""Largest angle between a wire's first 2 mm and the entry's direction."""
OVER_MM = 2.0
STEP_BACK_MM = 0.05
"""A step up to this (mm) may be rounding; between longer ones no wire turns back, by 120 degrees and more."""
TIGHTEST_RADII, QUARTER_DEG = 5.0, 90.0
"""Radius, in the wire's own, of a bend that strains its surface by a fifth; nitinol breaks at about a tenth. A quarter
of a turn is what it may make on the way of one such quarter, beyond the wire's own curve."""
STEPS = 4  # of the way on which that is judged
ROUNDING_MM = 1e-3
SAME = 0.15
"""How near log(depth / length) must be to the logarithm of a unit's factor for that unit to be suggested."""
SHORTER = 0.5
"""How much shorter the wire of the next deeper frame must be, over the difference of depths, to be in a wrong place."""
LAGS = (1, -1, 2, -2)
"""By how many frames a numbering of wires is tried that is off."""
LAG_FITS, LAG_FEWEST = 0.25, 3
"""How much better depths must fit then, over how badly they fit as they are, and in how many frames at the least."""
MIRROR = np.array([-1.0, -1.0, 1.0])
AXES = {"y, x, z": (1, 0, 2), "z, y, x": (2, 1, 0)}
"""Other orders of coordinates: that of a picture's rows and columns, and that of an array whose last axis is x."""


def begun(points_mm: Array, entry_mm: Array, direction: Array) -> Array:
    """The wire (n, 3) from the plane through the entry on: cut there, or continued back to it in a straight line."""
    beyond = (points_mm - entry_mm) @ direction
    if beyond[0] > ROUNDING_MM:
        return np.concatenate([points_mm[:1] - beyond[0] * direction, points_mm])
    crossed = np.flatnonzero((beyond[:-1] < -ROUNDING_MM) & (beyond[1:] >= -ROUNDING_MM))
    if beyond[0] >= -ROUNDING_MM or not len(crossed):
        return points_mm
    share = np.clip(-beyond[crossed] / (beyond[crossed + 1] - beyond[crossed]), 0.0, 1.0)
    places = points_mm[crossed] + share[:, None] * (points_mm[crossed + 1] - points_mm[crossed])
    # a wire may come back to the plane farther on: its base passes nearest to the entry
    nearest = int(np.argmin(np.linalg.norm(places - entry_mm, axis=1)))
    rest = points_mm[crossed[nearest] + 1 :]
    return np.concatenate([places[nearest][None], rest[np.linalg.norm(rest - places[nearest], axis=1) > 0]])


def oddity(
    points_mm: Array,
    entry_mm: Array,
    direction: Array,
    unit: str = "mm",
    depth_mm: float = float("nan"),
    scan: Grid | None = None,
) -> str:
    """Why a wire cannot have been pushed in at this entry, and what would make it fit; empty where it can.

    unit : in which its numbers were stated to be, before they became mm.     depth_mm : how deep it should be, where
    that is known: no unit explains a wire that it makes more than three times as long, or as short. Where it is not, no
    unit explains one that it makes shorter than its base may be off.     scan : whose voxels its numbers may be.
    """
    back = turned_back(points_mm, STEP_BACK_MM)
    if len(back):
        return f"it turns straight back at point {back[0]}: are its points in order, or do they scatter?"
    wrong = _misplaced(points_mm, entry_mm, direction)
    if not wrong:
        return ""
    ways = [*readings(points_mm, unit)]
    index = points_mm / UNITS_MM[unit]
    if scan is not None and np.abs(index).max() <= max(scan.shape):
        ways.insert(0, ("in voxels", scan.to_mm(index)))
    # one that only just passes, too, explains nothing
    near = 0.5 * AT_ENTRY_MM
    for name, other in ways:
        if _misplaced(other, entry_mm, direction, near):
            continue
        # what lies behind the entry's plane is in the introducer, and no part of a depth
        length_mm = float(arc_length(begun(other, entry_mm, direction))[-1])
        scaled = not np.isclose(arc_length(other)[-1], arc_length(points_mm)[-1])
        if not (scaled and _far_from(depth_mm, length_mm)):
            return f"{wrong}: it would if it were {name}"
    return f"{wrong}; check its coordinates"


def _misplaced(points_mm: Array, entry_mm: Array, direction: Array, near_mm: float = AT_ENTRY_MM) -> str:
    # what is added to reach the plane points along the entry by construction: it tells nothing
    wire = points_mm if (points_mm[0] - entry_mm) @ direction > 0 else begun(points_mm, entry_mm, direction)
    gap = float(np.linalg.norm(wire[0] - entry_mm))
    if gap > near_mm:
        return f"its base passes {gap:.3g} mm from entry_mm and not within {near_mm:g}"
    first = at_arc(wire, np.array([min(OVER_MM, float(arc_length(wire)[-1]))]))[0] - wire[0]
    turn = angle_deg(first, direction)
    if turn > LARGEST_TURN_DEG:
        return f"its first {OVER_MM:g} mm do not point along entry_direction but {turn:.0f} degrees away from it"
    return ""


def readings(points_mm: Array, unit: str) -> Iterator[tuple[str, Array]]:
    """Other readings of the numbers (point order, axes, units), each with its points; fewest changes first."""
    orders = {"": points_mm, "read from its other end (tip first)": points_mm[::-1]}
    spaces = {"": np.eye(3), "RAS": np.diag(MIRROR)}
    written = {"": np.eye(3)} | {f"written as {name}": np.eye(3)[list(axes)] for name, axes in AXES.items()}
    stated = f", not in {unit}" * (unit != "mm")
    units = {"": 1.0} | {f"in {name}{stated}": factor for name, factor in other_units(unit).items()}
    ways = product(orders.items(), spaces.items(), written.items(), units.items())
    all_of_them = [tuple(zip(*named, strict=True)) for named in ways]
    for names, (points, signs, axes, factor) in sorted(all_of_them, key=lambda one: sum(map(bool, one[0]))):
        if any(names):
            yield " and ".join(filter(None, names)), points @ axes @ signs * factor


def _far_from(depth_mm: float, length_mm: float) -> bool:
    """Whether a wire of this length is none of this depth, or of none that is worth a frame where that is NaN."""
    return bool(length_mm < AT_ENTRY_MM if np.isnan(depth_mm) else not depth_mm / 3.0 <= length_mm <= 3.0 * depth_mm)


def quarter_mm(radius_mm: float) -> float:
    """Way, mm, on which a wire of this radius makes a quarter of a turn in the tightest bend that it stands."""
    return 0.5 * float(np.pi) * TIGHTEST_RADII * radius_mm


def tightest_bend(points_mm: Array, radius_mm: float, rest_per_mm: ArrayLike = 0.0) -> tuple[float, Array] | None:
    """The angle, degrees, by which a wire turns where no wire of this radius does, and the place (3,); None elsewhere.

    rest_per_mm : the curvature that the wire was shaped with, 1/mm, or pairs (distance from the tip in mm, curvature).
    Of points farther apart than the way on which that is judged nothing is said.
    """
    reach, length = quarter_mm(radius_mm), arc_length(points_mm)
    if np.diff(length).max(initial=0.0) > reach:
        return None
    arc = samples(float(length[-1]), reach / STEPS)
    turn = turns_deg(at_arc(points_mm, arc), STEPS)
    profile = np.atleast_2d(np.asarray(rest_per_mm, dtype=np.float64))
    from_tip = arc[-1] - arc[: len(turn)]
    ends = [np.interp(from_tip - reach * share, profile[:, 0], profile[:, -1]) for share in (0.0, 0.5, 1.0)]
    beyond = turn - QUARTER_DEG - np.degrees(reach * np.abs(ends).max(axis=0))
    if not len(turn) or beyond.max() <= 0.0:
        return None
    worst = int(np.argmax(beyond))
    return float(turn[worst]), at_arc(points_mm, arc[[worst + STEPS // 2 + 1]])[0]


ENDS_EARLY = 0.75
"""Share of a frame's depth below which a wire looks cut off, and not held back."""


def not_to_depth(
    length_mm: float,
    depth_mm: float,
    tolerance_mm: float,
    stated: str = "mm",
    *,
    others_fit: bool = False,
    lagging: bool = False,
) -> str:
    """Why a wire does not have this depth, with a guess at why not; empty where it does.

    stated : see ``oddity``.     others_fit : wires of other frames, stated in this unit, have their depths.
    lagging : wires have the depths of other frames, so that this one is whole.
    """
    if abs(length_mm - depth_mm) <= tolerance_mm:
        return ""
    unit = unit_of(depth_mm / max(length_mm, 1e-9), SAME, stated)
    hint = f"; is it in {unit}?" if unit and not others_fit else ""
    if lagging:
        hint = "; wires have the depths of other frames: is each file that of its frame?"
    elif others_fit and length_mm < ENDS_EARLY * depth_mm:
        hint = "; wires of other frames are as long as these are deep: does its file end early?"
    return f"it is {length_mm:.3g} mm long from the entry on, the frame {depth_mm:.2f} mm deep{hint}"


def out_of_order(lengths_mm: Array, depths_mm: Array) -> list[tuple[int, int]]:
    """Pairs of frames, each and the next deeper one, of which the deeper has the clearly shorter wire.

    lengths_mm, depths_mm : (n,), NaN where a frame has none.
    """
    order = [int(n) for n in np.argsort(depths_mm, kind="stable") if np.isfinite(lengths_mm[n] + depths_mm[n])]
    return [
        (a, b)
        for a, b in pairwise(order)
        if lengths_mm[a] - lengths_mm[b] > SHORTER * (depths_mm[b] - depths_mm[a]) > 0.0
    ]


def numbered_otherwise(lengths_mm: Array, depths_mm: Array) -> int:
    """By how many frames wires lie ahead of those whose depth they have; 0 where they have their own, or no other's.

    lengths_mm, depths_mm : (n,) in the order of the frames, NaN where one has none. Where frames are equally far apart
    that is the same as depths that are counted from elsewhere.
    """

    def off(lag: int) -> float:
        last = len(depths_mm) - max(0, lag)
        own = np.abs(lengths_mm[max(0, -lag) : last] - depths_mm[max(0, lag) : len(depths_mm) + min(0, lag)])
        own = own[np.isfinite(own)]
        return float(np.median(own)) if len(own) >= LAG_FEWEST else np.inf

    step = np.abs(np.diff(depths_mm))
    as_it_is = off(0)
    if not np.isfinite(step).any() or not np.isfinite(as_it_is) or as_it_is < SHORTER * float(np.nanmedian(step)):
        return 0
    best = min(LAGS, key=off)
    return best if off(best) < LAG_FITS * as_it_is else 0
