"""The user's own curves beside the wires that the scans show: one of another frame, or moved, is not passed over."""

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np

from pipeline.arrays.polyline import at_arc
from pipeline.compare.metrics import point_to_curve
from pipeline.model import Array, Curve
from pipeline.run.stages.depths import in_common
from pipeline.run.stages.known import Frame
from pipeline.status import FrameStatus
from pipeline.trace.config import TraceConfig
from reports.case_files import listed
from reports.doubts import OFF_THE_SCANS

OFF_VOXELS, OFF_SIGMAS = 0.75, 3.0
"""Median distance from a traced wire, in voxels and in its own standard deviations, above which a curve is not its."""
ALL_VOXELS, ALL_LONGER, FEWEST = 0.35, 1.5, 3
"""Shift and length, in voxels, by which all curves are off together, and frames from which that is asked. Noise cancels
in their median; that tips in faint scans are seen a voxel short does not."""
MOST_NAMED = 6


class _Off(NamedTuple):
    """How far an own curve lies from the wire that a frame shows, mm: median distance, mean shift (3,), more length."""

    frame: int
    away: float
    sigma: float
    shift: Array
    longer: float
    tip_sigma: float


def beside_what_is_seen(
    frames: Sequence[Frame], seen: Sequence[Curve | None], config: TraceConfig, voxel_mm: float
) -> tuple[list[str], Collection[int]]:
    """A warning where own curves lie off the wires that are seen, or have other lengths; and the frames of these.

    For what those curves say no lumen is opened. seen : of each frame the wire that its scan shows; None where the
    curve of the frame is that very one.
    """
    both = _both(frames, seen)
    said = _apart(both, config, voxel_mm)
    each = listed([f"frame {index}: {what}" for index, what in said.items()], MOST_NAMED)
    found = [each] * bool(said) + (_together(both, voxel_mm) if 2 * len(said) < len(both) else [])
    warnings = [
        f"the manifest's {OFF_THE_SCANS} ({what}): check which curve belongs to "
        "which frame, its units and LPS; without the key traces the scans are traced"
        for what in found
    ]
    return warnings, said.keys()


def _both(frames: Sequence[Frame], seen: Sequence[Curve | None]) -> list[_Off]:
    """Of each frame with a curve of its own in whose scan a wire is surely seen, how far the two are apart."""
    return [
        _off(frame, frame.curve, wire)
        for frame, wire in zip(frames, seen, strict=True)
        if wire is not None and wire.status is FrameStatus.OK and frame.curve is not None and frame.traced
    ]


def _apart(both: Sequence[_Off], config: TraceConfig, voxel_mm: float) -> dict[int, str]:
    """By frame, in words, what its curve is off by; frames whose curves are where the wire is seen are left out."""
    said = {}
    for one in both:
        if one.away > max(OFF_VOXELS * voxel_mm, OFF_SIGMAS * one.sigma):
            said[one.frame] = f"{one.away:.2f} mm off"
        elif abs(one.longer) > config.length_tolerance_mm:
            said[one.frame] = f"{abs(one.longer):.1f} mm {'longer' if one.longer > 0 else 'shorter'}"
    return said


def _off(frame: Frame, own: Curve, wire: Curve) -> _Off:
    away, foot = point_to_curve(wire.points_mm, own.points_mm)
    shift = np.mean(at_arc(own.points_mm, foot) - wire.points_mm, axis=0)
    sigma = float(np.median(wire.sigma_mm))
    return _Off(frame.index, float(np.median(away)), sigma, shift, own.length_mm - wire.length_mm, wire.tip_sigma_mm)


def _together(both: Sequence[_Off], voxel_mm: float) -> list[str]:
    """By how much all curves are off alike, which in each frame alone is little."""
    if len(both) < FEWEST:
        return []
    shift, longer = np.median([one.shift for one in both], axis=0), np.array([one.longer for one in both])
    sigma, tip_sigma = np.nan_to_num(np.median([(one.sigma, one.tip_sigma) for one in both], axis=0))
    usual, said = in_common(longer, max(ALL_LONGER * voxel_mm, OFF_SIGMAS * tip_sigma)), []
    if np.linalg.norm(shift) > max(ALL_VOXELS * voxel_mm, OFF_SIGMAS * sigma):
        said.append(f"all shifted by about {shift.round(2).tolist()} mm (LPS)")
    if usual:
        said.append(f"{abs(usual):.2f} mm {'longer' if usual > 0 else 'shorter'} in the median")
    return [", ".join(said)] * bool(said)
