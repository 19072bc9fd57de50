"""The stress study: a random part of it by default, the whole of it as a slow test; and its own judges on trial."""

from __future__ import annotations

import math
import os
import signal
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipeline.benchmark.stress import run as study
from pipeline.benchmark.stress import scene_run
from pipeline.benchmark.stress.axes import AXES, draw
from pipeline.benchmark.stress.lumens import NEAR, changes_vessel, near_vessels
from pipeline.benchmark.stress.plan import ScenePlan, lumen_grid, placement
from pipeline.benchmark.stress.rubbing import RUBBING_MM, made_energy
from pipeline.benchmark.stress.run import run_isolated, run_stress, stress_table
from pipeline.benchmark.stress.scene_run import SceneOutcome, build, run_plan, run_scene, solve
from pipeline.benchmark.stress.statics import StaticChain, assemble
from pipeline.benchmark.stress.verdict import _strays, judge
from solver import Grid, Solution, relax
from tests.later import later

SEED = 400
SAMPLE = 100
SECONDS = 8.0


@pytest.mark.slow  # a minute; `make stress` judges them all
def test_a_random_part_of_the_scenes_ends_as_it_may() -> None:
    run_scene(SEED, 3)  # compiles, on nobody's clock
    stop = time.perf_counter() + SECONDS
    chosen = np.random.default_rng(1).choice(5000, SAMPLE, replace=False).tolist()
    # a slow machine sees fewer of them, never fewer than ten
    done = [run_scene(SEED, i) for n, i in enumerate(chosen) if n < 10 or time.perf_counter() < stop]
    faults = [outcome for outcome in done if outcome.fault]
    assert not faults, faults


@pytest.mark.slow
def test_all_scenes_end_as_they_may(tmp_path: Path) -> None:
    rows = run_stress(tmp_path / "scenes.csv", SEED, range(5000), print, min(2, os.cpu_count() or 1))
    faults = rows[rows["fault"] != ""]
    assert faults.empty, faults[["index", "axes", "fault", "detail"]].to_string()


def test_a_wall_in_another_unit_is_warned_of_and_a_noisy_one_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lumens of two voxels in noise were to warn of nothing, and with them no wall warned any more."""
    build(replace(ScenePlan(SEED, 0), noise_mm=0.8))
    monkeypatch.setattr(scene_run, "lumen_grid", lambda plan: in_quarters(lumen_grid(plan)))
    with pytest.warns(UserWarning, match=r"it changes by 3\.9 per mm"):
        build(ScenePlan(SEED, 0))


def in_quarters(grid: Grid) -> Grid:
    """In voxels of a quarter of a millimetre."""
    return grid.with_values(4.0 * np.asarray(grid.values))


# called converged with a moment left (closed form, and Newton on a wall of 7e5 N/mm²), or without an end
ONCE_WRONG = [(200, 181), (200, 199), (200, 277), (200, 390), (100, 149), (100, 474), (100, 887), (100, 86), (100, 124)]
# held off the wall by friction that was gone with the load; past the ridge of a septum, where rounding hid the lumen
ONCE_WRONG_OF_27 = [(11, 269), (400, 241), (1712, 557)]


@pytest.mark.parametrize(
    ("seed", "index", "axes"),
    [*((*s, 25) for s in ONCE_WRONG[1:8]), *((*s, 27) for s in ONCE_WRONG_OF_27[1:])]
    # the two slowest of nine, and one of three that friction held off the wall
    + later(*((*s, 25) for s in (ONCE_WRONG[0], ONCE_WRONG[8])), (*ONCE_WRONG_OF_27[0], 27)),
)
def test_scenes_that_were_once_wrong(seed: int, index: int, axes: int) -> None:
    """axes : how many there were then; a seed stands for their order, too."""
    outcome = run_plan(draw(seed, index, list(AXES)[:axes]))
    assert not outcome.fault, outcome
    assert outcome.seconds < 30.0


def test_scenes_are_the_same_in_any_order_and_cover_every_axis() -> None:
    again = [draw(SEED, i) for i in (40, 7)]
    assert repr(again[1]) == repr(draw(SEED, 7))
    assert repr(again[0]) != repr(again[1])
    firsts = {draw(SEED, i).axes[0] for i in range(len(AXES))}
    assert firsts == set(AXES)
    ranges = [draw(SEED, i) for i in range(0, 400)]
    assert min(p.segment_mm for p in ranges) < 0.2
    assert max(p.joints for p in ranges) > 1000
    assert max(p.wall_stiffness for p in ranges) > 1e5
    assert max(max(abs(r) for r in p.rolls) for p in ranges) > 3000.0


def test_rubbing_goes_in_and_out_again_with_friction_as_wires_have_it() -> None:
    plan = ScenePlan(0, 0, way="relax", joints=300, depths=[20.0], rolls=[0.0, 5.0], lumen_mm=1.0)
    found = [AXES["rubbing"](plan, np.random.default_rng(seed)) for seed in range(200)]
    friction = np.array([one["friction"] for one in found])
    assert 0.0 < friction.min() < 0.02 < 0.48 < friction.max() < 0.5
    for one in found:
        way = np.array(one["depths"])
        deepest = int(np.argmax(way))
        np.testing.assert_allclose(np.diff(way[: deepest + 1]), np.diff(RUBBING_MM))
        np.testing.assert_array_equal(way, way[::-1])
        assert (one["way"], one["joints"], one["rolls"]) == ("insertion", 200, [0.0])
        assert 0.3 <= (way[0] - RUBBING_MM[0]) / plan.length_mm <= 0.9


def _solved(**changes: Any) -> tuple[ScenePlan, Any, Any, Any]:
    plan = ScenePlan(0, 0, way="relax", joints=20, depths=[20.0], rolls=[0.0], lumen_mm=1.0, tilt_deg=20.0)
    for name, value in changes.items():
        setattr(plan, name, value)
    wire, wall = build(plan)
    return plan, wire, wall, solve(plan, wire, wall)[0]


def test_a_sound_solution_passes() -> None:
    plan, wire, wall, (solution, start) = _solved()
    assert solution.converged
    assert start > solution.energy_N_mm > 0.0
    verdict = judge(plan, wire, wall, solution, start, True)
    assert not verdict.fault
    assert verdict.residual < 1e-5


@pytest.mark.parametrize(
    ("fault", "spoil"),
    [
        ("nan", lambda s: replace(s, push_force_N=float("nan"))),
        ("stretched", lambda s: replace(s, joints_mm=s.joints_mm * (1 + 1e-9))),
        ("wrong_energy", lambda s: replace(s, energy_N_mm=s.energy_N_mm * 0.999)),
        ("energy_rose", lambda s: replace(s, energy_N_mm=1e9)),
    ],
)
def test_the_judge_sees(fault: str, spoil: Any) -> None:
    plan, wire, wall, (solution, start) = _solved()
    assert judge(plan, wire, wall, spoil(solution), start, False).fault == fault


def _rubbing(**changes: Any) -> tuple[ScenePlan, Any, Any, list[Any]]:
    """A curved wire that rubs through a bend, 1.75 mm in small steps and out again."""
    depths = [*(20.0 + RUBBING_MM), *(20.0 + RUBBING_MM[-2::-1])]
    plan = ScenePlan(0, 0, lumen="bend", friction=0.3, rolls=[0.0] * 15, depths=depths, rest=[[0.0, 0.05]])
    for name, value in changes.items():
        setattr(plan, name, value)
    wire, wall = build(plan)
    return plan, wire, wall, [solution for solution, _ in solve(plan, wire, wall)]


def test_friction_that_keeps_its_law_passes() -> None:
    plan, wire, wall, found = _rubbing()
    verdicts = [judge(plan, wire, wall, s, math.nan, False) for s in found]
    assert not any(v.fault for v in verdicts), verdicts
    assert 0.0 < max(v.residual for v in verdicts) < 1e-4
    assert max(float(np.abs(s.contact_force_N).sum()) for s in found) > 0.01
    assert not made_energy(plan, found)
    # friction acts a radius from the axis: without that lever the moments do not balance
    chain, solution = assemble(wire, wall, found[6].depth_mm), found[6]
    gradient, elastic = chain.moments(solution.joints_mm, solution.frames, solution.contact_force_N)
    assert np.abs(gradient).max() > 1e-3 * np.abs(elastic).max()


def test_the_judge_sees_friction_that_breaks_its_law() -> None:
    plan, wire, wall, found = _rubbing()
    # a coefficient that is a tenth less than the wire's own
    assert judge(replace(plan, friction=0.27), wire, wall, found[6], math.nan, False).fault == "friction"
    cheap = [replace(s, push_force_N=s.push_force_N - 0.3 * np.sign(b - a) * abs(s.push_force_N))
             for s, a, b in zip(found, [0.0, *plan.depths], plan.depths, strict=False)]  # fmt: skip
    assert made_energy(plan, cheap)
    assert made_energy(plan, [replace(s, friction_energy_N_mm=-1e-6) for s in found])


@pytest.mark.parametrize("lumen", NEAR)
def test_the_judge_sees_a_wire_in_the_other_vessel(lumen: str) -> None:
    """Straight through the septum, judged where the scene has one, and where the entry is in the other vessel."""
    plan = ScenePlan(0, 0, lumen=lumen, lumen_mm=1.2, septum_mm=0.6, voxel_mm=(0.3, 0.3, 0.3), turned=True, far_mm=1e3)
    turn, shift = placement(plan)
    own = np.column_stack([np.zeros((31, 2)), np.arange(31.0)])
    across = own + np.where(own[:, 2:] < 8.0, 0.0, 3.0) * np.array([1.0, 0.0, 0.0])

    def seen(joints: Any) -> str:
        return _strays(plan, SimpleNamespace(joints_mm=joints @ turn.T + shift, converged=True))  # type: ignore[arg-type]

    assert "different vessels" in seen(across[:16])
    assert not seen(own[:8])
    # on the ridge, and not beyond it
    assert not seen(own[:8] + np.array([1.5, 0.0, 0.0]))


def test_round_a_u_turn_is_no_other_vessel() -> None:
    angle = np.linspace(0.0, np.pi, 12)
    turn = np.column_stack([1.5 - 1.5 * np.cos(angle), 0 * angle, 20.0 + 1.5 * np.sin(angle)])
    up = np.column_stack([np.zeros((19, 2)), np.arange(1.0, 20.0)])
    joints = np.concatenate([up, turn, up[::-1] + np.array([3.0, 0.0, 0.0])])
    assert not changes_vessel("u_turn", joints, near_vessels("u_turn", joints, 1.2, 0.6), 0.3)
    # 1.5 mm behind its edge a carina may be cut, 4 mm behind it no more
    for edge, wrong in ((1, False), (4, True)):
        short = np.concatenate([up[: 19 - edge], up[: 19 - edge][::-1] + np.array([3.0, 0.0, 0.0])])
        assert bool(changes_vessel("u_turn", short, near_vessels("u_turn", short, 1.2, 0.6), 0.3)) == wrong


def test_scenes_with_a_septum_tempt_the_wire() -> None:
    """Some wires try the wall, most do not, and the walls are of 0 to 4 voxels."""
    chosen = [plan for plan in (draw(SEED, i) for i in range(2000)) if plan.axes == ("septum",)]
    share = [plan.septum_mm / plan.voxel_mm[0] for plan in chosen]
    assert {plan.lumen for plan in chosen} == set(NEAR)
    assert min(share) < 1.0
    assert max(share) > 3.0
    outcomes = [run_plan(plan) for plan in chosen]
    assert {"converged", "through_wall"} <= {outcome.outcome for outcome in outcomes}
    assert not any(outcome.fault for outcome in outcomes)


def test_every_relaxation_of_an_insertion_knows_its_start() -> None:
    plan, wire, wall, _ = _solved()
    plan.way, plan.depths, plan.rolls = "insertion", [4.0, 14.0, 20.0, 9.0], [0.0, 0.0, 40.0, 40.0]
    pairs = solve(plan, wire, wall)
    assert all(start >= solution.energy_N_mm > 0.0 for solution, start in pairs)
    # so early that the step before foresees little of this one
    assert pairs[0][1] > 1.1 * pairs[0][0].energy_N_mm
    solution, start = pairs[2]
    risen = replace(solution, energy_N_mm=start * (1 + 1e-6))
    assert judge(plan, wire, wall, risen, start, False).fault == "energy_rose"


def _bent(chain: StaticChain, solution: Solution) -> Solution:
    """The solution with one joint turned by 0.01 rad, and the energy of that."""
    angles = chain.angles(solution.frames)
    angles[5, 0] += 0.01
    nodes, frames = chain.roll_out(angles, solution.joints_mm[0], solution.frames[0])
    return replace(solution, joints_mm=nodes, frames=frames, energy_N_mm=chain.energy(nodes, frames))


def test_the_judge_sees_a_wire_that_is_not_at_rest() -> None:
    plan, wire, wall, (solution, _) = _solved()
    chain = assemble(wire, wall, 20.0)
    assert judge(plan, wire, wall, _bent(chain, solution), float("nan"), False).fault == "not_at_rest"


def test_the_judge_sees_a_free_wire_that_is_not_at_rest() -> None:
    """Without a wall rounding causes no moment that could excuse it."""
    plan = ScenePlan(0, 0, way="relax", wall=False, joints=20, depths=[20.0], rolls=[0.0])
    plan.stiffness, plan.load_N = [[0.0, 10.0]], (0.001, 0.0, 0.0)
    wire, _ = build(plan)
    solution = relax(wire, None, depth_mm=20.0, load_N=plan.load_N)
    chain = assemble(wire, None, 20.0, plan.load_N)
    assert not judge(plan, wire, None, solution, float("nan"), False).fault
    assert judge(plan, wire, None, _bent(chain, solution), float("nan"), False).fault == "not_at_rest"


def test_the_judge_sees_a_saddle() -> None:
    """A straight column under four times its buckling load is at rest, and no minimum."""
    plan = ScenePlan(0, 0, way="relax", wall=False, joints=20, depths=[20.0], rolls=[0.0])
    plan.stiffness = [[0.0, 10.0]]
    wire, _ = build(plan)
    force = 4 * np.pi**2 * 10.0 / (4 * 20.0**2)
    plan.load_N = (0.0, 0.0, -force)
    unloaded = relax(wire, None, depth_mm=20.0)
    chain = assemble(wire, None, 20.0, plan.load_N)
    energy = chain.energy(unloaded.joints_mm, unloaded.frames)
    column = replace(unloaded, energy_N_mm=energy)
    assert judge(plan, wire, None, column, float("nan"), True).fault == "no_minimum"
    assert not judge(plan, wire, None, column, float("nan"), False).fault


def _crashes(seed: int, index: int) -> SceneOutcome:
    if index == 1:
        os._exit(3)
    if index == 2:
        time.sleep(60.0)
    if index == 4:
        os.kill(os.getpid(), signal.SIGKILL)
    if index == 5:
        msg = "no such scene"
        raise KeyError(msg)
    if index == 3:
        stop = time.perf_counter() + 60.0
        while time.perf_counter() < stop:
            pass
    return SceneOutcome(index, ("roll",), "converged")


@pytest.mark.slow
def test_crash_and_hang_cost_themselves_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "run_scene", _crashes)
    done = list(run_isolated(0, [0, 1, 0, 2, 3, 4, 5, 0], limit_s=0.5))
    assert [d.outcome for d in done[:5]] == ["converged", "crash", "converged", "hang", "hang"]
    assert [d.outcome for d in done[5:]] == ["crash", "crash", "converged"]
    assert "exit code 3" in done[1].detail
    assert "no answer within 5 s" in done[3].detail
    assert "0.5 s of processor time" in done[4].detail
    assert "exit code -9" in done[5].detail
    assert "KeyError: 'no such scene'" in done[6].detail


def test_the_table_counts_every_scene_at_each_of_its_axes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(
        "pipeline.benchmark.stress.run.run_isolated",
        lambda *_: [
            SceneOutcome(0, ("roll", "hull"), "converged", iterations=4),
            SceneOutcome(1, ("roll",), "crash", "crash"),
        ],
    )
    table = stress_table(run_stress(tmp_path / "scenes.csv", 0, range(2), print))
    found = {(row.axis, row.outcome): row.count for row in table.itertuples(index=False)}
    assert dict(zip(table["axis"] + " " + table["outcome"], table["count"], strict=True)) == {
        "all converged": 1, "all CRASH": 1, "roll converged": 1, "hull converged": 1, "roll CRASH": 1,
    }  # fmt: skip
    assert len(found) == 5


def test_a_study_that_was_broken_off_goes_on_where_it_stopped(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    ran: list[int] = []
    stop = [2]

    def runs(_: int, indices: Any, *__: Any) -> Any:
        for index in indices:
            if index in stop:
                stop.clear()
                raise KeyboardInterrupt
            ran.append(index)
            yield SceneOutcome(
                index,
                ("roll", "hull"),
                "converged",
                "",
                'a "word", and\na line',
                residual=[1e-7 / 3, math.nan][index % 2],
            )

    monkeypatch.setattr("pipeline.benchmark.stress.run.run_isolated", runs)
    path = tmp_path / "scenes.csv"
    with pytest.raises(KeyboardInterrupt):
        run_stress(path, 5, range(4), print)
    with path.open("a", encoding="utf-8") as file:
        file.write('2,"roll hull",conv')
    rows = run_stress(path, 5, range(4), print)
    assert ran == [0, 1, 2, 3]
    assert list(rows["index"]) == [0, 1, 2, 3]
    whole = run_stress(tmp_path / "again.csv", 5, range(4), print)
    pd.testing.assert_frame_equal(rows, whole, check_dtype=False)
    # the table that the study leaves is one to go on from, too
    rows.to_csv(path, index=False)
    pd.testing.assert_frame_equal(run_stress(path, 5, range(4), print), whole, check_dtype=False)
    # rows of another seed, or of another solver, are no rows of this study
    assert ran == [0, 1, 2, 3] * 2
    run_stress(path, 6, range(4), print)
    monkeypatch.setattr("pipeline.benchmark.stress.run.version", lambda: "other")
    run_stress(path, 6, range(4), print)
    assert ran == [0, 1, 2, 3] * 4
