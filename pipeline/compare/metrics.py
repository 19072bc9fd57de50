"""The metrics of one frame: numbers that compare the simulated wire with the traced curve.

A metric is a function of a :class:`Pair` under the name of its column; ``reports.schema`` says what it means, its unit
and how a case pools it. ``register`` adds one, with its column.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from pipeline.arrays.polyline import angle_deg, at_arc, samples
from pipeline.compare.branches import Branches
from pipeline.compare.config import CompareConfig
from pipeline.model import Array, Curve, Lumen, OtherWire, arc_length
from reports.schema import ERRORS, Column
from solver import Solution

Simulated = Solution | OtherWire
COVERED_MM = 1.0
"""A point of the traced curve counts as covered where the simulated wire is no farther away."""
TANGENT_MM = 1.0
"""The vessel's direction at the tip is that of its axis from this far before to this far behind the point nearest to
the tip."""
OFF_AXIS_MM = 0.1
"""Nearer to the vessel's axis than this the side on which a wire lies is not known: a third of a voxel."""
PAIRS_AT_ONCE = 2_000_000  # point-segment pairs held in memory together: about 100 MB


def _feet(points: Array, start: Array, chord: Array) -> tuple[Array, Array]:
    """Squared distances (n, m) of points to segments and where the feet lie on them (0 to 1)."""
    squared = np.einsum("ij,ij->i", chord, chord)
    offset = points[:, None, :] - start[None, :, :]
    along = np.einsum("nmj,mj->nm", offset, chord) / np.where(squared > 0, squared, 1.0)
    along = np.clip(along, 0.0, 1.0)
    gap = offset - along[..., None] * chord
    return np.einsum("nmj,nmj->nm", gap, gap), along


def point_to_curve(points: ArrayLike, curve: ArrayLike) -> tuple[Array, Array]:
    """Distance from each point to the nearest place *on the segments* of a polyline.

    points : (n, 3) LPS mm.     curve : (m, 3) LPS mm, m >= 1, ordered from entry to tip.
    Returns distances (n,) in mm and the arc length (n,) in mm of the nearest place (the foot).
    One-sided: swap the arguments for the other direction; `compare` reports both. Cost O(n m), exact.
    """
    p = np.atleast_2d(np.asarray(points, dtype=np.float64))
    c = np.atleast_2d(np.asarray(curve, dtype=np.float64))
    if p.shape[1:] != (3,) or c.shape[1:] != (3,) or len(c) == 0:
        raise ValueError(
            f"point_to_curve: got points {p.shape} and curve {c.shape}; expected (n, 3) and (m, 3) with m >= 1"
        )
    if len(c) == 1:
        return np.linalg.norm(p - c[0], axis=1), np.zeros(len(p))
    start, chord, arc = c[:-1], np.diff(c, axis=0), arc_length(c)
    lengths = np.diff(arc)
    distance, foot = np.empty(len(p)), np.empty(len(p))
    block = max(PAIRS_AT_ONCE // len(start), 1)
    for first in range(0, len(p), block):
        part = slice(first, first + block)
        squared, along = _feet(p[part], start, chord)
        best = np.argmin(squared, axis=1)
        rows = np.arange(len(best))
        distance[part] = np.sqrt(squared[rows, best])
        foot[part] = arc[best] + along[rows, best] * lengths[best]
    return distance, foot


@dataclass(frozen=True, eq=False)
class VesselAxis:
    """What is known of the vessel beside its wall: its axis (k, 3) to the deepest tip, or None, and its branches."""

    axis_mm: Array | None
    branches: Branches


@dataclass(frozen=True, eq=False)
class Pair:
    """The simulated wire and the traced curve of one frame, and where they are compared.

    Points are LPS mm, from the entry to the tip.
    wire_mm (k, 3), curve_mm (m, 3) : joints of the wire, points of the curve.
    sample_mm (n, 3), arc_mm (n,) : the compared points of the wire, in equal steps along it, and their arc lengths.
    Equal steps make errors independent of the length of the segments. The beginning, to which the clamp was fitted, is
    left out.
    error_mm, foot_arc_mm (n,) : the distance of each to the curve, and the arc length along the curve of the place that
    is nearest.     back_mm : distances the other way, from equal steps along the curve to the wire, without its
    beginning.
    equal_mm (2, c, 3) : points of the wire and of the curve at the same arc lengths, as far as both reach, without the
    beginning.     lumen : the vessel.     way : its axis and branches.
    """

    wire_mm: Array
    curve_mm: Array
    sample_mm: Array
    arc_mm: Array
    error_mm: Array
    foot_arc_mm: Array
    back_mm: Array
    equal_mm: Array
    lumen: Lumen
    way: VesselAxis

    @property
    def by_arc_mm(self) -> Array:
        """Distances (c,) between points of equal arc length."""
        distances: Array = np.linalg.norm(self.equal_mm[0] - self.equal_mm[1], axis=1)
        return distances


Metric = Callable[[Pair], float | bool]
SHORT_MM = 2.0


def scored(arc_mm: Array, skip_mm: float) -> Array:
    """Of arc lengths (n,) along a wire those at which it is scored: beyond ``skip_mm``, where the clamp was fitted.

    Of a wire that is hardly longer than that the last 2 mm are scored, of one shorter than 4 mm the last half.
    """
    length = float(arc_mm[-1])
    return np.asarray(arc_mm[arc_mm >= min(skip_mm, max(length - SHORT_MM, 0.5 * length)) - 1e-9])


def pair_of(
    simulated: Simulated, traced: Curve, lumen: Lumen, config: CompareConfig, way: VesselAxis, ahead_mm: float = 0.0
) -> Pair:
    """Sample both curves and measure their distances. Raises ValueError where one of them is empty.

    ahead_mm : how far beyond the plane in which the wire begins the traced curve begins. A trace begins in the plane of
    the manifest's entry, a wire where the clamp was found to be; arc lengths of both are counted from the latter.
    """
    wire, curve = simulated.joints_mm, traced.points_mm
    if len(curve) < 2 or len(wire) < 2:
        raise ValueError(f"compare: got {len(wire)} simulated joints and {len(curve)} traced points, need 2 of each")
    arc = scored(samples(float(arc_length(wire)[-1]), config.sample_mm), config.skip_mm)
    back = at_arc(curve, scored(samples(traced.length_mm, config.sample_mm), config.skip_mm))
    points = at_arc(wire, arc)
    error, foot = point_to_curve(points, curve)
    common = arc[(arc >= ahead_mm - 1e-9) & (arc <= traced.length_mm + ahead_mm + 1e-9)]
    return Pair(
        wire,
        curve,
        points,
        arc,
        error,
        foot,
        back_mm=point_to_curve(back, wire)[0],
        equal_mm=np.stack([at_arc(wire, common), at_arc(curve, common - ahead_mm)]),
        lumen=lumen,
        way=way,
    )


def rms(values: ArrayLike) -> float:
    """Root mean square; NaN for no values."""
    array = np.asarray(values, dtype=np.float64)
    return float(np.sqrt(np.mean(array**2))) if array.size else float("nan")


def distal(error_mm: Array, arc_mm: Array, length_mm: float) -> Array:
    """Of point errors (n,) at arc lengths (n,) those of the last ``length_mm`` of the wire."""
    return np.asarray(error_mm[arc_mm >= arc_mm[-1] - length_mm - 1e-9])


def distal_rms(pair: Pair, length_mm: float) -> float:
    """Root mean square of the point errors in the last ``length_mm`` of the wire, mm."""
    return rms(distal(pair.error_mm, pair.arc_mm, length_mm))


def same_branch(pair: Pair) -> bool:
    """Whether both tips lie in one branch of the vessel. A place where branches meet belongs to all of them."""
    first, second = (pair.way.branches.at(curve[-1]) for curve in (pair.wire_mm, pair.curve_mm))
    return bool(first & second)


def tip_offset(pair: Pair) -> tuple[float, float]:
    """The simulated tip from the traced one, mm: along the vessel (positive: deeper), across it; NaN without axis."""
    axis = pair.way.axis_mm
    if axis is None or len(axis) < 2:
        return float("nan"), float("nan")
    offset, place = pair.wire_mm[-1] - pair.curve_mm[-1], point_to_curve(pair.curve_mm[-1], axis)[1]
    last = float(arc_length(axis)[-1])
    ends = at_arc(axis, np.clip([place[0] - TANGENT_MM, place[0] + TANGENT_MM], 0.0, last))
    tangent = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    along = float(offset @ tangent)
    return along, float(np.linalg.norm(offset - along * tangent))


def depth_offset(pair: Pair) -> float:
    """How much deeper the simulated wire lies, mm: mean offset of points of equal arc length, along the trace."""
    wire, curve = pair.equal_mm
    if len(curve) < 2:
        return float("nan")
    tangent = np.gradient(curve, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1), 1e-12)[:, None]
    return float(np.mean(np.sum((wire - curve) * tangent, axis=1)))


def side_agrees(pair: Pair) -> float:
    """Share of the points, where both wires lie 0.1 mm or more off the axis, at which they lie on the same side."""
    axis = pair.way.axis_mm
    if axis is None or len(axis) < 2:
        return float("nan")
    feet = [at_arc(axis, point_to_curve(points, axis)[1]) for points in pair.equal_mm]
    first, second = (points - foot for points, foot in zip(pair.equal_mm, feet, strict=True))
    known = np.minimum(np.linalg.norm(first, axis=1), np.linalg.norm(second, axis=1)) >= OFF_AXIS_MM
    return float(np.mean(np.sum(first * second, axis=1)[known] > 0)) if known.any() else float("nan")


def _last_chord(points: Array) -> Array:
    """The way (3,) over a curve's last millimetre. From vertex to vertex it would be longer the coarser a curve is."""
    length = float(arc_length(points)[-1])
    return np.asarray(points[-1] - at_arc(points, max(length - 1.0, 0.0)))


OF_POINTS: dict[str, Callable[[Array], float]] = {
    "rms_mm": rms,
    "mean_mm": lambda errors: float(errors.mean()),
    "p95_mm": lambda errors: float(np.percentile(errors, 95)),
    "max_mm": lambda errors: float(errors.max()),
}
"""Statistics of point errors: of one frame's points, and pooled over all points of a case alike."""
DISTAL_MM = {"distal10_rms_mm": 10.0, "distal20_rms_mm": 20.0}
"""Root mean square of the point errors of the wire's last millimetres, of one frame and pooled alike."""
METRICS: dict[str, Metric] = {
    **{name: lambda pair, of=of: of(pair.error_mm) for name, of in OF_POINTS.items()},  # type: ignore[misc]
    **{name: partial(distal_rms, length_mm=mm) for name, mm in DISTAL_MM.items()},
    "back_rms_mm": lambda pair: rms(pair.back_mm),
    "hausdorff_mm": lambda pair: float(max(pair.error_mm.max(), pair.back_mm.max())),
    "arc_rms_mm": lambda pair: rms(pair.by_arc_mm),
    "arc_max_mm": lambda pair: float(pair.by_arc_mm.max(initial=0.0)) if len(pair.by_arc_mm) else float("nan"),
    "tip_mm": lambda pair: float(np.linalg.norm(pair.wire_mm[-1] - pair.curve_mm[-1])),
    "tip_angle_deg": lambda pair: angle_deg(_last_chord(pair.wire_mm), _last_chord(pair.curve_mm)),
    "branch_ok": same_branch,
    "tip_along_mm": lambda pair: tip_offset(pair)[0],
    "tip_across_mm": lambda pair: tip_offset(pair)[1],
    "depth_offset_mm": depth_offset,
    "side_ok": side_agrees,
    "coverage": lambda pair: float(np.mean(pair.back_mm <= COVERED_MM)),
}


def measured(name: str, metric: Metric, pair: Pair) -> float | bool:
    """The metric's value; an error says which metric it comes from, since anybody may have registered it."""
    try:
        return metric(pair)
    except Exception as error:
        raise RuntimeError(f"metric {name!r}: {type(error).__name__}: {error}") from error


def register(column: Column, metric: Metric) -> None:
    """Add a metric and its column: errors.csv, summary.csv, the pages and the list of columns have it from then on.

    Its results are never kept from an earlier run, as nobody knows what else it depends on.
    """
    ERRORS.add(replace(column, module=module_of(metric)))
    METRICS[column.name] = metric


def module_of(function: Callable[..., object]) -> str:
    """The module that a function stands in; of a partial, that of what it calls."""
    return getattr(getattr(function, "func", function), "__module__", None) or "?"
