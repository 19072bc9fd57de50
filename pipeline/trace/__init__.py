"""trace: scan -> the real wire as one ordered sub-voxel curve from entry to tip."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from pipeline.arrays.polyline import unit_of
from pipeline.model import Curve, Lumen, Volume
from pipeline.ranges import Profile
from pipeline.status import FrameStatus
from pipeline.trace.attempt import EntryPose
from pipeline.trace.coarse import ALL_OF_THEM, Times, coarse_lumen, coarse_scan, matching, times
from pipeline.trace.config import TraceConfig
from pipeline.trace.doubts import FAINT_BEYOND
from pipeline.trace.elsewhere import hint_of_lines
from pipeline.trace.explain import explained, hardly_begun, missed_mm
from pipeline.trace.onward import GOES_ON
from pipeline.trace.region import shows_lumen
from pipeline.trace.rotation_plane import near_rotation_plane
from pipeline.trace.stated import Opacity
from pipeline.trace.subtraction import subtracting
from pipeline.trace.verdict import note_of
from pipeline.trace.whose_end import BEYOND_GAP, DIM_FROM_TIP, GAP

__all__ = [
    "BEYOND_GAP",
    "DIM_FROM_TIP",
    "FAINT_BEYOND",
    "GAP",
    "GOES_ON",
    "hardly_begun",
    "of_catheter",
    "of_length",
    "trace",
]

THICK_VOXELS = 1.6
"""Blur of a wire, from which its crest wanders: the ends of such wires, 0.9 mm in voxels of 0.15 mm, were 2 voxels off
in a tenth of the scans that showed nothing else."""
UNIT_ROOM = 0.095
"""How near log(length / depth) must be to the logarithm of a unit's factor for that unit to be named: a tenth."""

OFF_THE_LUMEN = note_of(
    "a frame of which no voxel lies in the lumen",
    "scan and lumen in one place, in mm LPS",
    "check the frame's origin and direction, and those of the reference or the lumen",
)

BACK_END = explained
"""How the curve is found: (subtraction, entry, previous, config) -> Curve."""


def trace(
    frame: Volume,
    lumen: Lumen,
    entry_mm: ArrayLike,
    entry_direction: ArrayLike,
    *,
    reference: Volume | None = None,
    previous: Curve | None = None,
    expected_mm: float | None = None,
    opacity: Profile | None = None,
    config: TraceConfig | None = None,
) -> Curve:
    """The wire of one frame from the plane of entry to the tip.

    frame, reference : scans of one geometry, with and without wire; where there is no reference, or correlated noise
    hides the wire, the background is modelled from the lumen's wall.  entry_mm, entry_direction : (3,) LPS mm.
    previous : the curve of the frame before, if any; it is consulted only where the frame alone leaves doubts.
    expected_mm : insertion depth, which helps to decide.  opacity : the wire's brightness per length over the distance
    from its tip (any unit), a number or pairs; found where it is not given.
    Returns a Curve; what went wrong is its status and note.
    """
    config = config or TraceConfig()
    heading = np.asarray(entry_direction, float) / np.linalg.norm(np.asarray(entry_direction, float))
    stated = EntryPose(np.asarray(entry_mm, float), heading, expected_mm, Opacity.of(opacity))
    scans = (frame, reference, lumen)
    curve = _seen(scans, stated, previous, config)
    voxel = frame.voxel_mm
    larger, ok = times(frame), curve.status is FrameStatus.OK
    if larger != ALL_OF_THEM and (not ok or curve.levels.get("blur_mm", 0.0) > THICK_VOXELS * voxel):
        again = _seen(_coarse(scans, larger), stated, previous, config)
        if again.status is FrameStatus.OK and not (ok and _same(again, curve, voxel, 1.0)):
            curve = again
    if len(curve.points_mm) == 0:
        hint = hint_of_lines(frame, reference, stated.point)
        return curve.reworded(lambda note: note + hint)
    axis = np.asarray(config.rotation_axis, float) if config.rotation_axis else frame.direction[:, 2]
    in_plane = near_rotation_plane(curve.points_mm, axis, config.in_plane_deg)
    in_plane_mm = float(in_plane.mean()) * curve.length_mm
    curve = replace(curve, in_plane=in_plane, counters={**curve.counters, "in_plane_mm": in_plane_mm})
    return of_length(curve, expected_mm, config)


Scans = tuple[Volume, Volume | None, Lumen]
"""A frame, its reference and lumen."""


def _coarse(scans: Scans, n: Times) -> Scans:
    """The same in larger voxels, so many of the frame's along each axis."""
    frame, reference, lumen = scans
    seen = coarse_scan(frame, n)
    return seen, reference and coarse_scan(reference, matching(reference, seen)), coarse_lumen(lumen, seen)


def _seen(scans: Scans, stated: EntryPose, previous: Curve | None, config: TraceConfig) -> Curve:
    """The wire of a frame. stated : in LPS."""
    frame, reference, lumen = scans
    if not shows_lumen(frame, lumen):
        return Curve(np.zeros((0, 3)), np.zeros(0)).doubted(FrameStatus.NO_WIRE, OFF_THE_LUMEN)
    with subtracting(frame, lumen, reference) as image:
        entry = replace(stated, point=image.local(stated.point[None])[0], direction=image.turned(stated.direction))
        curve = BACK_END(image, entry, previous, config)
        if reference is None or not image.correlated or curve.status is not FrameStatus.TRACE_LOW_CONTRAST:
            return curve
    # smoothing removes the reference's white noise; correlated noise stays and adds to the frame's: 1.4 times as much
    with subtracting(frame, lumen, None) as unaided:
        alone = BACK_END(unaided, entry, previous, config)
    return alone if alone.status is FrameStatus.OK and _same(alone, curve, image.voxel, 2.0) else curve


def _same(curve: Curve, other: Curve, voxel: float, tip_voxels: float) -> bool:
    """Whether two curves are the same wire: under a voxel apart along 95 % of it, under ``tip_voxels`` at the tip."""
    if len(other.points_mm) == 0:
        return False
    near = cKDTree(other.points_mm).query(curve.points_mm)[0]
    tips = float(np.linalg.norm(curve.points_mm[-1] - other.points_mm[-1]))
    return bool(np.quantile(near, 0.95) < voxel and tips < tip_voxels * voxel)


CATHETER_END_MM = 1.0
"""Distance of a trace's end from a catheter's within which it may be the catheter's own."""


def of_catheter(curve: Curve, catheter_mm: float) -> Curve:
    """The curve; ambiguous if it ends where the stated catheter does, whose tip may hide where the wire ends.

    A curve that gets dimmer where the catheter ends is no longer doubted for that. Used for frames without a stated
    depth alone: where there is one, it says which of the two was traced.
    """
    dim = curve.levels.get(DIM_FROM_TIP, np.inf)
    if abs(curve.length_mm - dim - catheter_mm) < CATHETER_END_MM:
        curve = curve.without(DIM_FROM_TIP)
    if curve.refused or not abs(curve.length_mm - catheter_mm) < CATHETER_END_MM:
        return curve
    note = f"trace: length: got {curve.length_mm:.2f} mm, where the catheter ends ({catheter_mm:.2f} mm); "
    note += "expected a wire that ends elsewhere, or a stated depth; give insertion_mm"
    return curve.doubted(FrameStatus.TRACE_AMBIGUOUS, note)


def of_length(curve: Curve, expected_mm: float | None, config: TraceConfig) -> Curve:
    """The curve, traced or given; one whose length is too far from the expected one gets LENGTH_MISMATCH."""
    if curve.refused or missed_mm(curve.length_mm, expected_mm, config) == 0:
        return curve
    note = f"trace: length: got {curve.length_mm:.2f} mm; expected {expected_mm:.2f} mm (insertion_mm) to within "
    note += f"{config.length_tolerance_mm} mm; look at the picture, then correct the manifest or "
    note += "trace.length_tolerance_mm"
    if expected_mm and (unit := unit_of(curve.length_mm / expected_mm, UNIT_ROOM)):
        note += f"; it would do in {unit}: give mm"
    return curve.doubted(FrameStatus.LENGTH_MISMATCH, note)
