"""Where in the frames the wire is looked for: the lumen's voxels on the frames' lattice, in the order of memory."""

from __future__ import annotations

import weakref
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.axis_order import contiguous, reorder
from pipeline.arrays.placement import corners_mm, integer_offset, sampled
from pipeline.model import Lumen
from solver.grid import Grid

HALO_VOXELS = 4.0
"""How far outside the lumen grey is read: the blurred wire and the windows of derivatives reach that far."""
INSIDE_MM = 0.3
"""How far outside the wall the wire's axis may seem to lie: one voxel of segmentation and registration error."""
SAMPLE = 20000
"""Voxels of the lumen from which noise is estimated (to half a per cent)."""


@dataclass(frozen=True, eq=False)
class Region:
    """The part of the frames' lattice that is looked at: the lumen's box and its voxels, in memory order.

    box : float32 signed distance on the frames' lattice.  corner : index in the frame of its voxel (0, 0, 0).
    runs : (n, 4) rows of voxels near the lumen: i, j, first k, stop k.  allowed : uint8 box, 1 where the wire's axis
    may lie.  within : flat indices of a sample of those.
    """

    box: Grid
    corner: NDArray[np.int64]
    runs: NDArray[np.int64]
    within: NDArray[np.int64]
    allowed: NDArray[np.uint8]


def voxels_of(runs: NDArray[np.int64]) -> NDArray[np.int64]:
    """The voxels (n, 3) of runs."""
    length = runs[:, 3] - runs[:, 2]
    row = np.repeat(runs[:, :3], length, axis=0)
    row[:, 2] += np.arange(len(row)) - np.repeat(np.cumsum(length) - length, length)
    return row


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
    index = frame.to_index(corners_mm(distance))
    low = np.clip(np.floor(index.min(0)), 0, np.array(frame.shape) - 1).astype(np.int64)
    high = np.clip(np.ceil(index.max(0)), low + 1, np.array(frame.shape)).astype(np.int64)
    empty = np.broadcast_to(np.float32(0), tuple(high - low))
    box = Grid(empty, frame.spacing_mm, frame.to_mm(low), frame.direction)
    return sampled(distance, box, float(np.max(distance.values))), low


def _region(frame: Grid, distance: Grid) -> Region:
    box, corner = _onto(frame, distance)
    box = contiguous(box)
    # float64: rounded to float32 the limit may take in the distances that were cut off there
    near = box.values < HALO_VOXELS * np.float64(box.spacing_mm.min())
    near = np.pad(near, ((0, 0), (0, 0), (1, 1)))
    edges = np.argwhere(near[..., 1:] != near[..., :-1])
    allowed = (box.values < INSIDE_MM).view(np.uint8)
    within = np.flatnonzero(allowed)
    within = within[:: max(1, len(within) // SAMPLE)]
    return Region(box, corner, np.column_stack([edges[::2], edges[1::2, 2]]), within, allowed)


_regions: weakref.WeakKeyDictionary[Lumen, tuple[bytes, Region]] = weakref.WeakKeyDictionary()
"""The last region of each lumen: frames share it, and it hangs on nothing but the lumen and the frames' lattice."""


def region_of(frame: Grid, lumen: Lumen, axes: tuple[int, int, int]) -> Region:
    """The region for frames of this lattice (their axes reordered by ``axes``)."""
    lattice = (frame.shape, axes, frame.spacing_mm, frame.origin_mm, frame.direction)
    key = np.concatenate([np.ravel(part) for part in lattice]).tobytes()
    known = _regions.get(lumen)
    if known is None or known[0] != key:
        known = key, _region(frame, reorder(lumen.distance, axes))
        _regions[lumen] = known
    return known[1]
