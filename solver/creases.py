"""Creases: where the distance between two lumens stops rising and falls again; only there can a wire change lumens.

In an exact distance the slope falls at once. A Gaussian, or resampling to finer voxels, spreads that fall over as many
voxels as the smoothing is wide: so it is looked for over longer and longer distances.
"""

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from solver import _tolerances as tol
from solver.doors import Array

Marks = NDArray[np.uint8]
Voxel = NDArray[np.int64]
SLAB = 2**17
"""Voxels that are looked at together."""


def creases(values: Array, spacing_mm: Array) -> Marks:
    """Blocks of the grid, ``tol.CREASE_BLOCK`` voxels wide, near a crease of the distance."""
    marks = np.zeros([-(-n // tol.CREASE_BLOCK) for n in values.shape], dtype=np.uint8)
    for first, slab in _slabs(values, 1):
        for axis, spacing in enumerate(spacing_mm):
            sharp = np.argwhere(np.diff(slab, 2, axis) < -tol.CREASE * spacing)
            _mark(marks, values, sharp + np.eye(3, dtype=int)[axis] + np.array([first, 0, 0]), 2)
    voxels, finest = 2, float(spacing_mm.min())
    while voxels == 2 or voxels * finest <= tol.CREASE_REACH_MM:
        _mark(marks, values, _rounded(values, spacing_mm, voxels), max(2, voxels // 2))
        voxels *= 2
    return marks


def _slabs(values: Array, halo: int) -> Iterator[tuple[int, Array]]:
    """Slabs of a grid along its first axis, with ``halo`` more layers on both sides; each with its first layer's index.

    The arrays made of one slab stay in the processor's cache: a third of the time that a whole grid takes.
    """
    layers = max(SLAB // max(1, values[0].size), 4 * halo)
    for first in range(0, max(1, len(values) - 2 * halo), layers):
        yield first, values[first : first + layers + 2 * halo]


def _rounded(values: Array, spacing_mm: Array, voxels: int) -> NDArray[np.int64]:
    """Voxels (n, 3) at which the slope falls by ``tol.CREASE``, taken over ``voxels`` of the finest axis to each side.

    Only places half that distance apart are tried. Where the distance still rises one way there is no crease: round
    the inner wall of a tight bend it falls to both sides along the vessel, but rises away from it.
    """
    way = voxels * float(spacing_mm.min())
    stride = np.maximum(np.minimum(voxels // 2, (0.5 * way / spacing_mm).astype(int)), 1)
    coarse = values[:: stride[0], :: stride[1], :: stride[2]]
    reach = np.maximum(np.rint(way / (stride * spacing_mm)).astype(int), 1)
    found = [
        np.add((first, 0, 0), _fallen(slab, spacing_mm, stride, reach)) for first, slab in _slabs(coarse, reach[0])
    ]
    return np.asarray(np.concatenate(found) * stride)


def _fallen(coarse: Array, spacing_mm: Array, stride: Voxel, reach: Voxel) -> NDArray[np.int64]:
    """The same in a slab of every ``stride``-th voxel, as its indices (n, 3), over ``reach`` of these to each side."""
    inner = [slice(n, size - n) for n, size in zip(reach, coarse.shape, strict=True)]
    middle = coarse[tuple(inner)]
    if 0 in middle.shape:
        return np.zeros((0, 3), dtype=np.int64)
    falls = np.zeros(middle.shape, dtype=bool)
    for axis, n in enumerate(reach):
        ahead, behind = (
            coarse[tuple(ends if a == axis else inner[a] for a in range(3))]
            for ends in (slice(2 * n, None), slice(coarse.shape[axis] - 2 * n))
        )
        falls |= ahead + behind < 2.0 * middle - tol.CREASE * n * stride[axis] * spacing_mm[axis]
    where = np.argwhere(falls) + reach
    ways = np.diag(reach)
    slopes = [(coarse[tuple((where + w).T)] - coarse[tuple((where - w).T)]) for w in ways]
    square = np.sum((np.stack(slopes) / (2.0 * reach * stride * spacing_mm)[:, None]) ** 2, axis=0)
    return np.asarray(where[square < tol.CREASE_SLOPE**2])


def _mark(marks: Marks, values: Array, where: NDArray[np.int64], near: int) -> None:
    """Mark the blocks that lie within ``near`` voxels of the voxels ``where`` (n, 3)."""
    for corner in product((-near, near), repeat=3):
        block = np.clip(where + corner, 0, np.array(values.shape) - 1) // tol.CREASE_BLOCK
        marks[tuple(block.T)] = 1
