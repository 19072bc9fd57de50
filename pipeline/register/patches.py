"""Points in patches along a vessel, and least squares with an offset and a gain of grey of each patch's own.

A gain that varies over a scan makes steps of grey where none is: one that went from 0.8 to 1.25 along 28 mm was taken
for a motion of 0.2 to 0.6 voxel. Within a patch it is one number.
"""

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Array

TINY = 1e-18
"""A grey, or its square, in place of 0 where something is divided by it: no scan's noise is below. Some are in 1e-7."""
PATCH_POINTS = 60
"""Points of a patch: five numbers are found from them."""
LEAST_MM = 5.0
SPAN_RADII = 4.0
"""Extent of two patches over the vessel's radius, beside which its wall's band is 2 wide and more: a patch goes all the
way round. That of one side alone hardly tells a step of grey from a moved wall (correlation 0.95)."""


def parted(points_mm: Array, span_mm: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """An order of the points (n, 3) in which patches are contiguous, and the first of each: pairs of neighbours.

    A pair extends no farther than ``span_mm`` where it has points enough.
    """
    if len(points_mm) < 2 * PATCH_POINTS:
        return np.arange(len(points_mm)), np.zeros(1, np.intp)
    pieces, todo = [], [np.arange(len(points_mm))]
    while todo:
        piece = todo.pop()
        extent = np.ptp(points_mm[piece], axis=0)
        along = points_mm[piece, int(np.argmax(extent))]
        piece, half = piece[np.argsort(along, kind="stable")], len(piece) // 2
        if extent.max() > span_mm and len(piece) >= 4 * PATCH_POINTS:
            todo += [piece[half:], piece[:half]]
        else:
            pieces += [piece[:half], piece[half:]]
    sizes = [len(piece) for piece in pieces]
    return np.concatenate(pieces), np.cumsum([0, *sizes[:-1]])


def spread_out(of_patches: Array, starts: NDArray[np.intp], count: int) -> Array:
    """What each patch has (k, ...), for each of ``count`` points."""
    return np.repeat(of_patches, np.diff(starts, append=count), axis=0)


def means(values: Array, starts: NDArray[np.intp]) -> Array:
    """Mean of the values (n, ...) over each patch."""
    count = np.diff(starts, append=len(values)).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(np.add.reduceat(values, starts, axis=0) / count)


def products(rows: Array, weights: Array, starts: NDArray[np.intp]) -> Array:
    """Weighted sums of squares and products of the columns of ``rows`` (n, m) over each patch, (k, m, m)."""
    weighted, ends = rows * weights[:, None], [*starts[1:], len(rows)]
    return np.stack([weighted[a:b].T @ rows[a:b] for a, b in zip(starts, ends, strict=True)])


def shaded(squares: Array, m: int) -> tuple[Array, Array, Array]:
    """Normal equations of least squares with each patch's own shading taken out, (k, m, m) and (k, m).

    squares : ``products`` of the m unknowns' columns, the c columns of a patch's shading, and what is to be explained.
    Also what gives the patches' (k, c) shadings of a solution: (k, c, m + 1), to be multiplied with (-x, 1).
    """
    last = squares.shape[1] - 1
    others = [*range(m), last]
    own, cross = squares[:, m:last, m:last], squares[:, m:last][:, :, others]
    # each by its own size: as a share of both, one of a scan of large greys held the offset back
    size = np.diagonal(own, axis1=1, axis2=2)
    ridge = np.where(size > 0.0, 1e-9 * size, 1.0)
    solved = np.asarray(np.linalg.solve(own + ridge[:, :, None] * np.eye(last - m), cross), np.float64)
    left = squares[:, :m][:, :, others] - np.swapaxes(cross[:, :, :m], 1, 2) @ solved
    return left[:, :, :m], left[:, :, m], solved
