"""Fuzzy connectedness of a grid: absolute at one threshold, all strengths, or relative to a rival object."""

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.lattice import sparse_zeros
from pipeline.segment._kernels.connect import FULL, READ, Affinity, Search, flood, strengths
from pipeline.segment._kernels.tiles import CELLS, GREY_STEPS, SIDE
from pipeline.segment.config import SegmentConfig
from pipeline.segment.levels import GreyLevels, Index
from solver.grid import Grid

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


def estimate_affinity(levels: GreyLevels, config: SegmentConfig = SegmentConfig()) -> Affinity:
    """The tables for an object with these levels; sigmas (grey values) and scale that are set replace the estimates."""
    scale = config.scale
    if scale is None:  # a kernel of sigma 0.7 voxel where contrast is above 5 noises, 1.0 below
        scale = 1 if levels.noise / levels.contrast < 0.2 else 2
    taps = binomial_taps(scale)
    spread = NOISE_SPREAD * levels.noise * noise_after(taps)
    s_h = config.homogeneity_sigma or max(HOMOGENEITY_SPREAD * levels.contrast, spread)
    s_o = config.feature_sigma or HALF_HEIGHT_SPREAD * levels.contrast
    low = levels.outside - levels.contrast
    high = levels.inside + 2.0 * levels.contrast
    step = (high - low) / (GREY_STEPS - 1)
    difference = step * np.arange(GREY_STEPS)
    mean = low + 0.5 * step * np.arange(2 * GREY_STEPS - 1)
    below = np.maximum(levels.inside - mean, 0.0)
    h = np.exp(-0.25 * (difference / s_h) ** 2)
    o = np.exp(-0.25 * (below / s_o) ** 2)
    return Affinity((FULL * h).astype(np.float32), o.astype(np.float32), low, 1.0 / step, taps)


def neighbours(adjacency: Literal[6, 26]) -> Index:
    """Offsets (n, 3) of the 6 face neighbours or of all 26."""
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


def connect(grid: Grid, seeds: Index, affinity: Affinity, threshold: float, offsets: Index) -> tuple[Index, float]:
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
    rivalled = others[rank[at]] == order
    return order[~rivalled | (own > other[rank[at]])], read + more
