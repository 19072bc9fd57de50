"""Directions (3,) and curves given as points (n, 3), in mm."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
