"""Whether insertion_mm states what the traces show, but of other frames, or as steps from frame to frame."""

from collections.abc import Mapping, Sequence

import numpy as np

from pipeline.run.stages.known import Frame

FEWEST = 3
"""Traced depths for a check of steps."""


def in_another_order(frames: Sequence[Frame], depths_mm: Mapping[int, float], tolerance_mm: float) -> list[str]:
    """A warning where the wires have the stated depths, but those of other frames. depths_mm : of ``traced_depths``."""
    numbers = [*depths_mm]
    stated = np.array([f.expected_mm for f in frames if f.index in depths_mm])
    traced = np.array([depths_mm[n] for n in numbers])
    place = np.argsort(np.argsort(traced, kind="stable"), kind="stable")
    whose = np.argsort(stated, kind="stable")[place]
    apart = np.abs(traced - stated)
    if not np.any(apart > tolerance_mm) or np.any(np.abs(traced - stated[whose]) > tolerance_mm):
        return []
    worst = int(np.argmax(apart))
    count = np.count_nonzero(apart > tolerance_mm)
    return [
        f"the traced wires have the depths that insertion_mm states, of other frames ({count} of {len(numbers)}): that "
        f"of frame {numbers[worst]}, {traced[worst]:.1f} mm, is of frame {numbers[int(whose[worst])]}; are frames and "
        "insertion_mm in one order?"
    ]


def as_steps(frames: Sequence[Frame], depths_mm: Mapping[int, float], tolerance_mm: float) -> list[str]:
    """A warning where the traced depths are the sums of those stated so far. depths_mm : of ``traced_depths``."""
    sums = dict(zip((f.index for f in frames), np.cumsum([f.expected_mm for f in frames]), strict=True))
    stated = {f.index: f.expected_mm for f in frames}
    off = [abs(depths_mm[n] - stated[n]) for n in depths_mm]
    of_sums = [abs(depths_mm[n] - sums[n]) for n in depths_mm]
    if len(off) < FEWEST or not max(off) > tolerance_mm or not max(of_sums) <= tolerance_mm:
        return []
    last = max(depths_mm)
    return [
        f"the traced wires are as deep as all that insertion_mm states so far added up (frame {last}: "
        f"{depths_mm[last]:.1f} mm, stated {stated[last]:g}, sum {sums[last]:.1f}): are these increments? State the "
        "depth of each frame, counted from entry_mm"
    ]
