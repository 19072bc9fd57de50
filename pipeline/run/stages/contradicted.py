"""Inputs that the scans speak against: without one of them the simulated wire lies far nearer to the traced ones.

What wins is not put in its place: what is chosen by some frames is not judged by these.
"""

from collections.abc import Sequence

import numpy as np

from pipeline.arrays.polyline import at_arc, samples
from pipeline.compare.config import CompareConfig
from pipeline.compare.metrics import point_to_curve, rms, scored
from pipeline.model import Array
from pipeline.run.stages.known import Context, Frame, Known
from pipeline.run.stages.rivals import CATHETER, ROLL, TIP_CURVE, Way, Wires, simulated_frames

FAR_NEARER = 0.7
"""Share of its rms distance below which a wire that is simulated otherwise speaks against what is stated: half the mean
square. Of a wire turned by 60 degrees or more, the right roll is that."""


def contradicted(run: Context, known: Known, ways: Sequence[Way], wires: Sequence[Wires]) -> list[str]:
    """A warning where one of ``ways`` lies far nearer than the wire as stated; of several, the nearest.

    wires : of each of ``ways``. Own simulators' wires say nothing about what this one is told.
    """
    frames, config = simulated_frames(known), run.config.compare
    if run.case.simulated is not None:
        return []
    nearer: list[tuple[float, float, Way]] = []
    for way, others in zip(ways, wires, strict=True):
        pairs = [(f, wire) for f, wire in zip(frames, others, strict=True) if wire is not None and _counts(f)]
        if 2 * len(pairs) > len(frames):
            other = rms(np.concatenate([_distances(frame, wire, config) for frame, wire in pairs]))
            stated = rms(np.concatenate([_distances(f, f.solved.joints_mm, config) for f, _ in pairs if f.solved]))
            nearer += [(other, stated, way)] if other < FAR_NEARER * stated else []
    return [_said(*min(nearer, key=lambda one: one[0]))] if nearer else []


def _counts(frame: Frame) -> bool:
    return frame.ok and frame.trusted_curve is not None and frame.solved is not None


def _distances(frame: Frame, wire: Array, config: CompareConfig) -> Array:
    """Of a wire's scored points from the frame's trace, mm."""
    assert frame.curve is not None
    arc = scored(samples(frame.depth_mm, config.sample_mm), config.skip_mm)
    return point_to_curve(at_arc(wire, arc), frame.curve.points_mm)[0]


def _said(other_mm: float, stated_mm: float, way: Way) -> str:
    """The warning, with what to look at."""
    how, do = {
        TIP_CURVE: ("straight at rest", "rest_curvature_per_mm, its sign and unit, and roll_deg"),
        ROLL: (
            f"turned by {way.turn_deg:g} degrees",
            "roll_deg (degrees), material_axis, the tip's sign and the axes (LPS or RAS)",
        ),
        CATHETER: ("without the catheter", "whether the scans show one, its stiffness and its insertion_mm"),
    }[way.without]
    return (
        f"{how}, the simulated wire lies {other_mm:.2f} mm (rms) from the traced ones, as stated {stated_mm:.2f} mm: "
        f"check {do}; what is chosen by these frames is not judged by them"
    )
