"""Scans in larger voxels: in a blur of one voxel a wire nine voxels thick has no crest, and nine times the noise."""

from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from pipeline.model import Lumen, Volume
from solver.grid import Grid, read_only

COARSE_MM = 0.3
"""Largest voxel that is made: guide wires are 0.3 to 1 mm thick."""
LEAST_VOXELS = 8
"""Fewest such voxels along an axis of the scan: a slab of fewer shows no line along it."""

Times = tuple[int, int, int]
_of_lumen: WeakKeyDictionary[Lumen, tuple[Times, Lumen]] = WeakKeyDictionary()
_of_scan: WeakKeyDictionary[Volume, tuple[Times, Volume]] = WeakKeyDictionary()
"""The last coarse version of each lumen and scan, with its factors: frames share them."""
ALL_OF_THEM: Times = (1, 1, 1)


def times(scan: Volume) -> Times:
    """How many of a scan's voxels are averaged into one along each axis; 1 where they are large enough, or few."""
    along = zip(scan.shape, scan.spacing_mm, strict=True)
    i, j, k = (max(1, min(int(COARSE_MM / size + 1e-6), count // LEAST_VOXELS)) for count, size in along)
    return i, j, k


def _means(grid: Grid, n: Times) -> Grid:
    """Means of so many voxels along each axis; what is left over at the far sides is dropped."""
    (i, j, k), (a, b, c) = n, (s // m for s, m in zip(grid.shape, n, strict=True))
    values = grid.values[: a * i, : b * j, : c * k].reshape(a, i, b, j, c, k).mean(axis=(1, 3, 5), dtype=np.float32)
    middle = 0.5 * (np.array(n) - 1.0)
    return Grid(read_only(values), np.array(n) * np.asarray(grid.spacing_mm), grid.to_mm(middle), grid.direction)


def coarse_scan(scan: Volume, n: Times) -> Volume:
    """The scan in voxels so many times as large along each axis."""
    if scan not in _of_scan or _of_scan[scan][0] != n:
        grid = _means(scan, n)
        _of_scan[scan] = n, Volume(grid.values, grid.spacing_mm, grid.origin_mm, grid.direction)
    return _of_scan[scan][1]


def coarse_lumen(lumen: Lumen, scan: Volume) -> Lumen:
    """The lumen on voxels of about that scan's; itself where its own, whose axes may be others, are as large."""
    nearest = np.argmax(np.abs(np.asarray(lumen.distance.direction).T @ scan.direction), axis=1)
    wanted = np.asarray(scan.spacing_mm)[nearest] / lumen.distance.spacing_mm
    i, j, k = (max(1, round(float(ratio))) for ratio in wanted)
    if (n := (i, j, k)) == ALL_OF_THEM:
        return lumen
    if lumen not in _of_lumen or _of_lumen[lumen][0] != n:
        _of_lumen[lumen] = n, replace(lumen, distance=_means(lumen.distance, n))
    return _of_lumen[lumen][1]
