"""trace without a lumen: a thin bright line through a start point, in a box."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pipeline.model import Curve, Lumen, Volume
from pipeline.trace import trace
from pipeline.trace.config import TraceConfig
from solver.grid import Grid


def box_lumen(volume: Volume, low_mm: ArrayLike, high_mm: ArrayLike) -> Lumen:
    """A lumen that is a box along the volume's axes between two opposite corners (LPS mm), clipped to the volume."""
    corners = volume.to_index(np.array([low_mm, high_mm], dtype=float))
    low = np.clip(np.floor(corners.min(axis=0)), 0, np.array(volume.shape) - 1).astype(int)
    high = np.clip(np.ceil(corners.max(axis=0)) + 1, low + 1, volume.shape).astype(int)
    depths = []
    for axis in range(3):
        n = int(high[axis] - low[axis])
        at = np.arange(n)
        depth = (np.minimum(at, n - 1 - at) + 0.5) * volume.spacing_mm[axis]
        depths.append(depth.reshape([-1 if a == axis else 1 for a in range(3)]))
    depth = np.minimum(np.minimum(depths[0], depths[1]), depths[2])
    distance = Grid((-depth).astype(np.float32), volume.spacing_mm, volume.to_mm(low), volume.direction)
    return Lumen(distance)


def trace_region(
    volume: Volume,
    low_mm: ArrayLike,
    high_mm: ArrayLike,
    start_mm: ArrayLike,
    direction: ArrayLike,
    *,
    previous: Curve | None = None,
    config: TraceConfig | None = None,
) -> Curve:
    """The thin bright line that passes ``start_mm`` along ``direction``, inside a box (two corners, LPS mm).

    For wires outside any vessel, in phantoms and gels: the background is one level, the median of the box. Returns
    a Curve as :func:`pipeline.trace.trace` does, from the plane through the start point onwards.
    """
    lumen = box_lumen(volume, low_mm, high_mm)
    return trace(volume, lumen, start_mm, direction, previous=previous, config=config)
