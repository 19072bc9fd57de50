"""One insertion of one scene with one setting, and what it cost."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.benchmark.scenes import BenchScene
from solver import Insertion, Solution, Status, VesselWall, relax

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Setting:
    """How the solver is asked; the names are those of ``solver.Insertion``."""

    segment_mm: float
    method: str = "newton"
    hull: str = "offset"
    quadrature: str = "tip"
    tolerance: float = 1e-9
    max_iterations: int = 200
    initial: str = "slide"


@dataclass(frozen=True, eq=False)
class Run:
    """The wire at the end, and the sums over all depths.

    reached : the whole depth, every step converged.     work : sums of the solver's counters.
    steps : depths asked for.     energies (steps,) : after each of them.
    """

    joints_mm: Array
    arcs_mm: Array
    depth_mm: float
    energy_N_mm: float
    status: Status
    reached: bool
    iterations: int
    steps: int
    energies: Array
    work: dict[str, float]

    @property
    def sentence(self) -> str:
        """The last status in words."""
        return self.status.value


def insert(scene: BenchScene, setting: Setting, wall: VesselWall | None = None) -> Run:
    """Push the scene's wire in. wall : made already (it costs more than an insertion)."""
    wall = scene.wall(setting.hull) if wall is None else wall
    solutions = list(_solutions(scene, setting, wall))
    last = solutions[-1]
    work: Counter[str] = Counter()
    for solution in solutions:
        work.update(solution.work)
    arcs = scene.wire(setting.segment_mm).arcs_at(last.depth_mm)
    return Run(
        last.joints_mm,
        np.asarray(arcs),
        last.depth_mm,
        last.energy_N_mm,
        last.status,
        all(s.converged for s in solutions) and abs(last.depth_mm - scene.depth_mm) < 1e-6,
        sum(s.iterations for s in solutions),
        len(solutions),
        np.array([s.energy_N_mm for s in solutions]),
        dict(work),
    )


def _solutions(scene: BenchScene, setting: Setting, wall: VesselWall | None) -> Any:
    wire = scene.wire(setting.segment_mm)
    if wall is None:
        return [_bent(scene, setting)]
    insertion = Insertion(
        wire, wall, scene.entry_mm, scene.direction, setting.method, setting.initial, scene.material_axis,
        tolerance=setting.tolerance, max_iterations=setting.max_iterations, step_mm=scene.step_mm,
        quadrature=setting.quadrature,
    )  # fmt: skip
    return insertion.to_depths(scene.depths(), roll_deg=scene.roll_deg)


def _bent(scene: BenchScene, setting: Setting) -> Solution:
    """A free wire is bent by its dead load at once."""
    return relax(
        scene.wire(setting.segment_mm), None, depth_mm=scene.depth_mm, entry_mm=scene.entry_mm,
        entry_direction=scene.direction, material_axis=scene.material_axis, roll_deg=scene.roll_deg,
        load_N=scene.load_N, method=setting.method, tolerance=setting.tolerance,
        max_iterations=setting.max_iterations,
    )  # fmt: skip
