"""Curve errors against the slow oracle, by symmetry and in closed form."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pipeline.arrays.polyline import at_arc, resample, samples, tangents, tip_tangent, to_length
from pipeline.compare import compare, compare_truth, point_to_curve, rms
from pipeline.compare.branches import branches_of
from pipeline.compare.config import CompareConfig
from pipeline.compare.metrics import VesselAxis, scored
from pipeline.model import Curve, Lumen, arc_length
from pipeline.run.stages.compare import _too_near, _truth_elsewhere
from pipeline.run.stages.known import Frame
from solver import Solution, Status
from solver.grid import Grid
from tests.naive import curves as naive


def random_curve(seed: int, count: int) -> np.ndarray:
    return np.cumsum(np.random.default_rng(seed).normal(size=(count, 3)), axis=0)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), n=st.integers(1, 12), m=st.integers(2, 15))
def test_point_to_curve_equals_the_slow_oracle(seed: int, n: int, m: int) -> None:
    points, curve = random_curve(seed, n) * 1.5, random_curve(seed + 1, m)
    distance, foot = point_to_curve(points, curve)
    expected, arc = naive.point_to_curve(points, curve)
    np.testing.assert_allclose(distance, expected, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(at_arc(curve, foot), at_arc(curve, arc), rtol=0.0, atol=1e-9)


def test_vertices_alone_would_overestimate() -> None:
    distance, foot = point_to_curve([[5.0, 1.0, 0.0]], [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]])
    assert (distance[0], foot[0]) == (1.0, 5.0)


def test_repeated_points_and_single_points_are_no_trouble() -> None:
    assert point_to_curve([[1.0, 0, 0]], [[0.0, 0, 0], [0.0, 0, 0]])[0][0] == 1.0
    assert point_to_curve([[1.0, 0, 0]], [[0.0, 0, 0]])[0][0] == 1.0


def test_blocks_of_points_give_the_same_as_one_block(monkeypatch: pytest.MonkeyPatch) -> None:
    points, curve = random_curve(3, 50), random_curve(4, 40)
    whole = point_to_curve(points, curve)
    monkeypatch.setattr("pipeline.compare.metrics.PAIRS_AT_ONCE", 100)
    np.testing.assert_array_equal(whole, point_to_curve(points, curve))


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 1000))
def test_errors_do_not_change_under_rigid_motion(seed: int) -> None:
    turn, shift = Rotation.random(random_state=seed), np.array([3.0, -2.0, 7.0])
    points, curve = random_curve(seed, 8), random_curve(seed + 1, 9)
    before, _ = point_to_curve(points, curve)
    after, _ = point_to_curve(turn.apply(points) + shift, turn.apply(curve) + shift)
    np.testing.assert_allclose(before, after, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize(("length", "step", "count"), [(10.0, 0.5, 21), (10.2, 0.5, 22), (0.3, 0.5, 2), (0.0, 0.5, 1)])
def test_samples_hold_both_ends(length: float, step: float, count: int) -> None:
    arc = samples(length, step)
    assert len(arc) == count
    assert arc[0] == 0.0
    assert arc[-1] == pytest.approx(length)


def test_a_curve_is_cut_or_continued_straight() -> None:
    curve = np.array([[0.0, 0, 0], [4.0, 0, 0], [4.0, 3.0, 0]])
    np.testing.assert_allclose(to_length(curve, 5.0)[-1], [4.0, 1.0, 0.0])
    np.testing.assert_allclose(to_length(curve, 9.0)[-1], [4.0, 5.0, 0.0])
    np.testing.assert_allclose(tip_tangent(curve), [0, 1, 0])
    assert arc_length(resample(curve, 0.1))[-1] == pytest.approx(7.0)


def test_tangents_are_chords_about_a_point_and_nothing_for_a_point_alone() -> None:
    curve = np.array([[0.0, 0, 0], [4.0, 0, 0], [4.0, 3.0, 0]])
    diagonal = np.sqrt(0.5)
    expected = [[1, 0, 0], [1, 0, 0], [diagonal, diagonal, 0], [0, 1, 0], [0, 1, 0]]
    found = tangents(curve, np.array([0.0, 2.0, 4.0, 7.0, 9.0]), 0.5)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(tangents(curve[:1], np.zeros(1), 0.5), np.zeros((1, 3)))


@pytest.mark.parametrize("rounding", [-1e-12, 1e-12])
def test_rounding_does_not_turn_the_end_of_a_curve(rounding: float) -> None:
    """One of its points lay 1 mm before the end but for the last digit: the tip's angle was 4.7 or 5.5 degrees."""
    curve = np.array([[0.0, 0, 0], [0.5, 0.2, 0], [1.0 + rounding, 0, 0], [1.5, 0, 0], [2.0, 0, 0]])
    np.testing.assert_allclose(tip_tangent(curve), [1, 0, 0], rtol=0.0, atol=1e-9)


def open_space() -> Lumen:
    grid = Grid(np.full((40, 40, 40), -5.0, np.float32), np.ones(3), np.full(3, -10.0))
    return Lumen(grid)


def simulated(joints: np.ndarray) -> Solution:
    frames, forces, nothing = np.zeros((len(joints), 3, 3)), np.zeros_like(joints), (0.0,) * 4
    rest = (forces[0], 0.0, *nothing, (), 0.0)
    return Solution(joints, frames, *nothing, Status.CONVERGED, 1, forces, *rest)


def traced(points: np.ndarray) -> Curve:
    return Curve(points, np.full(len(points), 0.01))


def line(length: float, offset: float = 0.0, step: float = 1.0) -> np.ndarray:
    arc = samples(length, step)
    return np.column_stack([arc, np.full_like(arc, offset), np.zeros_like(arc)])


@pytest.mark.parametrize("step", [0.25, 0.7, 0.75, 1.0])
def test_the_angle_of_the_tips_is_over_a_millimetre_whatever_the_steps(step: float) -> None:
    """A bent tip of 8 mm radius: its last chord was taken from vertex to vertex, up to two steps long."""
    arc = samples(10.0, step)
    bent = np.column_stack([8.0 * np.sin(arc / 8.0), 8.0 * (1.0 - np.cos(arc / 8.0)), np.zeros_like(arc)])
    result = compare(simulated(line(10.0)), traced(bent), open_space())
    assert result["tip_angle_deg"] == pytest.approx(np.degrees(9.5 / 8.0), abs=0.5)  # a chord's sagitta, 0.016 mm


def test_parallel_lines_are_as_far_apart_as_they_are() -> None:
    result = compare(simulated(line(20.0)), traced(line(20.0, 0.3)), open_space())
    for name in ("rms_mm", "mean_mm", "p95_mm", "max_mm", "back_rms_mm", "hausdorff_mm", "arc_rms_mm", "tip_mm"):
        assert result[name] == pytest.approx(0.3, abs=1e-12), name
    assert result["tip_angle_deg"] == 0.0
    assert result["branch_ok"]
    assert result["coverage"] == 1.0


def test_the_segment_length_cannot_flatter() -> None:
    """A coarse chain whose joints lie on the curve is still off between the joints."""
    angle = np.linspace(0, np.pi / 2, 200)
    curve = 10 * np.column_stack([np.sin(angle), 1 - np.cos(angle), 0 * angle])
    coarse = curve[[0, 99, 199]]
    result = compare(simulated(coarse), traced(curve), open_space())
    assert point_to_curve(coarse, curve)[0].max() < 1e-12
    assert result["max_mm"] == pytest.approx(10 * (1 - np.cos(np.pi / 8)), rel=0.02)


def test_a_wire_too_short_is_seen_by_coverage_tip_and_the_way_back() -> None:
    result = compare(simulated(line(10.0)), traced(line(20.0)), open_space())
    assert result["rms_mm"] == pytest.approx(0.0, abs=1e-12)
    assert result["coverage"] == pytest.approx(3 / 21), "of 10 to 20 mm the 1 mm that is near enough"
    assert result["tip_mm"] == pytest.approx(10.0)
    assert result["hausdorff_mm"] == pytest.approx(10.0)


def test_coverage_is_what_the_simulated_wire_comes_near_to() -> None:
    """A wire of the right length in the wrong place covers nothing; by its length alone it covered all."""
    assert compare(simulated(line(20.0, 1.5)), traced(line(20.0)), open_space())["coverage"] == 0.0
    assert compare(simulated(line(20.0, 0.9)), traced(line(20.0)), open_space())["coverage"] == 1.0


def test_tips_with_a_wall_between_them_are_in_different_branches() -> None:
    values = np.full((40, 40, 40), -3.0, np.float32)
    values[:, 18:22, :] = 2.0
    grid = Grid(values, np.ones(3), np.array([0.0, -20.0, -20.0]))
    lumen = Lumen(grid)
    assert not compare(simulated(line(20.0, 4.0)), traced(line(20.0, -4.0)), lumen)["branch_ok"]
    assert compare(simulated(line(20.0, 4.0)), traced(line(20.0, 5.0)), lumen)["branch_ok"]


def tubes(*paths: np.ndarray, voxel: float = 0.4, radius: float = 1.5) -> Lumen:
    """Round vessels along polylines, as a lumen."""
    low = np.min([path.min(axis=0) for path in paths], axis=0) - 2 * radius
    high = np.max([path.max(axis=0) for path in paths], axis=0) + 2 * radius
    axes = [np.arange(a, b, voxel) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    near = [point_to_curve(points.reshape(-1, 3), path)[0].reshape(points.shape[:3]) for path in paths]
    return Lumen(Grid((np.min(near, axis=0) - radius).astype(np.float32), np.full(3, voxel), low))


FORK = np.array([0.0, 0.0, 0.0]), np.array([12.0, 0.0, 0.0]), np.array([22.0, 8.0, 0.0]), np.array([22.0, -8.0, 0.0])


def test_branches_are_those_of_the_graph() -> None:
    """Two branches behind a fork are two, and neither is the vessel before it; at the fork all are one."""
    start, fork, left, right = FORK
    found = branches_of(tubes(np.array([start, fork, left]), np.array([fork, right])).distance, start)
    assert not found.at(left) & found.at(right)
    assert not found.at(0.5 * (fork + left)) & found.at(0.5 * (fork + right))
    assert not found.at(0.5 * start + 0.5 * fork) & found.at(left)
    apart = fork + np.array([2.0, 0.0, 0.0])  # here the two lumens part
    assert found.at(apart) >= found.at(left) | found.at(right)
    assert found.at(left) == found.at(0.4 * fork + 0.6 * left)


def test_a_sac_on_the_wall_makes_no_two_vessels_of_one() -> None:
    """A straight line between the tips crossed the wall beside the neck, and they were called in different branches."""
    vessel, sac = np.array([[0.0, 0, 0], [24.0, 0, 0]]), np.array([[12.0, 2.0, 0], [12.0, 2.6, 0]])
    lumen = tubes(vessel, sac)
    found = branches_of(lumen.distance, vessel[0])
    assert found.at(np.array([8.0, 0.5, 0])) & found.at(np.array([16.0, -0.5, 0]))
    deep = np.array([[12.0, 0, 0], [12.0, 4.0, 0]])  # 4 mm beyond the wall of a vessel of 1.5 mm radius
    found = branches_of(tubes(vessel, deep).distance, vessel[0])
    assert found.at(np.array([4.0, 0, 0])) == found.at(np.array([12.0, 4.0, 0])) == found.at(np.array([20.0, 0, 0]))
    bend = np.array([[0.0, 0, 0], [10.0, 0, 0], [10.0, 10.0, 0]])
    one = branches_of(tubes(bend).distance, bend[0])
    assert one.at(np.array([5.0, 1.0, 0])) & one.at(np.array([11.0, 6.0, 0])), "their straight line leaves the bend"


def test_the_tip_along_and_across_the_vessel_and_the_depth_that_is_off() -> None:
    axis = line(30.0)
    way = VesselAxis(axis, branches_of(tubes(axis).distance, axis[0]))
    deeper = line(21.0, 0.4)
    result = compare(simulated(deeper), traced(line(20.0, 0.0)), open_space(), way=way)
    assert (result["tip_along_mm"], result["tip_across_mm"]) == pytest.approx((1.0, 0.4))
    straight = compare(simulated(line(20.0) + np.array([0.7, 0.3, 0.0])), traced(line(20.0)), open_space(), way=way)
    assert straight["depth_offset_mm"] == pytest.approx(0.7)
    assert straight["arc_rms_mm"] ** 2 - 0.7**2 == pytest.approx(0.3**2), "what one offset leaves"


@pytest.mark.parametrize("ahead", [0.4, -0.4])
def test_arc_lengths_are_counted_from_the_plane_that_the_wire_is_held_in(ahead: float) -> None:
    """A trace begins in the plane of the manifest's entry: wires that were the traces had 0.1 mm, up to 0.24."""
    arc = np.arange(0.0, 40.0, 0.2)
    whole = 20.0 * np.column_stack([np.sin(arc / 20.0), 1.0 - np.cos(arc / 20.0), 0.0 * arc])
    wire, curve = (whole, whole[2:]) if ahead > 0 else (whole[2:], whole)
    found = compare(simulated(wire), traced(curve), open_space(), ahead_mm=ahead)
    assert [found["arc_rms_mm"], found["arc_max_mm"], found["depth_offset_mm"]] == pytest.approx([0.0] * 3, abs=1e-3)
    assert compare(simulated(wire), traced(curve), open_space())["arc_rms_mm"] == pytest.approx(0.4, rel=0.01)


def test_the_side_of_the_vessel_counts_where_it_is_known() -> None:
    axis = line(30.0)
    way = VesselAxis(axis, branches_of(tubes(axis).distance, axis[0]))

    def agrees(first: float, second: float) -> float:
        return compare(simulated(line(20.0, first)), traced(line(20.0, second)), open_space(), way=way)["side_ok"]

    assert agrees(0.8, 0.3) == 1.0
    assert agrees(0.8, -0.3) == 0.0
    assert np.isnan(agrees(0.8, 0.05)), "nearer to the axis than 0.1 mm nobody knows"
    assert np.isnan(compare(simulated(line(20.0, 1.0)), traced(line(20.0, 1.0)), open_space())["side_ok"]), "no axis"


def test_truth_errors_do_not_apply_where_there_is_no_curve() -> None:
    errors = compare_truth(line(5.0), None, simulated(line(5.0, 0.2)))
    assert "trace_mean_mm" not in errors
    assert errors["truth_rms_mm"] == pytest.approx(0.2)


def test_rms_of_nothing_is_not_zero() -> None:
    assert np.isnan(rms([]))


def test_an_empty_curve_is_refused() -> None:
    with pytest.raises(ValueError, match="need 2 of each"):
        compare(simulated(line(5.0)), Curve(np.zeros((0, 3)), np.zeros(0)), open_space())


def test_the_clamps_reach_counts_in_no_score() -> None:
    """A wire that is wrong in its first 10 mm alone is right; one that is wrong beyond is not made better by them."""
    arc = np.linspace(0.0, 30.0, 61)
    bent = np.column_stack([arc, np.where(arc < 9.0, 1.0, 0.0), 0 * arc])
    result = compare(simulated(line(30.0)), traced(bent), open_space())
    assert result["rms_mm"] == pytest.approx(0.0, abs=1e-12)
    assert result.arc_mm[0] == pytest.approx(10.0)
    whole = compare(simulated(line(30.0)), traced(bent), open_space(), CompareConfig(skip_mm=0.0))
    assert whole["rms_mm"] > 0.4  # 9 of 30 mm are 1 mm off


def test_of_a_wire_hardly_longer_than_the_reach_its_end_counts() -> None:
    for length, first in ((11.0, 9.0), (3.0, 1.5), (12.0, 10.0), (40.0, 10.0)):
        assert scored(samples(length, 0.5), 10.0)[0] == pytest.approx(first)


def test_the_distal_errors_are_of_the_last_millimetres() -> None:
    arc = np.linspace(0.0, 40.0, 81)
    curve = np.column_stack([arc, np.where(arc > 35.0, 1.0, 0.0), 0 * arc])
    result = compare(simulated(line(40.0)), traced(curve), open_space())
    assert result["distal10_rms_mm"] > result["distal20_rms_mm"] > result["rms_mm"] > 0.0


@pytest.mark.parametrize(
    ("off_mm", "sigma_mm", "said"), [(4e-16, 0.05, 1), (0.02, 0.05, 0), (0.004, np.nan, 1), (0.02, np.nan, 0)]
)
def test_a_wire_that_lies_nearer_to_traces_than_these_are_known_is_no_news(
    off_mm: float, sigma_mm: float, said: int
) -> None:
    """A simulator that handed the traces back came first, without a word; so did own traces that were its wires."""
    curve = Curve(np.zeros((5, 3)), np.full(5, sigma_mm), source="0.csv" * bool(np.isnan(sigma_mm)))
    errors = cast(Any, SimpleNamespace(error_mm=np.full(40, off_mm)))
    warnings = _too_near([Frame(0, curve=curve, comparison=errors), Frame(1)], 0.5, handed=True)
    assert len(warnings) == said
    assert all("made from the traces" in text for text in warnings)


def test_one_frame_that_was_made_from_its_trace_is_enough() -> None:
    """Four of five were pooled with an honest one, and nothing was said."""
    curve, off_mm = Curve(np.zeros((5, 3)), np.full(5, 0.05)), [0.001, 0.06, 0.001, 0.002, 0.0]
    errors = [cast(Any, SimpleNamespace(error_mm=np.full(40, mm))) for mm in off_mm]
    frames = [Frame(n, curve=curve, comparison=error) for n, error in enumerate(errors)]
    (said,) = _too_near(frames, 0.5, handed=True)
    assert said.startswith("in 4 frames (0, 2, 3, 4) the simulated wires lie within 0.002 mm (rms) of the traced ones")


@pytest.mark.parametrize("sigma_mm", [np.nan, 0.0, 0.03])
@pytest.mark.parametrize(("off_mm", "said"), [(0.0085, 0), (0.0004, 1)])
def test_curves_of_another_program_may_lie_near_the_solvers_own_wires(
    off_mm: float, said: int, sigma_mm: float
) -> None:
    """A rod without segments, given as traces, lay 0.0085 mm off: "made from the traces", and no score. Written to the
    micrometre, the solver's own are 0.0004 mm off; once ``traces_mm`` was stated, nothing was said of them."""
    frame = Frame(
        0,
        curve=Curve(np.zeros((5, 3)), np.full(5, sigma_mm), source="0.csv"),
        comparison=cast(Any, SimpleNamespace(error_mm=np.full(40, off_mm))),
    )
    assert len(_too_near([frame], 0.5, handed=False)) == said


def test_the_solvers_own_wire_may_lie_near_a_trace_that_is_little_known() -> None:
    """A soft phantom widens the sigma of its traces: an error of 0.06 mm was that of a wire made from the trace."""
    curve = Curve(np.zeros((5, 3)), np.full(5, 0.34))
    frame = Frame(0, curve=curve, comparison=cast(Any, SimpleNamespace(error_mm=np.full(40, 0.06))))
    assert not _too_near([frame], 0.5, handed=False)
    errors = cast(Any, SimpleNamespace(error_mm=np.full(6, 0.001)))
    short = [Frame(n, curve=curve, comparison=errors) for n in range(2)]
    assert not _too_near(short, 0.5, handed=True), "few points may lie near by chance"
    assert _too_near(short, 1.0, handed=True), "twelve millimetres of them are no chance, however sampled"


def test_tips_that_lie_beside_the_true_ones_in_half_of_the_frames_are_told() -> None:
    """Of scans with a voxel spacing 8 % too large three tips in five lay two voxels off."""
    curve = Curve(np.array([[0.0, 0, 0], [0, 0, 1]]), np.full(2, 0.05), tip_sigma_mm=0.1)
    truth = [{"trace_mean_mm": 0.05, "trace_tip_mm": mm} for mm in (0.1, 1.2, 1.3, 0.2)]
    (said,) = _truth_elsewhere([Frame(n, curve=curve, truth=t) for n, t in enumerate(truth)], 0.5)
    assert "(frame 1: 1.2 mm, frame 2: 1.3 mm)" in said
    assert not _truth_elsewhere([Frame(n, curve=curve, truth=t) for n, t in enumerate(truth[:2] + truth[:1])], 0.5)


@pytest.mark.parametrize(
    ("off_mm", "tip_mm", "said"),
    [(0.05, 0.1, ""), (17.0, 48.0, "lie 17 mm from"), (0.7, 0.7, "lie 0.7 mm from"), (0.1, 4.5, "frame 2: 4.5 mm")],
)
def test_a_truth_that_lies_elsewhere_is_no_truth(off_mm: float, tip_mm: float, said: str) -> None:
    """One in RAS gave trace_tip_mm of 48 mm beside wires that agreed to 0.07 mm, without a word; then one of other
    frames, whose wires lie beside these and end elsewhere; then one moved by a voxel, and two frames exchanged.
    """
    curve = Curve(np.array([[0.0, 0, 0], [0, 0, 1]]), np.full(2, 0.05))
    frames = [Frame(n, curve=curve, truth={"trace_mean_mm": off_mm, "trace_tip_mm": off_mm}) for n in range(3)]
    frames[2].truth["trace_tip_mm"] = tip_mm
    warnings = _truth_elsewhere([*frames, Frame(3)], 0.75)
    assert len(warnings) == bool(said)
    assert all(said in text for text in warnings)
