"""What a frame would show without wire: from a reference scan, or from the lumen's wall alone."""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from pipeline.arrays.axis_order import contiguous, reorder
from pipeline.arrays.placement import integer_offset, sampled
from pipeline.arrays.robust import spread
from pipeline.arrays.sparse import sparse_zeros
from pipeline.model import Lumen, Volume
from pipeline.trace._kernels.runs import WallModel, denoised, modelled, residual
from pipeline.trace.region import HALO_VOXELS, Region, voxels_of
from solver.grid import Grid

TABLE_HALF = 160
"""Entries of the wall's profile on either side."""
TABLE_STEP = 0.05
"""Voxels from one to the next."""
SMOOTH_VOXELS = 1.0
"""Gaussian with which the reference's departure from the model is smoothed: its noise falls to 0.15."""


def wall_blur(lumen: Lumen, voxel: float) -> float:
    """The scanner's blur (mm) as segment found it, else 0.9 voxel."""
    found = float(lumen.levels.get("scanner_blur_mm", float("nan")))
    return found if np.isfinite(found) and found > 0.3 * voxel else 0.9 * voxel


def _wall_model(scan: Grid, corner: NDArray[np.int64], region: Region, lumen: Lumen) -> WallModel:
    """Grey over signed distance: the medians well inside and 2 to 4 voxels outside, joined by a blurred step."""
    voxel = float(np.min(scan.spacing_mm))
    # every hundredth run or so is enough for two medians
    at = voxels_of(region.runs[:: max(1, len(region.runs) // 2000)])
    grey, distance = scan.values[tuple((at + corner).T)], region.box.values[tuple(at.T)]
    deep, out = distance < -voxel, (distance > 2 * voxel) & (distance < HALO_VOXELS * voxel)
    inside = float(np.median(grey[deep if deep.any() else distance < 0]))
    outside = float(np.median(grey[out])) if out.any() else inside
    steps = np.arange(-TABLE_HALF, TABLE_HALF + 1) * TABLE_STEP * voxel
    table = outside + (inside - outside) * ndtr(-steps / wall_blur(lumen, voxel))
    return WallModel(region.box.values, region.runs, table, TABLE_STEP * voxel)


def from_wall(frame: Grid, region: Region, lumen: Lumen) -> NDArray[np.float32]:
    """A background without a reference: two grey levels of the frame itself, joined by the blurred wall."""
    out = sparse_zeros(region.box.shape, np.float32)
    modelled(_wall_model(frame, region.corner, region, lumen), out)
    return out


def _on_box(reference: Volume, region: Region, axes: tuple[int, int, int]) -> tuple[Grid, NDArray[np.int64]]:
    """The reference, and where in it the region's box starts; interpolated onto the box if lattices differ."""
    grid = reorder(reference, axes)
    offset = integer_offset(grid, region.box)
    if offset is not None:
        corner = offset.astype(np.int64)
        if np.all(corner >= 0) and np.all(corner + region.box.shape <= np.array(grid.shape)):
            return contiguous(grid), corner
    return contiguous(sampled(grid, region.box, 0.0)), np.zeros(3, np.int64)


def _smoothed(reference: Volume, region: Region, lumen: Lumen, axes: tuple[int, int, int]) -> NDArray[Any]:
    scan, corner = _on_box(reference, region, axes)
    wall = _wall_model(scan, corner, region, lumen)
    kind = np.int16 if scan.values.dtype.kind in "iu" and scan.values.dtype.itemsize <= 2 else np.float32
    rough, out = sparse_zeros(region.box.shape, kind), sparse_zeros(region.box.shape, kind)
    residual(scan.values, corner, wall, rough)
    variance = spread(rough.reshape(-1)[region.within].astype(float)) ** 2
    taps = np.exp(-0.5 * (np.arange(-2, 3) / SMOOTH_VOXELS) ** 2)
    denoised(rough, wall, taps, HALO_VOXELS * float(np.min(scan.spacing_mm)), variance, out)
    return out


_smoothed_of: weakref.WeakKeyDictionary[Grid, tuple[Region, NDArray[Any]]] = weakref.WeakKeyDictionary()
"""The last background of each reference, which frames share; it hangs on the reference and the lumen's region alone."""


def from_reference(
    reference: Volume, region: Region, lumen: Lumen, axes: tuple[int, int, int]
) -> NDArray[Any]:
    """The reference near the lumen, its noise smoothed away."""
    known = _smoothed_of.get(reference)
    if known is None or known[0] is not region:
        known = region, _smoothed(reference, region, lumen, axes)
        _smoothed_of[reference] = known
    return known[1]
