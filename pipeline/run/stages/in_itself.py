"""Wires and catheters that pass through themselves: no part of the model pushes them apart."""

import math

from pipeline.run.stages.known import Frame
from pipeline.status import FrameStatus
from solver import Solution

MOST_OVERLAP_RADII = 0.1
"""Overlap of the wire with itself, in radii, that still counts as a touch: less than a scan can show."""


def not_in_itself(frame: Frame, overlap_mm: float, radius_mm: float, what: str = "the wire") -> Frame:
    """The frame, failed where what has this radius overlaps itself by more than a touch."""
    if not overlap_mm > MOST_OVERLAP_RADII * radius_mm:
        return frame
    return frame.failed("simulate", FrameStatus.SELF_CONTACT, f"{what} lies {overlap_mm:.2f} mm deep in itself")


def not_passed(frame: Frame, wire: Solution) -> Frame:
    """The frame, failed where a strand passed through another one on the way: the wire lies as no real one could."""
    if math.isinf(wire.passed_itself_mm):
        return frame
    said = f"the wire passed through itself at a depth of {wire.passed_itself_mm:.1f} mm"
    return frame.failed("simulate", FrameStatus.SELF_CONTACT, said)
