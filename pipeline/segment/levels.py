"""What the lumen and its surroundings look like near the seeds: two grey levels and the noise."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from pipeline.segment.affinity import Levels
from solver.grid import Grid

BOX_MM = 6.0
"""Half width of the box around a seed in which the levels are estimated: a carotid artery and what is around it."""
LEAST_BOX = 8
"""Its least half width in voxels."""
SNAP_MM = 0.75
"""Seeds come from a manifest that may be half a voxel off; the seed's grey is the median this far around."""
MAD = 1.4826


def box_around(grid: Grid, index: NDArray[Any], half_mm: float, least: int) -> tuple[slice, slice, slice]:
    """The voxels within ``half_mm`` (at least ``least`` voxels) of a voxel, clipped to the grid."""
    half = np.maximum(np.ceil(half_mm / grid.spacing_mm).astype(int), least)
    a, b, c = (
        slice(max(0, int(i - h)), min(n, int(i + h) + 1)) for i, h, n in zip(index, half, grid.shape, strict=True)
    )
    return a, b, c


def _two_levels(grey: NDArray[Any], seed: float, at: tuple[int, ...]) -> tuple[float, float, NDArray[np.bool_]]:
    """Median grey of the bright region that holds the seed and of what is darker, by fixed-point iteration."""
    outside = float(np.percentile(grey, 10))
    inside = seed
    region = np.zeros(grey.shape, bool)
    for _ in range(8):
        bright = grey > 0.5 * (inside + outside)
        if not bright[at] or bright.all():
            break
        labels, _ = ndimage.label(bright)
        region = labels == labels[at]
        core = ndimage.binary_erosion(region)
        inside = float(np.median(grey[core if core.sum() >= 8 else region]))
        inside = min(inside, seed + 0.5 * (seed - outside))
        outside = float(np.median(grey[~ndimage.binary_dilation(bright, iterations=2)])) if not bright.all() else outside
        if not np.isfinite(outside):
            outside = float(np.percentile(grey, 10))
    return inside, outside, region


def levels_at(grid: Grid, index: NDArray[Any]) -> tuple[Levels, NDArray[np.int64]]:
    """Levels around one seed voxel, and the brightest smoothed voxel beside it, where to start.

    Noise is the spread of (grey - grey smoothed by 1-2-1) inside, which white noise of sd 1 leaves at 0.935.
    """
    box = box_around(grid, index, BOX_MM, LEAST_BOX)
    raw = np.asarray(grid.values[box], np.float32)
    grey = raw
    for axis in range(3):
        grey = ndimage.convolve1d(grey, [0.25, 0.5, 0.25], axis=axis, mode="nearest")
    start = np.array([s.start for s in box])
    near = box_around(grid, index, SNAP_MM, 1)
    inner = tuple(slice(s.start - o, s.stop - o) for s, o in zip(near, start, strict=True))
    around = grey[inner]
    seed = float(np.median(around))
    best = np.unravel_index(int(np.argmin(np.abs(around - seed))), around.shape)
    at = tuple(int(b) + s.start for b, s in zip(best, inner, strict=True))
    inside, outside, region = _two_levels(grey, seed, at)
    rough = (raw - grey)[region] if region.any() else (raw - grey).ravel()
    noise = MAD * float(np.median(np.abs(rough - np.median(rough)))) / 0.935
    return Levels(inside, outside, noise), start + np.array(at)


def core_levels(raw: Grid, distance_mm: NDArray[Any], first: Levels) -> Levels:
    """Levels again from the whole vessel: grey well inside it, and 1 to 2 mm outside it."""
    inner = distance_mm < -1.5 * float(raw.spacing_mm.max())
    outer = (distance_mm > 1.0) & (distance_mm < 2.0)
    inside = float(np.median(raw.values[inner])) if inner.sum() > 50 else first.inside
    outside = float(np.median(raw.values[outer])) if outer.sum() > 50 else first.outside
    return Levels(inside, outside, first.noise)
