"""The introducer: where the wire is clamped, which way it points there, and how it is rolled."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver import _tolerances as tol
from solver.errors import refuse

Array = NDArray[np.float64]


def vector(name: str, value: ArrayLike) -> Array:
    """Three finite numbers as an array; ValueError where they are not."""
    v = np.array(value, dtype=np.float64)
    if v.shape != (3,) or not np.all(np.isfinite(v)):
        refuse("insertion", name, value, "three finite numbers", "LPS, in the unit of its name")
    return v


def unit(value: ArrayLike, name: str) -> Array:
    """The direction of a 3-vector; ValueError where it has none."""
    v = np.asarray(value, dtype=np.float64)
    size = float(np.linalg.norm(v)) if v.shape == (3,) else 0.0
    if not (np.isfinite(size) and size > 0):
        refuse("insertion", name, np.asarray(value).tolist(), "three finite numbers, not all 0", "give LPS")
    return v / size


def base_frame(direction: Array, material_axis: ArrayLike | None, roll_deg: float) -> Array:
    """Columns: material axes 1 and 2 and the direction of the wire at the entry, rolled right-handed about it."""
    if material_axis is None:
        axis = np.zeros(3)
        axis[int(np.argmin(np.abs(direction)))] = 1.0
    else:
        axis = unit(material_axis, "material_axis")
    across = axis - direction * float(axis @ direction)
    if float(np.linalg.norm(across)) < tol.PARALLEL:
        advice = "leave it out for the default"
        refuse("insertion", "material_axis", axis.tolist(), "not along entry_direction", advice)
    one = across / float(np.linalg.norm(across))
    two = _cross(direction, one)
    roll = np.deg2rad(roll_deg)
    first = np.cos(roll) * one + np.sin(roll) * two
    return np.column_stack([first, _cross(direction, first), direction])


def _cross(a: Array, b: Array) -> Array:
    """A x b: numpy's own costs 30 µs for three numbers."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
