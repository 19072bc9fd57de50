"""One process on several cores: calls that do not depend on each other, side by side in threads.

Kernels give up the interpreter's lock, so that they run at the same time. What a call returns does not depend on how
many cores there are; work is divided where each part of a result depends on its own inputs alone.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np
from numpy.typing import NDArray

_cores: ContextVar[int] = ContextVar("cores", default=1)
"""Of this thread; threads begun here have one each."""


@contextmanager
def on_cores(count: int) -> Iterator[None]:
    """Let the calls in the block use so many cores."""
    before = _cores.set(count)
    try:
        yield
    finally:
        _cores.reset(before)


def side_by_side(*calls: Callable[[], Any]) -> list[Any]:
    """The results of calls, in order."""
    if min(_cores.get(), len(calls)) < 2:
        return [call() for call in calls]
    with ThreadPoolExecutor(min(_cores.get(), len(calls)) - 1) as others:
        begun = [others.submit(call) for call in calls[1:]]
        first = calls[0]()
        # from the end on, what nobody has begun is done here
        rest = [call() if one.cancel() else one.result() for call, one in zip(calls[:0:-1], begun[::-1], strict=True)]
        return [first, *rest[::-1]]


def in_parts(work: Callable[[NDArray[Any]], Any], voxels: NDArray[Any]) -> list[Any]:
    """``work`` of a list in as many consecutive parts as there are cores."""

    def of(part: NDArray[Any]) -> Callable[[], Any]:
        return lambda: work(part)

    return side_by_side(*(of(part) for part in np.array_split(voxels, _cores.get())))
