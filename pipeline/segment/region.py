"""What a method of segmentation is given and what it finds; a method is a function like :func:`fuzzy.fuzzy_region`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.model import Counters
from pipeline.segment.levels import GreyLevels
from pipeline.status import FrameStatus, StageError
from solver.grid import Grid

Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Region:
    """The voxels of a vessel (flat indices of the scan), and what its wall is to be found by.

    thin : flat indices of branches too thin for a wall at half height.  levels : grey inside and outside.  taps : the
    separable smoothing of the grey in which the wall is looked for.
    """

    voxels: Index
    thin: Index
    levels: GreyLevels
    taps: NDArray[np.float32]
    counters: Counters


def failed(got: str, allowed: str, do: str) -> StageError:
    """The error that says why there is no lumen."""
    return StageError(FrameStatus.SEGMENT_FAILED, f"segment: {got}; expected {allowed}; {do}")


def seed_voxels(grid: Grid, seeds_mm: ArrayLike) -> Index:
    """The voxels (n, 3) of the seeds; a seed outside the volume has no lumen."""
    points = np.atleast_2d(np.asarray(seeds_mm, float))
    index = np.rint(grid.to_index(points)).astype(np.int64)
    outside = np.any((index < -1) | (index > np.array(grid.shape)), axis=1)
    if outside.all():
        got = f"seeds: got {np.round(points, 1).tolist()} mm"
        low, high = grid.to_mm([0, 0, 0]), grid.to_mm(np.array(grid.shape) - 1)
        allowed = f"a point inside the scan, {np.round(low, 1).tolist()} to {np.round(high, 1).tolist()} mm"
        raise failed(got, allowed, "check entry_mm or lumen_seed_mm (LPS mm)")
    return np.asarray(np.clip(index[~outside], 0, np.array(grid.shape) - 1))
