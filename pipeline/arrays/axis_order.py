"""Grids in the order of their memory, so that kernels walk files that are x-fastest without copying them."""

from __future__ import annotations

import numpy as np

from solver.grid import Grid


def reorder(grid: Grid, axes: tuple[int, int, int]) -> Grid:
    """The same grid (same points in mm) with its index axes in another order; a view, never a copy."""
    order = list(axes)
    return Grid(grid.values.transpose(axes), grid.spacing_mm[order], grid.origin_mm, grid.direction[:, order])


def contiguous(grid: Grid) -> Grid:
    """The grid itself if its values are C-contiguous, otherwise with a copy (of a crop, say) that is."""
    return grid if grid.values.flags.c_contiguous else grid.with_values(np.ascontiguousarray(grid.values))


def in_memory_order(grid: Grid) -> tuple[Grid, tuple[int, int, int]]:
    """The grid with C-contiguous values, its axes reversed if that is how they lie in memory (Fortran), and its axes.

    Both orders are their own inverse, so ``reorder(result, axes)`` gives the first order back.
    """
    reverse = grid.values.flags.f_contiguous and not grid.values.flags.c_contiguous
    axes = (2, 1, 0) if reverse else (0, 1, 2)
    return contiguous(reorder(grid, axes)), axes
