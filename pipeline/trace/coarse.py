"""Scans in larger voxels: in a blur of one voxel a wire nine voxels thick has no crest, and nine times the noise."""

from dataclasses import replace

import numpy as np

from pipeline.arrays.spare import Last
from pipeline.model import Lumen, Volume
from solver.grid import Grid, read_only

COARSE_MM = 0.3
"""Largest voxel that is made: guide wires are 0.3 to 1 mm thick."""
LEAST_VOXELS = 8
"""Fewest such voxels along an axis of the scan: a slab of fewer shows no line along it."""

_lumens, _scans = Last[Lumen](), Last[Volume]()
"""By the factor: frames share them."""


def times(scan: Volume) -> int:
    """How many of a scan's voxels, along each axis, are averaged into one; 1 where they are large enough, or few."""
    voxel = scan.voxel_mm
    return max(1, min(int(COARSE_MM / voxel + 1e-6), min(scan.shape) // LEAST_VOXELS))


def _means(grid: Grid, n: int) -> Grid:
    """Means of n^3 voxels; what is left over at the far sides is dropped."""
    a, b, c = (s // n for s in grid.shape)
    values = grid.values[: a * n, : b * n, : c * n].reshape(a, n, b, n, c, n).mean(axis=(1, 3, 5), dtype=np.float32)
    middle = np.full(3, 0.5 * (n - 1))
    return Grid(read_only(values), n * grid.spacing_mm, grid.to_mm(middle), grid.direction)


def coarse_scan(scan: Volume, n: int) -> Volume:
    """The scan in voxels n times as large."""

    def made() -> Volume:
        grid = _means(scan, n)
        return Volume(grid.values, grid.spacing_mm, grid.origin_mm, grid.direction)

    return _scans.of(scan, n, made)


def coarse_lumen(lumen: Lumen, voxel_mm: float) -> Lumen:
    """The lumen on voxels of about that size; itself where its own, which need not be the scan's, are as large."""
    n = max(1, round(voxel_mm / lumen.distance.voxel_mm))
    return lumen if n == 1 else _lumens.of(lumen, n, lambda: replace(lumen, distance=_means(lumen.distance, n)))
