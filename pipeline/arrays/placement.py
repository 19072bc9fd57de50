"""Where one grid lies in another: its corner on a shared lattice, its ends in mm, its values at other voxels."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from solver.grid import Array, Grid


def integer_offset(grid: Grid, inner: Grid) -> Array | None:
    """Index (3,) in ``grid`` of voxel (0, 0, 0) of ``inner`` if both lie on one lattice, else None.

    A lattice is the same when spacing and axes agree to a ten-thousandth and the shift is whole to 0.02 voxel.
    """
    same = np.allclose(grid.spacing_mm, inner.spacing_mm, rtol=1e-4) and np.allclose(
        grid.direction, inner.direction, atol=1e-4
    )
    shift = grid.to_index(inner.origin_mm)
    return np.rint(shift) if same and np.all(np.abs(shift - np.rint(shift)) <= 0.02) else None


def corners_mm(grid: Grid) -> Array:
    """The centres of the grid's eight corner voxels (8, 3), LPS mm."""
    ends = np.stack(np.meshgrid(*[(0, n - 1) for n in grid.shape], indexing="ij"), -1).reshape(-1, 3)
    return grid.to_mm(ends)


def sampled(grid: Grid, like: Grid, outside: float) -> Grid:
    """``grid`` interpolated (trilinear) at the voxels of ``like``, float32; ``outside`` beyond it."""
    matrix = (grid.direction.T @ like.direction) * like.spacing_mm / grid.spacing_mm[:, None]
    values = np.empty(like.shape, np.float32)
    ndimage.affine_transform(
        grid.values.astype(np.float32), matrix, grid.to_index(like.origin_mm), like.shape,
        output=values, order=1, mode="constant", cval=outside,
    )  # fmt: skip
    return like.with_values(values)
