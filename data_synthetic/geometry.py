"""Vectors and curves as arrays; where the voxels of a scan lie, and which of them are near given points."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from data_synthetic._compile import on_disk

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def unit(vector: ArrayLike) -> Array:
    """The vector at length one."""
    v = np.asarray(vector, dtype=np.float64)
    return np.asarray(v / np.linalg.norm(v))


def rotate(vector: ArrayLike, axis: ArrayLike, angle_rad: float) -> Array:
    """Right-handed rotation of a vector about an axis (Rodrigues)."""
    v, k = np.asarray(vector, dtype=np.float64), unit(axis)
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.asarray(c * v + s * np.cross(k, v) + (1.0 - c) * float(k @ v) * k)


def normal_to(axis: ArrayLike, direction: ArrayLike) -> Array:
    """The unit part of ``axis`` that is normal to ``direction``."""
    a, d = np.asarray(axis, dtype=np.float64), unit(direction)
    return unit(a - float(a @ d) * d)


def world_axis_across(direction: Array) -> Array:
    """The world axis that is least aligned with a direction."""
    return np.asarray(np.eye(3)[int(np.argmin(np.abs(direction)))])


def ends_of(lengths: ArrayLike) -> Array:
    """Arc lengths (n + 1,) of the ends of edges (n,) that follow each other, from 0."""
    return np.concatenate([[0.0], np.cumsum(lengths)])


def arc_lengths(points: Array) -> Array:
    """Arc length (n,) of every point of a curve, from 0."""
    return ends_of(np.linalg.norm(np.diff(points, axis=0), axis=1))


def at_arc(places: Array, arc: Array, values: Array) -> Array:
    """Values (n, 3) given at arc lengths (n,), linear between, at ``places`` (m,)."""
    return np.column_stack([np.interp(places, arc, values[:, a]) for a in range(3)])


Volume = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class ScanGrid:
    """shape (nx, ny, nz); voxel (i, j, k) is centred at ``origin + direction @ (spacing * (i, j, k))``, LPS mm."""

    shape: tuple[int, ...]
    spacing_mm: Array
    origin_mm: Array
    direction: Array

    def to_index(self, points_mm: ArrayLike) -> Array:
        """Continuous indices (n, 3)."""
        offset = np.asarray(points_mm, dtype=np.float64) - self.origin_mm
        return np.asarray(offset @ self.direction / self.spacing_mm)

    def to_mm(self, index: ArrayLike) -> Array:
        """LPS mm (n, 3)."""
        return np.asarray((np.asarray(index) * self.spacing_mm) @ self.direction.T + self.origin_mm)

    @property
    def voxel_mm(self) -> float:
        """Edge of the cube of a voxel's volume."""
        return float(np.prod(self.spacing_mm) ** (1.0 / 3.0))


def voxels_near(index: Array, radii_mm: Array, grid: ScanGrid) -> Index:
    """Indices (m, 3) of voxels within radii (n,) mm of points (n, 3), which are given in index coordinates."""
    mask = np.zeros(grid.shape, dtype=bool)
    mark_balls(index, radii_mm, grid.spacing_mm, mask)
    return np.argwhere(mask)


@on_disk()
def mark_balls(centres: Array, radii: Array, spacing: Array, mask: NDArray[np.bool_]) -> None:
    """Set mask where a voxel centre lies within radii (n,) mm of centres (n, 3) given in index coordinates."""
    for n in range(len(centres)):
        r = radii[n]
        lo, hi = np.empty(3, np.int64), np.empty(3, np.int64)
        for a in range(3):
            lo[a] = max(0, int(np.ceil(centres[n, a] - r / spacing[a])))
            hi[a] = min(mask.shape[a] - 1, int(np.floor(centres[n, a] + r / spacing[a])))
        for i in range(lo[0], hi[0] + 1):
            x = (i - centres[n, 0]) * spacing[0]
            for j in range(lo[1], hi[1] + 1):
                y = (j - centres[n, 1]) * spacing[1]
                for k in range(lo[2], hi[2] + 1):
                    z = (k - centres[n, 2]) * spacing[2]
                    if x * x + y * y + z * z <= r * r:
                        mask[i, j, k] = True
