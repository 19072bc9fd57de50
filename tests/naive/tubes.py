"""Slow, obvious distance to a tube: many balls."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def tube_distance(centres: Array, radii: Array, points: Array, between: int = 400) -> Array:
    """Least of |x - c| - r over balls interpolated ``between`` times on a chord-smooth (cubic) curve."""
    from scipy.interpolate import CubicSpline

    place = np.arange(len(centres))
    fine = np.linspace(0, len(centres) - 1, between * len(centres))
    c, r = CubicSpline(place, centres)(fine), CubicSpline(place, radii)(fine)
    return np.array([np.min(np.linalg.norm(c - p, axis=1) - r) for p in points])


def inside_share(anatomy_distance: object, low: Array, high: Array, count: int = 12) -> float:
    """Share of a box inside a shape, by ``count`` cubed positions."""
    axes = [a + (b - a) * (np.arange(count) + 0.5) / count for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return float(np.mean(anatomy_distance(points) < 0))  # type: ignore[operator]
