"""The lumen's grey under the wire where no reference scan shows it: what the frame has beside the wire."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import ndimage
from scipy.special import ndtr

from pipeline.arrays.robust import spread
from pipeline.arrays.sparse import sparse_zeros
from pipeline.model import Array
from pipeline.trace._kernels.tube import active_voxels
from pipeline.trace.region import HALO_VOXELS, voxels_of
from pipeline.trace.subtraction import Subtraction

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


def _smooth(sums: Array, counts: Array) -> Array:
    """Mean of the blocks around each block, 0 where they hold next to nothing."""
    top, below = (ndimage.gaussian_filter(a, SMOOTH_BLOCKS, mode="constant") for a in (sums, counts))
    return np.asarray(np.where(below > LEAST_SHARE * BLOCK**3, top / np.maximum(below, 1e-9), 0.0))


def levelled(image: Subtraction, curve: Array, sigma: float) -> Subtraction:
    """The image with the lumen's own unevenness taken away: contrast that fades, mixes or settles along the vessel.

    curve : (n, 3) kernel coordinates of the wire, ``sigma`` its blur (mm). The grey of the lumen's inner voxels that
    the wire does not reach is averaged over about 5 voxels, carried under the wire, and out through the wall by the
    wall's own blurred step.
    """
    voxel = float(np.min(image.region.box.spacing_mm))
    index = voxels_of(image.region.runs).T
    at = tuple(index)
    distance, grey = image.region.box.values[at], image.grey[at].astype(float)
    # a blur is wider than half the halo only where the wall was not found; its step is not carried further than that
    share = ndtr(-distance / min(image.wall_blur_mm, 0.5 * HALO_VOXELS * voxel))
    wire = sparse_zeros(image.grey.shape, np.int32)
    active_voxels(wire, image.spacing, np.ascontiguousarray(curve), CLEAR_BLURS * sigma)
    clear = (wire[at] == 0) & (distance < -DEEP_VOXELS * voxel)
    shape = tuple(-(-n // BLOCK) for n in image.grey.shape)
    block = np.ravel_multi_index(tuple(index[:, clear] // BLOCK), shape)
    counts = np.bincount(block, minlength=int(np.prod(shape))).reshape(shape).astype(float)
    sums = np.bincount(block, grey[clear], minlength=int(np.prod(shape))).reshape(shape)
    # voxel n lies at (n + 1/2) / BLOCK - 1/2 in blocks
    level = ndimage.map_coordinates(
        _smooth(sums, counts), (index + 0.5) / BLOCK - 0.5, order=1, mode="nearest"
    )
    # zeros, not a copy: memory is touched at the lumen alone
    out = sparse_zeros(image.grey.shape, np.float32)
    rest = grey - share * level
    out[at] = rest
    noise = spread(rest[clear]) if np.count_nonzero(clear) > 100 else image.noise
    return replace(image, grey=out, noise=max(noise, 1e-6), levels=image.levels | {"noise": noise})
