"""Fuzzy connectedness of a grid: absolute at one threshold, all strengths, or relative to a rival object."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline._kernels.connect import FULL, flood, strengths
from pipeline.segment.affinity import Affinity
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


def connect(
    grid: Grid, seeds: Index, affinity: Affinity, threshold: float, offsets: Index
) -> tuple[Index, float]:
    """Flat indices of the voxels connected to the seeds at ``threshold``, and the number of voxels read."""
    levels = np.zeros(grid.shape, np.uint16)
    reached = np.zeros(grid.shape, np.uint8)
    a = affinity
    order = flood(
        grid.values, levels, reached, seeds, offsets, a.taps, a.low, a.scale, a.homogeneity, a.feature,
        cut_level(threshold),
    )  # fmt: skip
    return order, float(len(order))


def strength_map(
    grid: Grid, seeds: Index, affinity: Affinity, threshold: float, offsets: Index
) -> tuple[NDArray[np.uint8], Index]:
    """Strength of connectedness 0..255 (0 below ``threshold``) and the flat indices of the voxels that have one."""
    levels = np.zeros(grid.shape, np.uint16)
    strength = np.zeros(grid.shape, np.uint8)
    a = affinity
    order: Any = strengths(
        grid.values, levels, strength, seeds, offsets, a.taps, a.low, a.scale, a.homogeneity, a.feature,
        cut_level(threshold),
    )  # fmt: skip
    return strength, order


def connect_relative(
    grid: Grid, seeds: Index, rivals: Index, affinity: Affinity, threshold: float, offsets: Index
) -> tuple[Index, float]:
    """Voxels connected to the seeds at ``threshold`` and more strongly than to the rival seeds (bone, a catheter).

    Both strengths are taken in the same affinity, so that they can be compared: a rival that touches the object is
    cut off at the weakest link between them (Saha and Udupa, relative fuzzy connectedness, CVIU 82 (2001) 42).
    """
    own, order = strength_map(grid, seeds, affinity, threshold, offsets)
    other, rival_order = strength_map(grid, rivals, affinity, threshold, offsets)
    kept = own.reshape(-1)[order] > other.reshape(-1)[order]
    return order[kept], float(len(order) + len(rival_order))
