"""Run one plan and judge every depth of it."""

from __future__ import annotations

from dataclasses import dataclass
from time import process_time

import numpy as np

from pipeline.benchmark import statics
from pipeline.benchmark.stress.judge import Verdict, judge, tip_load
from pipeline.benchmark.stress.lumens import entry, lumen_grid
from pipeline.benchmark.stress.plan import Plan, draw
from solver import GuideWire, Insertion, Solution, Status, VesselWall, relax

DEEP_EVERY = 3
"""Every third scene is also searched for a way down, which costs more than solving it."""


@dataclass(frozen=True)
class Outcome:
    """How one scene ended.

    outcome : converged, refused, a status identifier.     fault : empty if that is sound.     seconds : of processor
    time for all depths, judging excluded.
    """

    index: int
    axes: tuple[str, ...]
    outcome: str
    fault: str = ""
    detail: str = ""
    iterations: int = 0
    depths: int = 0
    depths_converged: int = 0
    residual: float = float("nan")
    stretch: float = float("nan")
    seconds: float = 0.0


def run_scene(seed: int, index: int) -> Outcome:
    """Build, run and judge scene ``index``; an exception other than a well-formed refusal is a fault."""
    plan = draw(seed, index)
    clock = process_time()
    try:
        wire, wall = build(plan)
        results = solve(plan, wire, wall)
    except ValueError as error:
        return _refused(plan, str(error), process_time() - clock)
    except Exception as error:  # a study of crashes must survive them
        text = f"{type(error).__name__}: {error}"
        return Outcome(index, plan.axes, "exception", "exception", text, seconds=process_time() - clock)
    seconds = process_time() - clock
    verdicts = [judge(plan, wire, wall, s, e, index % DEEP_EVERY == 0) for s, e in results]
    return _outcome(plan, [s for s, _ in results], verdicts, seconds)


def build(plan: Plan) -> tuple[GuideWire, VesselWall | None]:
    """The plan's wire and wall; ValueError where they refuse it."""
    wire = GuideWire(plan.segment_mm, plan.radius_mm, plan.stiffness, plan.rest, plan.torsion)
    if not plan.wall:
        return wire, None
    return wire, VesselWall(lumen_grid(plan), plan.wall_stiffness, plan.friction, plan.hull)


def solve(plan: Plan, wire: GuideWire, wall: VesselWall | None) -> list[tuple[Solution, float]]:
    """Solutions, each with the energy that its last relaxation started from."""
    at, direction, axis = entry(plan)
    if plan.way == "relax":
        return [_relaxed(plan, wire, wall)]
    insertion = Insertion(
        wire, wall, at, direction, plan.method, plan.initial, axis,
        max_iterations=plan.max_iterations, step_mm=plan.step_mm, quadrature=plan.quadrature, tip_load_N=plan.load_N,
    )  # fmt: skip
    found = insertion.to_depths(plan.depths, roll_deg=plan.rolls)
    return [(s, s.work["start_energy_N_mm"]) for s in found]


def _relaxed(plan: Plan, wire: GuideWire, wall: VesselWall | None) -> tuple[Solution, float]:
    at, direction, axis = entry(plan)
    start = None if plan.start is None else plan.start + at
    solution = relax(
        wire, wall, depth_mm=plan.depths[0], entry_mm=at, entry_direction=direction, material_axis=axis,
        roll_deg=plan.rolls[0], start_mm=start, load_N=plan.load_N if any(plan.load_N) else None,
        method=plan.method, max_iterations=plan.max_iterations, quadrature=plan.quadrature,
    )  # fmt: skip
    # the second assembly where it knows the start, else what the solver says of it
    known = plan.start is None and (plan.quadrature == "joints" or wall is None) and plan.friction == 0.0
    before = solution.work["start_energy_N_mm"]
    return solution, _straight_energy(plan, wire, wall, solution) if known else before


def _straight_energy(plan: Plan, wire: GuideWire, wall: VesselWall | None, solution: Solution) -> float:
    """Energy of the wire laid straight along the entry direction."""
    joints = statics.joints_of(wire, plan.depths[0])
    angle = np.zeros((len(joints.length), 3))
    angle[:, 1] = -joints.rest
    nodes, frames = statics.roll_out(joints, angle, solution.joints_mm[0], solution.frames[0])
    forces = statics.wall_forces(wall, wire, joints, nodes, frames)
    return statics.energy_of(joints, frames, forces.energy, nodes, tip_load(plan, len(joints.length)))


def _refused(plan: Plan, message: str, seconds: float) -> Outcome:
    """A refusal is sound if it says what, got what, what is allowed and what to do."""
    sound = "got " in message and message.count(";") >= 2 and len(message) > 30
    fault = "" if sound else "bad_message"
    return Outcome(plan.index, plan.axes, "refused", fault, message, seconds=seconds)


def _outcome(plan: Plan, solutions: list[Solution], verdicts: list[Verdict], seconds: float) -> Outcome:
    bad = next((v for v in verdicts if v.fault), None)
    ends = [s.status for s in solutions]
    failed = [s for s in ends if s is not Status.CONVERGED]
    name = failed[-1].identifier if failed else "converged"
    residual = [v.residual for v in verdicts if np.isfinite(v.residual)]
    stretch = [v.stretch for v in verdicts if np.isfinite(v.stretch)]
    return Outcome(
        plan.index,
        plan.axes,
        name,
        bad.fault if bad else "",
        bad.detail if bad else (failed[-1].value if failed else ""),
        sum(s.iterations for s in solutions),
        len(ends),
        len(ends) - len(failed),
        max(residual, default=float("nan")),
        max(stretch, default=float("nan")),
        seconds,
    )
