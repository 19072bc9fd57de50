"""The curve of the frame before, waited for only when the tracing of a frame asks for it."""

from collections.abc import Callable
from functools import cached_property

import numpy as np

from pipeline.model import Curve

NOTHING = Curve(np.zeros((0, 3)), np.zeros(0))
"""An empty curve: stands for the previous one where there is none."""
ASKS = Curve(np.zeros((0, 3)), np.zeros(0), source="depends on the curve of the frame before")
"""Stored under a frame's own inputs where its trace also depends on the frame before."""


def is_asks(kept: object) -> bool:
    """Whether a stored result is ``ASKS``."""
    return isinstance(kept, Curve) and kept.source == ASKS.source and len(kept.points_mm) == 0


class Before:
    """Stands for the previous frame's curve in a call of ``trace``, with all its attributes; asked : it was used.

    Most frames are traced without it: these wait for no other frame, and do not depend on any.
    """

    def __init__(self, find: Callable[[], Curve]) -> None:
        self._find, self.asked = find, False

    @cached_property
    def curve(self) -> Curve:
        """The curve itself."""
        self.asked = True
        return self._find()

    def __getattr__(self, name: str) -> object:
        return getattr(self.curve, name)
