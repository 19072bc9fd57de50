"""Run one plan and judge every depth of it."""

import warnings
from dataclasses import dataclass
from time import process_time

import numpy as np

from pipeline.benchmark.stress.axes import draw
from pipeline.benchmark.stress.plan import ScenePlan, entry, lumen_grid
from pipeline.benchmark.stress.rubbing import made_energy
from pipeline.benchmark.stress.statics import assemble
from pipeline.benchmark.stress.verdict import SceneVerdict, judge
from solver import GuideWire, Insertion, Solution, Status, VesselWall, relax

DEEP_EVERY = 3
"""Every third scene is also searched for a way down, which costs more than solving it."""

STEEP_NOISE = 0.5
"""Noise of distances, in voxels, that makes them steep by itself: by 1.8 to 3 per mm in 13 scenes of 2,800 (seed 1500),
with 0.8 voxel or more each. Without noise a steep wall is in another unit."""


@dataclass(frozen=True)
class SceneOutcome:
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
    residual: float = float("nan")
    stretch: float = float("nan")
    seconds: float = 0.0


def run_scene(seed: int, index: int) -> SceneOutcome:
    """Run scene ``index`` of the study ``seed``."""
    return run_plan(draw(seed, index))


def run_plan(plan: ScenePlan) -> SceneOutcome:
    """Build, run and judge a scene; an exception other than a well-formed refusal is a fault."""
    index = plan.index
    clock = process_time()
    try:
        wire, wall = build(plan)
        results = solve(plan, wire, wall)
    except ValueError as error:
        # a refusal is sound if it says what, got what, what is allowed and what to do
        sound = "got " in str(error) and str(error).count(";") >= 2 and len(str(error)) > 30
        outcome, fault, detail = "refused", "" if sound else "bad_message", str(error)
    except Exception as error:  # a study of crashes must survive them
        outcome, fault, detail = "exception", "exception", f"{type(error).__name__}: {error}"
    else:
        seconds = process_time() - clock
        verdicts = [judge(plan, wire, wall, s, e, index % DEEP_EVERY == 0) for s, e in results]
        if text := made_energy(plan, [s for s, _ in results]):
            verdicts.append(SceneVerdict("made_energy", text))
        return _outcome(plan, [s for s, _ in results], verdicts, seconds)
    return SceneOutcome(index, plan.axes, outcome, fault, detail, seconds=process_time() - clock)


def build(plan: ScenePlan) -> tuple[GuideWire, VesselWall | None]:
    """The plan's wire and wall; ValueError where they refuse it."""
    wire = GuideWire(plan.segment_mm, plan.radius_mm, plan.stiffness, plan.rest, plan.torsion)
    if not plan.wall:
        return wire, None
    with warnings.catch_warnings():
        # a lumen of a voxel, or of none, is a scene like another, and one with walls that end right beyond it
        warnings.filterwarnings("ignore", "wall: distance: (the least value|it is cut off)")
        if plan.noise_mm > STEEP_NOISE * min(plan.voxel_mm):
            warnings.filterwarnings("ignore", "wall: distance: it changes by")
        return wire, VesselWall(lumen_grid(plan), plan.wall_stiffness, plan.friction, plan.hull)


def solve(plan: ScenePlan, wire: GuideWire, wall: VesselWall | None) -> list[tuple[Solution, float]]:
    """Solutions, each with the energy that its last relaxation started from."""
    at, direction, axis = entry(plan)
    if plan.way == "insertion":
        insertion = Insertion(
            wire, wall, at, direction, plan.method, plan.initial, axis, max_iterations=plan.max_iterations,
            step_mm=plan.step_mm, quadrature=plan.quadrature, tip_load_N=plan.load_N,
        )  # fmt: skip
        found = list(insertion.to_depths(plan.depths, roll_deg=plan.rolls))
    else:
        start = None if plan.start is None else plan.start + at
        found = [
            relax(
                wire, wall, depth_mm=plan.depths[0], entry_mm=at, entry_direction=direction, material_axis=axis,
                roll_deg=plan.rolls[0], start_mm=start, load_N=plan.load_N if any(plan.load_N) else None,
                method=plan.method, max_iterations=plan.max_iterations, quadrature=plan.quadrature,
            )
        ]  # fmt: skip
        if start is None and (plan.quadrature == "joints" or wall is None) and plan.friction == 0.0:
            return [(found[0], _straight_energy(plan, wire, wall, found[0]))]
    return [(s, s.work["start_energy_N_mm"]) for s in found]


def _straight_energy(plan: ScenePlan, wire: GuideWire, wall: VesselWall | None, solution: Solution) -> float:
    """Energy of the wire laid straight along the entry direction, by the second assembly."""
    chain = assemble(wire, wall, plan.depths[0], plan.load_N)
    angles = np.zeros((len(chain.length), 3))
    angles[:, 1] = -chain.rest
    return chain.energy(*chain.roll_out(angles, solution.joints_mm[0], solution.frames[0]))


def _outcome(plan: ScenePlan, solutions: list[Solution], verdicts: list[SceneVerdict], seconds: float) -> SceneOutcome:
    """The first fault, the last status that is not "converged", and the worst of what was measured."""
    bad = next((v for v in verdicts if v.fault), None)
    failed = [s.status for s in solutions if s.status is not Status.CONVERGED]
    return SceneOutcome(
        plan.index,
        plan.axes,
        failed[-1].identifier if failed else "converged",
        bad.fault if bad else "",
        bad.detail if bad else (failed[-1].value if failed else ""),
        iterations=sum(s.iterations for s in solutions),
        depths=len(solutions),
        residual=max((v.residual for v in verdicts if np.isfinite(v.residual)), default=float("nan")),
        stretch=max((v.stretch for v in verdicts if np.isfinite(v.stretch)), default=float("nan")),
        seconds=seconds,
    )
