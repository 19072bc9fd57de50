"""The plan of one random scene, and the wall and entry made from it: the entry at the origin, the vessel along +z."""

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.benchmark.stress.lumens import NEAR, near_vessels
from pipeline.benchmark.stress.statics import Array
from pipeline.benchmark.vessels import lumen_distance
from solver import Grid

BOXES = {
    "straight": ([-7.0, -7.0, -6.0], [7.0, 7.0, 70.0]),
    "bend": ([-7.0, -7.0, -6.0], [34.0, 7.0, 40.0]),
    "siphon": ([-7.0, -7.0, -6.0], [30.0, 7.0, 34.0]),
    "sphere": ([-14.0, -14.0, -6.0], [14.0, 14.0, 24.0]),
    "channel": ([-16.0, -7.0, -6.0], [16.0, 7.0, 60.0]),
    "voxel": ([-5.0, -5.0, -5.0], [5.0, 5.0, 12.0]),
    "thread": ([-5.0, -5.0, -5.0], [5.0, 5.0, 30.0]),
    **dict.fromkeys(NEAR, ([-4.0, -4.0, -4.0], [9.0, 4.0, 30.0])),
}
"""The grid's two corners for each kind of lumen, mm."""
SHOWN = (
    "way", "lumen", "segment_mm", "joints", "wall_stiffness", "friction", "septum_mm", "hull", "quadrature", "dtype",
    "method",
)  # fmt: skip
"""What the table of scenes shows of a plan."""


@dataclass
class ScenePlan:
    """Everything that defines a scene, before anything is built.

    way : "relax" (one relaxation from a start shape) or "insertion" (depth after depth).
    lumen : kind of vessel; ``lumen_mm`` its radius, ``voxel_mm`` (3,) the grid's spacing.
    septum_mm : wall between it and another one near it.
    stiffness, rest : rows [distance from tip mm, value].     start : (m, 3) polyline of a relaxation, or None.
    """

    seed: int
    index: int
    axes: tuple[str, ...] = ()
    way: str = "insertion"
    segment_mm: float = 1.0
    joints: int = 40
    radius_mm: float = 0.18
    stiffness: list[list[float]] = field(default_factory=lambda: [[0.0, 10.0]])
    rest: list[list[float]] = field(default_factory=lambda: [[0.0, 0.0]])
    torsion: float = math.inf
    wall: bool = True
    wall_stiffness: float = 1.0
    friction: float = 0.0
    hull: str = "offset"
    quadrature: str = "joints"
    initial: str = "slide"
    method: str = "newton"
    lumen: str = "straight"
    lumen_mm: float = 2.0
    voxel_mm: tuple[float, float, float] = (0.8, 0.8, 0.8)
    dtype: str = "float32"
    septum_mm: float = 1.0
    stenosis: float = 1.0
    noise_mm: float = 0.0
    defect: str = ""
    crop: float = 1.0
    turned: bool = False
    far_mm: float = 0.0
    tilt_deg: float = 0.0
    offset_mm: float = 0.0
    depths: list[float] = field(default_factory=list)
    rolls: list[float] = field(default_factory=list)
    step_mm: float = 1.0
    start: Array | None = None
    load_N: tuple[float, float, float] = (0.0, 0.0, 0.0)
    max_iterations: int = 200

    @property
    def length_mm(self) -> float:
        """Length of the wire in the vessel at its longest."""
        return self.segment_mm * self.joints


def lumen_grid(plan: ScenePlan) -> Grid:
    """The plan's wall on its grid, with its defects."""
    rng = np.random.default_rng([plan.seed, plan.index, 1])
    low, high = np.array(BOXES[plan.lumen])
    high = low + (high - low) * np.array([1.0, 1.0, plan.crop])
    axes = [np.arange(a, b, v) for a, b, v in zip(low, high, plan.voxel_mm, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    if plan.lumen in ("voxel", "thread"):
        # two values alone would be a mask, which a wall refuses
        values = 0.5 * float(np.mean(plan.voxel_mm)) * (1.0 + 1e-3 * np.linalg.norm(points, axis=-1))
        inside = np.hypot(points[..., 0], points[..., 1]) < 0.5 * min(plan.voxel_mm[:2]) + 1e-9
        where = np.argwhere(inside & (points[..., 2] > -1.0))[: 1 if plan.lumen == "voxel" else None]
        values[tuple(where.T)] *= -1.0
    else:
        if plan.lumen in NEAR:
            values = near_vessels(plan.lumen, points, plan.lumen_mm, plan.septum_mm).min(axis=0)
        else:
            values = lumen_distance(plan.lumen, points, plan.lumen_mm)
        middle = 0.5 * (axes[2][0] + axes[2][-1])
        narrow = (1.0 - plan.stenosis) * plan.lumen_mm * np.exp(-(((points[..., 2] - middle) / 2.5) ** 2))
        values = values + narrow
    values = values + plan.noise_mm * rng.uniform(-1.0, 1.0, values.shape)
    values = values.astype(plan.dtype)
    if plan.defect == "all nan":
        values[...] = np.nan
    elif plan.defect:
        values[tuple(rng.integers(0, values.shape))] = float(plan.defect)
    turn, shift = placement(plan)
    return Grid(values, np.array(plan.voxel_mm), turn @ low + shift, turn)


def placement(plan: ScenePlan) -> tuple[Array, Array]:
    """Rotation (3, 3) and shift (3,), mm, from the scene's own frame to where it lies."""
    rng = np.random.default_rng([plan.seed, plan.index, 2])
    turn = Rotation.random(rng=rng).as_matrix() if plan.turned else np.eye(3)
    return turn, plan.far_mm * rng.uniform(-1.0, 1.0, 3)


def side_angle(plan: ScenePlan) -> float:
    """Angle about the vessel at which the entry lies off its axis, rad; a curved tip bends a right angle beyond it."""
    return float(np.random.default_rng([plan.seed, plan.index, 3]).uniform(0.0, 2 * np.pi))


def entry(plan: ScenePlan) -> tuple[Array, Array, Array]:
    """Entry point, direction and material axis of the plan, where the scene lies."""
    turn, shift = placement(plan)
    about = side_angle(plan)
    side = np.array([np.cos(about), np.sin(about), 0.0])
    tilt = np.deg2rad(plan.tilt_deg)
    direction = np.cos(tilt) * np.array([0.0, 0.0, 1.0]) + np.sin(tilt) * side
    across = np.array([-np.sin(about), np.cos(about), 0.0])
    return turn @ (plan.offset_mm * side) + shift, turn @ direction, turn @ across
