"""Trivial predictors: what anybody would guess without a simulator. Skill is measured against them.

All but ``previous`` are told where the wire ends up (the deepest traced tip), which a simulator is not: beating them is
not easy, and that is the point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from skimage.graph import MCP_Geometric

from pipeline.arrays.polyline import smooth, to_length
from pipeline.model import Array, Curve, Lumen
from solver import Grid, GuideWire, VesselWall, relax

CENTRE_POWER = 3
"""Cost = (clearance + voxel)^-3: high enough to hold the path on the medial line in bends (at 2 it cuts corners)."""


ROOM_MM = 8.0
"""Paths are looked for in the traced wires' box and this much around it: a detour outside is no predictor."""
STRAIGHT_WIRE = {"segment_mm": 1.0, "bending_stiffness_N_mm2": 10.0}
HARD_WALL_N_MM2 = 100.0  # with EI = 10 N mm^2 a wire sinks in by less than 0.05 mm: bending alone decides


@dataclass(frozen=True, eq=False)
class Nulls:
    """Paths (n, 3) LPS mm from the entry towards the deepest tip; None where there is none."""

    lumen: Lumen
    entry_direction: Array
    radius_mm: float
    centreline: Array | None = None
    shortest: Array | None = None

    def at_depth(self, name: str, depth_mm: float) -> Array | None:
        """A predictor's wire of the given length."""
        path = getattr(self, name)
        return None if path is None or len(path) < 2 else to_length(path, depth_mm)

    @cached_property
    def _hard_wall(self) -> VesselWall:
        return VesselWall(self.lumen.distance, stiffness_N_mm2=HARD_WALL_N_MM2)

    def min_bending(self, depth_mm: float) -> Array | None:
        """The curve of least bending in the lumen: a straight wire laid on the centreline and let go."""
        start = self.at_depth("centreline", depth_mm)
        if start is None:
            return None
        wire = GuideWire(radius_mm=self.radius_mm, **STRAIGHT_WIRE)
        solution = relax(
            wire,
            self._hard_wall,
            depth_mm=depth_mm,
            entry_mm=start[0],
            entry_direction=self.entry_direction,
            start_mm=start,
        )
        return np.asarray(solution.joints_mm) if solution.converged else None


def voxel_path(clearance: Grid, cost: Array, entry_mm: Array, target_mm: Array) -> Array | None:
    """Cheapest path (n, 3) LPS mm through voxels of finite cost, or None where the two ends are not joined."""
    walkable = np.argwhere(cost < np.inf)
    if len(walkable) == 0:
        return None
    wanted = [clearance.to_index(p) for p in (entry_mm, target_mm)]
    ends = [tuple(walkable[np.argmin(np.sum((walkable - index) ** 2, axis=1))]) for index in wanted]
    search = MCP_Geometric(cost, sampling=tuple(clearance.spacing_mm))
    total, _ = search.find_costs([ends[0]], [ends[1]])
    if not np.isfinite(total[ends[1]]):
        return None
    inner = clearance.to_mm(np.array(search.traceback(ends[1])))
    return np.vstack([entry_mm, inner[1:]])


def _room(lumen: Lumen, points_mm: Array) -> Grid:
    """The distance around the traced wires alone: a tenth of a circle of Willis, and of the memory."""
    grid = lumen.distance
    corners = np.array(
        np.meshgrid(*zip(points_mm.min(axis=0) - ROOM_MM, points_mm.max(axis=0) + ROOM_MM, strict=True))
    )
    index = grid.to_index(corners.reshape(3, -1).T)
    low = np.clip(np.floor(index.min(axis=0)), 0, np.array(grid.shape) - 1).astype(int)
    high = np.clip(np.ceil(index.max(axis=0)) + 1, low + 1, grid.shape).astype(int)
    return grid.crop((low[0], low[1], low[2]), (high[0], high[1], high[2]))


def build(lumen: Lumen, entry_mm: Array, entry_direction: Array, traced_mm: Array, radius_mm: float) -> Nulls:
    """The predictors for a wire of ``radius_mm`` from the entry to the tip of the deepest trace (n, 3)."""
    room = _room(lumen, np.vstack([entry_mm, traced_mm]))
    clearance = -np.asarray(room.values, dtype=np.float64)
    voxel = float(room.spacing_mm.mean())
    centre_cost = np.where(clearance > 0, (np.maximum(clearance, 0) + voxel) ** -CENTRE_POWER, np.inf)
    short_cost = np.where(clearance > min(radius_mm, 0.5 * float(clearance.max())), 1.0, np.inf)
    paths = [voxel_path(room, cost, entry_mm, traced_mm[-1]) for cost in (centre_cost, short_cost)]
    smoothed = [None if path is None else smooth(path, 0.5 * voxel) for path in paths]
    return Nulls(lumen, entry_direction, radius_mm, *smoothed)


def previous(curves: Sequence[Curve | None], frame: int, depth_mm: float) -> Array | None:
    """The last traced wire before ``frame``, pushed on along its own curve and then straight to the new depth."""
    for curve in reversed(curves[:frame]):
        if curve is not None and len(curve.points_mm) > 1:
            return to_length(curve.points_mm, depth_mm)
    return None
