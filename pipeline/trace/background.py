"""What a frame would show without wire: from a reference scan, or from the lumen's wall alone."""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from pipeline.arrays.axis_order import contiguous, integer_offset, reorder
from pipeline.arrays.sparse import sparse_zeros
from pipeline.model import Lumen, Volume
from pipeline.trace._kernels.background import denoised, model, residual
from pipeline.trace.region import HALO_VOXELS, MAD, Region, sampled
from solver.grid import Grid

TABLE_HALF = 160
"""Entries of the wall's profile on either side, a twentieth of a voxel apart."""
SMOOTH_VOXELS = 1.0
"""Gaussian with which the reference's departure from the model is smoothed: its noise falls to 0.15."""
_backgrounds: weakref.WeakKeyDictionary[Grid, tuple[Any, NDArray[Any]]] = weakref.WeakKeyDictionary()


def wall_blur(lumen: Lumen, voxel: float) -> float:
    """The scanner's blur as segment found it, else 0.9 voxel."""
    found = float(lumen.counters.get("scanner_blur_mm", float("nan")))
    return found if np.isfinite(found) and found > 0.3 * voxel else 0.9 * voxel


def _profile(grey: NDArray[Any], distance: NDArray[Any], voxel: float, blur: float) -> NDArray[np.float64]:
    """Grey over signed distance: the medians well inside and 2 to 4 voxels outside, joined by a blurred step."""
    deep, out = distance < -voxel, (distance > 2 * voxel) & (distance < HALO_VOXELS * voxel)
    inside = float(np.median(grey[deep if deep.any() else distance < 0]))
    outside = float(np.median(grey[out])) if out.any() else inside
    at = np.arange(-TABLE_HALF, TABLE_HALF + 1) * 0.05 * voxel
    return np.asarray(outside + (inside - outside) * ndtr(-at / blur))


def _sample(scan: Grid, corner: NDArray[np.int64], region: Region) -> tuple[NDArray[Any], NDArray[Any]]:
    """Grey and distance at every hundredth run or so, enough for two medians."""
    runs = region.runs[:: max(1, len(region.runs) // 2000)]
    length = runs[:, 3] - runs[:, 2]
    row = np.repeat(runs[:, :3], length, axis=0)
    row[:, 2] += np.arange(len(row)) - np.repeat(np.cumsum(length) - length, length)
    at = row + corner
    return scan.values[tuple(at.T)], region.box.values[tuple(row.T)]


def modelled(frame: Grid, region: Region, lumen: Lumen) -> NDArray[np.float32]:
    """A background without a reference: two grey levels of the frame itself, joined by the blurred wall."""
    voxel = float(np.min(frame.spacing_mm))
    table = _profile(*_sample(frame, region.corner, region), voxel, wall_blur(lumen, voxel))
    out = sparse_zeros(region.box.shape, np.float32)
    model(region.box.values, region.runs, table, 0.05 * voxel, out)
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


def smoothed(reference: Volume, region: Region, lumen: Lumen, axes: tuple[int, int, int]) -> NDArray[Any]:
    """The reference near the lumen, its noise smoothed away; worked out once, since frames share it."""
    known = _backgrounds.get(reference)
    if known is not None and known[0] is region:
        return known[1]
    scan, corner = _on_box(reference, region, axes)
    voxel = float(np.min(scan.spacing_mm))
    table = _profile(*_sample(scan, corner, region), voxel, wall_blur(lumen, voxel))
    kind = np.int16 if scan.values.dtype.kind in "iu" and scan.values.dtype.itemsize <= 2 else np.float32
    rough = sparse_zeros(region.box.shape, kind)
    distance = region.box.values
    residual(scan.values, corner, distance, region.runs, table, 0.05 * voxel, rough)
    values = rough.reshape(-1)[region.within].astype(float)
    variance = (MAD * float(np.median(np.abs(values - np.median(values))))) ** 2
    x = np.arange(-2, 3)
    taps = np.exp(-0.5 * (x / SMOOTH_VOXELS) ** 2)
    out = sparse_zeros(region.box.shape, kind)
    limit = HALO_VOXELS * voxel
    denoised(rough, distance, region.runs, table, 0.05 * voxel, taps, limit, variance, out)
    _backgrounds[reference] = (region, out)
    return out
