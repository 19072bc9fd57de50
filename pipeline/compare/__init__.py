"""compare: how far the simulated wire is from the real one, beside how far anybody's guess would be."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pipeline.arrays.polyline import at_arc, samples
from pipeline.compare.branches import branches_of
from pipeline.compare.config import CompareConfig
from pipeline.compare.metrics import (
    METRICS,
    Pair,
    Simulated,
    VesselAxis,
    measured,
    pair_of,
    point_to_curve,
    rms,
    scored,
)
from pipeline.model import Array, Curve, Lumen, arc_length

__all__ = ["Comparison", "compare", "compare_truth", "point_to_curve", "rms"]


@dataclass(frozen=True, eq=False)
class Comparison(Pair):
    """Errors of one frame: the pair with every metric of it.

    values : the metrics by their columns' names; ``comparison["rms_mm"]`` is one of them. Point errors are kept, since
    pooled statistics come from points, never from averaged RMSEs.
    """

    values: Mapping[str, float | bool]

    def __getitem__(self, name: str) -> float | bool:
        """A metric by its column's name."""
        return self.values[name]


def compare(
    simulated: Simulated,
    traced: Curve,
    lumen: Lumen,
    config: CompareConfig = CompareConfig(),
    way: VesselAxis | None = None,
    ahead_mm: float = 0.0,
) -> Comparison:
    """Errors of one simulated wire against the traced one. Raises ValueError for an empty curve.

    way : the vessel's axis and branches, found once for all frames; without it the branches are found here, and no
    metric has an axis.     ahead_mm : how far beyond the plane in which the wire begins the traced curve begins.
    """
    start = traced.points_mm[:1] if len(traced.points_mm) else np.zeros((1, 3))
    pair = pair_of(
        simulated, traced, lumen, config, way or VesselAxis(None, branches_of(lumen.distance, start[0])), ahead_mm
    )
    values = {name: measured(name, metric, pair) for name, metric in METRICS.items()}
    return Comparison(**vars(pair), values=values)


def compare_truth(
    truth_mm: Array, traced: Curve | None, simulated: Simulated | None, config: CompareConfig = CompareConfig()
) -> dict[str, float]:
    """Synthetic studies only: errors of both curves against the true wire, mm, by their columns' names.

    Distances go from equal steps along each curve to the true wire. A curve that does not exist has no entry.
    """
    values: dict[str, float] = {}
    if traced is not None and len(traced.points_mm) > 1:
        distance, tip = _against(traced.points_mm, truth_mm, config.sample_mm)
        values |= {"trace_mean_mm": float(distance.mean()), "trace_max_mm": float(distance.max())}
        values["trace_tip_mm"] = tip
    if simulated is not None and len(simulated.joints_mm) > 1:
        distance, tip = _against(simulated.joints_mm, truth_mm, config.sample_mm, config.skip_mm)
        values |= {"truth_rms_mm": rms(distance), "truth_tip_mm": tip}
    return values


def _against(curve: Array, truth: Array, step_mm: float, skip_mm: float = 0.0) -> tuple[Array, float]:
    """Distances of equal steps along a curve, behind the clamp's reach, to the true wire, and between the tips."""
    arc = scored(samples(float(arc_length(curve)[-1]), step_mm), skip_mm)
    distance, _ = point_to_curve(at_arc(curve, arc), truth)
    return distance, float(np.linalg.norm(curve[-1] - truth[-1]))
