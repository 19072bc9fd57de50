"""Processor time of a piece of work, compilation excluded by whoever calls."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from time import perf_counter, process_time
from typing import TypeVar

Result = TypeVar("Result")

LONG_S = 2.0
"""Work longer than this is timed once: its own length averages the noise."""


def timed(work: Callable[[], Result], repeats: int = 3) -> tuple[float, Result]:
    """Median seconds of processor time over the repeats, and the last result.

    Processor time, not time on the wall: all that is measured here runs in one thread, and a busy machine would
    otherwise be measured along.
    """
    seconds: list[float] = []
    for _ in range(max(repeats, 1)):
        start, wall = process_time(), perf_counter()
        result = work()
        seconds.append(process_time() - start)
        if perf_counter() - wall > LONG_S:
            break
    return statistics.median(seconds), result
