"""One random scene: a moderate one, then made extreme along one to three axes."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Rng = np.random.Generator


@dataclass
class Plan:
    """Everything that defines a scene, before anything is built; axes change it in place.

    way : "relax" (one relaxation from a start shape) or "insertion" (depth after depth).
    lumen : kind of vessel; ``lumen_mm`` its radius, ``voxel_mm`` (3,) the grid's spacing.
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
    start: NDArray[np.float64] | None = None
    load_N: tuple[float, float, float] = (0.0, 0.0, 0.0)
    max_iterations: int = 200

    @property
    def length_mm(self) -> float:
        """Length of the wire in the vessel at its longest."""
        return self.segment_mm * self.joints

    def describe(self) -> dict[str, Any]:
        """What the table of scenes shows of it."""
        names = (
            "way",
            "lumen",
            "segment_mm",
            "joints",
            "wall_stiffness",
            "hull",
            "quadrature",
            "dtype",
            "method",
        )
        return {name: getattr(self, name) for name in names}


def log_uniform(rng: Rng, low: float, high: float) -> float:
    """A number between low and high, uniform in its logarithm."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


LUMENS = ("straight", "bend", "siphon", "sphere", "channel")


def draw(seed: int, index: int) -> Plan:
    """Scene ``index`` of the study ``seed``: the same one every time, in any order."""
    from pipeline.benchmark.stress.axes import AXES

    rng = np.random.default_rng([seed, index])
    plan = _moderate(rng, seed, index)
    names = list(AXES)
    first = names[index % len(names)]
    others = rng.choice([n for n in names if n != first], size=int(rng.integers(0, 3)), replace=False)
    for name in (first, *others):
        AXES[str(name)](plan, rng)
    plan.axes = (first, *(str(n) for n in others))
    _finish(plan, rng)
    return plan


def _moderate(rng: Rng, seed: int, index: int) -> Plan:
    segment = log_uniform(rng, 0.5, 2.0)
    voxel = log_uniform(rng, 0.5, 1.0)
    curved = rng.random() < 0.5
    return Plan(
        seed,
        index,
        way=str(rng.choice(["relax", "insertion"])),
        segment_mm=segment,
        joints=max(1, round(rng.uniform(15.0, 60.0) / segment)),
        stiffness=[[0.0, log_uniform(rng, 0.5, 5.0)], [30.0, log_uniform(rng, 5.0, 40.0)]],
        rest=[[0.0, 0.08], [10.0, 0.08], [10.0, 0.0]] if curved else [[0.0, 0.0]],
        wall_stiffness=log_uniform(rng, 0.1, 100.0),
        quadrature=str(rng.choice(["joints", "joints", "tip", "segments"])),
        initial=str(rng.choice(["slide", "slide", "translate"])),
        lumen=str(rng.choice(LUMENS)),
        lumen_mm=rng.uniform(1.0, 3.0),
        voxel_mm=(voxel, voxel, voxel),
        dtype=str(rng.choice(["float32", "float64"])),
        rolls=[float(rng.uniform(-180.0, 180.0))],
    )


def _finish(plan: Plan, rng: Rng) -> None:
    """Depths that the axes left open: three on the way in, sometimes one on the way out."""
    if not plan.depths:
        share = [0.3, 0.7, 1.0] + [0.4] * int(rng.random() < 0.3)
        plan.depths = [plan.length_mm * s for s in share]
    if plan.way == "relax":
        plan.depths = [max(plan.depths)]
    # a wire of a thousand joints is relaxed at a few depths only: this study is about stability, not speed
    plan.step_mm = max(plan.step_mm, plan.length_mm / 60.0)
    turns = len(plan.depths)
    plan.rolls = (plan.rolls * turns)[:turns]
