"""The noise of a scan around a vessel: of one voxel beside the next, and what smoothing leaves of it.

Noise of a scanner is correlated: the second is more than white noise of the first would leave. Scales are told apart
by the wavelet planes of the algorithm "a trous" (Starck and Murtagh, Astronomical Image and Data Analysis, 2006).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from pipeline.arrays.grids import spread

SHARP = 0.935
"""Spread of grey less smoothed grey, of white noise of 1."""
PLANES = 0.914, 0.867, 0.781
"""Share that the two planes hold of white noise, smoothed by 1-2-1 not at all, once and twice. Of noise correlated over
0.5, 0.8 and 1.5 voxels (Gaussian) it is 4, 11 and 28 per cent less, once smoothed: by so much it is understated."""
WHITE = 1.0, 0.234, 0.146
"""What smoothing leaves of white noise."""
CLEAR = 7
"""Voxels that the second and third plane reach: so far from the vessel's edge it does not count."""
LEAST = 100
NOISY = 0.1
"""Most noise over contrast from which a lumen is taken: the wall's level is then 5 noises from either side, and of 3e6
voxels one crosses it. With 0.12 the wall of tubes was off by 0.3 voxel (rms), with 0.16 by 1, with 0.3 by 3."""


def smoothed(grey: NDArray[Any], step: int = 1) -> NDArray[Any]:
    """Grey smoothed by 1-2-1 along each axis, over neighbours ``step`` voxels away."""
    taps = np.zeros(2 * step + 1)
    taps[[0, step, -1]] = 0.25, 0.5, 0.25
    for axis in range(3):
        grey = ndimage.convolve1d(grey, taps, axis=axis, mode="nearest")
    return grey


def voxel_noise(rough: NDArray[Any], region: NDArray[np.bool_]) -> float:
    """Spread of ``rough`` (grey less smoothed grey) well inside the region, or well outside if that is too thin.

    In units of the white noise that would leave as much.
    """
    core = ndimage.binary_erosion(region, iterations=2)
    if core.sum() < LEAST:
        core = ~ndimage.binary_dilation(region, iterations=4)
    return spread(rough[core] if core.any() else rough.ravel()) / SHARP


def noise_left(
    grey: NDArray[Any], region: NDArray[np.bool_], bright: NDArray[np.bool_], noise: float
) -> tuple[float, ...]:
    """Standard deviation of the noise around the region, in ``grey`` smoothed by 1-2-1 not at all, once and twice.

    What is wider than ten voxels or so is tissue, not noise; the darkest grey is padding. bright : what is as bright as
    the region, itself and others. noise : of a voxel beside the next, taken for white where there is no room to tell.
    """
    shown = grey > grey.min()
    for full in (ndimage.binary_opening(bright), region):  # other vessels and bone too, where that leaves room
        outside = shown & ~ndimage.binary_dilation(full, iterations=CLEAR)
        if np.count_nonzero(outside) >= LEAST:
            break
    else:
        outside = ndimage.binary_erosion(region, iterations=CLEAR)
    if np.count_nonzero(outside) < LEAST:
        return tuple(share * noise for share in WHITE)
    left = []
    for times, share in enumerate(PLANES):
        grey = smoothed(grey) if times else grey
        second = smoothed(grey, 2)
        third = smoothed(second, 4)
        left.append(float(np.hypot(spread((grey - second)[outside]), spread((second - third)[outside]))) / share)
    return tuple(left)


def warning(scale: int | None, noise: float, contrast: float) -> tuple[str, ...]:
    """A sentence where a scale that is set leaves too much noise; scales from the noise itself leave 0.06 of 0.4."""
    if scale is None or noise <= NOISY * contrast:
        return ()
    return (
        f"segment: with segment.scale = {scale} noise is {noise / contrast:.2f} of the vessel's contrast, allowed "
        f"{NOISY:g}: single voxels of noise pass for wall; take segment.scale out of the settings, or raise it",
    )
