"""A regular grid of values in space: the one place where index and millimetre meet."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def read_only(array: ArrayLike, dtype: Any = None) -> NDArray[Any]:
    """Return a view (a copy only if the dtype asks for one) that cannot be written to."""
    view = np.asarray(array, dtype=dtype).view()
    view.flags.writeable = False
    return view


@dataclass(frozen=True, eq=False)
class Grid:
    """Values on a regular grid, indexed x, y, z.

    values : (nx, ny, nz) any dtype; ``values[i, j, k]`` sits at ``origin + direction @ (spacing * (i, j, k))``.
    spacing_mm : (3,) mm.     origin_mm : (3,) LPS mm, the centre of voxel (0, 0, 0).
    direction : (3, 3) orthonormal; column a is where index axis a points in LPS.
    """

    values: NDArray[Any]
    spacing_mm: Array = field(default_factory=lambda: np.ones(3))
    origin_mm: Array = field(default_factory=lambda: np.zeros(3))
    direction: Array = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        """Freeze the arrays and refuse a geometry that is not one."""
        object.__setattr__(self, "values", read_only(self.values))
        for name, shape in (("spacing_mm", (3,)), ("origin_mm", (3,)), ("direction", (3, 3))):
            value = read_only(np.array(getattr(self, name), dtype=np.float64))
            if value.shape != shape or not np.all(np.isfinite(value)):
                raise ValueError(f"grid {name}: got {value.tolist()}, expected {shape} finite numbers")
            object.__setattr__(self, name, value)
        if self.values.ndim != 3:
            raise ValueError(f"grid values: got an array of shape {self.values.shape}, expected three axes x, y, z")
        if np.any(self.spacing_mm <= 0):
            raise ValueError(f"grid spacing_mm: got {self.spacing_mm.tolist()}, expected three positive lengths in mm")
        if not np.allclose(self.direction.T @ self.direction, np.eye(3), atol=1e-4):
            raise ValueError(f"grid direction: got {self.direction.tolist()}, expected an orthonormal matrix")

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of voxels along x, y, z."""
        nx, ny, nz = self.values.shape
        return nx, ny, nz

    def to_index(self, points_mm: ArrayLike) -> Array:
        """Continuous indices (..., 3) of LPS points (..., 3) in mm."""
        offset = np.asarray(points_mm, dtype=np.float64) - self.origin_mm
        return np.asarray(offset @ self.direction / self.spacing_mm)

    def to_mm(self, index: ArrayLike) -> Array:
        """LPS points (..., 3) in mm of continuous indices (..., 3)."""
        scaled = np.asarray(index, dtype=np.float64) * self.spacing_mm
        return np.asarray(scaled @ self.direction.T + self.origin_mm)

    def with_values(self, values: NDArray[Any]) -> "Grid":
        """The same geometry holding other values."""
        return Grid(values, self.spacing_mm, self.origin_mm, self.direction)

    def crop(self, start: tuple[int, int, int], stop: tuple[int, int, int]) -> "Grid":
        """The sub-grid of voxels ``start`` (inclusive) to ``stop`` (exclusive), as a view."""
        window = tuple(slice(a, b) for a, b in zip(start, stop, strict=True))
        return Grid(self.values[window], self.spacing_mm, self.to_mm(start), self.direction)
