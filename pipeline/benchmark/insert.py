"""One insertion of one scene with one setting, and what it cost."""

import statistics
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter, process_time
from typing import TypeVar

from pipeline.benchmark.scenes import BenchScene
from pipeline.model import Array
from solver import Insertion, Solution, VesselWall

Result = TypeVar("Result")

LONG_S = 2.0
"""Work longer than this is timed once: its own length averages the noise."""


@dataclass(frozen=True)
class SolverSetting:
    """Settings of the solver; the names are those of ``solver.Insertion``."""

    segment_mm: float
    method: str = "newton"
    hull: str = "offset"
    quadrature: str = "tip"
    tolerance: float = 1e-9
    max_iterations: int = 200


@dataclass(frozen=True, eq=False)
class Run:
    """The wire at the end, and the sums over all depths.

    last : the solution at the last depth.     arcs_mm : (joints + 1,), where its joints lie along the wire.
    reached : the whole depth, every step converged.     steps : depths asked for.
    work : sums of the solver's counters.
    """

    last: Solution
    arcs_mm: Array
    reached: bool
    steps: int
    iterations: int
    work: dict[str, float]


def insert(scene: BenchScene, setting: SolverSetting, wall: VesselWall | None = None) -> Run:
    """Push the scene's wire in; a free wire, whose one step is its length, is bent by its dead load at once.

    wall : one that is made already, since making it costs more than an insertion.
    """
    wall = scene.wall(setting.hull) if wall is None else wall
    wire = scene.wire(setting.segment_mm)
    insertion = Insertion(
        wire, wall, scene.entry_mm, scene.direction, setting.method, material_axis=scene.material_axis,
        tolerance=setting.tolerance, max_iterations=setting.max_iterations, step_mm=scene.step_mm,
        quadrature=setting.quadrature, tip_load_N=scene.load_N,
    )  # fmt: skip
    solutions = list(insertion.to_depths(scene.depths(), roll_deg=scene.roll_deg))
    last, work = solutions[-1], Counter[str]()
    for solution in solutions:
        work.update(solution.work)
    reached = all(s.converged for s in solutions) and abs(last.depth_mm - scene.depth_mm) < 1e-6
    iterations = sum(s.iterations for s in solutions)
    return Run(last, wire.arcs_at(last.depth_mm), reached, len(solutions), iterations, dict(work))


def timed(work: Callable[[], Result], repeats: int = 3) -> tuple[float, Result]:
    """Median seconds of processor time over the repeats, and the last result.

    Not wall-clock time: all that is measured here runs in one thread, and a busy machine would be measured along.
    """
    seconds: list[float] = []
    for _ in range(repeats):
        start, wall = process_time(), perf_counter()
        result = work()
        seconds.append(process_time() - start)
        if perf_counter() - wall > LONG_S:
            break
    return statistics.median(seconds), result
