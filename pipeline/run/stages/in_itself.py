"""Wires and catheters that pass through themselves: no part of the model pushes them apart."""

from pipeline.run.stages.known import Frame
from pipeline.status import FrameStatus

MOST_OVERLAP_RADII = 0.1
"""Overlap of the wire with itself, in radii, that still counts as a touch: less than a scan can show."""


def not_in_itself(frame: Frame, overlap_mm: float, radius_mm: float, what: str = "the wire") -> Frame:
    """The frame, failed where what has this radius overlaps itself by more than a touch."""
    if not overlap_mm > MOST_OVERLAP_RADII * radius_mm:
        return frame
    return frame.failed("simulate", FrameStatus.SELF_CONTACT, f"{what} lies {overlap_mm:.2f} mm deep in itself")
