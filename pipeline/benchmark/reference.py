"""The curve that errors are measured against: the limit of short segments by Richardson's extrapolation."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from pipeline.benchmark.insert import Run, SolverSetting, insert
from pipeline.benchmark.scenes import BenchScene
from pipeline.model import Array

FINE_MM = 0.1
"""Segments of the coarser of the two insertions, as short as the shortest that are judged; the pair 0.1, 0.05 mm leaves
about 1e-4 mm in the bend."""
COARSER = 3
"""Number of pairs that are tried, each twice as coarse as the one before, where finer ones do not reach the depth."""
SAMPLE_MM = 0.5
"""Arc step of the comparison: the same for every segment length, so that coarse chains are not flattered."""


@dataclass(frozen=True, eq=False)
class Reference:
    """points_mm (m, 3) at arcs_mm (m,), and energy_N_mm, both extrapolated.

    uncertainty_mm : RMS distance between the extrapolated curve and the finer of the two that made it.
    """

    arcs_mm: Array
    points_mm: Array
    energy_N_mm: float
    uncertainty_mm: float

    def errors_of(self, run: Run) -> tuple[float, float, float]:
        """RMS and tip distance, mm, and relative energy error of a run; NaN where it did not reach the depth."""
        if not run.reached:
            return float("nan"), float("nan"), float("nan")
        points = resampled(run.last.joints_mm, run.arcs_mm, self.arcs_mm)
        return *shape_error(points, self.points_mm), run.last.energy_N_mm / self.energy_N_mm - 1.0


@cache
def reference(scene: BenchScene, fine_mm: float = FINE_MM) -> Reference:
    """Two insertions with segments of ``fine_mm`` and half of it, coarser ones where these do not reach the depth.

    The error falls with the square of the segment length, so the limit is x(h/2) + (x(h/2) - x(h)) / 3.
    ValueError where none of them reaches it.
    """
    arcs = np.linspace(0.0, scene.depth_mm, max(2, round(scene.depth_mm / SAMPLE_MM) + 1))
    for segment in fine_mm * 2.0 ** np.arange(COARSER):
        runs = [insert(scene, SolverSetting(s, quadrature="segments")) for s in (segment, 0.5 * segment)]
        if all(run.reached for run in runs):
            coarse, fine = (resampled(run.last.joints_mm, run.arcs_mm, arcs, smooth=True) for run in runs)
            first, second = (run.last.energy_N_mm for run in runs)
            limit = fine + (fine - coarse) / 3.0
            return Reference(arcs, limit, second + (second - first) / 3.0, shape_error(fine, limit)[0])
    last = next(run.last for run in runs if not run.reached)
    where = f"its reference stopped at {last.depth_mm:.2f} of {scene.depth_mm:g} mm: {last.status.value}"
    raise ValueError(f"benchmark: scene {scene.name}: {where}; allowed: a scene that can be passed; lower its depth")


def resampled(joints_mm: ArrayLike, arcs_mm: Array, samples_mm: Array, *, smooth: bool = False) -> Array:
    """Points (m, 3) at arc lengths (m,) of a chain with joints (n, 3) at arc lengths (n,).

    smooth : through a cubic spline, fourth order, for a reference; the chain itself is straight between its joints.
    """
    joints = np.asarray(joints_mm, dtype=np.float64)
    if smooth and len(joints) > 3:
        return np.asarray(CubicSpline(arcs_mm, joints)(samples_mm))
    return np.column_stack([np.interp(samples_mm, arcs_mm, joints[:, a]) for a in range(3)])


def shape_error(points: Array, reference: Array) -> tuple[float, float]:
    """Root mean square and tip distance, mm, of points (m, 3) at the same arc lengths."""
    apart = np.linalg.norm(points - reference, axis=1)
    return float(np.sqrt(np.mean(apart**2))), float(apart[-1])
