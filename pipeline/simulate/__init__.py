"""simulate: the insertion replayed to the depth of every frame, from the clamp on."""

from __future__ import annotations

from pipeline.simulate.clamp import Entry, measured_entry
from pipeline.simulate.replay import guide_wire, rolls, simulate, vessel_wall

__all__ = ["Entry", "guide_wire", "measured_entry", "rolls", "simulate", "vessel_wall"]
