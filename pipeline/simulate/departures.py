"""Where traces contradict what the manifest states of the clamp: said in words, whatever the wire is simulated from."""

from collections.abc import Sequence

import numpy as np

from pipeline.arrays.polyline import angle_deg, at_arc
from pipeline.model import Array, Clamp, Curve, arc_length
from pipeline.simulate.evidence import UNKNOWN_VOXELS
from reports.case_files import counted

FAR_OFF = 3.0
"""Standard deviations beyond which a statement is called contradicted: chance alone goes there once in a hundred."""

FIRST_MM = np.array([0.5, 3.5])
"""Where the chord begins and ends that shows a wire's direction at the clamp."""
LEAST_MM = 10.0
"""Length from which a curved tip lies beyond it."""
TURNED_DEG = 3.0
"""Angle between chords that is worth a word: a trace's error of 0.03 mm turns one by 0.6 degrees, frame by frame."""


def departed(given: Clamp, found: Clamp, sigma_mm: float, sigma_deg: float) -> str:
    """A warning where an estimate lies farther from the manifest's clamp than that says; nothing where it does not.

    The place along the wire is not among it: it is the manifest's. sigma_mm, sigma_deg : as stated; 0 stays there.
    """
    shift = found.entry_mm - given.entry_mm
    across = float(np.linalg.norm(shift - given.direction * (shift @ given.direction)))
    turned = angle_deg(found.direction, given.direction)
    told = []
    if 0.0 < FAR_OFF * sigma_mm < across:
        told.append(f"{across:.2f} mm across the wire, {across / sigma_mm:.1f} times entry_sigma_mm ({sigma_mm:.3g})")
    if 0.0 < FAR_OFF * sigma_deg < turned:
        share = turned / sigma_deg
        told.append(f"{turned:.1f} degrees in direction, {share:.1f} times entry_direction_sigma_deg ({sigma_deg:.3g})")
    if not told:
        return ""
    return (
        f"the clamp that was estimated is off the manifest's by {' and by '.join(told)}: check entry_mm and "
        "entry_direction, and where these are right roll, material_axis and the wire's tip and stiffness; state larger "
        "standard deviations where they are known less well"
    )


def beside(curves: Sequence[Curve], given: Clamp, sigma_mm: float, voxel_mm: float) -> str:
    """A warning where the traced wires pass beside an entry that is taken as it is stated; nothing where they do not.

    curves : from the plane of the entry on.     sigma_mm : as stated, of the entry.
    """
    starts = np.array([curve.points_mm[0] for curve in curves]).reshape(-1, 3) - given.entry_mm
    along = starts @ given.direction
    starts = (starts - along[:, None] * given.direction)[np.abs(along) < voxel_mm]
    if not len(starts):
        return ""
    off = float(np.linalg.norm(np.median(starts, axis=0)))
    known = float(np.hypot(sigma_mm, UNKNOWN_VOXELS * voxel_mm))
    if off <= FAR_OFF * known:
        return ""
    return (
        f"the traced wires pass {off:.2f} mm beside the manifest's entry (median of "
        f"{counted(len(starts), 'frame')}), {off / known:.0f} times the {known:.2g} mm that entry_sigma_mm = "
        f"{sigma_mm:.3g} and a trace's own error allow; the wire is simulated from the manifest's entry all the same: "
        "check entry_mm, or let the clamp be estimated (a larger entry_sigma_mm and simulate.entry = traced)"
    )


def turned(pairs: Sequence[tuple[Array, Array]]) -> str:
    """A warning where traced wires leave an entry, whose direction is taken as stated, in another one than simulated.

    pairs : simulated and traced wire (n, 3) of each frame.
    """
    both = [pair for pair in pairs if min(arc_length(line)[-1] for line in pair) > LEAST_MM]
    if not both:
        return ""
    simulated, traced = (np.median([_chord(line) for line in lines], axis=0) for lines in zip(*both, strict=True))
    off = angle_deg(traced, simulated)
    if not off > TURNED_DEG:
        return ""
    return (
        f"in their first {FIRST_MM[1]:g} mm the traced wires point {off:.0f} degrees away from the simulated ones "
        f"(median of {counted(len(both), 'frame')}), which leave in entry_direction as stated: check it, or let "
        "the clamp be estimated (a larger entry_direction_sigma_deg and simulate.entry = traced)"
    )


def _chord(line: Array) -> Array:
    """The direction (3,) of a wire at the clamp."""
    first, last = at_arc(line, FIRST_MM)
    return np.asarray((last - first) / np.linalg.norm(last - first))
