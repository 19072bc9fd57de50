"""Greys in two groups, and whether these are two plateaus: of vessel and bone, or of what lies around a vessel."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from skimage.filters import threshold_otsu

from pipeline.arrays.grids import spread

ASHMANS_D = 4.5
"""Distance of two groups over their spread from which they are two plateaus (Ashman et al. 1994, Astron. J. 108, 2348).
A vessel has up to 3.5 in 152 tempting scenes without bone (seeds 1200 to 1203), whatever the noise, also around a wire
and where the medium settles or decays; with bone 1.11 to 1.13 times as bright, at a contrast of 8 noises, 5 to 6."""


class Groups(NamedTuple):
    """Greys in two groups: which (n,) are of the brighter, the medians of both, and how far apart two plateaus are."""

    bright: NDArray[np.bool_]
    low: float
    high: float
    apart: float


def two_groups(grey: NDArray[Any]) -> Groups:
    """Greys (n,) split by Otsu's threshold, and judged by Ashman's D; all alike, as without noise, none is bright."""
    bright = grey > threshold_otsu(grey)
    if not bright.any():
        return Groups(bright, np.nan, np.nan, np.inf)
    low, high = (float(np.median(group)) for group in (grey[~bright], grey[bright]))
    wide = float(np.hypot(spread(grey[~bright]), spread(grey[bright]))) / np.sqrt(2.0)
    return Groups(bright, low, high, ASHMANS_D * wide)
