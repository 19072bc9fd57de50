"""Grey values smoothed and quantised tile by tile, a tile when one of its voxels is first asked for.

Smoothing a whole volume costs more than all that follows; a vessel touches one tile in a hundred. Within a tile the
separable kernel takes three sweeps over a few kilobytes. A voxel's value does not depend on the tile it falls in, so
the result is bit for bit that of smoothing everything first (tests/pipeline/test_segment_connect.py).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.lattice import clamped, kernel

SHIFT = 3
SIDE = 1 << SHIFT
INNER = SIDE - 1
"""Mask of a voxel's index within its tile."""
CELLS = SIDE**3
"""8^3 voxels: with 16^3 a vessel of 10 voxels smooths three times as many as it needs, with 4^3 halos dominate."""
GREY_STEPS = 1024
"""Grey steps of the affinity tables; 1024 instead of 256 changes fewer than ten voxels of a vessel tree."""


@kernel
def _sweep(source: NDArray[Any], taps: NDArray[Any], stride: int, length: int, out: NDArray[Any]) -> None:
    """One axis of the kernel over a flat array: out[n] = sum of taps[t] source[n + t stride], three taps at a time.

    Runs over row ends as well, where the result is not used: one long loop is what the compiler can vectorise.
    """
    d = out[:length]
    s0, s1, s2 = source[:length], source[stride : stride + length], source[2 * stride : 2 * stride + length]
    w0, w1, w2 = taps[0], taps[1], taps[2]
    for n in range(length):
        d[n] = w0 * s0[n] + w1 * s1[n] + w2 * s2[n]
    for t in range(3, taps.shape[0], 2):
        w0, w1 = taps[t], taps[t + 1]
        s0, s1 = (source[t * stride : t * stride + length], source[(t + 1) * stride : (t + 1) * stride + length])
        for n in range(length):
            d[n] += w0 * s0[n] + w1 * s1[n]


@kernel
def smooth_tile(
    volume: NDArray[Any], taps: NDArray[Any], at: tuple[int, int, int], one: NDArray[Any], two: NDArray[Any]
) -> None:
    """Smooth the SIDE^3 voxels from ``at`` on by the kernel, into ``two`` seen as (w, w, w) with w = SIDE + 2 reach.

    one, two : float32, w^3; only the first SIDE entries along each axis of ``two`` are valid. Border voxels are
    repeated outside. Exact for 16-bit grey and up to three binomial taps.
    """
    reach = taps.shape[0] // 2
    ni, nj, nk = volume.shape
    w = SIDE + 2 * reach
    i0, j0, k0 = at[0] - reach, at[1] - reach, at[2] - reach
    n = 0
    for a in range(i0, i0 + w):
        x = clamped(a, ni)
        for b in range(j0, j0 + w):
            y = clamped(b, nj)
            to = one[n : n + w]
            if k0 >= 0 and k0 + w <= nk:
                row = volume[x, y, k0 : k0 + w]
                for c in range(w):
                    to[c] = row[c]
            else:
                for c in range(w):
                    to[c] = volume[x, y, clamped(k0 + c, nk)]
            n += w
    if reach == 0:
        two[:] = one
        return
    length = w * w * w - 2 * reach
    _sweep(one, taps, 1, length, two)
    length -= 2 * reach * w
    _sweep(two, taps, w, length, one)
    length -= 2 * reach * w * w
    _sweep(one, taps, w * w, length, two)


@kernel
def scratch(taps: NDArray[Any]) -> NDArray[Any]:
    """Working memory (2, w^3) for :func:`smooth_tile`."""
    w = SIDE + 2 * (taps.shape[0] // 2)
    return np.zeros((2, w * w * w), np.float32)
