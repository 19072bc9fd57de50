"""Scans that occur twice in a case under different names, found by their voxels."""

from collections.abc import Collection, Sequence
from dataclasses import replace

from pipeline.run.stages.known import Frame
from pipeline.status import FrameStatus


def once(frames: Sequence[Frame], calibrated: Collection[str] = ()) -> list[Frame]:
    """Fail each frame that has the voxels of an earlier one, in whatever file, or of a scan that was calibrated with.

    calibrated : ``Frame.voxels`` of these scans.
    """
    out, first = list(frames), dict[str, int]()
    for n, frame in enumerate(frames):
        same = first.setdefault(frame.voxels, n)
        if frame.voxels in calibrated:
            out[n] = _repeated(frame, "a scan that was calibrated with: it says nothing about the model")
        elif frame.voxels and same != n:
            out[n] = _repeated(frame, f"frame {same}")
    return out


def _repeated(frame: Frame, whose: str) -> Frame:
    """The frame, not counted, whatever is wrong with its trace: that others agree with it would be nothing new."""
    as_read = replace(frame, status=FrameStatus.OK.identifier)
    return as_read.failed("load", FrameStatus.REPEATED, f"it has the voxels of {whose}")
