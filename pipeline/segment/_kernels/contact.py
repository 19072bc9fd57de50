"""Cores of a lumen's parts, how far along each part a voxel lies, and where two parts' voxels meet.

``inner`` are the lumen's voxels (flat box indices, ascending), ``ids`` is the box with their position + 1, 0 elsewhere.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.arrays.tiles import unravelled


@njit(cache=True)
def thickness(
    ids: NDArray[Any], inner: NDArray[Any], depth: NDArray[Any], spacing: NDArray[Any]
) -> NDArray[Any]:
    """Local thickness (n,): the radius of the largest inscribed ball that covers a voxel (Hildebrand, Ruegsegger 1997).

    depth : (n,) mm to the wall. A ball that lies within a neighbour's, to a tenth of a voxel, is passed over.
    """
    hx, hy, hz = spacing[0], spacing[1], spacing[2]
    ni, nj, nk = ids.shape
    out = depth.copy()
    for n in range(inner.shape[0]):
        i, j, k = unravelled(inner[n], ids.shape)
        d = depth[n]
        covered = False
        for a in range(max(0, i - 1), min(ni, i + 2)):
            for b in range(max(0, j - 1), min(nj, j + 2)):
                for c in range(max(0, k - 1), min(nk, k + 2)):
                    m = ids[a, b, c] - 1
                    if m >= 0 and m != n:
                        apart = np.sqrt(((a - i) * hx) ** 2 + ((b - j) * hy) ** 2 + ((c - k) * hz) ** 2)
                        covered = covered or depth[m] >= d + 0.9 * apart
        if covered:
            continue
        ri, rj, rk = int(d / hx), int(d / hy), int(d / hz)
        for a in range(max(0, i - ri), min(ni, i + ri + 1)):
            for b in range(max(0, j - rj), min(nj, j + rj + 1)):
                for c in range(max(0, k - rk), min(nk, k + rk + 1)):
                    m = ids[a, b, c] - 1
                    if m >= 0 and out[m] < d:
                        square = ((a - i) * hx) ** 2 + ((b - j) * hy) ** 2 + ((c - k) * hz) ** 2
                        if square <= d * d:
                            out[m] = d
    return out


@njit(cache=True)
def _spread(
    ids: NDArray[Any],
    inner: NDArray[Any],
    allowed: NDArray[Any],
    steps: NDArray[Any],
    queue: NDArray[Any],
    count: int,
) -> int:
    """Number voxels by 26-neighbour steps from those in ``queue``; ``steps`` is -1 where not reached yet."""
    ni, nj, nk = ids.shape
    done = 0
    while done < count:
        n = queue[done]
        done += 1
        i, j, k = unravelled(inner[n], ids.shape)
        for a in range(max(0, i - 1), min(ni, i + 2)):
            for b in range(max(0, j - 1), min(nj, j + 2)):
                for c in range(max(0, k - 1), min(nk, k + 2)):
                    m = ids[a, b, c] - 1
                    if m >= 0 and allowed[m] and steps[m] < 0:
                        steps[m] = steps[n] + 1
                        queue[count] = m
                        count += 1
    return count


@njit(cache=True)
def along_cores(
    ids: NDArray[Any], inner: NDArray[Any], core: NDArray[Any]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """For core voxels the number of their connected part (-1 elsewhere) and the steps to one of the part's ends."""
    size = inner.shape[0]
    part, steps, first = np.full(size, -1, np.int32), np.full(size, -1, np.int32), np.full(size, -1, np.int32)
    queue = np.empty(size, np.int32)
    parts = 0
    for n in range(size):
        if not core[n] or part[n] >= 0:
            continue
        first[n], queue[0] = 0, n
        count = _spread(ids, inner, core, first, queue, 1)
        for m in range(count):
            part[queue[m]] = parts
        end = queue[count - 1]
        steps[end], queue[0] = 0, end
        _spread(ids, inner, core, steps, queue, 1)
        parts += 1
    return part, steps


@njit(cache=True)
def nearest_core(ids: NDArray[Any], inner: NDArray[Any], core: NDArray[Any]) -> NDArray[Any]:
    """For every voxel the core voxel (position) that reaches it first, layer by layer; -1 where none does."""
    size = inner.shape[0]
    owner, queue = np.full(size, -1, np.int32), np.empty(size, np.int32)
    count = 0
    for n in range(size):
        if core[n]:
            owner[n], queue[count] = n, n
            count += 1
    done = 0
    while done < count:
        n = queue[done]
        done += 1
        i, j, k = unravelled(inner[n], ids.shape)
        for side in range(6):
            a, b, c = i, j, k
            step = 2 * (side & 1) - 1
            if side < 2:
                a += step
            elif side < 4:
                b += step
            else:
                c += step
            if min(a, b, c) < 0 or a >= ids.shape[0] or b >= ids.shape[1] or c >= ids.shape[2]:
                continue
            m = ids[a, b, c] - 1
            if m >= 0 and owner[m] < 0:
                owner[m] = owner[n]
                queue[count] = m
                count += 1
    return owner


@njit(cache=True)
def meetings(
    ids: NDArray[Any],
    inner: NDArray[Any],
    owner: NDArray[Any],
    part: NDArray[Any],
    steps: NDArray[Any],
    reach: NDArray[Any],
) -> NDArray[Any]:
    """Faces (m, 3) between voxels of different parts, or far along one part: voxel, and the core voxels of both sides.

    reach : (n,) steps along a part within which a neighbour belongs to the same stretch of vessel.
    """
    found = np.empty((1024, 3), np.int32)
    count = 0
    for n in range(inner.shape[0]):
        i, j, k = unravelled(inner[n], ids.shape)
        for axis in range(3):
            a, b, c = i + (axis == 0), j + (axis == 1), k + (axis == 2)
            if a >= ids.shape[0] or b >= ids.shape[1] or c >= ids.shape[2]:
                continue
            m = ids[a, b, c] - 1
            if m < 0 or owner[m] < 0 or owner[n] < 0:
                continue
            p, q = owner[n], owner[m]
            if p == q or (part[p] == part[q] and abs(steps[p] - steps[q]) <= reach[p] + reach[q]):
                continue
            if count >= found.shape[0]:
                larger = np.empty((2 * count, 3), np.int32)
                larger[:count] = found
                found = larger
            found[count, 0], found[count, 1], found[count, 2] = n, p, q
            count += 1
    return found[:count]


@njit(cache=True)
def runs_on(
    ids: NDArray[Any],
    inner: NDArray[Any],
    part: NDArray[Any],
    steps: NDArray[Any],
    voxel: int,
    window: int,
    least: int,
) -> bool:
    """Whether the part goes on by ``least`` steps both ways from a core voxel, within ``window`` voxels of it."""
    i, j, k = unravelled(inner[voxel], ids.shape)
    before = after = False
    for a in range(max(0, i - window), min(ids.shape[0], i + window + 1)):
        for b in range(max(0, j - window), min(ids.shape[1], j + window + 1)):
            for c in range(max(0, k - window), min(ids.shape[2], k + window + 1)):
                m = ids[a, b, c] - 1
                if m >= 0 and part[m] == part[voxel]:
                    before = before or steps[m] <= steps[voxel] - least
                    after = after or steps[m] >= steps[voxel] + least
    return bool(before and after)
