"""Contrast medium is never twice the same: the contrast of a frame over its reference's, taken before the subtraction.

A wire, blurred, reaches every voxel of a narrow vessel and makes it brighter, never darker: the medium is read off the
darkest tenth of the lumen.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from pipeline.arrays.grids import spread
from pipeline.model import Array
from pipeline.trace.region import SearchRegion, voxels_of
from solver.grid import Grid

LEAST_LEVEL = 200
"""Voxels from which a level is taken."""
DARKEST = 0.1
"""Share of the lumen's voxels that shows the medium alone: a wire in all but three tenths moves it by a third of the
noise of a voxel, and a median by any amount."""
SAME_GAIN = 0.02
"""Difference of two scans' contrast, as a share of it, that is left alone."""
SAME_NOISE = 0.5
"""The same in noises of a voxel, as an estimate from the darkest tenth may be off by that."""


def _difference(frame: Array, still: Array, deep: NDArray[np.bool_], out: NDArray[np.bool_]) -> float:
    """Contrast of a scan's voxels (n,) over that of another without wire, both as they were scanned; 1 for the same.

    A smoothed scan would not do: it is lower in the middle of a narrow vessel.
    """
    rest = frame - still
    noise, contrast = spread(rest[out]), float(np.median(still[deep]) - np.median(still[out]))
    medium = float(np.quantile(rest[deep], DARKEST)) - noise * float(ndtri(DARKEST))
    more = medium - float(np.median(rest[out]))
    same = contrast < noise or abs(more) < max(SAME_GAIN * contrast, SAME_NOISE * noise)
    return 1.0 if same else 1.0 + more / contrast


def matched(
    grey: NDArray[np.float32], background: NDArray[Any], region: SearchRegion, frame: Grid, still: NDArray[Any]
) -> float:
    """The frame's contrast over the reference's; what is not 1 is taken away from ``grey``, the frame less background.

    still : the reference's own grey at ``region.sample``.
    """
    at = tuple(region.sample.T)
    distance, voxel = region.box.values[at], float(np.min(region.box.spacing_mm))
    deep, out = distance < -voxel, distance > 2 * voxel
    if min(np.count_nonzero(deep), np.count_nonzero(out)) < LEAST_LEVEL:
        return 1.0
    seen = frame.values[tuple((region.sample + region.corner).T)].astype(float)
    gain = _difference(seen, still.astype(float), deep, out)
    if gain != 1.0:
        low, offset = float(np.median(background[at][out])), float(np.median(grey[at][out]))
        everywhere = tuple(voxels_of(region.runs).T)
        more = np.float32(gain - 1.0) * (background[everywhere] - np.float32(low))
        grey[everywhere] -= np.float32(offset) + more.astype(np.float32)
    return gain
