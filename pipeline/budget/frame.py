"""What an ensemble says of one frame."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from pipeline.arrays.polyline import at_arc
from pipeline.budget.shapes import Shapes, energy_score_mm, shapes_of
from pipeline.budget.verdict import ROUND, axes_across, judged, reach_mm
from pipeline.model import Array

FEWEST = 8
"""Fewest members at rest for a frame to have a budget."""


class FrameSample(NamedTuple):
    """The nominal wire of a frame, and the traced one.

    arc_mm (n,), nominal_mm (n, 3) : where the wires are looked at.     curve_mm (m, 3), foot_arc_mm (n,) : the traced
    wire and its places nearest to these; None without one.     own_mm2 (n,) : variance along each axis across the wire
    of the trace and of the segments.     ahead_mm : how far the traced wire begins beyond the plane of the clamp.
    """

    arc_mm: Array
    nominal_mm: Array
    curve_mm: Array | None = None
    foot_arc_mm: Array | None = None
    own_mm2: Array | None = None
    ahead_mm: float = 0.0


@dataclass(frozen=True, eq=False)
class Budget:
    """A frame's budget, at points (n,) along the simulated wire.

    median_mm (n, 3).     covariance_mm2 (n, 3, 3) : of the inputs; second moment about the nominal wire, so that what
    the mean is off counts, too; of the members that have the nominal wire's shape.     input_mm (n,) : u of the inputs.
    members : at rest.     shapes : where there are two.     whole_mm (n,) : u_val, of inputs, trace and segments.
    u_mm, ratio (n,) : u_val in the direction of the error, and the error over it. All three are None where nothing was
    traced, as is energy_score_mm NaN.     released : see ``shapes.releases``.
    """

    arc_mm: Array
    median_mm: Array
    covariance_mm2: Array
    input_mm: Array
    members: int
    shapes: Shapes | None = None
    whole_mm: Array | None = None
    u_mm: Array | None = None
    ratio: Array | None = None
    energy_score_mm: float = float("nan")
    released: str = ""


def frame_budget(wires: Array, seen: FrameSample) -> Budget | None:
    """The budget of a frame from an ensemble (members, n, 3); None where too few of its members came to rest."""
    wires = wires[np.isfinite(wires).all(axis=(1, 2))]
    if len(wires) < FEWEST:
        return None
    arc, nominal, curve, foot, own, ahead_mm = seen
    real = None if curve is None else at_arc(curve, arc - ahead_mm)
    shapes = shapes_of(wires, nominal, real, arc)
    near = wires if shapes is None else wires[shapes.with_simulated]  # of fewer than four no u is known
    away = near - nominal
    moment = np.einsum("mni,mnj->nij", away, away) / len(near)
    axes = axes_across(nominal, arc) if curve is None or foot is None else axes_across(curve, foot)
    budget = Budget(arc, np.median(near, axis=0), moment, reach_mm(moment, axes, len(near)), len(wires), shapes)
    if curve is None or foot is None or own is None or real is None:
        return budget
    verdict = judged(at_arc(curve, foot) - nominal, moment, own, axes, len(near))
    return replace(
        budget,
        whole_mm=np.sqrt(budget.input_mm**2 + ROUND**2 * own),
        u_mm=verdict.u_mm,
        ratio=verdict.ratio,
        energy_score_mm=energy_score_mm(wires, real),
    )
