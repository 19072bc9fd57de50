"""A grid's values at the voxels of another grid."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from solver.grid import Grid


def sampled(grid: Grid, like: Grid, outside: float) -> Grid:
    """``grid`` interpolated (trilinear) at the voxels of ``like``, float32; ``outside`` beyond it."""
    matrix = (grid.direction.T @ like.direction) * like.spacing_mm / grid.spacing_mm[:, None]
    values = np.empty(like.shape, np.float32)
    ndimage.affine_transform(
        grid.values.astype(np.float32), matrix, grid.to_index(like.origin_mm), like.shape,
        output=values, order=1, mode="constant", cval=outside,
    )  # fmt: skip
    return like.with_values(values)
