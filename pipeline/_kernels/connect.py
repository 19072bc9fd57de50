"""Fuzzy connectedness: strength of a voxel = the best path from a seed, a path being as strong as its weakest link.

Udupa and Samarasekera, Graph. Models Image Process. 58 (1996) 246. The grey values are smoothed and quantised
only at voxels that are reached (``levels`` is 0 where nothing was read), so cost follows the object, not the volume:
both arrays that hold state come from ``np.zeros``, whose untouched pages cost nothing.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

LEVELS = 1024
"""Grey steps of the affinity tables; 256 to 1024 change fewer than ten voxels of a vessel tree."""
FULL = 255
"""Quantised strength of a seed: strengths are 0 to 255."""


@njit(cache=True, inline="always")
def _clamped(i: int, n: int) -> int:
    return 0 if i < 0 else (n - 1 if i >= n else i)


@njit(cache=True)
def smoothed(volume: NDArray[Any], taps: NDArray[Any], i: int, j: int, k: int) -> float:
    """The separable kernel ``taps`` (2r+1) applied at one voxel; the border voxel is repeated outside."""
    reach = taps.shape[0] // 2
    ni, nj, nk = volume.shape
    total = 0.0
    for a in range(-reach, reach + 1):
        ia = _clamped(i + a, ni)
        plane = 0.0
        for b in range(-reach, reach + 1):
            jb = _clamped(j + b, nj)
            row = 0.0
            for c in range(-reach, reach + 1):
                row += taps[c + reach] * volume[ia, jb, _clamped(k + c, nk)]
            plane += taps[b + reach] * row
        total += taps[a + reach] * plane
    return total


@njit(cache=True)
def _level(
    volume: NDArray[Any],
    levels: NDArray[Any],
    taps: NDArray[Any],
    low: float,
    scale: float,
    i: int,
    j: int,
    k: int,
) -> int:
    """Quantised grey 0..LEVELS-1 of one voxel, read from the volume the first time only."""
    known = levels[i, j, k]
    if known:
        return int(known) - 1
    value = smoothed(volume, taps, i, j, k) if taps.shape[0] > 1 else float(volume[i, j, k])
    step = int((value - low) * scale + 0.5) if value > low else 0
    step = min(step, LEVELS - 1)
    levels[i, j, k] = step + 1
    return step


@njit(cache=True)
def _grown(array: NDArray[Any]) -> NDArray[Any]:
    larger = np.empty(2 * array.shape[0], array.dtype)
    larger[: array.shape[0]] = array
    return larger


@njit(cache=True, inline="always")
def _plain_level(volume: NDArray[Any], low: float, scale: float, i: int, j: int, k: int) -> int:
    """Quantised grey of one voxel as it is."""
    value = float(volume[i, j, k])
    return min(int((value - low) * scale + 0.5) if value > low else 0, LEVELS - 1)


@njit(cache=True)
def flood(
    volume: NDArray[Any],
    levels: NDArray[Any],
    reached: NDArray[Any],
    seeds: NDArray[Any],
    offsets: NDArray[Any],
    taps: NDArray[Any],
    low: float,
    scale: float,
    homogeneity: NDArray[Any],
    feature: NDArray[Any],
    threshold: int,
) -> NDArray[Any]:
    """Voxels whose strength of connectedness is at least ``threshold``: an alpha cut needs no queue.

    Any order of visiting links of at least the threshold reaches exactly that set, so a stack does, which is
    several times faster than ordering by strength. ``reached`` (uint8 zeros) is marked 1; the flat indices of
    the voxels are returned in the order in which they were reached.
    """
    ni, nj, nk = volume.shape
    plain = taps.shape[0] == 1
    cut = np.float32(threshold - 0.5)
    order = np.empty(65536, np.int64)
    stack = np.empty(65536, np.int64)
    count = 0
    top = 0
    for s in range(seeds.shape[0]):
        i, j, k = seeds[s, 0], seeds[s, 1], seeds[s, 2]
        if not reached[i, j, k]:
            reached[i, j, k] = 1
            order[count] = (i * nj + j) * nk + k
            stack[top] = (i << 42) | (j << 21) | k
            count += 1
            top += 1
    while top:
        top -= 1
        packed = stack[top]
        i, j, k = packed >> 42, (packed >> 21) & 0x1FFFFF, packed & 0x1FFFFF
        here = (
            _plain_level(volume, low, scale, i, j, k)
            if plain
            else _level(volume, levels, taps, low, scale, i, j, k)
        )
        if count + offsets.shape[0] >= order.shape[0]:
            order = _grown(order)
        if top + offsets.shape[0] >= stack.shape[0]:
            stack = _grown(stack)
        for m in range(offsets.shape[0]):
            a, b, c = i + offsets[m, 0], j + offsets[m, 1], k + offsets[m, 2]
            if a < 0 or b < 0 or c < 0 or a >= ni or b >= nj or c >= nk or reached[a, b, c]:
                continue
            if plain:
                there = _plain_level(volume, low, scale, a, b, c)
            else:
                there = _level(volume, levels, taps, low, scale, a, b, c)
            if homogeneity[abs(here - there)] * feature[here + there] < cut:
                continue
            reached[a, b, c] = 1
            order[count] = (a * nj + b) * nk + c
            stack[top] = (a << 42) | (b << 21) | c
            count += 1
            top += 1
    return order[:count]


@njit(cache=True)
def strengths(
    volume: NDArray[Any],
    levels: NDArray[Any],
    strength: NDArray[Any],
    seeds: NDArray[Any],
    offsets: NDArray[Any],
    taps: NDArray[Any],
    low: float,
    scale: float,
    homogeneity: NDArray[Any],
    feature: NDArray[Any],
    threshold: int,
) -> NDArray[Any]:
    """Strength of connectedness 0..255 of every voxel that has at least ``threshold``, written to ``strength``.

    Dijkstra's algorithm for max-min paths with one bucket per quantised strength (linked lists in two growing
    arrays). A voxel is pushed only when its strength rises, so an entry is stale exactly when its bucket differs
    from the voxel's strength. Returns the flat indices reached.
    """
    ni, nj, nk = volume.shape
    head = np.full(FULL + 1, -1, np.int64)
    voxel = np.empty(4096, np.int64)
    after = np.empty(4096, np.int64)
    order = np.empty(4096, np.int64)
    count = 0
    pushed = 0
    for s in range(seeds.shape[0]):
        i, j, k = seeds[s, 0], seeds[s, 1], seeds[s, 2]
        if strength[i, j, k] == FULL:
            continue
        strength[i, j, k] = FULL
        order[count] = voxel[pushed] = (i * nj + j) * nk + k
        after[pushed] = head[FULL]
        head[FULL] = pushed
        count += 1
        pushed += 1
    bucket = FULL
    while bucket >= threshold:
        entry = head[bucket]
        if entry < 0:
            bucket -= 1
            continue
        head[bucket] = after[entry]
        flat = voxel[entry]
        k = flat % nk
        rest = flat // nk
        j = rest % nj
        i = rest // nj
        if strength[i, j, k] != bucket:
            continue
        here = _level(volume, levels, taps, low, scale, i, j, k)
        for m in range(offsets.shape[0]):
            a, b, c = i + offsets[m, 0], j + offsets[m, 1], k + offsets[m, 2]
            if a < 0 or b < 0 or c < 0 or a >= ni or b >= nj or c >= nk or strength[a, b, c] >= bucket:
                continue
            there = _level(volume, levels, taps, low, scale, a, b, c)
            link = min(bucket, int(homogeneity[abs(here - there)] * feature[here + there] + 0.5))
            if link < threshold or link <= strength[a, b, c]:
                continue
            if count + 1 >= order.shape[0]:
                order = _grown(order)
            if pushed + 1 >= voxel.shape[0]:
                voxel = _grown(voxel)
                after = _grown(after)
            to = (a * nj + b) * nk + c
            if strength[a, b, c] == 0:
                order[count] = to
                count += 1
            strength[a, b, c] = link
            voxel[pushed] = to
            after[pushed] = head[link]
            head[link] = pushed
            pushed += 1
    return order[:count]
