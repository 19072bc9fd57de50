"""Separable smoothing of a lattice at single voxels: nothing is filtered where nothing is asked."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.compiled import door, kernel
from pipeline.arrays.lattice import clamped, unravelled


@kernel
def smoothed(volume: NDArray[Any], taps: NDArray[Any], i: int, j: int, k: int) -> float:
    """The separable kernel ``taps`` (2r+1) applied at one voxel; the border voxel is repeated outside."""
    reach = taps.shape[0] // 2
    ni, nj, nk = volume.shape
    total = 0.0
    for a in range(-reach, reach + 1):
        ia = clamped(i + a, ni)
        plane = 0.0
        for b in range(-reach, reach + 1):
            jb = clamped(j + b, nj)
            row = 0.0
            for c in range(-reach, reach + 1):
                row += taps[c + reach] * volume[ia, jb, clamped(k + c, nk)]
            plane += taps[b + reach] * row
        total += taps[a + reach] * plane
    return total


@door
def smooth_voxels(grey: NDArray[Any], taps: NDArray[Any], voxels: NDArray[Any]) -> NDArray[Any]:
    """The separable kernel ``taps`` at flat indices of a box, float32."""
    out = np.empty(voxels.shape[0], np.float32)
    for n in range(voxels.shape[0]):
        i, j, k = unravelled(voxels[n], grey.shape)
        out[n] = smoothed(grey, taps, i, j, k)
    return out
