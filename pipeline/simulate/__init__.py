"""simulate: the insertion replayed to the depth of every frame, from the clamp on."""

from __future__ import annotations

from pipeline.simulate.clamp import measured_clamp
from pipeline.simulate.replay import insertion_of, simulate

__all__ = ["insertion_of", "measured_clamp", "simulate"]
