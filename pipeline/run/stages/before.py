"""The curve of the frame before, for a frame that may not need it: waited for where it is asked for."""

from collections.abc import Callable
from functools import cached_property

import numpy as np

from pipeline.model import Curve

NOTHING = Curve(np.zeros((0, 3)), np.zeros(0))
"""The curve of no frame."""
ASKS = Curve(np.zeros((0, 3)), np.zeros(0), note="depends on the curve of the frame before")
"""Stands in the store under the inputs of a frame that does not follow from these alone."""


def is_asks(kept: object) -> bool:
    """Whether what the store has is ``ASKS``."""
    return isinstance(kept, Curve) and kept.note == ASKS.note and len(kept.points_mm) == 0


class Before:
    """Stands for the curve before, as ``trace`` takes it; has everything that a curve has.

    Most frames are traced without it: these wait for no other, and do not depend on any.
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
