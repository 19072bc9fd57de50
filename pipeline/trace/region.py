"""Where in the frames the wire is looked for: the lumen's voxels on the frames' lattice, in the order of memory."""

from __future__ import annotations

import weakref
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from pipeline.arrays.axis_order import contiguous, integer_offset, reorder
from pipeline.model import Lumen
from pipeline.trace._kernels.ridges import runs_below
from solver.grid import Grid

HALO_VOXELS = 4.0
"""How far outside the lumen grey is read: the blurred wire and the windows of derivatives reach that far."""
INSIDE_MM = 0.3
"""How far outside the wall the wire's axis may seem to lie: one voxel of segmentation and registration error."""
SAMPLE = 20000
"""Voxels of the lumen from which noise is estimated (to half a per cent)."""
MAD = 1.4826


@dataclass(frozen=True, eq=False)
class Region:
    """The part of the frames' lattice that is looked at: the lumen's box and its voxels, in memory order.

    box : float32 signed distance on the frames' lattice.  corner : index in the frame of its voxel (0, 0, 0).
    runs : (n, 4) rows of voxels near the lumen.  within : flat indices of a sample of those in it.
    allowed : uint8 box, 1 where the wire's axis may lie.
    """

    box: Grid
    corner: NDArray[np.int64]
    runs: NDArray[np.int64]
    within: NDArray[np.int64]
    allowed: NDArray[np.uint8]


def _onto(frame: Grid, distance: Grid) -> tuple[Grid, NDArray[np.int64]]:
    """The distance on the frame's lattice and the corner of its box; interpolated only where lattices differ."""
    offset = integer_offset(frame, distance)
    if offset is not None:
        corner = offset.astype(np.int64)
        low = np.maximum(corner, 0)
        high = np.minimum(corner + distance.shape, frame.shape)
        if np.any(high <= low):
            return distance.crop((0, 0, 0), (1, 1, 1)), low
        a, b = (low - corner).tolist(), (high - corner).tolist()
        return distance.crop((a[0], a[1], a[2]), (b[0], b[1], b[2])), low
    ends = np.stack(np.meshgrid(*[(0, n - 1) for n in distance.shape], indexing="ij"), -1).reshape(-1, 3)
    index = frame.to_index(distance.to_mm(ends))
    low = np.clip(np.floor(index.min(0)), 0, np.array(frame.shape) - 1).astype(np.int64)
    high = np.clip(np.ceil(index.max(0)), low + 1, np.array(frame.shape)).astype(np.int64)
    empty = Grid(
        np.broadcast_to(np.float32(0), tuple(high - low)), frame.spacing_mm, frame.to_mm(low), frame.direction
    )
    return sampled(distance, empty, float(np.max(distance.values))), low


def sampled(grid: Grid, like: Grid, outside: float) -> Grid:
    """``grid`` interpolated (trilinear) at the voxels of ``like``, float32; ``outside`` beyond it."""
    matrix = (grid.direction.T @ like.direction) * like.spacing_mm / grid.spacing_mm[:, None]
    shift = grid.to_index(like.origin_mm)
    values = np.empty(like.shape, np.float32)
    ndimage.affine_transform(
        grid.values.astype(np.float32),
        matrix,
        shift,
        like.shape,
        output=values,
        order=1,
        mode="constant",
        cval=outside,
    )
    return like.with_values(values)


_regions: weakref.WeakKeyDictionary[Lumen, dict[Any, Region]] = weakref.WeakKeyDictionary()


def _key(grid: Grid) -> tuple[Any, ...]:
    return (grid.shape, *(tuple(np.ravel(a)) for a in (grid.spacing_mm, grid.origin_mm, grid.direction)))


def region_of(frame: Grid, lumen: Lumen, axes: tuple[int, int, int]) -> Region:
    """The region for frames of this lattice; worked out once per lumen, since frames share it."""
    known = _regions.setdefault(lumen, {})
    key = (axes, *_key(frame))
    if key not in known:
        box, corner = _onto(frame, reorder(lumen.distance, axes))
        box = contiguous(box)
        runs = runs_below(box.values, HALO_VOXELS * float(np.min(box.spacing_mm)))
        allowed = (box.values < INSIDE_MM).view(np.uint8)
        within = np.flatnonzero(allowed)
        within = within[:: max(1, len(within) // SAMPLE)]
        known.clear()
        known[key] = Region(box, corner, runs, within, allowed)
    return known[key]
