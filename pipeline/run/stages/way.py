"""The way of the hand as a case knows it: how deep every frame is simulated, and which are only gone through."""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from pipeline.model import Clamp
from pipeline.run.stages.depths import FEWEST
from pipeline.run.stages.known import Context, Frame
from pipeline.simulate.clamp import depth_from
from pipeline.simulate.way import Stop, Way
from pipeline.status import FrameStatus


def stop_of(frame: Frame) -> Stop:
    """What the hand had done by a frame whose depth is known."""
    return Stop(frame.index, frame.depth_mm, frame.roll_deg, frame.catheter_mm)


def passed(frames: Sequence[Frame], read: Collection[int]) -> list[Stop]:
    """The frames that are gone through between those that are ``read``, by number: all whose depth is known.

    The others' way is not known; the insertion goes on from the frame before.
    """
    return [stop_of(frame) for frame in frames if frame.index not in read and not np.isnan(frame.depth_mm)]


def passed_at(frames: Sequence[Frame], read: Collection[int], source: str, clamp: Clamp) -> list[Stop]:
    """The same before the depths of a case are settled, or with those of another ``clamp`` or ``source``."""
    return passed(with_depths(frames, source, clamp), read)


def way_of(run: Context, frames: Sequence[Frame], read: Sequence[Frame]) -> Way:
    """The way to frames that are ``read`` through all ``frames`` of a case whose depths are settled."""
    through = passed(frames, {frame.index for frame in read})
    return Way.reading(map(stop_of, read), through, sheathed=run.case.catheter is not None)


def by_trace(frame: Frame, source: str) -> bool:
    """Whether the depth of a frame is its traced length.

    The length of a trace that is not trusted is taken only where no depth is stated: pulling the wire back to it and
    pushing it on again would change the frames that follow, where there is friction.
    """
    told = frame.trusted_curve is not None or np.isnan(frame.expected_mm)
    return source == "traced" and frame.traced and bool(told)


def with_depths(frames: Sequence[Frame], source: str, clamp: Clamp) -> list[Frame]:
    """The frames with the depth to simulate: the traced length, else the manifest's; failed where neither is known.

    Where depths are traced, a stated one is taken as the traced ones show that it was read: hands count from a mark of
    their own, and a wire that is drawn back by that in one frame alone lies elsewhere in those that follow.
    """
    traced = {f.index: depth_from(clamp, f.curve) for f in frames if f.curve is not None and by_trace(f, source)}
    apart = np.array([traced[f.index] - f.expected_mm for f in frames if f.index in traced and f.trusted_curve])
    apart = apart[np.isfinite(apart)]
    off = float(np.median(apart)) if len(apart) >= FEWEST else 0.0
    return [
        _at(f, traced[f.index], TRACED_BEHIND) if f.index in traced else _at(f, f.expected_mm + off, STATED_BEHIND)
        for f in frames
    ]


TRACED_BEHIND = (
    "the traced wire ends {:.2f} mm behind the entry, where nothing can be pushed to; check that entry_direction "
    "points the way the wire is pushed, and that entry_mm lies before its tip"
)
STATED_BEHIND = (
    "nothing is traced, and its insertion_mm, counted as the traces show that the others' were, ends {:.2f} mm behind "
    "the entry, where nothing can be pushed to; check insertion_mm"
)


def _at(frame: Frame, depth: float, behind: str) -> Frame:
    """The frame at a depth, mm; failed where that is NaN or ``behind`` the entry."""
    if depth <= 0.0:
        note = behind.format(-depth)
        return replace(frame, depth_mm=float("nan")).failed("simulate", FrameStatus.SIMULATE_FAILED, note)
    found = replace(frame, depth_mm=depth)
    if not np.isnan(depth):
        return found
    return found.failed("simulate", FrameStatus.SIMULATE_FAILED, "no depth: nothing traced and no insertion_mm given")
