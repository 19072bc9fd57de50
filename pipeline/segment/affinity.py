"""The affinity of two neighbouring voxels: how alike they are, and how much like the object."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.segment._kernels.connect import FULL, Affinity
from pipeline.segment._kernels.tiles import GREY_STEPS
from pipeline.segment.levels import GreyLevels

HALF_HEIGHT_SPREAD = 0.42
"""sigma of the object feature over the contrast: the feature is 0.5 half way down to the background."""
HOMOGENEITY_SPREAD = 0.17
"""sigma of the homogeneity over the contrast; a wall blurred by 0.8 voxel falls by 0.45 contrasts per voxel."""
NOISE_SPREAD = 3.0
"""Least sigma of the homogeneity in standard deviations of the smoothed noise: noise alone must not cut a vessel."""


def binomial_taps(scale: int) -> NDArray[np.float32]:
    """The binomial kernel of 2 scale + 1 taps: the scale in voxels over which a voxel's grey is taken."""
    taps = np.ones(1)
    for _ in range(2 * scale):
        taps = np.convolve(taps, [0.5, 0.5])
    return np.asarray(taps, np.float32)


def noise_after(taps: NDArray[Any]) -> float:
    """Standard deviation of unit white noise after the separable kernel in three dimensions."""
    return float(np.sqrt(np.sum(np.asarray(taps, float) ** 2)) ** 3)


def estimate_affinity(
    levels: GreyLevels,
    homogeneity_sigma: float | None = None,
    feature_sigma: float | None = None,
    scale: int | None = None,
) -> Affinity:
    """The tables for an object with these levels; a sigma that is given (grey values) replaces the estimate."""
    if scale is None:  # a kernel of sigma 0.7 voxel where contrast is above 5 noises, 1.0 below
        scale = 1 if levels.noise / levels.contrast < 0.2 else 2
    taps = binomial_taps(scale)
    spread = NOISE_SPREAD * levels.noise * noise_after(taps)
    s_h = homogeneity_sigma or max(HOMOGENEITY_SPREAD * levels.contrast, spread)
    s_o = feature_sigma or HALF_HEIGHT_SPREAD * levels.contrast
    low = levels.outside - levels.contrast
    high = levels.inside + 2.0 * levels.contrast
    step = (high - low) / (GREY_STEPS - 1)
    difference = step * np.arange(GREY_STEPS)
    mean = low + 0.5 * step * np.arange(2 * GREY_STEPS - 1)
    below = np.maximum(levels.inside - mean, 0.0)
    h = np.exp(-0.25 * (difference / s_h) ** 2)
    o = np.exp(-0.25 * (below / s_o) ** 2)
    return Affinity((FULL * h).astype(np.float32), o.astype(np.float32), low, 1.0 / step, taps)
