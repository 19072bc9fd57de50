"""Random scenes: a moderate plan is drawn, then made extreme along one to three axes of stress."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pipeline.benchmark.stress.lumens import NEAR
from pipeline.benchmark.stress.plan import ScenePlan, side_angle
from pipeline.benchmark.stress.rubbing import RUBBING_MM

Rng = np.random.Generator
Changes = dict[str, Any]
"""Fields of a plan and their new values."""
LUMENS = ("straight", "bend", "siphon", "sphere", "channel")


def draw(seed: int, index: int, among: Sequence[str] = ()) -> ScenePlan:
    """Scene ``index`` of the study ``seed``: the same one every time, in any order. among : axes, default all."""
    rng = np.random.default_rng([seed, index])
    plan = moderate(rng, seed, index)
    names = list(among or AXES)
    first = names[index % len(names)]
    others = rng.choice([n for n in names if n != first], size=int(rng.integers(0, 3)), replace=False)
    plan.axes = (first, *(str(n) for n in others))
    for name in plan.axes:
        plan = replace(plan, **AXES[name](plan, rng))
    if not plan.depths:
        # three on the way in, sometimes one on the way out
        share = [0.3, 0.7, 1.0] + [0.4] * int(rng.random() < 0.3)
        plan.depths = [plan.length_mm * s for s in share]
    if plan.way == "relax":
        plan.depths = [max(plan.depths)]
    # a wire of a thousand joints is relaxed at a few depths only: this study is about stability, not speed
    plan.step_mm = max(plan.step_mm, plan.length_mm / 60.0)
    plan.rolls = (plan.rolls * len(plan.depths))[: len(plan.depths)]
    return plan


def moderate(rng: Rng, seed: int, index: int) -> ScenePlan:
    """A scene of ordinary proportions."""
    segment = _log_uniform(rng, 0.5, 2.0)
    voxel = _log_uniform(rng, 0.5, 1.0)
    curved = rng.random() < 0.5
    return ScenePlan(
        seed,
        index,
        way=str(rng.choice(["relax", "insertion"])),
        segment_mm=segment,
        joints=max(1, round(rng.uniform(15.0, 60.0) / segment)),
        stiffness=[[0.0, _log_uniform(rng, 0.5, 5.0)], [30.0, _log_uniform(rng, 5.0, 40.0)]],
        rest=[[0.0, 0.08], [10.0, 0.08], [10.0, 0.0]] if curved else [[0.0, 0.0]],
        wall_stiffness=_log_uniform(rng, 0.1, 100.0),
        quadrature=str(rng.choice(["joints", "joints", "tip", "segments"])),
        initial=str(rng.choice(["slide", "slide", "translate"])),
        lumen=str(rng.choice(LUMENS)),
        lumen_mm=rng.uniform(1.0, 3.0),
        voxel_mm=(voxel, voxel, voxel),
        dtype=str(rng.choice(["float32", "float64"])),
        rolls=[float(rng.uniform(-180.0, 180.0))],
    )


def _log_uniform(rng: Rng, low: float, high: float) -> float:
    """A number between low and high, uniform in its logarithm."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def _bending_range(plan: ScenePlan, rng: Rng) -> Changes:
    """Six decades of EI within one wire, in any order, with or without a jump."""
    count = int(rng.integers(2, 7))
    at = np.sort(rng.uniform(0.0, plan.length_mm, count))
    decade = np.concatenate([[-3.0, 3.0], rng.uniform(-3.0, 3.0, count - 2)])
    rng.shuffle(decade)
    rows = [[float(a), float(10.0**d)] for a, d in zip(at, decade, strict=True)]
    if rng.random() < 0.5:
        rows = [row for a, b in zip(rows, [*rows[1:], rows[-1]], strict=True) for row in (a, [b[0], a[1]])]
    return {"stiffness": rows}


def _segment_length(plan: ScenePlan, rng: Rng) -> Changes:
    """Segments from 0.1 mm to 5 mm, which is longer than most lumens are wide."""
    segment = _log_uniform(rng, 0.1, 5.0)
    return {"segment_mm": segment, "joints": int(np.clip(round(plan.length_mm / segment), 1, 600))}


def _joints(plan: ScenePlan, rng: Rng) -> Changes:
    """From one joint to two thousand."""
    joints = max(1, round(_log_uniform(rng, 1.0, 2000.0)))
    segment = _log_uniform(rng, 0.1, 0.5) if joints > 200 else plan.segment_mm
    return {"joints": joints, "segment_mm": segment}


def _rest_curvature(plan: ScenePlan, rng: Rng) -> Changes:
    """Rest curvature up to 1 / (2 segment), either way, of the whole wire or its tip."""
    curvature = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 1.0)) * 0.5 / plan.segment_mm
    where = rng.uniform(2.0, 15.0)
    tip = [[where, curvature], [where, 0.0]] if rng.random() < 0.6 else []
    return {"rest": [[0.0, curvature], *tip]}


def _kinks(plan: ScenePlan, rng: Rng) -> Changes:
    """A wire that was bent sharply at some places, or one that starts from a zigzag."""
    length, segment = plan.length_mm, plan.segment_mm
    if rng.random() < 0.5:
        places, values = [0.0], [0.0]
        for at in np.sort(rng.uniform(0.0, length, 3)):
            kink = float(rng.uniform(-0.5 / segment, 0.5 / segment))
            places += [at, at, at + segment, at + segment]
            values += [0.0, kink, kink, 0.0]
        ordered = np.maximum.accumulate(places).tolist()
        return {"rest": [[place, value] for place, value in zip(ordered, values, strict=True)]}
    steps = rng.normal(size=(40, 3)) + np.array([0.0, 0.0, rng.uniform(0.0, 1.5)])
    steps *= length / 40 / np.linalg.norm(steps, axis=1, keepdims=True)
    return {"way": "relax", "start": np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])}


def _narrow_lumen(_: ScenePlan, rng: Rng) -> Changes:
    """A lumen that is narrower than the wire."""
    radius = rng.uniform(0.3, 1.5)
    return {"radius_mm": radius, "lumen_mm": radius * rng.uniform(0.2, 1.0)}


def _zero_step(plan: ScenePlan, rng: Rng) -> Changes:
    """Depths that differ by nothing or by rounding, and no wire at all."""
    end = plan.length_mm * rng.uniform(0.3, 1.0)
    choices = [0.0, end, end, end + 1e-13, end * (1 + 1e-9), 1e-12, end]
    return {"way": "insertion", "depths": [choices[i] for i in rng.permutation(len(choices))]}


def _loads(plan: ScenePlan, rng: Rng) -> Changes:
    """A dead load on the tip, with or without a wall, from a feather to far beyond buckling."""
    wall = bool(rng.random() < 0.4)
    force = _log_uniform(rng, 1e-3, 300.0) * plan.stiffness[-1][1] / plan.length_mm**2
    direction = rng.normal(size=3)
    if rng.random() < 0.5:
        direction = np.array([0.0, 0.0, -1.0])
    return {"wall": wall, "load_N": tuple((force * direction / np.linalg.norm(direction)).tolist())}


def _closed_form(plan: ScenePlan, rng: Rng) -> Changes:
    """The seed's relaxation on a scene of its own scale."""
    rolls = [math.copysign(min(abs(r), 90.0), r) for r in plan.rolls]
    limit = int(rng.choice([200, 2000]))
    return {"method": "closed_form", "joints": min(plan.joints, 40), "rolls": rolls, "max_iterations": limit}


def _septum(plan: ScenePlan, rng: Rng) -> Changes:
    """A vessel or a limb close by, behind a wall of up to 4 voxels; a soft wire, curved at its tip, and a soft wall."""
    voxel, soft, curvature = rng.uniform(0.2, 0.4), _log_uniform(rng, 0.2, 3.0), rng.uniform(0.0, 0.4)
    # every second tip points at the other vessel, which lies along x
    towards = -np.degrees(side_angle(plan)) - 90.0
    return {
        "lumen": str(rng.choice(NEAR)),
        "lumen_mm": rng.uniform(0.8, 1.5),
        "septum_mm": voxel * rng.uniform(0.0, 4.0),
        "voxel_mm": (voxel, voxel, voxel),
        "stiffness": [[0.0, soft], [15.0, 4.0 * soft]],
        "rest": [[0.0, curvature], [6.0, curvature], [6.0, 0.0]],
        "wall_stiffness": _log_uniform(rng, 0.1, 10.0),
        "joints": max(1, round(rng.uniform(8.0, 30.0) / plan.segment_mm)),
        "rolls": [float(towards)] if rng.random() < 0.5 else plan.rolls,
    }


def _rubbing(plan: ScenePlan, rng: Rng) -> Changes:
    """Friction in small steps, in and out again, so that the hand's work can be added up."""
    end = plan.length_mm * rng.uniform(0.3, 0.9)
    way = end + RUBBING_MM
    changes = {"way": "insertion", "friction": rng.uniform(0.0, 0.5), "joints": min(plan.joints, 200)}
    return {**changes, "depths": [*way.tolist(), *way[-2::-1].tolist()], "rolls": plan.rolls[:1]}


AXES: dict[str, Callable[[ScenePlan, Rng], Changes]] = {
    # from next to nothing to hard
    "wall_stiffness": lambda _, rng: {"wall_stiffness": _log_uniform(rng, 1e-3, 1e6)},
    "bending_range": _bending_range,
    "segment_length": _segment_length,
    "joints": _joints,
    "rest_curvature": _rest_curvature,
    "kinks": _kinks,
    "narrow_lumen": _narrow_lumen,
    # down to a twentieth of the radius
    "stenosis": lambda _, rng: {"stenosis": rng.uniform(0.05, 0.6)},
    # up to 60 degrees off the vessel's axis
    "misaligned_entry": lambda _, rng: {"tilt_deg": rng.uniform(5.0, 60.0)},
    # the entry lies beside the vessel's axis, often outside the vessel
    "entry_outside": lambda plan, rng: {"offset_mm": plan.lumen_mm * rng.uniform(0.5, 3.0)},
    "zero_step": _zero_step,
    # all the way in one step, back, and in again
    "huge_step": lambda plan, rng: {
        "way": "insertion",
        "step_mm": 1e6,
        "depths": [plan.length_mm * rng.uniform(1.0, 3.0), 1.0, plan.length_mm],
    },
    # up to ten turns, either way, in one go or spread over the depths
    "roll": lambda _, rng: {"rolls": rng.uniform(-3600.0, 3600.0, int(rng.integers(1, 4))).tolist()},
    # NaN or inf in the grid, at one voxel or at all
    "bad_grid": lambda _, rng: {"defect": str(rng.choice(["nan", "inf", "-inf", "all nan"]))},
    # the grid ends before the wire's last depth
    "grid_edge": lambda _, rng: {"crop": rng.uniform(0.15, 0.8)},
    # a lumen of one voxel, or a chain of single voxels
    "single_voxel": lambda _, rng: {"lumen": str(rng.choice(["voxel", "thread"]))},
    # grids in other types, anisotropic and turned, far from the origin
    "precision": lambda _, rng: {
        "dtype": str(rng.choice(["float16", "float32", "float64"])),
        "voxel_mm": tuple(rng.uniform(0.3, 1.5, 3).tolist()),
        "turned": bool(rng.random() < 0.7),
        "far_mm": float(rng.choice([0.0, 1e3, 1e5])),
    },
    # sampled hulls of few and many points, and thick wires
    "hull": lambda _, rng: {
        "hull": f"samples:{int(rng.choice([1, 2, 3, 4, 8, 16]))}",
        "radius_mm": rng.uniform(0.0, 0.8),
        "quadrature": "joints",
    },
    # a field that is no distance: noise of up to a voxel on every node
    "noisy_wall": lambda plan, rng: {"noise_mm": float(max(plan.voxel_mm)) * rng.uniform(0.05, 1.0)},
    "loads": _loads,
    # finite torsional stiffness, over six decades
    "torsion": lambda _, rng: {"torsion": _log_uniform(rng, 1e-3, 1e3)},
    # Coulomb's coefficient, from 0.001 to 1
    "friction": lambda _, rng: {"way": "insertion", "friction": _log_uniform(rng, 1e-3, 1.0)},
    # a wire without thickness, or thicker than a segment is long
    "radius": lambda plan, rng: {"radius_mm": float(rng.choice([0.0, 1e-6, plan.segment_mm * 2]))},
    # an iteration limit that is too low: it must be said, and the state must be sound
    "few_iterations": lambda _, rng: {"max_iterations": int(rng.integers(1, 6))},
    "closed_form": _closed_form,
    "septum": _septum,
    "rubbing": _rubbing,
}
"""Each makes one thing of a scene extreme. The order is part of what a seed stands for."""
