"""Inputs that the scans speak against: without one of them the simulated wire lies far nearer to the traced ones.

What wins is not put in its place: what is chosen by some frames is not judged by these.
"""

from collections.abc import Sequence
from itertools import compress

import numpy as np

from pipeline.arrays.polyline import at_arc, samples
from pipeline.compare.config import CompareConfig
from pipeline.compare.metrics import point_to_curve, scored
from pipeline.model import Array
from pipeline.run.stages.known import Context, Frame, Known
from pipeline.run.stages.variants import BENT, CATHETER, ROLL, TIP_CURVE, SimulatedVariant, Wires, simulated_frames
from pipeline.simulate.departures import turned

FAR_NEARER = 0.7
"""Share of its rms distance below which a wire that is simulated otherwise speaks against what is stated: half the mean
square. Of a wire turned by 60 degrees or more, the right roll is that."""
FEWEST = 3
"""Frames from which that says something: of one, which any small cause may bend, half the distance is no news."""
ENDS = "whether the traces end where the wire does, which a stated insertion_mm tells (a faint tip is not seen)"
SURE_DEG = 0.1
"""Standard deviation of a direction above which traces that speak against it move it so far that the estimate tells."""
FRAME_NEARER, LEAST_MM = 0.4, 0.3
"""The same for a frame alone, whose wire may have let go, and the least rms distance that is worth a word there."""


Squares = tuple[float, int]
"""Sum of squared distances in mm^2, and of how many points; of none where a wire or a trace is missing."""


def from_traces(known: Known, wires: Wires, config: CompareConfig) -> list[Squares]:
    """By simulated frame, how far a wire's scored points lie from its trace."""
    return [_squares(frame, wire, config) for frame, wire in zip(simulated_frames(known), wires, strict=True)]


def contradicted(
    run: Context, known: Known, ways: Sequence[SimulatedVariant], otherwise: Sequence[Sequence[Squares]]
) -> list[str]:
    """A warning where one of ``ways`` lies far nearer than the wire as stated, in the case or in a frame of it.

    Of several ways, the nearest. otherwise : of each of ``ways``, its wires ``from_traces``.
    """
    frames = simulated_frames(known)
    elsewhere = _leave_elsewhere(known)
    if elsewhere:
        return [elsewhere]
    wires = [None if frame.solved is None else frame.solved.joints_mm for frame in frames]
    stated = from_traces(known, wires, run.config.compare)
    seen = sum(count > 0 for _, count in stated)
    whole = _nearest(ways, stated, otherwise, FAR_NEARER) if seen >= FEWEST else None
    if whole:
        return [_said("", *whole)]
    turned = [way.without == ROLL for way in ways]
    rolls, by_roll = list(compress(ways, turned)), list(compress(otherwise, turned))
    alone = [_nearest(rolls, [own], [of[i : i + 1] for of in by_roll], FRAME_NEARER) for i, own in enumerate(stated)]
    return [
        _said(f"frame {frame.index}: ", *one)
        for frame, one in zip(frames, alone, strict=True)
        if one and one[1] > LEAST_MM and not frame.uncertain
    ]


def _leave_elsewhere(known: Known) -> str:
    """What ``turned`` says of a clamp whose direction was not estimated, or is stated so well that it hardly moves."""
    if known.clamp is None or known.clamp.sigma_deg > SURE_DEG:
        return ""
    pairs = [
        (frame.solved.joints_mm, curve.points_mm)
        for frame in simulated_frames(known)
        if frame.ok and frame.solved is not None and (curve := frame.trusted_curve) is not None
    ]
    return turned(pairs)


def _squares(frame: Frame, wire: Array | None, config: CompareConfig) -> Squares:
    """Of a wire's scored points from the frame's trace."""
    curve = frame.trusted_curve
    if wire is None or curve is None or not frame.ok:
        return 0.0, 0
    arc = scored(samples(frame.depth_mm, config.sample_mm), config.skip_mm)
    off = point_to_curve(at_arc(wire, arc), curve.points_mm)[0]
    return float(off @ off), len(off)


def _nearest(
    ways: Sequence[SimulatedVariant], stated: Sequence[Squares], otherwise: Sequence[Sequence[Squares]], share: float
) -> tuple[float, float, SimulatedVariant] | None:
    """The way whose rms distance is least, with it and the stated one's over the same frames; None above a share.

    otherwise : of each way, as ``stated`` by frame.
    """
    found = []
    for way, own in zip(ways, otherwise, strict=True):
        both = [(*a, b[0]) for a, b in zip(stated, own, strict=True) if a[1] and b[1]]
        if 2 * len(both) > len(stated):
            squares, count, others = np.sum(both, axis=0)
            found.append((float(np.sqrt(others / count)), float(np.sqrt(squares / count)), way))
    nearer = [one for one in found if one[0] < share * one[1]]
    return min(nearer, key=lambda one: one[0]) if nearer else None


def _said(where: str, other_mm: float, stated_mm: float, way: SimulatedVariant) -> str:
    """The warning, with what to look at."""
    how, do = {
        BENT: (
            f"with {way.bent:g} times its tip's curve",
            f"rest_curvature_per_mm (per mm) and, where that is right, roll_deg, the wall's friction and {ENDS}",
        ),
        TIP_CURVE: ("straight at rest", f"rest_curvature_per_mm, roll_deg and {ENDS}"),
        ROLL: (
            f"turned by {(way.turn_deg + 179.0) % 360.0 - 179.0:+g} degrees",
            "roll_deg (degrees), material_axis, the tip's sign, the axes (LPS or RAS) and, with friction, "
            "torsional_stiffness_N_mm2",
        ),
        CATHETER: ("without the catheter", "whether the scans show one, its stiffness and its insertion_mm"),
    }[way.without]
    return (
        f"{where}{how}, the simulated wire lies {other_mm:.2f} mm (rms) from the traced one, as stated "
        f"{stated_mm:.2f} mm: check {do}; what is chosen by these frames is not judged by them"
    )
