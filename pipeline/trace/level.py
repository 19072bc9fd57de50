"""The lumen's grey under the wire where no reference scan shows it: what the frame has beside the wire."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.special import ndtr

from pipeline.arrays.sparse import sparse_zeros
from pipeline.model import Array
from pipeline.trace._kernels.tube import active_voxels
from pipeline.trace.region import HALO_VOXELS, MAD
from pipeline.trace.scene import Scene

CLEAR_BLURS = 3.5
"""Distance from the wire's axis, in its blurs, from which grey is taken for the lumen's: 0.2 % of the peak is left."""
DEEP_VOXELS = 1.0
"""Depth in the lumen from which a voxel shows the lumen's own grey: nearer the wall its blur mixes in."""
BLOCK = 4
"""Edge (voxels) of the blocks in which grey is averaged first."""
SMOOTH_BLOCKS = 1.25
"""Gaussian over block means: 5 voxels, wide enough to reach across the wire, short against changes of contrast."""
LEAST_SHARE = 0.02
"""Share of the voxels of a full block below which the smoothed blocks say nothing and the level is left alone."""


def _near(scene: Scene, curve: Array, radius: float) -> NDArray[np.bool_]:
    """Voxels (flat, bool) within ``radius`` mm of the curve (n, 3)."""
    slot = sparse_zeros(scene.grey.shape, np.int32)
    active_voxels(scene.grey.shape, scene.spacing, np.ascontiguousarray(curve), radius, slot)
    return np.asarray(slot.reshape(-1) > 0)


def _indices(runs: NDArray[np.int64]) -> NDArray[np.int64]:
    """Voxels (n, 3) of runs (rows i, j, first k, stop k)."""
    length = runs[:, 3] - runs[:, 2]
    row = np.repeat(runs[:, :3], length, axis=0)
    row[:, 2] += np.arange(len(row)) - np.repeat(np.cumsum(length) - length, length)
    return row


def _smooth(sums: Array, counts: Array) -> Array:
    """Mean of the blocks around each block, 0 where they hold next to nothing."""
    top, below = (ndimage.gaussian_filter(a, SMOOTH_BLOCKS, mode="constant") for a in (sums, counts))
    return np.asarray(np.where(below > LEAST_SHARE * BLOCK**3, top / np.maximum(below, 1e-9), 0.0))


def levelled(scene: Scene, curve: Array, sigma: float, wall_blur: float) -> Scene:
    """The scene with the lumen's own unevenness taken away: contrast that fades, mixes or settles along the vessel.

    curve : (n, 3) kernel coordinates of the wire, ``sigma`` its blur (mm). The grey of the lumen's inner voxels that
    the wire does not reach is averaged over about 5 voxels, carried under the wire, and out through the wall by the
    wall's own blurred step (``wall_blur`` mm).
    """
    voxel = float(np.min(scene.region.box.spacing_mm))
    index = _indices(scene.region.runs)
    distance = scene.region.box.values[tuple(index.T)]
    # a blur is wider than half the halo only where the wall was not found; its step is not carried further than that
    share = ndtr(-distance / min(wall_blur, 0.5 * HALO_VOXELS * voxel))
    clear = ~_near(scene, curve, CLEAR_BLURS * sigma)[np.ravel_multi_index(tuple(index.T), scene.grey.shape)]
    clear &= distance < -DEEP_VOXELS * voxel
    grey = scene.grey[tuple(index.T)].astype(float)
    shape = tuple(-(-n // BLOCK) for n in scene.grey.shape)
    block = np.ravel_multi_index(tuple((index[clear] // BLOCK).T), shape)
    counts = np.bincount(block, minlength=int(np.prod(shape))).reshape(shape).astype(float)
    sums = np.bincount(block, grey[clear], minlength=int(np.prod(shape))).reshape(shape)
    # voxel n lies at (n + 1/2) / BLOCK - 1/2 in blocks
    at = (index.T + 0.5) / BLOCK - 0.5
    level = ndimage.map_coordinates(_smooth(sums, counts), at, order=1, mode="nearest")
    # zeros, not a copy: memory is touched at the lumen alone
    out = sparse_zeros(scene.grey.shape, np.float32)
    out[tuple(index.T)] = grey - share * level
    rest = (grey - share * level)[clear]
    noise = MAD * float(np.median(np.abs(rest - np.median(rest)))) if len(rest) > 100 else scene.noise
    return replace(scene, grey=out, noise=max(noise, 1e-6), counters=scene.counters | {"noise": noise})
