"""Grids: the order of their memory, where one lies in another, the noise in their values, and the wall of one."""

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from solver import VesselWall
from solver.grid import Array, Grid, read_only

MAD = 1.4826
"""Standard deviation of normal noise over its median absolute deviation."""
TIED = 0.1
"""Share of all deviations that are the median from which on they are whole greys of little noise (up to 6)."""
LATTICE_MM, LATTICE_VOXELS = 0.3, 60e6
"""Voxels of a lumen that comes without a lattice; they are larger where its box would hold more than so many."""


def wall_of_grid(distance: Grid, stiffness_N_mm2: float = 1.0, hull: str = "offset") -> VesselWall:
    """The wall of a signed distance. Its doubts are for the case's warnings, not for the terminal."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return VesselWall(distance, stiffness_N_mm2, hull=hull)


def reorder(grid: Grid, axes: tuple[int, int, int]) -> Grid:
    """The same grid (same points in mm) with its index axes in another order; a view, never a copy."""
    order = list(axes)
    return Grid(grid.values.transpose(axes), grid.spacing_mm[order], grid.origin_mm, grid.direction[:, order])


def towards_lps(grid: Grid) -> NDArray[Any]:
    """Its values with axes in the order and the sense of x, y and z, as nearly as they go; a view, never a copy."""
    along, order = np.abs(grid.direction), [0, 0, 0]
    for _ in range(3):
        x, axis = divmod(int(np.argmax(along)), 3)
        order[x] = axis
        along[x], along[:, axis] = -1.0, -1.0
    back = tuple(x for x in range(3) if grid.direction[x, order[x]] < 0.0)
    return np.asarray(np.flip(grid.values.transpose(order), back))


def contiguous(grid: Grid) -> Grid:
    """The grid itself if its values are C-contiguous, otherwise one with a contiguous copy of them (of a crop, say)."""
    return grid if grid.values.flags.c_contiguous else grid.with_values(read_only(np.ascontiguousarray(grid.values)))


def in_memory_order(grid: Grid) -> tuple[Grid, tuple[int, int, int]]:
    """The grid with C-contiguous values, and the order of its axes: reversed if the values lie in Fortran order.

    Both orders are their own inverse, so ``reorder(result, axes)`` gives the original order back.
    """
    reverse = grid.values.flags.f_contiguous and not grid.values.flags.c_contiguous
    axes = (2, 1, 0) if reverse else (0, 1, 2)
    return contiguous(reorder(grid, axes)), axes


def around(grid: Grid, points_mm: Array, room_mm: float) -> Grid:
    """The grid, cropped to the box of some points (n, 3), LPS mm, and ``room_mm`` beyond it on every side."""
    ends = zip(points_mm.min(axis=0) - room_mm, points_mm.max(axis=0) + room_mm, strict=True)
    index = grid.to_index(np.array(np.meshgrid(*ends)).reshape(3, -1).T)
    low = np.clip(np.floor(index.min(axis=0)), 0, np.array(grid.shape) - 1).astype(int)
    high = np.clip(np.ceil(index.max(axis=0)) + 1, low + 1, grid.shape).astype(int)
    return grid.crop((low[0], low[1], low[2]), (high[0], high[1], high[2]))


def lattice_mm(size_mm: Array) -> float:
    """Edge (mm) of the voxels of a box of this size (3,), mm, that comes without a lattice."""
    return max(LATTICE_MM, float(np.cbrt(np.prod(size_mm) / LATTICE_VOXELS)))


def integer_offset(grid: Grid, inner: Grid) -> NDArray[np.int64] | None:
    """Index (3,) in ``grid`` of voxel (0, 0, 0) of ``inner`` if both lie on one lattice, else None.

    A lattice is the same when spacing and axes agree to a ten-thousandth and the shift is whole to 0.02 voxel.
    """
    same = np.allclose(grid.spacing_mm, inner.spacing_mm, rtol=1e-4) and np.allclose(
        grid.direction, inner.direction, atol=1e-4
    )
    shift = grid.to_index(inner.origin_mm)
    return np.rint(shift).astype(np.int64) if same and np.all(np.abs(shift - np.rint(shift)) <= 0.02) else None


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
    return like.with_values(read_only(values))


def slopes_at(grid: Grid, index: NDArray[np.int64]) -> Array:
    """Central differences (n, 3) of a grid's values at voxels (n, 3) off its edge, along its axes; twice the slope."""
    values = grid.values
    steps = enumerate(np.eye(3, dtype=int))
    slope = [(values[tuple((index + s).T)] - values[tuple((index - s).T)]) / grid.spacing_mm[a] for a, s in steps]
    return np.stack(slope, axis=1).astype(float)


def normals_at(grid: Grid, near: NDArray[np.bool_], count: int) -> tuple[NDArray[np.int64], Array]:
    """Indices (n, 3) of about ``count`` voxels of those that are set, off the grid's edge; unit normals (n, 3), LPS."""
    flat = np.flatnonzero(near)
    index = unflattened(flat[:: max(1, len(flat) // count)], grid.shape)
    index = index[np.all((index > 0) & (index < np.array(grid.shape) - 1), axis=1)]
    normals = slopes_at(grid, index) @ grid.direction.T
    return index, np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9))


def indices_of(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Indices (n, 3) where a contiguous mask is set, as ``np.argwhere``, in a fifth of its time where little is set."""
    return unflattened(np.flatnonzero(mask), mask.shape)


def unflattened(flat: NDArray[np.int64], shape: tuple[int, ...]) -> NDArray[np.int64]:
    """Indices (n, 3) of flat ones (n,)."""
    return np.stack(np.unravel_index(flat, shape), axis=1)


def spelt(place: Array, digits: int = 1) -> str:
    """Coordinates (3,) in a sentence, without a minus before a zero."""
    return ", ".join(f"{x:.{digits}f}" for x in np.round(np.asarray(place, float), digits) + 0.0)


def spread(values: NDArray[Any]) -> float:
    """Standard deviation of normal noise, from the median absolute deviation, which outliers hardly change.

    Of whole greys many deviations are the median, which lies somewhere between their edges, as in a histogram: noise of
    0.6 to 1.9 greys was told as 1.5, and less as none.
    """
    off = np.abs(values - np.median(values))
    middle = float(np.median(off))
    tied = np.count_nonzero(off == middle)
    if off.size > tied > TIED * off.size and np.array_equal(off, np.rint(off)):
        low = max(middle - 0.5, 0.0)
        middle = low + (middle + 0.5 - low) * (0.5 * off.size - np.count_nonzero(off < middle)) / tied
    return MAD * middle
