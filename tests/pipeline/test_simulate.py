"""The stage between manifest and solver: scales, rolls, conventions of section 4 of the manifest."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from pipeline.cli import main
from pipeline.model import Clamp, Lumen, OverWire
from pipeline.run.cache import Store
from pipeline.run.log import Log
from pipeline.run.stages.covered import along, too_thick
from pipeline.run.stages.known import Context, Frame, Known
from pipeline.run.stages.load import each_frame
from pipeline.run.stages.simulate import _doubtful, _pressed_deep, judged
from pipeline.run.stages.turned_back import turned_back
from pipeline.simulate import altered, guide_wire, insertion_of, resolution
from pipeline.simulate.config import SimulateConfig, SolverConfig
from pipeline.study.manifest import Case, ManifestError, read_manifest
from pipeline.study.settings import Config
from solver import GuideWire, Insertion, Solution, VesselWall
from solver.grid import Grid

MANIFEST = """
schema = 1
[wires.w]
radius_mm = 0.18
bending_stiffness_N_mm2 = [[0.0, 1.0], [10.0, 3.0]]
rest_curvature_per_mm = [[0.0, 0.1], [8.0, 0.1], [8.0, 0.0]]
[[case]]
id = "tube"
lumen = "none.stl"
entry_mm = [0.0, 0.0, 0.0]
entry_direction = [0.0, 0.0, 1.0]
material_axis = [1.0, 0.0, 0.0]
wire = "w"
insertion_mm = [6.0, 12.0]
"""


@pytest.fixture
def case(tmp_path: Path) -> Case:
    path = tmp_path / "manifest.toml"
    path.write_text(MANIFEST, encoding="utf-8")
    return read_manifest(path).cases[0]


def wide_open() -> Lumen:
    """Space without a wall nearby: the rest shape shows."""
    grid = Grid(np.full((20, 20, 20), -30.0, np.float32), np.full(3, 2.0), np.full(3, -19.0))
    return Lumen(grid)


def test_what_the_solver_doubts_of_a_lumen_is_a_warning_of_the_case(case: Case) -> None:
    """It was a UserWarning of Python on the terminal, with a path and a line of code."""
    axis = np.linspace(-3.0, 3.0, 21)
    across = np.hypot(*np.meshgrid(axis, axis, indexing="ij")) - 1.5
    tube = Grid(np.repeat(2.0 * across[..., None], 21, axis=2), [0.3] * 3, [-3.0, -3.0, 0.0])
    known = Known(lumen=Lumen(tube), clamp=Clamp(np.zeros(3), np.array([0.0, 0.0, 1.0])))
    (said,) = _doubtful(Context(case, Config(), Store(None), Log(lambda *_: None)), known, [])
    assert re.match(r"simulate: the lumen's signed distance: it changes by 2 per mm", said)


def run(case: Case, roll: float, depths: tuple[float, ...] = (6.0, 12.0)) -> list[Solution]:
    clamp = Clamp(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array(case.material_axis))
    insertion = insertion_of(case.wire, case.wall, wide_open(), clamp, SolverConfig(segment_mm=0.5))
    return list(insertion.to_depths(depths, roll))


def test_a_study_can_give_the_wire_a_weight(case: Case) -> None:
    """Sag of a free tip of 12 mm under its weight, beside what its hook does; beam theory to 1 %."""
    heavy = replace(case.wire, weight_N_per_mm=1e-5, rest_curvature_per_mm=0.0, bending_stiffness_N_mm2=0.6)
    clamp = Clamp(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array(case.material_axis), np.array([0.0, 2.0, 0.0]))
    insertion = insertion_of(heavy, case.wall, wide_open(), clamp, SolverConfig(segment_mm=0.5))
    last = list(insertion.to_depths([12.0]))[-1]
    assert last.joints_mm[-1, 1] == pytest.approx(1e-5 * 12.0**4 / (8 * 0.6), rel=0.01)


STUDY = MANIFEST.replace("none.stl", "tube.swc").replace("6.0, 12.0", "10.0, 10.0, 14.0")
CATHETER = "catheter = {bending_stiffness_N_mm2 = 50.0, radius_mm = 0.9, insertion_mm = [0.0, 9.0, 4.0]}\n"


@pytest.mark.slow
def test_a_catheter_is_a_key_of_the_case(tmp_path: Path) -> None:
    """From the manifest through check and run: it straightens the second frame and, drawn back, lets the third bend."""
    (tmp_path / "tube.swc").write_text("1 0 0 0 -5 6 -1\n2 0 0 0 25 6 1\n", encoding="utf-8")
    path, tips = tmp_path / "manifest.toml", {}
    for name, text in (("bare", STUDY), ("over", STUDY + CATHETER)):
        path.write_text(text, encoding="utf-8")
        assert main(["check", str(path)]) == 0
        assert main(["run", str(path), "-o", str(tmp_path / name), "--set", "solver.segment_mm=0.5"]) == 0
        with h5py.File(next((tmp_path / name).rglob("frames.h5"))) as file:
            tips[name] = [np.asarray(file[f"frames/{n:03d}/simulated_mm"])[-1] for n in range(3)]
    np.testing.assert_allclose(tips["over"][0], tips["bare"][0], rtol=0.0, atol=1e-6)
    assert np.hypot(*tips["over"][1][:2]) < 0.2 * np.hypot(*tips["bare"][1][:2])
    # 8 mm of hook are 10 mm beyond the catheter: only where it is clamped, nothing changes
    np.testing.assert_allclose(tips["over"][2], tips["bare"][2], rtol=0.0, atol=1e-3)
    path.write_text(STUDY + CATHETER.replace("9.0", "10.5"), encoding="utf-8")
    assert main(["check", str(path)]) == 2


def test_a_weight_without_down_is_a_problem_of_the_manifest(tmp_path: Path) -> None:
    path, weighed = tmp_path / "manifest.toml", MANIFEST.replace("radius_mm", "weight_N_per_mm = 8e-6\nradius_mm")
    path.write_text(weighed, encoding="utf-8")
    with pytest.raises(ManifestError, match=r"case 'tube': down is missing: wire 'w' has a weight; \[0, 1, 0\]"):
        read_manifest(path)
    path.write_text(weighed.replace("wire = ", "down = [0, 1, 0]\nwire = "), encoding="utf-8")
    assert read_manifest(path).cases[0].down == (0.0, 1.0, 0.0)


def test_positive_rest_curvature_bends_towards_the_material_axis(case: Case) -> None:
    last = run(case, 0.0)[-1]
    assert last.converged
    assert last.joints_mm[-1, 0] > 1.0
    assert abs(last.joints_mm[-1, 1]) < 1e-9


def test_positive_roll_turns_right_handed_about_the_entry_direction(case: Case) -> None:
    plain, turned = run(case, 0.0)[-1].joints_mm, run(case, 90.0)[-1].joints_mm
    np.testing.assert_allclose(turned, plain @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1.0]]), rtol=0.0, atol=1e-6)


def test_profiles_travel_with_the_tip(case: Case) -> None:
    """The free tip has its rest shape at any depth: a circle of 10 mm radius over 8 mm."""
    for wire in run(case, 0.0, (9.0, 12.0)):
        tip = wire.joints_mm[-13:]
        turn = np.diff(tip, axis=0) / 0.5
        angle = np.arccos(np.clip(turn[0] @ turn[-1], -1, 1))
        assert angle == pytest.approx(0.1 * 0.5 * 11, rel=1e-3)


def test_depth_is_the_length_of_the_wire(case: Case) -> None:
    for wire, depth in zip(run(case, 0.0, (6.3, 11.9)), (6.3, 11.9), strict=True):
        assert np.linalg.norm(np.diff(wire.joints_mm, axis=0), axis=1).sum() == pytest.approx(depth, abs=1e-9)


def test_scales_reach_the_wire(case: Case) -> None:
    plain = guide_wire(case.wire, 1.0)
    stiff = guide_wire(case.wire, 1.0, bending_scale=1.2)
    np.testing.assert_allclose(
        np.array(stiff.bending_stiffness_N_mm2)[:, 1], 1.2 * np.array(plain.bending_stiffness_N_mm2)[:, 1]
    )
    number = replace(case.wire, bending_stiffness_N_mm2=2.0)
    assert guide_wire(number, 1.0, bending_scale=0.5).bending_stiffness_N_mm2 == 1.0


def test_what_a_sensitivity_run_may_change_beyond_common_factors(case: Case) -> None:
    """A taper twice as long, a tip without its curve: numbers and profiles alike, values and lengths apart."""
    changed = altered(case.wire, SimulateConfig(taper_scale=2.0, rest_curvature_scale=0.0))
    before, after = (np.array(wire.bending_stiffness_N_mm2) for wire in (case.wire, changed))
    np.testing.assert_allclose(after, before * (2.0, 1.0))
    assert not np.any(np.atleast_2d(changed.rest_curvature_per_mm)[:, -1])
    number = replace(case.wire, bending_stiffness_N_mm2=2.0, rest_curvature_per_mm=0.1)
    assert altered(number, SimulateConfig(taper_scale=2.0)).bending_stiffness_N_mm2 == 2.0
    assert altered(number, SimulateConfig(rest_curvature_scale=3.0)).rest_curvature_per_mm == pytest.approx(0.3)
    assert altered(case.wire, SimulateConfig()) == replace(
        case.wire,
        bending_stiffness_N_mm2=[tuple(k) for k in case.wire.bending_stiffness_N_mm2],
        rest_curvature_per_mm=[tuple(k) for k in case.wire.rest_curvature_per_mm],
    )
    clamp = Clamp(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    rubbing = insertion_of(case.wire, case.wall, wide_open(), clamp, config=SimulateConfig(friction=0.2))
    assert rubbing.wall.friction == 0.2


def test_one_roll_stands_for_all_frames_and_a_list_for_each() -> None:
    assert each_frame(15.0, 2) == (15.0, 15.0)
    assert each_frame((10.0, 20.0), 2) == (10.0, 20.0)


def test_a_wire_that_comes_through_the_wall_fails_its_frame(case: Case) -> None:
    """Two vessels with 0.6 mm between them, and a tip that is bent towards the other one."""
    axes = [np.arange(a, b, 0.3) for a, b in ((-4, 7), (-4, 4), (-3, 20))]
    x, y, _ = np.meshgrid(*axes, indexing="ij")
    distance = np.minimum(np.hypot(x, y), np.hypot(x - 3.0, y)) - 1.2
    grid = Grid(distance.astype(np.float32), np.full(3, 0.3), np.array([-4.0, -4.0, -3.0]))
    lumen = Lumen(grid, grid.with_values((distance < 0).astype(np.uint8)))
    bent = replace(case.wire, rest_curvature_per_mm=[(0.0, 0.3), (6.0, 0.3), (6.0, 0.0)])
    clamp = Clamp(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    wall = replace(case.wall, stiffness_N_mm2=1.0)
    *_, last = insertion_of(bent, wall, lumen, clamp, SolverConfig(segment_mm=0.5)).to_depths([4.0, 8.0, 15.0])
    frame = Frame(0, depth_mm=15.0, simulated=last).failed("simulate", last.status)
    assert frame.status == "through_wall"
    assert "through the wall" in frame.sentence
    assert not frame.ok


def test_a_wire_deep_in_a_soft_wall_is_told_and_one_that_presses_is_not() -> None:
    """Straight across a tube of 1 mm with a wall that hardly holds it, and one that does."""
    axes = [np.arange(a, b, 0.3) for a, b in ((-4, 9), (-4, 4), (-3, 15))]
    x, y, _ = np.meshgrid(*axes, indexing="ij")
    grid = Grid((np.hypot(x, y) - 1.0).astype(np.float32), np.full(3, 0.3), np.array([-4.0, -4.0, -3.0]))
    told = {}
    for stiffness in (1e-4, 20.0):
        insertion = Insertion(GuideWire(0.5, 0.18, 20.0), VesselWall(grid, stiffness), [0, 0, 0], [0.5, 0, 1.0])
        wires = [s for s in insertion.to_depths([2.0, 5.0, 6.0]) if s.converged]
        told[stiffness] = _pressed_deep([(Frame(n), wire) for n, wire in enumerate(wires)], 0.18)
    assert told[20.0] == []
    (sentence,) = told[1e-4]
    assert "2 frames" in sentence
    assert "deeper into the wall than its radius of 0.18 mm, in frame 2 by 1." in sentence


def test_a_wire_that_lies_in_itself_says_so_and_fails_its_frame() -> None:
    turned = GuideWire(0.25, 0.18, 2.0, 0.5)
    wire = next(Insertion(turned, None, [0, 0, 0], [0, 0, 1]).to_depths([20.0]))
    assert "self_overlap_mm" not in vars(wire)
    assert wire.self_overlap_mm == pytest.approx(0.36, abs=0.01)
    assert judged(Frame(0, simulated=wire), wire, 0.18).status == "self_contact"
    short = next(Insertion(turned, None, [0, 0, 0], [0, 0, 1]).to_depths([6.0]))
    assert short.self_overlap_mm == 0.0
    assert judged(Frame(0, simulated=short), short, 0.18).ok
    passed = judged(Frame(0, simulated=short), replace(short, passed_itself_mm=5.04), 0.18)
    assert (passed.status, passed.message) == ("self_contact", "the wire passed through itself at a depth of 5.0 mm")


@pytest.mark.parametrize("over_mm", [0.0, 12.0])
def test_a_catheter_that_lies_in_itself_fails_its_frame(over_mm: float) -> None:
    """A helix of 2 mm radius and turns 1.2 mm apart: the wire is free of itself, a catheter of 0.9 mm is not."""
    turned = GuideWire(0.25, 0.18, 2.0, 0.5)
    wire = next(Insertion(turned, None, [0, 0, 0], [0, 0, 1]).to_depths([20.0]))
    arc = np.arange(0.0, 20.0, 0.25)
    apart = np.stack([2.0 * np.cos(arc / 2.0), 2.0 * np.sin(arc / 2.0), 1.2 * arc / (4.0 * np.pi)], 1)
    wire = replace(wire, joints_mm=apart)
    said = judged(Frame(0, catheter_mm=over_mm), wire, 0.18, OverWire(50.0, 0.9, over_mm))
    assert said.status == ("self_contact" if over_mm else "ok")
    assert not over_mm or "the catheter of radius_mm = 0.9 lies 0." in said.message
    assert judged(Frame(0, catheter_mm=over_mm), wire, 0.18, OverWire(50.0, 0.4, over_mm)).ok


def test_a_catheter_thicker_than_the_vessel_is_told_where_it_is_inserted() -> None:
    """One of 7 mm radius in a vessel of 1.6 mm was ok without a word. The tube is closed behind the entry."""
    axes = [np.arange(a, b, 0.3) for a, b in ((-4, 4), (-4, 4), (-3, 24))]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    distance = np.maximum(np.hypot(x, y) - 1.6, -0.2 - z)
    wall = VesselWall(Grid(distance.astype(np.float32), np.full(3, 0.3), np.array([-4.0, -4.0, -3.0])), 2.0)
    insertion = Insertion(GuideWire(0.5, 0.18, 20.0), wall, [1.2, 0, 0], [0, 0, 1.0])
    wires = list(insertion.to_depths([10.0, 15.0]))
    for radius, tips, frames in ((7.0, (8.0, 12.0), 2), (2.2, (0.0, 12.0), 1), (7.0, (0.0, 0.0), 0)):
        lines = {n: along(wire, tip) for n, (wire, tip) in enumerate(zip(wires, tips, strict=True))}
        said = too_thick("catheter", radius, lines, wall)
        assert len(said) == bool(frames)
        assert not frames or f"{frames} frame" in said[0]
        assert not frames or f"radius_mm = {radius:g}, and in frame " in said[0]
        assert not frames or "the lumen has room for 1.4" in said[0]  # the middle lies between voxels of 0.3 mm
    assert too_thick("catheter", 1.5, {n: along(wire, 8.0) for n, wire in enumerate(wires)}, wall) == []
    assert too_thick("wire", 0.18, dict(enumerate(map(along, wires))), wall) == []


def test_a_wire_thicker_than_the_vessel_is_told() -> None:
    """One of 0.9 mm lay in a stenosis of 0.3 mm, ok, without a word: its wall gave way by less than its radius."""
    axes = [np.arange(a, b, 0.25) for a, b in ((-3, 3.1), (-3, 3.1), (-3, 24))]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    distance = np.hypot(x, y) - 1.5 + 1.4 * np.exp(-(((z - 10.0) / 3.0) ** 2))
    wall = VesselWall(Grid(distance, np.full(3, 0.25), np.array([-3.0, -3.0, -3.0])), 2.0)
    for radius, told in ((0.44, True), (0.18, False)):
        (wire,) = Insertion(GuideWire(0.5, radius, 20.0), wall, [0, 0, 0], [0, 0, 1.0]).to_depths([18.0])
        assert wire.converged
        assert wire.max_penetration_mm < radius
        said = too_thick("wire", radius, {3: along(wire)}, wall)
        assert bool(said) == told
        assert not told or said[0].startswith("1 frame: the wire is thicker than the vessel: radius_mm = 0.44, and in")


def test_nothing_to_simulate_is_no_error() -> None:
    """No frame was traced and no depth is stated: the case crashed, and what its frames said was lost."""
    nothing = resolution.resolve(lambda segment_mm, refined: [], [1.0, 0.5])
    assert len(nothing.wires) == len(nothing.num_mm) == 0


def test_a_wire_that_runs_back_in_the_vessel_is_told_and_a_curled_tip_is_not() -> None:
    """In a real carotid artery one lay doubled back over 26 mm, ok, without a word."""
    axes = np.meshgrid(*[np.arange(-4.0, 4.5, 0.5)] * 2, np.arange(0.0, 60.5, 0.5), indexing="ij")
    tube = Grid(np.hypot(axes[0], axes[1]) - 3.0, np.full(3, 0.5), np.array([-4.0, -4.0, 0.0]), np.eye(3))
    out, turn = np.linspace(0.0, 40.0, 81), np.linspace(0.0, np.pi, 20)
    bend = np.stack([-2.0 * np.cos(turn), 0.0 * turn, 40.0 + 2.0 * np.sin(turn)], axis=1)
    pushed = np.stack([0.0 * out - 2.0, 0.0 * out, out], axis=1)
    back = np.stack([0.0 * out + 2.0, 0.0 * out, out[::-1]], axis=1)
    curls = np.concatenate([pushed, *[np.concatenate([bend, bend[::-1] * [1, 1, -1] + [0, 0, 80]])] * 3])
    wires = {0: pushed, 1: np.concatenate([pushed, bend, back[:60]]), 2: curls, 3: np.concatenate([pushed, bend])}
    (said,) = turned_back(VesselWall(tube, 1.0), np.zeros(3), wires)
    assert said.startswith("frame 1: the simulated wire has turned round")
    assert "in frame 1 from 42 mm along it by 31 mm" in said
    assert turned_back(VesselWall(tube, 1.0), np.zeros(3), {}) == []
    # a sac beside the entry made loops of all vessels as wide as it is
    sac = np.sqrt((axes[0] - 6.0) ** 2 + axes[1] ** 2 + (axes[2] - 4.0) ** 2) - 5.5
    wide = Grid(np.minimum(tube.values, sac), tube.spacing_mm, tube.origin_mm, tube.direction)
    assert turned_back(VesselWall(wide, 1.0), np.zeros(3), wires) == [said]
    # one that is held the wrong way round folds in the closed end behind its entry, and its tip is far ahead of that
    behind = np.concatenate([pushed[60:0:-1], bend * [1, 1, -1] + [0, 0, 40], back[::-1]])
    (said,) = turned_back(VesselWall(tube, 1.0), np.array([0.0, 0.0, 30.0]), {0: behind})
    assert "runs back in the vessel, in frame 0" in said
