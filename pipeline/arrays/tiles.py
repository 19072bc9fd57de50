"""Grey values smoothed and quantised tile by tile, a tile when one of its voxels is first asked for.

Smoothing a whole volume costs more than all that follows; a vessel touches one tile in a hundred. Within a tile the
separable kernel takes three sweeps over a few kilobytes. A voxel's value does not depend on the tile it falls in, so
the result is bit for bit that of smoothing everything first (tests/pipeline/test_segment_connect.py).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

SHIFT = 3
SIDE = 1 << SHIFT
INNER = SIDE - 1
"""Mask of a voxel's index within its tile."""
CELLS = SIDE**3
"""8^3 voxels: with 16^3 a vessel of 10 voxels smooths three times as many as it needs, with 4^3 halos dominate."""
LEVELS = 1024
"""Grey steps of the affinity tables; 256 to 1024 change fewer than ten voxels of a vessel tree."""
SEEN = 1 << 15
"""Mark of a cell that is reached, or lies outside the volume and never will be."""


@njit(cache=True, inline="always")
def clamped(i: int, n: int) -> int:
    """The index of the border voxel for indices outside."""
    return 0 if i < 0 else (n - 1 if i >= n else i)


@njit(cache=True, inline="always")
def unravelled(flat: int, shape: tuple[int, int, int]) -> tuple[int, int, int]:
    """Indices of a flat C-order index."""
    rest = flat // shape[2]
    return rest // shape[1], rest % shape[1], flat % shape[2]


@njit(cache=True)
def grown(array: NDArray[Any]) -> NDArray[Any]:
    """A copy with twice the room."""
    larger = np.empty(2 * array.shape[0], array.dtype)
    larger[: array.shape[0]] = array
    return larger


@njit(cache=True)
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


@njit(cache=True)
def _sweep(source: NDArray[Any], taps: NDArray[Any], stride: int, length: int, out: NDArray[Any]) -> None:
    """One axis of the kernel over a flat array: out[n] = sum of taps[t] source[n + t stride], three taps at a time.

    Runs over row ends as well, where the result is not used: one long loop is what the compiler makes vectors of.
    """
    d = out[:length]
    s0, s1, s2 = source[:length], source[stride : stride + length], source[2 * stride : 2 * stride + length]
    w0, w1, w2 = taps[0], taps[1], taps[2]
    for n in range(length):
        d[n] = w0 * s0[n] + w1 * s1[n] + w2 * s2[n]
    for t in range(3, taps.shape[0], 2):
        w0, w1 = taps[t], taps[t + 1]
        s0, s1 = (
            source[t * stride : t * stride + length],
            source[(t + 1) * stride : (t + 1) * stride + length],
        )
        for n in range(length):
            d[n] += w0 * s0[n] + w1 * s1[n]


@njit(cache=True)
def smooth_tile(
    volume: NDArray[Any],
    taps: NDArray[Any],
    i0: int,
    j0: int,
    k0: int,
    one: NDArray[Any],
    two: NDArray[Any],
) -> None:
    """The kernel at the SIDE^3 voxels from (i0, j0, k0) on, into ``two`` seen as (w, w, w) with w = SIDE + 2 reach.

    one, two : float32, w^3; only the first SIDE entries along each axis of ``two`` are meant. Border voxels are
    repeated outside. Exact for 16-bit grey and up to three binomial taps.
    """
    reach = taps.shape[0] // 2
    ni, nj, nk = volume.shape
    w = SIDE + 2 * reach
    within = k0 >= reach and k0 + SIDE + reach <= nk
    n = 0
    for a in range(i0 - reach, i0 + SIDE + reach):
        x = clamped(a, ni)
        for b in range(j0 - reach, j0 + SIDE + reach):
            y = clamped(b, nj)
            to = one[n : n + w]
            if within:
                row = volume[x, y, k0 - reach : k0 - reach + w]
                for c in range(w):
                    to[c] = row[c]
            else:
                for c in range(w):
                    to[c] = volume[x, y, clamped(k0 - reach + c, nk)]
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


@njit(cache=True)
def scratch(taps: NDArray[Any]) -> NDArray[Any]:
    """Room (2, w^3) for :func:`smooth_tile`."""
    w = SIDE + 2 * (taps.shape[0] // 2)
    return np.zeros((2, w * w * w), np.float32)


@njit(cache=True)
def open_tile(
    volume: NDArray[Any],
    taps: NDArray[Any],
    low: float,
    scale: float,
    tile: NDArray[Any],
    work: NDArray[Any],
    cells: NDArray[Any],
) -> None:
    """Quantised smoothed grey 0..LEVELS-1 of one tile (its three indices) into ``cells`` (CELLS,) uint16.

    Cells outside the volume are marked SEEN.
    """
    i0, j0, k0 = tile[0] * SIDE, tile[1] * SIDE, tile[2] * SIDE
    ni, nj, nk = volume.shape
    one, two = work[0], work[1]
    smooth_tile(volume, taps, i0, j0, k0, one, two)
    w = SIDE + 2 * (taps.shape[0] // 2)
    n = 0
    for a in range(SIDE):
        for b in range(SIDE):
            row = two[(a * w + b) * w : (a * w + b) * w + SIDE]
            to = cells[n : n + SIDE]
            for c in range(SIDE):
                to[c] = np.int32(min(max((row[c] - low) * scale + 0.5, 0.0), LEVELS - 1.0))
            if i0 + a >= ni or j0 + b >= nj:
                to[:] = SEEN
            elif k0 + SIDE > nk:
                to[nk - k0 :] = SEEN
            n += SIDE
