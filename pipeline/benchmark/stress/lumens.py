"""The walls of the stress scenes: signed distances on small grids, the entry at the origin, the vessel along +z."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pipeline.benchmark.stress.plan import Plan
from solver import Grid

Array = NDArray[np.float64]

BOXES = {
    "straight": ([-7.0, -7.0, -6.0], [7.0, 7.0, 70.0]),
    "bend": ([-7.0, -7.0, -6.0], [34.0, 7.0, 40.0]),
    "siphon": ([-7.0, -7.0, -6.0], [30.0, 7.0, 34.0]),
    "sphere": ([-14.0, -14.0, -6.0], [14.0, 14.0, 24.0]),
    "channel": ([-16.0, -7.0, -6.0], [16.0, 7.0, 60.0]),
    "voxel": ([-5.0, -5.0, -5.0], [5.0, 5.0, 12.0]),
    "thread": ([-5.0, -5.0, -5.0], [5.0, 5.0, 30.0]),
}
SPHERE_MM = 9.0


def lumen_distance(kind: str, points: Array, radius: float) -> Array:
    """Signed distance of points (..., 3), negative inside."""
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    if kind == "bend":
        return np.asarray(_arc(x, y, z - 10.0, 20.0) - radius)
    if kind == "siphon":
        first = _arc(x, y, z - 8.0, 8.0)
        # the second bend turns back from where the first one ends
        second = np.where(x > 8.0, np.hypot(np.hypot(x - 8.0, z - 24.0) - 8.0, y), np.inf)
        return np.asarray(np.minimum(np.where(x > 8.0, np.inf, first), second) - radius)
    if kind == "sphere":
        neck = np.hypot(np.hypot(x, y), np.maximum(z - 4.0, 0.0)) - min(radius, 3.0)
        return np.asarray(np.minimum(neck, np.sqrt(x**2 + y**2 + (z - 12.0) ** 2) - SPHERE_MM))
    if kind == "channel":
        return np.asarray(np.abs(y) - radius)
    return np.asarray(np.hypot(x, y) - radius)


def _arc(x: Array, y: Array, z: Array, turn: float) -> Array:
    """Distance from a line up to z = 0, then a quarter circle towards +x, then a line along +x."""
    ring = np.hypot(np.hypot(turn - x, z) - turn, y)
    return np.where(z < 0, np.hypot(x, y), np.where(x > turn, np.hypot(z - turn, y), ring))


def _axes(plan: Plan) -> tuple[list[Array], Array]:
    low, high = (np.array(v) for v in BOXES[plan.lumen])
    high = low + (high - low) * np.array([1.0, 1.0, plan.crop])
    return [np.arange(a, b, v) for a, b, v in zip(low, high, plan.voxel_mm, strict=True)], low


def lumen_grid(plan: Plan) -> Grid:
    """The plan's wall on its grid, with its defects."""
    rng = np.random.default_rng([plan.seed, plan.index, 1])
    axes, low = _axes(plan)
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    if plan.lumen in ("voxel", "thread"):
        values = np.full(points.shape[:3], 0.5 * float(np.mean(plan.voxel_mm)))
        inside = np.hypot(points[..., 0], points[..., 1]) < 0.5 * min(plan.voxel_mm[:2]) + 1e-9
        where = np.argwhere(inside & (points[..., 2] > -1.0))
        for i in where[: 1 if plan.lumen == "voxel" else None]:
            values[tuple(i)] *= -1.0
    else:
        values = lumen_distance(plan.lumen, points, plan.lumen_mm)
        middle = 0.5 * (axes[2][0] + axes[2][-1])
        narrow = (1.0 - plan.stenosis) * plan.lumen_mm * np.exp(-(((points[..., 2] - middle) / 2.5) ** 2))
        values = values + narrow
    values = values + plan.noise_mm * rng.uniform(-1.0, 1.0, values.shape)
    values = values.astype(plan.dtype)
    _spoil(values, plan.defect, rng)
    turn, shift = placement(plan)
    return Grid(values, np.array(plan.voxel_mm), turn @ low + shift, turn)


def _spoil(values: NDArray[np.generic], defect: str, rng: np.random.Generator) -> None:
    if defect == "all nan":
        values[...] = np.nan
    elif defect:
        values[tuple(rng.integers(0, values.shape))] = float(defect)


def placement(plan: Plan) -> tuple[Array, Array]:
    """Rotation (3, 3) and shift (3,) that take the scene to where it lies."""
    rng = np.random.default_rng([plan.seed, plan.index, 2])
    turn = Rotation.random(rng=rng).as_matrix() if plan.turned else np.eye(3)
    return turn, plan.far_mm * rng.uniform(-1.0, 1.0, 3)


def entry(plan: Plan) -> tuple[Array, Array, Array]:
    """Entry point, direction and material axis of the plan, in the scene's place."""
    rng = np.random.default_rng([plan.seed, plan.index, 3])
    turn, shift = placement(plan)
    about = rng.uniform(0.0, 2 * np.pi)
    side = np.array([np.cos(about), np.sin(about), 0.0])
    tilt = np.deg2rad(plan.tilt_deg)
    direction = np.cos(tilt) * np.array([0.0, 0.0, 1.0]) + np.sin(tilt) * side
    across = np.array([-np.sin(about), np.cos(about), 0.0])
    return turn @ (plan.offset_mm * side) + shift, turn @ direction, turn @ across
