"""The curve that errors are measured against: the limit of short segments by Richardson's extrapolation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.benchmark.errors import arc_samples, resampled, shape_error
from pipeline.benchmark.insert import Run, Setting, insert
from pipeline.benchmark.scenes import BenchScene

Array = NDArray[np.float64]

FINE_MM = 0.1
"""Half the smallest segment but one that is judged; the pair 0.1, 0.05 mm leaves about 1e-4 mm in the bend."""
COARSER = 3
"""Pairs that are tried, each twice as coarse, where the finest one does not get through."""


@dataclass(frozen=True, eq=False)
class Reference:
    """points_mm (m, 3) at arcs_mm (m,), and energy_N_mm, both extrapolated.

    uncertainty_mm : RMS distance between the extrapolated curve and the finer of the two that made it.
    """

    arcs_mm: Array
    points_mm: Array
    energy_N_mm: float
    uncertainty_mm: float


def reference(scene: BenchScene, fine_mm: float = FINE_MM) -> Reference:
    """Two insertions with segments of ``fine_mm`` and half of it, coarser ones where these do not reach the depth.

    The error falls with the square of the segment length, so the limit is x(h/2) + (x(h/2) - x(h)) / 3.
    ValueError where none of them reaches it.
    """
    arcs = arc_samples(scene.depth_mm)
    for segment in fine_mm * 2.0 ** np.arange(COARSER):
        runs = [insert(scene, Setting(s, quadrature="segments")) for s in (segment, 0.5 * segment)]
        if all(run.reached for run in runs):
            return _extrapolated(runs, arcs)
    run = next(run for run in runs if not run.reached)
    where = (
        f"benchmark: scene {scene.name}: its reference stopped at {run.depth_mm:.2f} of {scene.depth_mm:g} mm"
    )
    msg = f"{where}: {run.sentence}; allowed: a scene that can be passed; lower its depth"
    raise ValueError(msg)


def _extrapolated(runs: list[Run], arcs: Array) -> Reference:
    """The limit of a run and one with half its segments."""
    curves = [resampled(run.joints_mm, run.arcs_mm, arcs, smooth=True) for run in runs]
    limit = curves[1] + (curves[1] - curves[0]) / 3.0
    energy = runs[1].energy_N_mm + (runs[1].energy_N_mm - runs[0].energy_N_mm) / 3.0
    return Reference(arcs, limit, energy, shape_error(curves[1], limit)[0])
