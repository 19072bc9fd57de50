"""Lists of voxels (flat indices of a box) in one pass each, which NumPy does by way of three lists of coordinates."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.lattice import entry_point, kernel, unravelled
from pipeline.segment._kernels.contact import Inner

CELL_SHIFT = 3
"""Cells of 8^3 voxels, in which the nearest of many voxels is looked for."""


@entry_point
def extent(flat: NDArray[Any], shape: tuple[int, int, int]) -> NDArray[Any]:
    """The first and the last index (2, 3) of voxels along each axis."""
    out = np.empty((2, 3), np.int64)
    out[0, 0], out[0, 1], out[0, 2] = unravelled(flat[0], shape)
    out[1] = out[0]
    for voxel in flat:
        i, j, k = unravelled(voxel, shape)
        out[0, 0], out[0, 1], out[0, 2] = min(out[0, 0], i), min(out[0, 1], j), min(out[0, 2], k)
        out[1, 0], out[1, 1], out[1, 2] = max(out[1, 0], i), max(out[1, 1], j), max(out[1, 2], k)
    return out


@entry_point
def rebased(
    flat: NDArray[Any], shape: tuple[int, int, int], shift: NDArray[Any], other: tuple[int, int, int]
) -> NDArray[Any]:
    """Voxels as flat indices of another box; shift : (3,) to be added to their indices in this one."""
    out = np.empty(flat.shape[0], np.int64)
    for n in range(flat.shape[0]):
        i, j, k = unravelled(flat[n], shape)
        i, j, k = i + shift[0], j + shift[1], k + shift[2]
        if min(i, j, k) < 0 or i >= other[0] or j >= other[1] or k >= other[2]:
            raise ValueError("a voxel lies outside the box")
        out[n] = (i * other[1] + j) * other[2] + k
    return out


@kernel
def _faces(shape: tuple[int, int, int]) -> NDArray[Any]:
    """Steps of a flat index to the 6-neighbours."""
    across = shape[1] * shape[2]
    return np.array([-across, -shape[2], -1, 1, shape[2], across])


@kernel
def _surrounded(ids: NDArray[Any], at: int, steps: NDArray[Any]) -> bool:
    """Whether all neighbours of a voxel belong to the set."""
    whole = True
    for step in steps:
        whole = whole and ids[at + step] > 0
    return whole


@entry_point
def shell(voxels: Inner) -> NDArray[Any]:
    """Which voxels (n,) have a 6-neighbour outside the set: the one nearest to anything outside is of these."""
    inner, ids, steps = voxels.flat, voxels.ids.reshape(-1), _faces(voxels.ids.shape)
    out = np.empty(inner.shape[0], np.bool_)
    for n in range(inner.shape[0]):
        out[n] = not _surrounded(ids, inner[n], steps)
    return out


@entry_point
def eroded(voxels: Inner, layers: int) -> NDArray[Any]:
    """The voxels left, flat, once so many 6-neighbour layers are taken off; takes them out of ``voxels.ids``."""
    ids, left, steps = voxels.ids.reshape(-1), voxels.flat, _faces(voxels.ids.shape)
    for _ in range(layers):
        kept, gone = np.empty(left.shape[0], np.int64), np.empty(left.shape[0], np.int64)
        stay = go = 0
        for at in left:
            if _surrounded(ids, at, steps):
                kept[stay] = at
                stay += 1
            else:
                gone[go] = at
                go += 1
        for at in gone[:go]:
            ids[at] = 0
        left = kept[:stay]
    return left


@entry_point
def components(voxels: Inner) -> NDArray[Any]:
    """The 6-connected part of each voxel (n,), numbered from 0 in the order of their first voxels."""
    inner, ids, steps = voxels.flat, voxels.ids.reshape(-1), _faces(voxels.ids.shape)
    part, queue = np.full(inner.shape[0], -1, np.int32), np.empty(inner.shape[0], np.int32)
    parts = 0
    for first in range(inner.shape[0]):
        if part[first] >= 0:
            continue
        part[first], queue[0] = parts, first
        count, done = 1, 0
        while done < count:
            n = queue[done]
            done += 1
            for step in steps:
                m = ids[inner[n] + step] - 1
                if m >= 0 and part[m] < 0:
                    part[m], queue[count] = parts, m
                    count += 1
        parts += 1
    return part


@kernel
def _by_cell(flat: NDArray[Any], shape: tuple[int, int, int], cells: tuple[int, int, int]) -> tuple[Any, Any]:
    """The indices (n, 3) of voxels, cell after cell, and where each cell's begin, and the last one's end."""
    begin, cell = np.zeros(cells[0] * cells[1] * cells[2] + 1, np.int64), np.empty(flat.shape[0], np.int64)
    for n in range(flat.shape[0]):
        i, j, k = unravelled(flat[n], shape)
        cell[n] = ((i >> CELL_SHIFT) * cells[1] + (j >> CELL_SHIFT)) * cells[2] + (k >> CELL_SHIFT)
        begin[cell[n] + 1] += 1
    for m in range(1, begin.shape[0]):
        begin[m] += begin[m - 1]
    at, free = np.empty((flat.shape[0], 3), np.int64), begin.copy()
    for n in range(flat.shape[0]):
        at[free[cell[n]], 0], at[free[cell[n]], 1], at[free[cell[n]], 2] = unravelled(flat[n], shape)
        free[cell[n]] += 1
    return at, begin


@kernel
def _off(i: int, cell: int) -> int:
    """Steps from an index to the nearest index of a cell; 0 within it."""
    return max(0, (cell << CELL_SHIFT) - i, i - (cell << CELL_SHIFT) - (1 << CELL_SHIFT) + 1)


@entry_point
def gaps(flat: NDArray[Any], others: NDArray[Any], shape: tuple[int, int, int], reach: float) -> NDArray[Any]:
    """Distance (n,) in voxels from each voxel to the nearest of the others; infinite from ``reach`` on."""
    cells = (shape[0] >> CELL_SHIFT) + 1, (shape[1] >> CELL_SHIFT) + 1, (shape[2] >> CELL_SHIFT) + 1
    at, begin = _by_cell(others, shape, cells)
    out, around = np.empty(flat.shape[0]), (int(reach) >> CELL_SHIFT) + 1
    for n in range(flat.shape[0]):
        i, j, k = unravelled(flat[n], shape)
        a, b, c = i >> CELL_SHIFT, j >> CELL_SHIFT, k >> CELL_SHIFT
        best = reach * reach
        for x in range(max(0, a - around), min(cells[0], a + around + 1)):
            for y in range(max(0, b - around), min(cells[1], b + around + 1)):
                for z in range(max(0, c - around), min(cells[2], c + around + 1)):
                    cell = (x * cells[1] + y) * cells[2] + z
                    if begin[cell] == begin[cell + 1] or _off(i, x) ** 2 + _off(j, y) ** 2 + _off(k, z) ** 2 >= best:
                        continue
                    for m in range(begin[cell], begin[cell + 1]):
                        u, v, w = at[m, 0] - i, at[m, 1] - j, at[m, 2] - k
                        best = min(best, float(u * u + v * v + w * w))
        out[n] = np.sqrt(best) if best < reach * reach else np.inf
    return out


@entry_point
def largest(part: NDArray[Any], values: NDArray[Any], count: int) -> NDArray[Any]:
    """The largest of the values (n,) in each of ``count`` parts, 0 at least."""
    out = np.zeros(count)
    for n in range(part.shape[0]):
        out[part[n]] = max(out[part[n]], values[n])
    return out
