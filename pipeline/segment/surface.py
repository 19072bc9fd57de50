"""From a mask and grey values to a signed distance: half-level surface, closest points, blur's bias taken off."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.sparse import sparse_zeros
from pipeline.segment._kernels.wall import (
    PAD,
    dilate,
    distances,
    ends,
    feet,
    into_box,
    lost_feet,
    mean_around,
    propagate,
    smooth_lattice,
    surface_voxels,
)
from pipeline.segment.affinity import Levels
from pipeline.segment.blur import blur_of_wall, half_level_offset
from pipeline.status import FrameStatus, StageError
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


def box_of(order: NDArray[np.int64], grid: Grid, margin_mm: float) -> Box:
    """The box that holds the voxels (flat indices) and ``margin_mm`` around them, clipped to the grid, then padded."""
    margin = np.ceil(margin_mm / grid.spacing_mm).astype(np.int64)
    first, last = ends(order, grid.shape)
    low = np.maximum(first - margin, 0)
    high = np.minimum(last + margin + 1, grid.shape)
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


@dataclass(frozen=True, eq=False)
class Site:
    """A connected region about to get a surface: its padded box, and its mask with layers around it.

    volume : C-contiguous grey.  near : flat indices in the box where ``state`` (mask 1, layers 2, 3, ...) is set.
    """

    volume: Grid
    taps: NDArray[np.float32]
    box: Box
    state: NDArray[np.uint8]
    near: NDArray[np.int64]

    @property
    def grid(self) -> Grid:
        """The box without its padding, holding nothing yet."""
        a, b, c = (n - 2 * PAD for n in self.box.shape)
        empty = np.broadcast_to(np.float32(0), (a, b, c))
        return Grid(empty, self.volume.spacing_mm, self.volume.to_mm(self.box.corner), self.volume.direction)


def prepare(
    volume: Grid,
    order: NDArray[np.int64],
    taps: NDArray[np.float32],
    margin_mm: float,
    more: NDArray[np.int64] | None = None,
) -> Site:
    """The site of the voxels at flat indices ``order`` of a C-contiguous volume, with ``margin_mm`` around them.

    more : further voxels that the box must hold.
    """
    box = box_of(order if more is None else np.concatenate([order, more]), volume, margin_mm)
    state = sparse_zeros(box.shape, np.uint8)
    flat = into_box(order, volume.shape, box.corner, box.shape)
    state.reshape(-1)[flat] = 1
    dilate(state, flat, LAYERS, 2)
    return Site(volume, taps, box, state, np.flatnonzero(state))


def _half_level_wall(site: Site, level: float, inside: NDArray[np.uint8]) -> Wall:
    """Closest points on the surface where smoothed grey is ``level``; marks ``inside``."""
    lattice = sparse_zeros(site.box.shape, np.float32)
    smooth_lattice(site.volume.values, site.box.corner, site.taps, site.state, site.near, lattice)
    voxels = surface_voxels(site.state, lattice, level, DEEP, site.near, inside)
    return find_wall(lattice, level, np.asarray(site.volume.spacing_mm), voxels, inside)


def signed_distance(
    site: Site, levels: Levels, outer_mm: float
) -> tuple[NDArray[np.float32], dict[str, float]]:
    """Signed distance (float32, mm, negative inside) on ``site.grid``.

    Outside, beyond ``outer_mm``, the distance stays at ``outer_mm``. Returns also counters: visits, surface voxels,
    blur_mm.
    """
    shape, spacing = site.box.shape, np.asarray(site.volume.spacing_mm)
    inside = sparse_zeros(shape, np.uint8)
    wall = _half_level_wall(site, levels.half, inside)
    voxels, good = wall.voxels, np.isfinite(wall.distance)
    if not good.any():
        got = f"no place where smoothed grey is {levels.half:.0f}, half way between the vessel and its surroundings"
        do = "the vessel is thinner than its blur: scan with smaller voxels, or set segment.scale = 0"
        msg = f"segment: got {got}; expected a surface; {do}"
        raise StageError(FrameStatus.SEGMENT_FAILED, msg)
    owner = np.zeros(shape, np.int32)
    owner.reshape(-1)[voxels[good]] = np.flatnonzero(good) + 1
    blur = blur_of_wall(wall.steepness[good], wall.curvature[good], levels.contrast)
    wall, bend = corrected(wall, owner, blur, spacing)
    inside.reshape(-1)[voxels[good]] = wall.distance[good] < 0
    visits = propagate(owner, inside, spacing, voxels, wall.foot, outer_mm)
    stray = lost_feet(owner, spacing, voxels, wall.foot, good)
    if len(stray):
        bend[stray] = 0.0
        visits += propagate(owner, inside, spacing, voxels[stray], wall.foot, outer_mm)
    # the distances overwrite the feet's numbers they are read from: one box is held instead of two
    values = owner.reshape(-1).view(np.float32)[: site.grid.values.size].reshape(site.grid.shape)
    distances(owner, inside, spacing, wall.foot, wall.normal, bend, outer_mm, PAD, values)
    return values, {"surface_voxels": float(len(voxels)), "distance_visits": float(visits), "blur_mm": blur}
