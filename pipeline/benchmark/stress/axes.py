"""The axes of stress: each makes one thing of a scene extreme."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pipeline.benchmark.stress.plan import Plan, Rng, log_uniform


def wall_stiffness(plan: Plan, rng: Rng) -> None:
    """From next to nothing to hard."""
    plan.wall_stiffness = log_uniform(rng, 1e-3, 1e6)


def bending_range(plan: Plan, rng: Rng) -> None:
    """Six decades of EI within one wire, in any order, with or without a jump."""
    count = int(rng.integers(2, 7))
    at = np.sort(rng.uniform(0.0, plan.length_mm, count))
    decade = np.concatenate([[-3.0, 3.0], rng.uniform(-3.0, 3.0, count - 2)])
    rng.shuffle(decade)
    rows = [[float(a), float(10.0**d)] for a, d in zip(at, decade, strict=True)]
    if rng.random() < 0.5:
        rows = [row for a, b in zip(rows, [*rows[1:], rows[-1]], strict=True) for row in (a, [b[0], a[1]])]
    plan.stiffness = rows


def segment_length(plan: Plan, rng: Rng) -> None:
    """Segments from 0.1 to 5 mm, longer than the lumen is wide."""
    length = plan.length_mm
    plan.segment_mm = log_uniform(rng, 0.1, 5.0)
    plan.joints = int(np.clip(round(length / plan.segment_mm), 1, 600))


def joints(plan: Plan, rng: Rng) -> None:
    """From one joint to two thousand."""
    plan.joints = max(1, round(log_uniform(rng, 1.0, 2000.0)))
    plan.segment_mm = log_uniform(rng, 0.1, 0.5) if plan.joints > 200 else plan.segment_mm


def rest_curvature(plan: Plan, rng: Rng) -> None:
    """Up to 1/(2 segment), whole wire or tip."""
    curvature = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 1.0)) * 0.5 / plan.segment_mm
    where = rng.uniform(2.0, 15.0)
    plan.rest = [[0.0, curvature]]
    if rng.random() < 0.6:
        plan.rest += [[where, curvature], [where, 0.0]]


def kinks(plan: Plan, rng: Rng) -> None:
    """A wire that was bent sharply at some places, or one that starts from a zigzag."""
    if rng.random() < 0.5:
        limit = 0.5 / plan.segment_mm
        rows = [[0.0, 0.0]]
        for at in np.sort(rng.uniform(0.0, plan.length_mm, 3)):
            kink = float(rng.uniform(-limit, limit))
            rows += [[float(at), 0.0], [float(at), kink]]
            rows += [[float(at) + plan.segment_mm, kink], [float(at) + plan.segment_mm, 0.0]]
        plan.rest = [[max(r[0], p[0]), r[1]] for r, p in zip(rows, [rows[0], *rows[:-1]], strict=True)]
        plan.rest = [
            [float(a), v]
            for a, v in zip(np.maximum.accumulate([r[0] for r in rows]), (r[1] for r in rows), strict=True)
        ]
        return
    plan.way = "relax"
    steps = rng.normal(size=(40, 3)) + np.array([0.0, 0.0, rng.uniform(0.0, 1.5)])
    steps *= plan.length_mm / 40 / np.linalg.norm(steps, axis=1, keepdims=True)
    plan.start = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


def narrow_lumen(plan: Plan, rng: Rng) -> None:
    """Narrower than the wire."""
    plan.radius_mm = rng.uniform(0.3, 1.5)
    plan.lumen_mm = plan.radius_mm * rng.uniform(0.2, 1.0)


def stenosis(plan: Plan, rng: Rng) -> None:
    """Down to a twentieth of the radius."""
    plan.stenosis = rng.uniform(0.05, 0.6)


def misaligned_entry(plan: Plan, rng: Rng) -> None:
    """Up to 60 degrees off the vessel's axis."""
    plan.tilt_deg = rng.uniform(5.0, 60.0)


def entry_outside(plan: Plan, rng: Rng) -> None:
    """The entry lies beside the vessel's axis, often outside the vessel."""
    plan.offset_mm = plan.lumen_mm * rng.uniform(0.5, 3.0)


def zero_step(plan: Plan, rng: Rng) -> None:
    """No step, a step of rounding, no wire at all."""
    plan.way = "insertion"
    end = plan.length_mm * rng.uniform(0.3, 1.0)
    choices = [0.0, end, end, end + 1e-13, end * (1 + 1e-9), 1e-12, end]
    plan.depths = [choices[i] for i in rng.permutation(len(choices))]


def huge_step(plan: Plan, rng: Rng) -> None:
    """All the way at once, and back."""
    plan.way = "insertion"
    plan.step_mm = 1e6
    plan.depths = [plan.length_mm * rng.uniform(1.0, 3.0), 1.0, plan.length_mm]


def roll(plan: Plan, rng: Rng) -> None:
    """Up to ten turns, either way, in one go or spread over the depths."""
    plan.rolls = [float(rng.uniform(-3600.0, 3600.0)) for _ in range(int(rng.integers(1, 4)))]


def bad_grid(plan: Plan, rng: Rng) -> None:
    """NaN or inf in the grid."""
    plan.defect = str(rng.choice(["nan", "inf", "-inf", "all nan"]))


def grid_edge(plan: Plan, rng: Rng) -> None:
    """The grid ends on the way."""
    plan.crop = rng.uniform(0.15, 0.8)


def single_voxel(plan: Plan, rng: Rng) -> None:
    """A lumen of one voxel, or a chain of single voxels."""
    plan.lumen = str(rng.choice(["voxel", "thread"]))


def precision(plan: Plan, rng: Rng) -> None:
    """Grids in other types, anisotropic and turned, far from the origin."""
    plan.dtype = str(rng.choice(["float16", "float32", "float64"]))
    plan.voxel_mm = tuple(float(v) for v in rng.uniform(0.3, 1.5, 3))  # type: ignore[assignment]
    plan.turned = bool(rng.random() < 0.7)
    plan.far_mm = float(rng.choice([0.0, 1e3, 1e5]))


def hull(plan: Plan, rng: Rng) -> None:
    """Sampled hulls of few and many points, and thick wires."""
    plan.hull = f"samples:{int(rng.choice([1, 2, 3, 4, 8, 16]))}"
    plan.radius_mm = rng.uniform(0.0, 0.8)
    plan.quadrature = "joints"


def noisy_wall(plan: Plan, rng: Rng) -> None:
    """A field that is no distance: noise of up to a voxel on every node."""
    plan.noise_mm = float(max(plan.voxel_mm)) * rng.uniform(0.05, 1.0)


def loads(plan: Plan, rng: Rng) -> None:
    """A dead load on the tip, with or without a wall, from a feather to far beyond buckling."""
    plan.wall = bool(rng.random() < 0.4)
    alpha = log_uniform(rng, 1e-3, 300.0)
    force = alpha * plan.stiffness[-1][1] / plan.length_mm**2
    direction = rng.normal(size=3)
    if rng.random() < 0.5:
        direction = np.array([0.0, 0.0, -1.0])
    load = force * direction / np.linalg.norm(direction)
    plan.load_N = (float(load[0]), float(load[1]), float(load[2]))


def torsion(plan: Plan, rng: Rng) -> None:
    """A finite torsional stiffness, over six decades."""
    plan.torsion = log_uniform(rng, 1e-3, 1e3)


def friction(plan: Plan, rng: Rng) -> None:
    """Coulomb friction up to 1."""
    plan.way = "insertion"
    plan.friction = log_uniform(rng, 1e-3, 1.0)


def radius(plan: Plan, rng: Rng) -> None:
    """A wire without thickness, or thicker than a segment is long."""
    plan.radius_mm = float(rng.choice([0.0, 1e-6, plan.segment_mm * 2]))


def few_iterations(plan: Plan, rng: Rng) -> None:
    """An iteration limit that is too low: it must be said, and the state must be sound."""
    plan.max_iterations = int(rng.integers(1, 6))


def closed_form(plan: Plan, rng: Rng) -> None:
    """The seed's relaxation on a scene of its own scale."""
    plan.method = "closed_form"
    plan.joints = min(plan.joints, 40)
    plan.rolls = [math.copysign(min(abs(r), 90.0), r) for r in plan.rolls]
    plan.max_iterations = int(rng.choice([200, 2000]))


AXES: dict[str, Callable[[Plan, Rng], None]] = {
    f.__name__: f
    for f in (
        wall_stiffness, bending_range, segment_length, joints, rest_curvature, kinks, narrow_lumen, stenosis,
        misaligned_entry, entry_outside, zero_step, huge_step, roll, bad_grid, grid_edge, single_voxel, precision,
        hull, noisy_wall, loads, torsion, friction, radius, few_iterations, closed_form,
    )
}  # fmt: skip
