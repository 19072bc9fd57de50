"""Where the voxels of a synthetic scan lie."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ScanGrid:
    """shape (nx, ny, nz); voxel (i, j, k) is centred at ``origin + direction @ (spacing * (i, j, k))``, LPS mm."""

    shape: tuple[int, int, int]
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


def centred_grid(
    centre_mm: ArrayLike,
    shape: tuple[int, int, int],
    spacing_mm: ArrayLike,
    direction: ArrayLike | None = None,
) -> ScanGrid:
    """The grid of that shape and spacing whose middle lies at ``centre_mm``."""
    spacing = np.broadcast_to(np.asarray(spacing_mm, dtype=np.float64), 3).copy()
    axes = np.eye(3) if direction is None else np.asarray(direction, dtype=np.float64)
    half = axes @ (0.5 * (np.array(shape) - 1) * spacing)
    return ScanGrid(shape, spacing, np.asarray(centre_mm, dtype=np.float64) - half, axes)
