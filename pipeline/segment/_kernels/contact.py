"""Cores of a lumen's parts, how far along each part a voxel lies, and where two parts' voxels meet."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.lattice import entry_point, grown, kernel, steps_around, unravelled


class Inner(NamedTuple):
    """The voxels of a lumen as ``flat`` (n,) box indices, ascending, and as a box of their positions + 1 (``ids``).

    ids : 0 elsewhere, and all along the box's border.
    """

    ids: NDArray[Any]
    flat: NDArray[Any]


class Cores(NamedTuple):
    """For each voxel (n,) the number of the connected core that it belongs to, and the steps to one end of that core.

    Both are -1 outside the cores.
    """

    part: NDArray[Any]
    steps: NDArray[Any]


@kernel
def _lengths(spacing: NDArray[Any]) -> NDArray[Any]:
    """The lengths (27,) of the steps of ``steps_around``, less a tenth."""
    out = np.empty(27)
    for n in range(27):
        a, b, c = unravelled(n, (3, 3, 3))
        x, y, z = (a - 1) * spacing[0], (b - 1) * spacing[1], (c - 1) * spacing[2]
        out[n] = 0.9 * np.sqrt(x**2 + y**2 + z**2)
    return out


@kernel
def _covered(voxels: Inner, depth: NDArray[Any], n: int, steps: NDArray[Any], lengths: NDArray[Any]) -> bool:
    """Whether the ball of voxel n lies within that of a neighbour, to a tenth of a voxel."""
    ids, at = voxels.ids.reshape(-1), voxels.flat[n]
    for s in range(27):
        m = ids[at + steps[s]] - 1
        if m >= 0 and m != n and depth[m] >= depth[n] + lengths[s]:
            return True
    return False


@entry_point
def thickness(voxels: Inner, depth: NDArray[Any], spacing: NDArray[Any]) -> NDArray[Any]:
    """Local thickness (n,): the radius of the largest inscribed ball that covers a voxel (Hildebrand, Ruegsegger 1997).

    depth : (n,) mm to the wall. Balls that lie within a neighbour's are passed over.
    """
    (ids, inner), (hx, hy, hz) = voxels, (spacing[0], spacing[1], spacing[2])
    ni, nj, nk = ids.shape
    out, steps, lengths = depth.copy(), steps_around(ids.shape, 1), _lengths(spacing)
    for n in range(inner.shape[0]):
        i, j, k = unravelled(inner[n], ids.shape)
        d = depth[n]
        if _covered(voxels, depth, n, steps, lengths):
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


@kernel
def _spread(voxels: Inner, allowed: NDArray[Any], steps: NDArray[Any], queue: NDArray[Any]) -> int:
    """Breadth-first search over allowed voxels from the first in ``queue``: their 26-neighbour steps into ``steps``.

    ``steps`` is -1 where not reached yet. Returns how many were reached; ``queue`` holds them in that order.
    """
    inner, ids, around = voxels.flat, voxels.ids.reshape(-1), steps_around(voxels.ids.shape, 1)
    steps[queue[0]] = done = 0
    count = 1
    while done < count:
        n = queue[done]
        done += 1
        for step in around:
            m = ids[inner[n] + step] - 1
            if m >= 0 and allowed[m] and steps[m] < 0:
                steps[m] = steps[n] + 1
                queue[count] = m
                count += 1
    return count


@entry_point
def along_cores(voxels: Inner, core: NDArray[Any]) -> Cores:
    """The 26-connected parts of the ``core`` voxels (n,); steps count from the voxel furthest from a part's first."""
    size = voxels.flat.shape[0]
    part, steps, first = np.full(size, -1, np.int32), np.full(size, -1, np.int32), np.full(size, -1, np.int32)
    queue = np.empty(size, np.int32)
    parts = 0
    for n in range(size):
        if core[n] and part[n] < 0:
            queue[0] = n
            count = _spread(voxels, core, first, queue)
            for m in queue[:count]:
                part[m] = parts
            queue[0] = queue[count - 1]
            _spread(voxels, core, steps, queue)
            parts += 1
    return Cores(part, steps)


@entry_point
def nearest_core(voxels: Inner, core: NDArray[Any]) -> NDArray[Any]:
    """For every voxel the position of the core voxel fewest 6-neighbour steps away; -1 where none leads to it."""
    inner, ids, (_, nj, nk) = voxels.flat, voxels.ids.reshape(-1), voxels.ids.shape
    size = inner.shape[0]
    owner, queue = np.full(size, -1, np.int32), np.empty(size, np.int32)
    count = done = 0
    for n in range(size):
        if core[n]:
            owner[n], queue[count] = n, n
            count += 1
    while done < count:
        n = queue[done]
        done += 1
        for step in (-nj * nk, nj * nk, -nk, nk, -1, 1):
            m = ids[inner[n] + step] - 1
            if m >= 0 and owner[m] < 0:
                owner[m] = owner[n]
                queue[count] = m
                count += 1
    return owner


@entry_point
def meetings(voxels: Inner, owner: NDArray[Any], cores: Cores, reach: NDArray[Any]) -> NDArray[Any]:
    """Voxel faces at which two parts meet, or two stretches of one part that are far from each other along it.

    reach : (n,) steps along a part within which a neighbour belongs to the same stretch of vessel. Returns (m, 3): a
    voxel at the face, and the core voxels that own its two sides.
    """
    inner, ids, (_, nj, nk) = voxels.flat, voxels.ids.reshape(-1), voxels.ids.shape
    part, steps = cores
    found = np.empty((1024, 3), np.int32)
    count = 0
    for n in range(inner.shape[0]):
        for step in (nj * nk, nk, 1):
            m = ids[inner[n] + step] - 1
            if m < 0 or owner[m] < 0 or owner[n] < 0:
                continue
            p, q = owner[n], owner[m]
            if p == q or (part[p] == part[q] and abs(steps[p] - steps[q]) <= reach[p] + reach[q]):
                continue
            if count >= found.shape[0]:
                found = grown(found)
            found[count, 0], found[count, 1], found[count, 2] = n, p, q
            count += 1
    return found[:count]


@entry_point
def runs_on(voxels: Inner, cores: Cores, voxel: int, window: int, least: int) -> bool:
    """Whether the part goes on by ``least`` steps both ways from a core voxel, within ``window`` voxels of it."""
    (ids, inner), (part, steps) = voxels, cores
    i, j, k = unravelled(inner[voxel], ids.shape)
    before = after = False
    for a in range(max(0, i - window), min(ids.shape[0], i + window + 1)):
        for b in range(max(0, j - window), min(ids.shape[1], j + window + 1)):
            for c in range(max(0, k - window), min(ids.shape[2], k + window + 1)):
                m = ids[a, b, c] - 1
                if m >= 0 and part[m] == part[voxel]:
                    before = before or steps[m] <= steps[voxel] - least
                    after = after or steps[m] >= steps[voxel] + least
                    if before and after:
                        return True
    return False
