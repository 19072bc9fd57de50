"""Grids of cubic voxels about a point."""

import numpy as np
from numpy.typing import ArrayLike

from data_synthetic.geometry import ScanGrid


def centred_grid(centre_mm: ArrayLike, shape: tuple[int, ...], voxel_mm: float) -> ScanGrid:
    """The grid of that shape whose middle lies at ``centre_mm``."""
    low = np.asarray(centre_mm, dtype=np.float64) - 0.5 * (np.array(shape) - 1) * voxel_mm
    return ScanGrid(shape, np.full(3, voxel_mm), low, np.eye(3))
