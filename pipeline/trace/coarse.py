"""Scans in larger voxels: in a blur of one voxel a wire nine voxels thick has no crest, and nine times the noise."""

from dataclasses import replace

import numpy as np

from pipeline.arrays.spare import Last
from pipeline.model import Lumen, Volume
from pipeline.trace.config import MOST_APART
from solver.grid import Grid, read_only

COARSE_MM = 0.3
"""Largest edge that the smallest one gets, and about that of the others: guide wires are 0.3 to 1 mm thick."""
LEAST_VOXELS = 8
"""Fewest such voxels along an axis of the scan: a slab of fewer shows no line along it."""

Times = tuple[int, int, int]
ALL_OF_THEM: Times = (1, 1, 1)
_lumens, _scans = Last[Lumen](), Last[Volume]()
"""By the factors: frames share them."""


def times(scan: Volume) -> Times:
    """How many of a scan's voxels are averaged into one along each axis; 1 where they are large enough, or few.

    The nearest number: rounded down, 0.15 x 0.15 x 0.1503 mm became 0.3 x 0.3 x 0.15. 1 too where slices lie so far
    apart that no trace is accepted: in larger pixels they no longer look it, and 10 of 75 traces were cut short.
    """
    if scan.spacing_mm.max() >= MOST_APART * scan.voxel_mm:
        return ALL_OF_THEM
    made = max(1, int(COARSE_MM / scan.voxel_mm + 1e-6)) * scan.voxel_mm
    along = zip(scan.shape, scan.spacing_mm, strict=True)
    i, j, k = (max(1, min(round(float(made / size)), count // LEAST_VOXELS)) for count, size in along)
    return i, j, k


def matching(grid: Grid, scan: Volume) -> Times:
    """How many voxels of a grid, whose axes may be others, make about one of the scan's along each of its own axes."""
    nearest = np.argmax(np.abs(grid.direction.T @ scan.direction), axis=1)
    i, j, k = (max(1, round(float(ratio))) for ratio in scan.spacing_mm[nearest] / grid.spacing_mm)
    return i, j, k


def _means(grid: Grid, n: Times) -> Grid:
    """Means of so many voxels along each axis; what is left over at the far sides is dropped."""
    (i, j, k), (a, b, c) = n, (s // m for s, m in zip(grid.shape, n, strict=True))
    values = grid.values[: a * i, : b * j, : c * k].reshape(a, i, b, j, c, k).mean(axis=(1, 3, 5), dtype=np.float32)
    middle = 0.5 * (np.array(n) - 1.0)
    return Grid(read_only(values), np.array(n) * grid.spacing_mm, grid.to_mm(middle), grid.direction)


def coarse_scan(scan: Volume, n: Times) -> Volume:
    """The scan in voxels so many times as large along each axis."""

    def made() -> Volume:
        grid = _means(scan, n)
        return Volume(grid.values, grid.spacing_mm, grid.origin_mm, grid.direction)

    return _scans.of(scan, n, made)


def coarse_lumen(lumen: Lumen, scan: Volume) -> Lumen:
    """The lumen on voxels of about that scan's; itself where its own are as large."""
    if (n := matching(lumen.distance, scan)) == ALL_OF_THEM:
        return lumen
    return _lumens.of(lumen, n, lambda: replace(lumen, distance=_means(lumen.distance, n)))
