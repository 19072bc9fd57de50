"""Scans that occur twice, in a case or among those of a calibration: of the same voxels, or traced as one scan is.

A scan that was written again (in another format, rounded, with a grey more or a little noise) has other voxels, and is
traced alike to a hundredth of a voxel. Two scans of one wire are not, as each has noise of its own.
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from pipeline.arrays.polyline import at_arc, samples
from pipeline.compare.metrics import point_to_curve, rms
from pipeline.model import Array, Curve
from pipeline.run.stages.known import Frame
from pipeline.status import FrameStatus

ALIKE = 0.4
"""Distance between two traces over their standard deviation, below which they are of one scan. Two scans of one wire
are traced twice the standard deviation apart (1.4 times along each of two axes), those of a scan written again with a
grey more or less 0.02 to 0.3 times."""
STEP_MM = 2.0
"""Between the points that are kept of a trace."""
TIP = "tip "
"""How ``Frame.voxels`` of the user's own curve begins."""
OF_CALIBRATION = "a scan that was calibrated with"


def once(frames: Sequence[Frame], calibrated: Collection[str] = (), traced_mm: Sequence[ArrayLike] = ()) -> list[Frame]:
    """Fail each frame whose scan is an earlier one's, or one that was calibrated with: by its voxels or its trace.

    calibrated : ``Frame.voxels`` of these scans.     traced_mm : points (n, 3) on their traces, as ``kept`` has them.
    """
    out, first = list(frames), dict[str, int]()
    for n, frame in enumerate(frames):
        same = first.setdefault(frame.voxels, n)
        whose = OF_CALIBRATION if frame.voxels in calibrated else f"frame {same}" if frame.voxels and same != n else ""
        if whose:
            out[n] = _repeated(frame, _the_same(frame.voxels, whose))
    earlier = [(OF_CALIBRATION, np.asarray(points, dtype=np.float64)) for points in traced_mm]
    for n, frame in enumerate(out):
        if (curve := frame.trusted_curve) is not None:
            out[n] = _repeated(frame, why) if (why := _alike(curve, earlier)) else frame
            earlier.append((f"frame {n}", kept(curve)))
    return out


def kept(curve: Curve) -> Array:
    """Points (n, 3) on a trace by which its scan is known again, its tip the last."""
    return at_arc(curve.points_mm, samples(curve.length_mm, STEP_MM))


def _the_same(voxels: str, whose: str) -> str:
    """In words, what two frames have in common that are known by the same."""
    return f"it ends where {whose} does, to 0.01 mm" if voxels.startswith(TIP) else f"it has the voxels of {whose}"


def _alike(curve: Curve, earlier: Sequence[tuple[str, Array]]) -> str:
    """Of which earlier scan a curve is, in words; empty where of none, or where nobody knows how well it is traced."""
    near = ALIKE * float(np.median(curve.sigma_mm))
    for whose, points in earlier:
        if math.dist(points[-1], curve.points_mm[-1]) < ALIKE * curve.tip_sigma_mm:
            apart = rms(point_to_curve(points, curve.points_mm)[0])
            if apart < near:
                known = f"where traces are known to {near / ALIKE:.2g} mm"
                return f"it is traced to within {apart:.2g} mm of {whose}, {known}: one scan, written again"
    return ""


def _repeated(frame: Frame, why: str) -> Frame:
    """The frame, not counted, whatever is wrong with its trace: that others agree with it would be nothing new."""
    as_read = replace(frame, status=FrameStatus.OK.identifier)
    return as_read.failed("load", FrameStatus.REPEATED, why)
