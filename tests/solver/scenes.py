"""Vessels with a closed form, sampled on a grid: what the solver's tests insert wires into."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver import Grid

Array = NDArray[np.float64]


def bend_distance(points: ArrayLike, radius: float = 30.0, inlet: float = 30.0, lumen: float = 2.0) -> Array:
    """Signed distance of a straight inlet along +z, tangent to a 90° bend towards +x, then straight on."""
    p = np.asarray(points, dtype=np.float64)
    x, y, z = p[..., 0], p[..., 1], p[..., 2] - inlet
    ring = np.hypot(np.hypot(radius - x, z) - radius, y)
    outlet = np.hypot(z - radius, y)
    return np.where(z < 0, np.hypot(x, y), np.where(x > radius, outlet, ring)) - lumen


def sampled(distance: NDArray[np.float64], spacing: float, low: ArrayLike) -> Grid:
    """A grid of distances."""
    return Grid(distance, [spacing] * 3, low)


@cache
def bend_grid(spacing: float = 0.3, dtype: str = "float32") -> Grid:
    """The bend of radius 30 mm, inlet 30 mm, lumen radius 2 mm."""
    low, high = np.array([-5.0, -5.0, -5.0]), np.array([55.0, 5.0, 65.0])
    axes = [np.arange(a, b, spacing) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    return sampled(bend_distance(points).astype(dtype), spacing, low)
