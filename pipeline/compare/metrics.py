"""Stage 5: how far is the simulated wire from the real one?

Shape errors are taken on equal arc-length samples of both curves, so that neither the segment length of the simulation
nor the point density of the trace can flatter. Point errors are kept: pooled statistics come from points, never from
averaged RMSEs. Nothing is aligned or registered here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.arrays.polyline import at_arc, resample, samples, tip_tangent
from pipeline.compare.config import CompareConfig
from pipeline.model import Array, Curve, Lumen, Simulated, arc_length

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
        msg = f"point_to_curve: got points {p.shape} and curve {c.shape}; expected (n, 3) and (m, 3) with m >= 1"
        raise ValueError(msg)
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


def rms(values: ArrayLike) -> float:
    """Root mean square; NaN for no values."""
    array = np.asarray(values, dtype=np.float64)
    return float(np.sqrt(np.mean(array**2))) if array.size else float("nan")


@dataclass(frozen=True, eq=False)
class Comparison:
    """Errors of one frame in mm: the point errors and what is derived from them.

    sample_mm : (n, 3) samples of the simulated wire.  arc_mm, error_mm, foot_arc_mm : (n,).
    """

    sample_mm: Array
    arc_mm: Array
    error_mm: Array
    foot_arc_mm: Array
    rms_mm: float
    mean_mm: float
    p95_mm: float
    max_mm: float
    back_rms_mm: float
    hausdorff_mm: float
    arc_rms_mm: float
    arc_max_mm: float
    tip_mm: float
    tip_angle_deg: float
    branch_ok: bool
    coverage: float


def _angle_deg(a: Array, b: Array) -> float:
    """Angle by atan2: arccos loses half the digits near 0."""
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))


def same_branch(simulated_tip: Array, traced_tip: Array, lumen: Lumen, slack_mm: float) -> bool:
    """Whether the straight line between the tips stays in the lumen to within ``slack_mm``.

    Two wires in one vessel see each other; between two branches there is a wall.
    """
    chord = simulated_tip + np.linspace(0.0, 1.0, 33)[:, None] * (traced_tip - simulated_tip)
    index = np.rint(lumen.distance.to_index(chord)).astype(int)
    index = np.clip(index, 0, np.array(lumen.distance.shape) - 1)
    return bool(np.max(lumen.distance.values[tuple(index.T)]) <= slack_mm)


def compare(
    simulated: Simulated, traced: Curve, lumen: Lumen, config: CompareConfig = CompareConfig()
) -> Comparison:
    """Errors of one simulated wire against the traced one; refuses an empty curve with ValueError."""
    if len(traced.points_mm) < 2 or len(simulated.joints_mm) < 2:
        counts = f"{len(simulated.joints_mm)} simulated joints and {len(traced.points_mm)} traced points"
        msg = f"compare: got {counts}, need 2 of each"
        raise ValueError(msg)
    wire, curve = simulated.joints_mm, traced.points_mm
    arc = samples(float(arc_length(wire)[-1]), config.sample_mm)
    points = at_arc(wire, arc)
    error, foot = point_to_curve(points, curve)
    back, _ = point_to_curve(resample(curve, config.sample_mm), wire)
    common = arc[arc <= traced.length_mm + 1e-9]
    by_arc = np.linalg.norm(at_arc(wire, common) - at_arc(curve, common), axis=1)
    slack = 0.5 * float(lumen.distance.spacing_mm.max()) + simulated.max_penetration_mm
    return Comparison(
        sample_mm=points,
        arc_mm=arc,
        error_mm=error,
        foot_arc_mm=foot,
        rms_mm=rms(error),
        mean_mm=float(error.mean()),
        p95_mm=float(np.percentile(error, 95)),
        max_mm=float(error.max()),
        back_rms_mm=rms(back),
        hausdorff_mm=float(max(error.max(), back.max())),
        arc_rms_mm=rms(by_arc),
        arc_max_mm=float(by_arc.max()),
        tip_mm=float(np.linalg.norm(wire[-1] - curve[-1])),
        tip_angle_deg=_angle_deg(tip_tangent(wire), tip_tangent(curve)),
        branch_ok=same_branch(wire[-1], curve[-1], lumen, slack),
        coverage=min(1.0, float(arc[-1]) / traced.length_mm),
    )


@dataclass(frozen=True)
class TruthErrors:
    """Synthetic studies only: traced and simulated curves against the true wire, mm, NaN where there is none."""

    trace_mean_mm: float = float("nan")
    trace_max_mm: float = float("nan")
    trace_tip_mm: float = float("nan")
    truth_rms_mm: float = float("nan")
    truth_tip_mm: float = float("nan")


def _against(curve: NDArray[np.float64], truth: Array, step_mm: float) -> tuple[Array, float]:
    distance, _ = point_to_curve(resample(curve, step_mm), truth)
    return distance, float(np.linalg.norm(curve[-1] - truth[-1]))


def compare_truth(
    truth_mm: Array,
    traced: Curve | None,
    simulated: Simulated | None,
    config: CompareConfig = CompareConfig(),
) -> TruthErrors:
    """Errors of both curves against the known wire, one-sided from 0.5 mm samples of each curve to the truth."""
    values: dict[str, float] = {}
    if traced is not None and len(traced.points_mm) > 1:
        distance, tip = _against(traced.points_mm, truth_mm, config.sample_mm)
        values |= {
            "trace_mean_mm": float(distance.mean()),
            "trace_max_mm": float(distance.max()),
            "trace_tip_mm": tip,
        }
    if simulated is not None and len(simulated.joints_mm) > 1:
        distance, tip = _against(simulated.joints_mm, truth_mm, config.sample_mm)
        values |= {"truth_rms_mm": rms(distance), "truth_tip_mm": tip}
    return TruthErrors(**values)
