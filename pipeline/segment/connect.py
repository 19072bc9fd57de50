"""Fuzzy connectedness of a grid: absolute at one threshold, all strengths, or relative to a rival object."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.sparse import sparse_zeros
from pipeline.segment._kernels.connect import FULL, READ, Affinity, Search, flood, strengths
from pipeline.segment._kernels.tiles import CELLS, SIDE
from solver.grid import Grid

Index = NDArray[np.int64]


def neighbours(adjacency: int) -> Index:
    """Offsets (n, 3) of the 6 face neighbours or of all 26."""
    if adjacency not in (6, 26):
        msg = f"segment.adjacency: got {adjacency}; expected 6 or 26; 6 keeps vessels apart that touch at an edge"
        raise ValueError(msg)
    steps = np.stack(np.meshgrid(*[(-1, 0, 1)] * 3, indexing="ij"), -1).reshape(-1, 3)
    size = np.abs(steps).sum(axis=1)
    return np.asarray(steps[size == 1] if adjacency == 6 else steps[size > 0], np.int64)


def cut_level(threshold: float) -> int:
    """The quantised strength 1..255 of a threshold in 0..1."""
    return min(FULL, max(1, round(threshold * FULL)))


def _search(grid: Grid, affinity: Affinity, offsets: Index) -> Search:
    a, b, c = (-(-n // SIDE) + 2 for n in grid.shape)
    tiles, cells = np.zeros(a * b * c, np.uint8), sparse_zeros((a * b * c * CELLS,), np.uint16)
    return Search(grid.values, affinity, cells, tiles, (a, b, c), np.ascontiguousarray(offsets))


def _read(search: Search) -> float:
    """Number of voxels read."""
    return float(np.count_nonzero(search.tiles == READ) * CELLS)


def connect(
    grid: Grid, seeds: Index, affinity: Affinity, threshold: float, offsets: Index
) -> tuple[Index, float]:
    """Flat indices of the voxels connected to the seeds at ``threshold``, and the number of voxels read."""
    search = _search(grid, affinity, offsets)
    return flood(search, seeds, cut_level(threshold)), _read(search)


def strength_list(
    grid: Grid, seeds: Index, affinity: Affinity, threshold: float, offsets: Index
) -> tuple[Index, NDArray[np.uint8], float]:
    """Flat indices of the voxels connected at ``threshold``, how strongly (0..255), and the number of voxels read."""
    search = _search(grid, affinity, offsets)
    room = sparse_zeros(search.cells.shape, np.uint8)
    return *strengths(search, seeds, cut_level(threshold), room), _read(search)


def connect_relative(
    grid: Grid, seeds: Index, rivals: Index, affinity: Affinity, threshold: float, offsets: Index
) -> tuple[Index, float]:
    """Voxels connected to the seeds at ``threshold`` and more strongly than to the rival seeds (bone, a catheter).

    Both strengths are taken in the same affinity, so that they can be compared: a rival that touches the object is
    cut off at the weakest link between them (Saha and Udupa, relative fuzzy connectedness, CVIU 82 (2001) 42).
    """
    order, own, read = strength_list(grid, seeds, affinity, threshold, offsets)
    others, other, more = strength_list(grid, rivals, affinity, threshold, offsets)
    if len(others) == 0:
        return order, read + more
    rank = np.argsort(others)
    at = np.minimum(np.searchsorted(others, order, sorter=rank), len(others) - 1)
    shared = others[rank[at]] == order
    kept = own > np.where(shared, other[rank[at]], 0)
    return order[kept], read + more
