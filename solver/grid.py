"""A regular grid of values in space: the one place where index and millimetre meet."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver.doors import ANYWHERE_MM, FAR_MM, Array, Found, Range, numbers
from solver.errors import refuse

__all__ = ["Array", "Grid", "read_only"]

SPACING_MM = Range(1e-6, FAR_MM, "spacing is above 0: turn an axis round in `direction`", "write [0.4, 0.4, 0.4]")
COSINES = Range(-2, 2, "columns of length 1", "of SimpleITK's nine: numpy.reshape(image.GetDirection(), (3, 3))")


def frozen(state: dict[str, Any]) -> dict[str, Any]:
    """What was unpickled, its arrays read-only: numpy forgets that they were."""
    for value in state.values():
        if isinstance(value, np.ndarray):
            value.flags.writeable = False
    return state


def read_only(array: ArrayLike, dtype: Any = None) -> NDArray[Any]:
    """Return a view (a copy only if the dtype asks for one) that cannot be written to."""
    view = np.asarray(array, dtype=dtype).view()
    view.flags.writeable = False
    return view


def _own(values: object) -> NDArray[Any]:
    """Values that no caller can change any more: a copy, or the array itself where it is read-only (``read_only``)."""
    if np.ma.is_masked(values):
        refuse("grid", "values", Found("a masked array"), "an array without masked voxels", "fill them")
    try:
        array = np.asarray(values)
    except ValueError:
        refuse("grid", "values", values, "an array with three axes x, y, z", "rows must be equally long")
    if array.ndim != 3 or array.size == 0 or array.dtype.kind not in "biufc":
        found = Found(f"{array.dtype} of shape {array.shape}")
        refuse("grid", "values", found, "numbers with three axes x, y, z", "values[i, j, k] is the voxel at x, y, z")
    return read_only(array.copy(order="K") if array.flags.writeable else array)


@dataclass(frozen=True, eq=False, repr=False)
class Grid:
    """Values on a regular grid, indexed x, y, z.

    values : (nx, ny, nz) any dtype; ``values[i, j, k]`` sits at ``origin + direction @ (spacing * (i, j, k))``.
    An array that can be written to is copied; ``read_only(array)`` hands one over without a copy.
    spacing_mm : (3,) mm.     origin_mm : (3,) LPS mm, the centre of voxel (0, 0, 0).
    direction : (3, 3) orthonormal; column a is where index axis a points in LPS.
    """

    values: NDArray[Any]
    spacing_mm: Array = field(default_factory=lambda: np.ones(3))
    origin_mm: Array = field(default_factory=lambda: np.zeros(3))
    direction: Array = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        """Freeze the arrays and refuse a geometry that is not one."""
        object.__setattr__(self, "values", _own(self.values))
        allowed = {"spacing_mm": SPACING_MM, "origin_mm": ANYWHERE_MM, "direction": COSINES}
        for name, limits in allowed.items():
            shape = (3, 3) if name == "direction" else (3,)
            value = numbers("grid", name, getattr(self, name), shape, limits)
            object.__setattr__(self, name, read_only(value.copy()))
        if not np.allclose(self.direction.T @ self.direction, np.eye(3), atol=1e-4):
            refuse("grid", "direction", self.direction.tolist(), "an orthonormal matrix", "columns of length 1")

    def __repr__(self) -> str:
        """What a prompt and messages show: not its values."""
        spacing = " x ".join(f"{edge:.4g}" for edge in self.spacing_mm)
        return f"Grid({self.values.dtype} {self.shape}, voxels of {spacing} mm)"

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Freeze what was unpickled."""
        vars(self).update(frozen(state))

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of voxels along x, y, z."""
        nx, ny, nz = self.values.shape
        return nx, ny, nz

    @property
    def voxel_mm(self) -> float:
        """The shortest edge of its voxels, mm."""
        return float(self.spacing_mm.min())

    def to_index(self, points_mm: ArrayLike) -> Array:
        """Continuous indices (..., 3) of LPS points (..., 3) in mm."""
        points = numbers("grid", "points_mm", points_mm, (..., 3), ANYWHERE_MM)
        return np.asarray((points - self.origin_mm) @ self.direction / self.spacing_mm)

    def to_mm(self, index: ArrayLike) -> Array:
        """LPS points (..., 3) in mm of continuous indices (..., 3)."""
        at = numbers("grid", "index", index, (..., 3), Range(-1e12, 1e12, "voxels from the first one"))
        return np.asarray(at * self.spacing_mm @ self.direction.T + self.origin_mm)

    def beyond_mm(self, points_mm: ArrayLike) -> Array:
        """How far, (n,) mm, LPS points (n, 3) are outside the voxels, which end half a voxel beyond their centres."""
        index = self.to_index(points_mm)
        beyond = np.maximum(np.maximum(-index, index - (np.array(self.shape) - 1.0)) - 0.5, 0.0)
        return np.asarray(np.linalg.norm(beyond * self.spacing_mm, axis=-1))

    def with_values(self, values: NDArray[Any]) -> "Grid":
        """The same geometry holding other values."""
        return Grid(values, self.spacing_mm, self.origin_mm, self.direction)

    def crop(self, start: tuple[int, int, int], stop: tuple[int, int, int]) -> "Grid":
        """The sub-grid of voxels ``start`` (inclusive) to ``stop`` (exclusive), as a view."""
        first = numbers("grid", "start", start, (3,), Range(0, max(self.shape), "voxels"))
        last = numbers("grid", "stop", stop, (3,), Range(0, max(self.shape), "voxels"))
        whole = np.all(first == np.floor(first)) and np.all(last == np.floor(last))
        if not whole or np.any(first >= last) or np.any(last > self.shape):
            refuse("grid", "crop", (start, stop), f"whole voxels, start < stop <= {self.shape}", "give indices x, y, z")
        window = tuple(slice(int(a), int(b)) for a, b in zip(first, last, strict=True))
        return Grid(self.values[window], self.spacing_mm, self.to_mm(start), self.direction)
