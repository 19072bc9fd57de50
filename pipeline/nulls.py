"""Trivial predictors: what anybody would guess without a simulator. Skill is measured against them.

All but ``previous`` are told where the wire ends up (the deepest traced tip), which a simulator is not: beating them is
not easy, and that is the point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from skimage.graph import MCP_Geometric

from pipeline.curves import smooth, to_length
from pipeline.model import Array, Curve, Lumen

CENTRE_POWER = 3
"""Cost = (clearance + voxel)^-3: high enough to hold the path on the medial line in bends (at 2 it cuts corners)."""


@dataclass(frozen=True, eq=False)
class Nulls:
    """Paths (n, 3) LPS mm from the entry towards the deepest tip; None where there is none."""

    centreline: Array | None = None
    shortest: Array | None = None
    min_bending: Array | None = None

    def at_depth(self, name: str, depth_mm: float) -> Array | None:
        """A predictor's wire of the given length."""
        path = getattr(self, name)
        return None if path is None or len(path) < 2 else to_length(path, depth_mm)


def voxel_path(lumen: Lumen, cost: Array, entry_mm: Array, target_mm: Array) -> Array | None:
    """Cheapest path (n, 3) LPS mm through voxels of finite cost, or None where the two ends are not joined."""
    grid = lumen.distance
    walkable = np.argwhere(cost < np.inf)
    if len(walkable) == 0:
        return None
    ends = [
        tuple(walkable[np.argmin(np.sum((walkable - grid.to_index(p)) ** 2, axis=1))])
        for p in (entry_mm, target_mm)
    ]
    search = MCP_Geometric(cost, sampling=tuple(grid.spacing_mm))
    total, _ = search.find_costs([ends[0]], [ends[1]])
    if not np.isfinite(total[ends[1]]):
        return None
    inner = grid.to_mm(np.array(search.traceback(ends[1])))
    return np.vstack([entry_mm, inner[1:]])


def build(lumen: Lumen, entry_mm: Array, target_mm: Array, radius_mm: float) -> Nulls:
    """The static predictors for a wire of ``radius_mm`` from the entry to the deepest traced tip."""
    clearance = -np.asarray(lumen.distance.values, dtype=np.float64)
    voxel = float(lumen.distance.spacing_mm.mean())
    inside = clearance > 0
    centre_cost = np.where(inside, (np.maximum(clearance, 0) + voxel) ** -CENTRE_POWER, np.inf)
    short_cost = np.where(clearance > min(radius_mm, 0.5 * float(clearance.max())), 1.0, np.inf)
    centre = voxel_path(lumen, centre_cost, entry_mm, target_mm)
    short = voxel_path(lumen, short_cost, entry_mm, target_mm)
    return Nulls(
        None if centre is None else smooth(centre, 0.5 * voxel),
        None if short is None else smooth(short, 0.5 * voxel),
    )


def previous(curves: Sequence[Curve | None], frame: int, depth_mm: float) -> Array | None:
    """The last traced wire before ``frame``, pushed on along its own curve and then straight to the new depth."""
    for curve in reversed(curves[:frame]):
        if curve is not None and len(curve.points_mm) > 1:
            return to_length(curve.points_mm, depth_mm)
    return None
