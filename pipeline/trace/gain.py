"""A frame's contrast over its reference's, how far its grey lies off, and the correction of both: contrast medium is
never twice the same, and grey is counted from elsewhere where a scanner is not calibrated.

A wire, blurred, reaches every voxel of a narrow vessel and makes it brighter, never darker: the medium is read off the
darkest tenth of the lumen, or off the darkest tenth of its pieces where that is less.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from pipeline.arrays.grids import spread
from pipeline.model import Array
from pipeline.trace.region import SearchRegion, voxels_of

LEAST_LEVEL = 200
"""Fewest voxels from which a level is estimated."""
DARKEST = 0.1
"""Share of the lumen's voxels that shows the medium alone: a wire that reaches all but three tenths of them moves this
quantile by a third of the noise of a voxel, and a median by any amount."""
BLOCK, LEAST_IN_BLOCK, LEAST_BLOCKS = 8, 8, 10
"""Edge of a piece of lumen in voxels, fewest voxels of one that counts, and fewest pieces. Where a wire lies in nearly
all of a vessel of 0.6 to 0.7 mm radius, the darkest tenth of voxels has 2 to 5 % more contrast at a contrast of 30
noises, that of pieces 1 to 3 %: a faint end of three noises was taken off with that."""
CORRELATED = 1.5
"""Noise of pieces, over what white noise has, from which they tell nothing: correlated over a voxel it is 2 to 3, and
without any difference pieces had up to 6 % less contrast."""
SAME_GAIN = 0.02
"""Difference of two scans' contrast, as a share of it, that is left alone."""
SAME_OFFSET, SURE_OFFSET = 0.2, 5.0
"""Difference of two scans' grey outside the lumen, in noises of theirs, that is left alone, and times the root of the
voxels: a third of a noise (a lost intercept, a scanner that is not calibrated) cost every second wire, a fifth none."""
SAME_NOISE = 0.5
"""The same in noises of a voxel, as an estimate from the darkest tenth may be off by that."""

CUT_OFF = 0.1
"""Share of the voxels outside the lumen that have the frame's least grey, from which noise is cut off there: exports
without a sign end at 0, and tissue about 0 has half of its voxels there."""
DARKEST_OF_ALL = 0.02
"""Share of the lumen's voxels from which on to DARKEST noise is read then: no wire is in them."""


def _of_pieces(rest: Array, full: Array, piece: NDArray[np.int64]) -> tuple[Array, Array]:
    """What is left over the contrast in each piece, and its standard deviation where that of a voxel's rest is 1.

    rest, full : (n,) of voxels.  piece : (n,) the number of the piece that each of them lies in.
    """
    size = np.bincount(piece)
    whole = np.bincount(piece, full)
    kept = size >= LEAST_IN_BLOCK
    return np.bincount(piece, rest)[kept] / whole[kept], np.sqrt(size[kept]) / whole[kept]


def _difference(
    rest: Array, full: Array, piece: NDArray[np.int64], where: tuple[NDArray[np.bool_], NDArray[np.bool_]], noise: float
) -> float:
    """By how much the contrast differs, as a share of it; 0 for the same.

    rest : (n,) frame minus reference, both as they were scanned: smoothing lowers the middle of a narrow vessel.
    full : (n,) the background above what surrounds the vessel; less near the wall.  piece : (n,) the number of the
    piece of the scan that each of the n voxels lies in.  where : which of them lie well inside the lumen, and which
    outside it.  noise : spread of ``rest`` there.
    """
    deep, out = where
    contrast = float(np.median(full[deep]))
    inner = deep & (full > 0.5 * contrast)
    if contrast < noise or np.count_nonzero(inner) < LEAST_LEVEL:
        return 0.0
    rest = rest - np.median(rest[out])
    medium = float(np.quantile(rest[inner] / full[inner], DARKEST) - ndtri(DARKEST) * noise / contrast)
    pieces, deviations = _of_pieces(rest[inner], full[inner], piece[inner])
    beside, white = _of_pieces(rest[out], np.ones(np.count_nonzero(out)), piece[out])
    if min(len(pieces), len(beside)) >= LEAST_BLOCKS:
        # correlated noise does not average out over a piece, as those outside the lumen show
        own = max(noise, spread(beside / white))
        if own < CORRELATED * noise:
            medium = min(medium, float(np.quantile(pieces - ndtri(DARKEST) * own * deviations, DARKEST)))
    return medium if abs(medium) > max(SAME_GAIN, SAME_NOISE * noise / contrast) else 0.0


def matched(
    grey: NDArray[np.float32], background: NDArray[Any], region: SearchRegion, seen: NDArray[Any], still: NDArray[Any]
) -> float:
    """The frame's contrast over the reference's; ``grey``, frame minus background, is corrected where that is not 1, or
    where the frame's grey lies off.

    seen, still : the frame's and the reference's own grey at ``region.sample``.
    """
    at, distance, voxel = region.sample_flat, region.sample_depth, region.box.voxel_mm
    deep, out = distance < -voxel, distance > 2 * voxel
    if min(np.count_nonzero(deep), np.count_nonzero(out)) < LEAST_LEVEL:
        return 1.0
    medium = background.reshape(-1)[at]
    low, offset = float(np.median(medium[out])), float(np.median(grey.reshape(-1)[at[out]]))
    rest = seen.astype(float) - still
    noise = spread(rest[out])
    coarse = tuple(n // BLOCK + 1 for n in region.box.shape)
    piece = np.ravel_multi_index(tuple((region.sample // BLOCK).T), coarse)
    if np.mean(seen[out] == seen.min()) > CUT_OFF:
        # cut off, noise is half as large there, and its median is not its mean, which the smoothed reference shows
        noise, offset = _darker(rest[deep]), float(np.median(rest[out]))
        piece = np.zeros_like(piece)  # and tells nothing of its correlation
    more = _difference(rest, medium - low, piece, (deep, out), noise)
    sure = max(SAME_OFFSET, SURE_OFFSET / float(np.sqrt(np.count_nonzero(out))))
    apart = abs(offset) > sure * noise
    if more != 0.0 or apart:
        everywhere = tuple(voxels_of(region.runs).T)
        further = np.float32(more) * (background[everywhere] - np.float32(low))
        grey[everywhere] -= np.float32(offset) + further.astype(np.float32)
    return 1.0 + more


def _darker(rest: Array) -> float:
    """Noise of what is left (n,) in a lumen, by its dark side, to which no wire adds."""
    low, high = np.quantile(rest, (DARKEST_OF_ALL, DARKEST))
    return float((high - low) / (ndtri(DARKEST) - ndtri(DARKEST_OF_ALL)))
