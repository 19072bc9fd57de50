"""What a wire stands out from: the frame minus its background, on the lumen's box, at the lumen's voxels alone."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.arrays.axis_order import in_memory_order
from pipeline.arrays.jets import Blurred, values_at
from pipeline.arrays.robust import spread
from pipeline.arrays.sparse import sparse_zeros
from pipeline.model import Lumen, Volume
from pipeline.trace._kernels.runs import subtract
from pipeline.trace.background import from_reference, from_wall, wall_blur
from pipeline.trace.region import Region, region_of
from solver.grid import Array

BLUR_VOXELS = 0.8
"""The scanner's blur over the smallest voxel, from which the shape of the blur in thick slices is taken."""
CREST_VOXELS = 0.7
"""Blur in which grey is read along a curve."""


@dataclass(frozen=True, eq=False)
class Subtraction:
    """Grey above the background (float32, on the region's box, valid on ``region.runs``) and its noise.

    noise : robust standard deviation of one voxel.  modelled : True where no reference scan was there to subtract.
    wall_blur_mm : the scanner's.  Points and directions are in kernel coordinates: index along the box's axes times
    ``spacing``.
    """

    region: Region
    grey: NDArray[np.float32]
    noise: float
    modelled: bool
    wall_blur_mm: float
    counters: dict[str, float] = field(default_factory=dict)
    levels: dict[str, float] = field(default_factory=dict)

    @cached_property
    def spacing(self) -> Array:
        """Voxel size along the box's axes in the coordinates of the kernels, mm.

        Slices thicker than the pixels are drawn together until the wire's blur is as wide along every axis (scanner
        0.8 of the smallest voxel, and the slice's own box): the kernels know one blur. Equal voxels are left alone.
        """
        size = np.asarray(self.region.box.spacing_mm)
        blur = np.hypot(BLUR_VOXELS * size.min(), size / np.sqrt(12))
        return np.asarray(size * blur.min() / blur)

    @cached_property
    def voxel(self) -> float:
        """Smallest of ``spacing``, mm."""
        return float(self.spacing.min())

    def local(self, points_mm: ArrayLike) -> Array:
        """LPS mm -> kernel coordinates."""
        return np.ascontiguousarray(self.region.box.to_index(points_mm) * self.spacing)

    def world(self, points: ArrayLike) -> Array:
        """Kernel coordinates -> LPS mm."""
        return self.region.box.to_mm(np.asarray(points, float) / self.spacing)

    def turned(self, direction: ArrayLike) -> Array:
        """A direction in LPS -> kernel coordinates."""
        along = np.asarray(direction, float) @ self.region.box.direction
        along = along * self.spacing / self.region.box.spacing_mm
        return np.asarray(along / np.linalg.norm(along))

    def along(self, points: Array) -> Array:
        """Blurred grey (n,) at points (n, 3)."""
        return values_at(Blurred(self.grey, self.spacing, CREST_VOXELS * self.voxel), points)

    @contextmanager
    def showing(self, voxels: NDArray[np.int64], grey: NDArray[Any]) -> Iterator[None]:
        """Other grey at some voxels (flat) for the length of the block: in place, as a copy holds a whole box."""
        flat = self.grey.reshape(-1)
        kept = flat[voxels]
        flat[voxels] = grey
        try:
            yield
        finally:
            flat[voxels] = kept

    def depth_at(self, points: Array) -> NDArray[Any]:
        """Signed distance to the wall (n,) at the voxels nearest to points (n, 3); the box's edge stands for beyond."""
        box = self.region.box
        index = np.clip(np.rint(points / self.spacing).astype(int), 0, np.array(box.shape) - 1)
        return np.asarray(box.values[tuple(index.T)])


def subtracted(frame: Volume, lumen: Lumen, reference: Volume | None) -> Subtraction:
    """Subtract the background at the lumen's voxels; one pass over them, no copy of the frame."""
    grid, axes = in_memory_order(frame)
    region = region_of(grid, lumen, axes)
    if reference is None:
        background: NDArray[Any] = from_wall(grid, region, lumen)
    else:
        background = from_reference(reference, region, lumen, axes)
    grey = sparse_zeros(region.box.shape, np.float32)
    read = float(subtract(grid.values, background, region.corner, region.runs, grey))
    noise = spread(grey.reshape(-1)[region.within])
    total = float(np.prod(grid.shape))
    counters = {"voxels_total": total, "voxels_read": read, "voxels_skipped": total - read}
    blur = wall_blur(lumen, float(np.min(region.box.spacing_mm)))
    return Subtraction(region, grey, max(noise, 1e-6), reference is None, blur, counters, {"noise": noise})
