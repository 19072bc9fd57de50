"""Vessels with a closed form, sampled on a grid: what the solver's tests insert wires into."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver import Grid, Insertion, Solution

Array = NDArray[np.float64]
Distance = Callable[[Array], Array]


def bend_distance(points: ArrayLike, radius: float = 30.0, inlet: float = 30.0, lumen: float = 2.0) -> Array:
    """Signed distance of a straight inlet along +z, tangent to a 90° bend towards +x, then straight on."""
    p = np.asarray(points, dtype=np.float64)
    x, y, z = p[..., 0], p[..., 1], p[..., 2] - inlet
    ring = np.hypot(np.hypot(radius - x, z) - radius, y)
    outlet = np.hypot(z - radius, y)
    return np.where(z < 0, np.hypot(x, y), np.where(x > radius, outlet, ring)) - lumen


def sheath_distance(points: ArrayLike, bore: float) -> Array:
    """A straight sheath along +z that opens within 4 mm about z = 0 into the inlet of the bend."""
    p = np.asarray(points, dtype=np.float64)
    z = p[..., 2]
    t = np.clip((z + 2.0) / 4.0, 0.0, 1.0)
    tube = np.hypot(p[..., 0], p[..., 1]) - (bore + (2.0 - bore) * t * t * (3.0 - 2.0 * t))
    return np.where(z < 4.0, tube, bend_distance(p))


def tube_distance(points: ArrayLike, lumen: float = 2.0) -> Array:
    """A straight tube along z."""
    p = np.asarray(points, dtype=np.float64)
    return np.hypot(p[..., 0], p[..., 1]) - lumen


def fork_distance(points: ArrayLike, lumen: float = 1.5, angle: float = 0.45, fork: float = 20.0) -> Array:
    """A trunk along +z that forks at z = 20 mm into two branches in the x-z plane."""
    p = np.asarray(points, dtype=np.float64)
    x, y, z = p[..., 0], p[..., 1], p[..., 2] - fork
    trunk = np.sqrt(x**2 + y**2 + np.maximum(z, 0.0) ** 2)
    branch = []
    for side in (-1.0, 1.0):
        along = np.maximum(side * x * np.sin(angle) + z * np.cos(angle), 0.0)
        branch.append(np.sqrt((x - side * along * np.sin(angle)) ** 2 + y**2 + (z - along * np.cos(angle)) ** 2))
    return np.minimum(trunk, np.minimum(*branch)) - lumen


def sampled(distance: Distance, spacing: float, low: ArrayLike, high: ArrayLike, dtype: str = "float64") -> Grid:
    """A grid of distances over a box."""
    axes = [np.arange(a, b + spacing / 2, spacing) for a, b in zip(low, high, strict=True)]  # type: ignore[call-overload]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    return Grid(distance(points).astype(dtype), np.full(3, spacing), np.asarray(low, dtype=np.float64))


@cache
def bend_grid(spacing: float = 0.3, dtype: str = "float32") -> Grid:
    """The bend of radius 30 mm, inlet 30 mm, lumen radius 2 mm."""
    return sampled(bend_distance, spacing, (-5.0, -5.0, -5.0), (55.0, 5.0, 65.0), dtype)


@cache
def sheath_grid(bore: float, length: float) -> Grid:
    """The bend behind a sheath of this bore radius and length, mm."""
    low, high = (-4.0, -3.0, -length - 3.0), (34.0, 3.0, 66.0)
    return sampled(lambda p: sheath_distance(p, bore), 0.3, low, high, "float32")


@cache
def tube_grid(spacing: float = 0.25, lumen: float = 2.0, length: float = 60.0) -> Grid:
    """A straight tube along z."""
    side = lumen + 2.0
    return sampled(lambda p: tube_distance(p, lumen), spacing, (-side, -side, -4.0), (side, side, length))


@cache
def fork_grid(spacing: float = 0.25) -> Grid:
    """The fork."""
    return sampled(fork_distance, spacing, (-16.0, -4.0, -4.0), (16.0, 4.0, 46.0))


@cache
def plane_grid(height: float = 10.0, tilt: float = 0.0) -> Grid:
    """A plane wall: the lumen is below it. Linear, so that the spline reproduces it."""

    def distance(p: Array) -> Array:
        return p[..., 2] * np.cos(tilt) + p[..., 0] * np.sin(tilt) - height

    return sampled(distance, 1.0, (-20.0, -20.0, -5.0), (20.0, 20.0, 25.0))


def last(insertion: Insertion, depths: ArrayLike, roll: float = 0.0) -> Solution:
    """The wire at the last of some depths, all of which must be reached."""
    solution = None
    for solution in insertion.to_depths(np.asarray(depths, dtype=float), roll_deg=roll):
        assert solution.converged, (solution.depth_mm, solution.sentence)
    assert solution is not None
    return solution


def same_bits(a: Solution, b: Solution) -> None:
    """Every field is the same to the last bit, counters too."""
    for name, value in vars(a).items():
        other = getattr(b, name)
        assert np.array_equal(value, other) if isinstance(value, np.ndarray) else value == other, name
