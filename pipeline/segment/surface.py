"""From a mask and grey values to a signed distance: half-level surface, closest points, blur's bias taken off."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline._kernels.wall import (
    PAD,
    dilate,
    distances,
    feet,
    lost_feet,
    mean_around,
    propagate,
    smooth_lattice,
    surface_voxels,
)
from pipeline.segment.affinity import Levels
from pipeline.segment.blur import blur_of_wall, half_level_offset
from solver.grid import Array, Grid

LAYERS = 4
"""Layers around the mask in which grey is smoothed: two may still be inside, two more feed the spline."""
DEEP = 3
"""Mark of the last layer (mask = 1) that may be inside: connectedness is off by up to half a voxel, noise by one."""


@dataclass(frozen=True, eq=False)
class Box:
    """The vessel's padded box in the volume: the volume voxel of its voxel (PAD, PAD, PAD), and its arrays."""

    corner: NDArray[np.int64]
    shape: tuple[int, int, int]

    def flat(self, index: NDArray[np.int64]) -> NDArray[np.int64]:
        """Flat box indices of volume indices (n, 3)."""
        i, j, k = (index - self.corner + PAD).T
        return np.asarray((i * self.shape[1] + j) * self.shape[2] + k)


def box_of(index: NDArray[np.int64], grid: Grid, margin_mm: float) -> Box:
    """The box that holds the voxels (n, 3) and ``margin_mm`` around them, clipped to the grid, then padded."""
    margin = np.ceil(margin_mm / grid.spacing_mm).astype(np.int64)
    low = np.maximum(index.min(axis=0) - margin, 0)
    high = np.minimum(index.max(axis=0) + margin + 1, grid.shape)
    a, b, c = (int(n) + 2 * PAD for n in high - low)
    return Box(low, (a, b, c))


@dataclass(frozen=True, eq=False)
class Wall:
    """The surface's closest points and what they tell: foot, normal, curvature (1/mm), steepness (grey per mm)."""

    voxels: NDArray[np.int64]
    distance: Array
    foot: Array
    normal: Array
    curvature: Array
    steepness: Array


def find_wall(
    lattice: NDArray[Any], level: float, spacing: Array, voxels: NDArray[Any], inside: NDArray[Any]
) -> Wall:
    """Closest points of the voxels next to the half-level surface."""
    n = len(voxels)
    foot, normal = np.zeros((n, 3)), np.zeros((n, 3))
    curvature, steepness = np.zeros(n), np.zeros(n)
    distance = feet(lattice, level, spacing, voxels, inside, foot, normal, curvature, steepness)
    return Wall(voxels, distance, foot, normal, curvature, steepness)


def corrected(wall: Wall, owner: NDArray[np.int32], sigma_mm: float, spacing: Array) -> tuple[Wall, Array]:
    """The wall moved out by the blur's offset, and the curvature averaged over the neighbourhood, 1/mm.

    Curvature is a second derivative of noisy grey: its mean over 5^3 voxels is what the offset is taken from.
    """
    good = np.isfinite(wall.distance)
    limit = 1.0 / float(spacing.min())
    bend = mean_around(owner, wall.voxels, np.clip(wall.curvature, -limit, limit), good, 2)
    offset = half_level_offset(bend, sigma_mm)
    moved = wall.foot + offset[:, None] * wall.normal
    return Wall(wall.voxels, wall.distance - offset, moved, wall.normal, bend, wall.steepness), bend


def signed_distance(
    volume: Grid,
    order: NDArray[np.int64],
    levels: Levels,
    taps: NDArray[np.float32],
    margin_mm: float,
    outer_mm: float,
) -> tuple[Grid, dict[str, float]]:
    """Signed distance (float32, mm, negative inside) on the vessel's box.

    volume : C-contiguous.  order : flat indices of the connected voxels.  Outside, beyond ``outer_mm``, the distance
    stays at ``outer_mm``. Returns also counters: visits, surface voxels, blur_mm.
    """
    index = np.stack(np.unravel_index(order, volume.shape), axis=1)
    box = box_of(index, volume, margin_mm)
    state = np.zeros(box.shape, np.uint8)
    flat = box.flat(index)
    state.reshape(-1)[flat] = 1
    dilate(state, flat, LAYERS, 2)
    near = np.flatnonzero(state)
    lattice = np.zeros(box.shape, np.float32)
    smooth_lattice(volume.values, box.corner, taps, near, lattice)
    inside = np.zeros(box.shape, np.uint8)
    voxels = surface_voxels(state, lattice, levels.half, DEEP, near, inside)
    spacing = np.asarray(volume.spacing_mm)
    wall = find_wall(lattice, levels.half, spacing, voxels, inside)
    del lattice
    owner = np.zeros(box.shape, np.int32)
    good = np.isfinite(wall.distance)
    owner.reshape(-1)[voxels[good]] = np.flatnonzero(good) + 1
    blur = blur_of_wall(wall.steepness[good], wall.curvature[good], levels.contrast)
    wall, bend = corrected(wall, owner, blur, spacing)
    inside.reshape(-1)[voxels[good]] = wall.distance[good] < 0
    visits = propagate(owner, inside, spacing, voxels, wall.foot, outer_mm)
    stray = lost_feet(owner, spacing, voxels, wall.foot, good)
    if len(stray):
        bend[stray] = 0.0
        visits += propagate(owner, inside, spacing, voxels[stray], wall.foot, outer_mm)
    distance = owner.view(np.float32)
    distances(owner, inside, spacing, wall.foot, wall.normal, bend, outer_mm, distance)
    keep = tuple(slice(PAD, n - PAD) for n in box.shape)
    origin = volume.to_mm(box.corner)
    values = np.ascontiguousarray(distance[keep])
    counters = {"surface_voxels": float(len(voxels)), "distance_visits": float(visits), "blur_mm": blur}
    return Grid(values, volume.spacing_mm, origin, volume.direction), counters
