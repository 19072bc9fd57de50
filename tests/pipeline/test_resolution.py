"""The length of the segments: chosen so that it does not matter, and said where it still does."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

from pipeline.benchmark.scenes import BenchScene, bend
from pipeline.benchmark.vessels import lumen_distance
from pipeline.compare.metrics import point_to_curve, rms
from pipeline.run.stages.known import Frame
from pipeline.run.stages.simulate import judged
from pipeline.simulate.config import Segment
from pipeline.simulate.resolution import FINEST_MM, Resolved, lengths_mm, resolve
from solver import Grid, GuideWire, Insertion, Solution, Status, VesselWall
from tests.studies.short_segments import compared, in_little_room

CURVED = [(0.0, 0.3), (6.0, 0.3), (6.0, 0.0)]


@cache
def siphon() -> BenchScene:
    """Two turns of 8 mm radius, the second one back, and a wire with a curved tip."""
    soft = GuideWire(1.0, 0.18, np.array([[0.0, 1.0], [15.0, 4.0]]), np.array(CURVED))
    distance = partial(lumen_distance, "siphon", radius=1.5)
    box = ((-3.0, -3.0, -3.0), (20.0, 3.0, 30.0))
    return BenchScene("siphon", 34.0, guide_wire=soft, distance=distance, box=box, material_axis=(1.0, 0.0, 0.0))


def insert(scene: BenchScene, segment_mm: float, refined: bool = True) -> Sequence[Solution]:
    insertion = Insertion(
        scene.wire(segment_mm), scene.wall(), scene.entry_mm, scene.direction, material_axis=scene.material_axis,
        finest_mm=0.05 if refined else 1.0,
    )  # fmt: skip
    return list(insertion.to_depths(scene.depths(), roll_deg=scene.roll_deg))


@cache
def resolved(name: str) -> tuple[Resolved, np.ndarray]:
    """A scene at the length chosen, and its true errors against half of the shortest length."""
    scene = {"bend": bend, "siphon": siphon}[name]()
    rest = CURVED if name == "siphon" else 0.0
    found = resolve(partial(insert, scene), lengths_mm("auto", rest))
    limit = insert(scene, FINEST_MM / 2)
    errors = [rms(point_to_curve(a.joints_mm, b.joints_mm)[0]) for a, b in zip(found.wires, limit, strict=True)]
    return found, np.array(errors)


def test_lengths_are_halved_from_what_the_rest_curvature_allows() -> None:
    assert lengths_mm("auto", 0.0) == [1.0, 0.5, 0.25, 0.125, 0.0625]
    assert lengths_mm("auto", CURVED) == [0.25, 0.125, 0.0625]
    assert lengths_mm("auto", -100.0) == [0.125, 0.0625]
    assert lengths_mm(0.4, CURVED) == [0.8, 0.4]
    # twice the length would turn by more than a right angle at rest
    assert lengths_mm(1.0, 1.2) == [1.0]


@pytest.mark.parametrize("name", ["bend", "siphon"])
def test_the_length_chosen_is_right_to_a_tenth_of_a_voxel(name: str) -> None:
    found, error = resolved(name)
    assert all(w.converged for w in found.wires)
    assert error.max() < 0.03
    assert np.mean(error <= found.num_mm) >= 0.95


def test_a_straight_wire_in_a_wide_bend_needs_no_short_segments() -> None:
    assert resolved("bend")[0].segment_mm >= 0.5


def test_the_bound_is_no_idle_one() -> None:
    """With segments of 1 mm the curved tip is off by more than with the length chosen, and the bound says so."""
    found, _ = resolved("siphon")
    coarse = resolve(partial(insert, siphon()), lengths_mm(1.0, CURVED))
    assert coarse.segment_mm == 1.0
    assert np.nanmax(coarse.num_mm) > 3 * np.nanmax(found.num_mm)


def test_the_push_has_a_bound_of_its_own() -> None:
    """Where the lumen leaves no room the shape is right and the push is the slope of the voxels' waves, wrong by all of
    it. Nothing said so."""
    rows = compared(in_little_room(0.25), [[0.0, 0.1], [6.0, 0.1], [6.0, 0.0]])
    off, num, (pushed, right), bound = rows[:, 0], rows[:, 1], rows[:, 2:4].T, rows[:, 4]
    assert np.all(off <= num)
    assert np.abs(pushed - right).max() > 4 * np.abs(right).max()
    assert np.all(np.abs(pushed - right) <= bound)
    found, _ = resolved("bend")
    limit = np.array([wire.push_force_N for wire in insert(bend(), FINEST_MM)])
    off = np.abs(limit - [wire.push_force_N for wire in found.wires])
    assert np.mean(off <= found.num_push_N) >= 0.95
    assert found.num_push_N.max() < 0.1 * limit.max()


@pytest.mark.parametrize("asked", [1.0, "auto"])
def test_the_bound_knows_a_push_that_is_wrong_where_the_wire_is_pressed_at_its_entry(asked: Segment) -> None:
    """The joint that is held beyond the entry makes it a few hundredths of a newton."""
    axes = np.arange(-2.5, 2.6, 0.25), np.arange(-2.5, 2.6, 0.25), np.arange(-3.0, 22.1, 0.25)
    x, y, _ = np.meshgrid(*axes, indexing="ij")
    tube = VesselWall(Grid(np.hypot(x, y) - 1.0, np.full(3, 0.25), np.array([-2.5, -2.5, -3.0])), 3.0)

    def pressed(segment_mm: float, refined: bool) -> Sequence[Solution]:
        insertion = Insertion(GuideWire(segment_mm, 0.18, 1.0), tube, [1.02, 0.0, 0.0], [0.0, 0.0, 1.0])
        return list(insertion.to_depths([5.0, 10.0, 15.0, 18.25]))

    found, limit = resolve(pressed, lengths_mm(asked, 0.0)), pressed(FINEST_MM, True)
    off = np.array([abs(a.push_force_N - b.push_force_N) for a, b in zip(found.wires, limit, strict=True)])
    assert off.max() > 5 * max(abs(wire.push_force_N) for wire in limit)
    assert np.all(off <= found.num_push_N)


def test_a_length_that_loses_depths_is_not_taken() -> None:
    def one(segment_mm: float) -> Sequence[Solution]:
        wires = insert(bend(20.0), segment_mm)
        return wires if segment_mm > 0.3 else [*wires[:-1], replace(wires[-1], status=Status.STALLED)]

    apart = resolve(lambda mm, _: [replace(w, joints_mm=w.joints_mm + mm) for w in one(mm)], lengths_mm("auto", 0.0))
    assert apart.segment_mm == 0.5
    assert "fewer depths" in apart.reason


def test_a_depth_that_only_rough_steps_reach_leaves_shorter_lengths_to_the_others() -> None:
    """One depth typed as 200 for 20: as many were reached with 1 mm as with 0.5, and all kept wires of 1 mm."""

    def one(segment_mm: float, refined: bool) -> Sequence[Solution]:
        wires = insert(bend(20.0), segment_mm)
        return [*wires[:-1], replace(wires[-1], status=Status.STALLED)] if refined else wires

    found = resolve(one, lengths_mm("auto", 0.0))
    assert found.segment_mm < 1.0
    assert "fewer depths" not in found.reason


def test_a_depth_that_shorter_lengths_lose_leaves_the_others_their_bound() -> None:
    """It took it from all: wires of 1 mm segments were 0.13 mm off, ok, without a word."""

    def one(segment_mm: float, _: bool) -> Sequence[Solution]:
        wires = insert(bend(20.0), segment_mm)
        return wires if segment_mm > 0.6 else [*wires[:-1], replace(wires[-1], status=Status.STALLED)]

    kept = resolve(one, lengths_mm("auto", 0.0))
    assert kept.segment_mm == 1.0
    assert np.all(np.isfinite(kept.num_mm[:-1] + kept.num_push_N[:-1]))
    assert np.isnan(kept.num_mm[-1])


def test_a_joint_that_cannot_follow_the_bend_is_no_result() -> None:
    """A soft tip behind a jump of 1:1000 goes round a U-turn by folding at a joint: at rest, and wrong."""
    tip = replace(siphon(), guide_wire=GuideWire(1.0, 0.18, np.array([[0.0, 0.01], [3.0, 0.01], [3.0, 10.0]])))
    turns = [(w.largest_turn_deg, judged(Frame(0), w, 0.18).status) for w in insert(tip, 1.0) if w.converged]
    assert max(turn for turn, _ in turns) > 30
    assert {status for turn, status in turns if turn > 30} == {"under_resolved"}
    assert {status for turn, status in turns if turn <= 30} == {"ok"}


def test_a_turn_is_the_angle_between_two_segments() -> None:
    rest = GuideWire(0.5, 0.18, 10.0, 0.2)
    (solution,) = Insertion(rest, None, (0, 0, 0), (0, 0, 1)).to_depths([10.0])
    assert solution.largest_turn_deg == pytest.approx(np.degrees(0.2 * 0.5), abs=1e-9)


def test_depths_that_one_length_loses_may_be_reached_by_the_next() -> None:
    def one(segment_mm: float, _: bool) -> Sequence[Solution]:
        wires = insert(bend(20.0), segment_mm)
        return wires if segment_mm != 0.5 else [*wires[:-1], replace(wires[-1], status=Status.FOLDED)]

    found = resolve(one, lengths_mm("auto", 0.0))
    assert found.segment_mm < 0.5
    assert all(wire.converged for wire in found.wires)
