"""What a wire stands out from: the frame minus its background, on the lumen's box, at the lumen's voxels alone."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.axis_order import in_memory_order
from pipeline.arrays.sparse import sparse_zeros
from pipeline.model import Lumen, Volume
from pipeline.trace._kernels.ridges import subtract
from pipeline.trace.background import modelled, smoothed
from pipeline.trace.region import MAD, Region, region_of
from solver.grid import Array

BLUR_VOXELS = 0.8
"""The scanner's blur over the smallest voxel, from which the shape of the blur in thick slices is taken."""


@dataclass(frozen=True, eq=False)
class Scene:
    """Grey above the background (float32, on the region's box, valid on ``region.runs``) and its noise.

    noise : robust standard deviation of one voxel.  modelled : True where no reference scan was there to subtract.
    """

    region: Region
    grey: NDArray[np.float32]
    noise: float
    modelled: bool
    counters: dict[str, float] = field(default_factory=dict)

    @property
    def spacing(self) -> Array:
        """Voxel size along the box's axes in the coordinates of the kernels, mm.

        Slices thicker than the pixels are drawn together until the wire's blur is as wide along every axis (scanner
        0.8 of the smallest voxel, and the slice's own box): the kernels know one blur. Equal voxels are left alone.
        """
        size = np.asarray(self.region.box.spacing_mm)
        blur = np.hypot(BLUR_VOXELS * size.min(), size / np.sqrt(12))
        return np.asarray(size * blur.min() / blur)

    def local(self, points_mm: Any) -> Array:
        """LPS mm -> mm along the box's axes from its first voxel (the coordinates of the kernels)."""
        return np.ascontiguousarray(self.region.box.to_index(points_mm) * self.spacing)

    def world(self, points: Any) -> Array:
        """Kernel coordinates -> LPS mm."""
        return self.region.box.to_mm(np.asarray(points, float) / self.spacing)

    def turned(self, direction: Any) -> Array:
        """A direction in LPS -> kernel coordinates."""
        along = np.asarray(direction, float) @ self.region.box.direction
        along = along * self.spacing / self.region.box.spacing_mm
        return np.asarray(along / np.linalg.norm(along))


def build_scene(frame: Volume, lumen: Lumen, reference: Volume | None) -> Scene:
    """Subtract the background at the lumen's voxels; one pass over them, no copy of the frame."""
    grid, axes = in_memory_order(frame)
    region = region_of(grid, lumen, axes)
    background = (
        modelled(grid, region, lumen) if reference is None else smoothed(reference, region, lumen, axes)
    )
    grey = sparse_zeros(region.box.shape, np.float32)
    read = subtract(grid.values, background, region.corner, region.runs, grey)
    sample = grey.reshape(-1)[region.within]
    noise = MAD * float(np.median(np.abs(sample - np.median(sample))))
    total = float(np.prod(grid.shape))
    counters = {
        "voxels_total": total,
        "voxels_read": float(read),
        "voxels_skipped": total - read,
        "noise": noise,
    }
    return Scene(region, grey, max(noise, 1e-6), reference is None, counters)
