"""Vessels with a closed form, sampled on a grid: what the solver's tests insert wires into."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from solver import Grid, GuideWire, Insertion, Solution, VesselWall

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


def winding(rng: np.random.Generator, length_mm: float, tightest_mm: float, most_rad: float) -> Array:
    """Points (n, 3) every quarter of a millimetre: 8 mm straight on, then bends at random, some with a straight piece
    behind them.

    tightest_mm, most_rad : the least radius of a bend, and the most that it turns.
    """
    along, place, path = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, 3.0]), list[Array]()
    while 0.25 * len(path) < length_mm:
        radius, axis = rng.uniform(tightest_mm, 25), np.cross(along, rng.normal(size=3))
        bend = Rotation.from_rotvec(axis / np.linalg.norm(axis) * 0.25 / radius)
        steps = [bend] * int(rng.uniform(3, most_rad * radius) / 0.25)
        if rng.random() < 0.4:
            steps += [Rotation.identity()] * int(rng.uniform(2, 8) / 0.25)
        for turn in steps:
            along = turn.apply(along)
            place = place + 0.25 * along
            path.append(place)
    return np.vstack([np.linspace([0.0, 0.0, -5.0], [0.0, 0.0, 3.0], 33), path])


def held_by_friction() -> tuple[GuideWire, VesselWall, float]:
    """A vessel of random bends and widths, with friction 0.3, that holds a wire fast at 28 mm: wire, wall, roll."""
    rng = np.random.default_rng([7, 133])
    points = winding(rng, 45.0, 3.0, 1.6)
    wide = rng.uniform(0.7, 2.2) * (1.0 + 0.625 * gaussian_filter1d(rng.normal(size=len(points)), 12))
    low = points.min(axis=0) - 4.0
    axes = [np.arange(a, b, 0.5) for a, b in zip(low, points.max(axis=0) + 4.5, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    near, which = cKDTree(points).query(nodes, k=8)
    distance = (near - np.clip(wide, 0.45, 3.0)[which]).min(axis=-1)
    rng.choice(4)  # of frictions
    stiffness = 10 ** rng.uniform(-0.5, 2)
    wall = VesselWall(Grid(distance, [0.5] * 3, low), stiffness, friction=0.3)
    curve, tip = rng.uniform(0, 0.35), 10 ** rng.uniform(-1.5, 0.5)
    knee, shaft = (10.0, 15.0)[rng.choice(2)], 10 ** rng.uniform(0.3, 1.5)
    bending = [[0.0, tip], [knee, tip], [knee if rng.random() < 0.5 else knee + 15, shaft]]
    torsion = np.inf if rng.random() < 0.6 else 10 ** rng.uniform(0, 1.3)
    rest = [[0.0, curve], [7.0, curve], [7.0 if rng.random() < 0.5 else 12.0, 0.0]]
    return GuideWire(0.5, 0.18, bending, rest, float(torsion)), wall, float(rng.uniform(0, 360))
