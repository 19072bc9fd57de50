"""Scans that occur twice, in a case or among those of a calibration: of the same voxels, or traced as one scan is.

A scan that was written again (in another format, rounded, with a grey more or a little noise) has other voxels, and is
traced alike to a hundredth of a voxel. Two scans of one wire are not, unless their noise is little.
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from pipeline.arrays.polyline import at_arc, samples
from pipeline.compare.metrics import point_to_curve, rms
from pipeline.model import Array, Curve
from pipeline.run.stages.known import Frame, trusted
from pipeline.status import FrameStatus
from reports.case_files import frames_named

ALIKE = 0.4
"""Distance between two traces over their standard deviation, below which they are of one wire that lay still: two scans
of it with noise are traced up to twice the standard deviation apart (1.4 times along each of two axes), a scan that is
written again with a grey more or less 0.02 to 0.3 times. With little noise that standard deviation is not noise's, and
two scans cannot be told from one."""
ONE_WIRE = 3.0
"""The same of two scans of one wire, each with noise of its own: they are traced twice their standard deviation apart
(1.4 times along each of two axes)."""
OWN_MM, OWN_TIP_MM = 0.03, 0.06
"""What traces of the user's own are taken to be known to where they are held against others, mm, per axis and at the
tip: as those of scans with voxels of 0.3 mm. What is stated of them (traces_mm) may be 0, and says nothing of tips."""
LEAST_AGAIN = 2
"""Frames from which that is no chance: at one depth two insertions may lie alike."""
MOST_NAMED = 3
STEP_MM = 2.0
"""Between the points that are kept of a trace."""
TIP = "tip "
"""How ``Frame.voxels`` of the user's own curve begins."""
OF_CALIBRATION = "a scan that was calibrated with"


def once(frames: Sequence[Frame], calibrated: Collection[str] = (), traced_mm: Sequence[ArrayLike] = ()) -> list[Frame]:
    """Fail each frame that has the voxels of an earlier one, or whose scan was calibrated with, by voxels or trace.

    calibrated : ``Frame.voxels`` of these scans.     traced_mm : points (n, 3) on their traces, as ``kept`` has them.
    """
    out, first = list(frames), dict[str, int]()
    learnt = _learnt(traced_mm)
    for n, frame in enumerate(frames):
        same = first.setdefault(frame.voxels, n)
        whose = OF_CALIBRATION if frame.voxels in calibrated else f"frame {same}" if frame.voxels and same != n else ""
        why = _the_same(frame.voxels, whose) if whose else _alike(frame.open_curve, learnt)
        out[n] = _repeated(frame, why) if why else frame
    return out


def alike(frames: Sequence[Frame]) -> list[str]:
    """A warning where scans are traced as one scan is, or as one wire is in scans with little noise."""
    earlier: list[tuple[str, Array]] = []
    said: list[str] = []
    for frame in frames:
        if (curve := frame.trusted_curve) is not None:
            said += [f"frame {frame.index} {why}"] if (why := _alike(curve, earlier)) else []
            earlier.append((f"frame {frame.index}", kept(curve)))
    if not said:
        return []
    return [
        f"{'; '.join(said[:MOST_NAMED])}{f'; and {len(said) - MOST_NAMED} more' * (len(said) > MOST_NAMED)}: one scan "
        "that was written again, or one wire that was scanned twice, and it counts as often; take all but one out"
    ]


def rescanned(frames: Sequence[Frame], traced_mm: Sequence[ArrayLike]) -> list[str]:
    """A warning where frames lie where scans that were calibrated with do: one insertion, scanned again.

    traced_mm : points (n, 3) on their traces, as ``kept`` has them. Frames that are traced as one such scan are
    ``repeated`` and not among these.
    """
    again = _again(frames, _learnt(traced_mm), ONE_WIRE)
    if not again:
        return []
    return [
        f"{frames_named([*again])} lie where scans that were calibrated with do, as one insertion does that "
        "is scanned again: what has taught the parameters is no test of them; take it out, unless the wire was drawn "
        "out and pushed in again between the scans"
    ]


def copies(
    frames: Sequence[Frame], voxels: Collection[str], traced_mm: Sequence[ArrayLike], whose: str
) -> dict[int, str]:
    """By number the frames that are ``whose``, in other files or a little altered, and in words why.

    voxels : ``Frame.voxels`` of that case.     traced_mm : points (n, 3) on its traces, as ``kept`` has them.
    """
    learnt, found = _learnt(traced_mm, whose), dict[int, str]()
    for frame in frames:
        if (curve := frame.trusted_curve) is not None:
            found[frame.index] = _the_same(frame.voxels, whose) if frame.voxels in voxels else _alike(curve, learnt)
    return _again(frames, learnt, ALIKE) | {number: why for number, why in found.items() if why}


def scanned_twice(frames: Sequence[Frame], traced_mm: Sequence[ArrayLike], case: str) -> list[str]:
    """A warning where frames to calibrate with lie where those of another case do that is taken for another insertion.

    traced_mm : points (n, 3) on its traces, as ``kept`` has them.
    """
    again = _again(frames, _learnt(traced_mm), ONE_WIRE)
    return [
        f"{frames_named([*again])} lie where those of case {case!r} do, and count as another insertion: "
        "if it is one that was scanned again, state the same group for both"
    ] * bool(again)


def _again(frames: Sequence[Frame], learnt: Sequence[tuple[str, Array]], sigmas: float) -> dict[int, str]:
    """By number the frames that lie where others do, and in words where; none where so few are that it is chance."""
    curves = {number: _supposed(curve) for number, curve in trusted(frames).items()}
    found = {number: why for number, curve in curves.items() if (why := _alike(curve, learnt, sigmas))}
    return found if len(found) >= max(LEAST_AGAIN, 0.5 * len(curves)) else {}


def _supposed(curve: Curve) -> Curve:
    """The curve; one of the user's own, whose tip states no standard deviation, with those of a scan's trace."""
    if np.isfinite(curve.tip_sigma_mm):
        return curve
    return replace(curve, sigma_mm=np.full(len(curve.points_mm), OWN_MM), tip_sigma_mm=OWN_TIP_MM)


def kept(curve: Curve) -> Array:
    """Points (n, 3) on a trace by which its scan is known again, its tip the last."""
    return at_arc(curve.points_mm, samples(curve.length_mm, STEP_MM))


def _learnt(traced_mm: Sequence[ArrayLike], whose: str = OF_CALIBRATION) -> list[tuple[str, Array]]:
    return [(whose, np.asarray(points, dtype=np.float64)) for points in traced_mm]


def _the_same(voxels: str, whose: str) -> str:
    """In words, what two frames have in common that are known by the same."""
    return f"ends where {whose} does, to 0.01 mm" if voxels.startswith(TIP) else f"has the voxels of {whose}"


def _alike(curve: Curve | None, earlier: Sequence[tuple[str, Array]], sigmas: float = ALIKE) -> str:
    """As which earlier scan a frame is traced, in words; empty where as none, or where nobody knows how well it is.

    sigmas : standard deviations of a trace by which it may be off.
    """
    if curve is None:
        return ""
    near = sigmas * float(np.median(curve.sigma_mm))
    for whose, points in earlier:
        if math.dist(points[-1], curve.points_mm[-1]) < sigmas * curve.tip_sigma_mm:
            apart = rms(point_to_curve(points, curve.points_mm)[0])
            if apart < near:
                known = f"traces are known to {near / sigmas:.2g} mm"
                return f"is traced to within {round(apart, 4):.2g} mm of {whose} ({known})"
    return ""


def _repeated(frame: Frame, why: str) -> Frame:
    """The frame, not counted, whatever is wrong with its trace: that others agree with it would be nothing new."""
    as_read = replace(frame, status=FrameStatus.OK.identifier)
    return as_read.failed("load", FrameStatus.REPEATED, f"it {why}")
