"""Trivial predictors in lumens whose centreline, shortest way and straightest way are known."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.compare import nulls, point_to_curve, rms
from pipeline.model import Clamp, Lumen, arc_length
from solver import relax
from solver.grid import Grid

VOXEL, RADIUS, BEND = 0.4, 2.0, 15.0


def lumen_of(distance: np.ndarray, origin: np.ndarray) -> Lumen:
    grid = Grid(distance.astype(np.float32), np.full(3, VOXEL), origin)
    return Lumen(grid)


@pytest.fixture(scope="module")
def quarter_torus() -> tuple[Lumen, np.ndarray]:
    """A quarter of a torus in the x-z plane around the origin, tube radius 2 mm, and its axis."""
    x, y, z = np.meshgrid(*[np.arange(-4, n, VOXEL) for n in (20.0, 4.0, 20.0)], indexing="ij")
    distance = np.hypot(np.hypot(x, z) - BEND, y) - RADIUS
    angle = np.linspace(0, np.pi / 2, 200)
    axis = BEND * np.column_stack([np.cos(angle), 0 * angle, np.sin(angle)])
    return lumen_of(distance, np.full(3, -4.0)), axis


def clues_of(lumen: Lumen, axis: np.ndarray) -> nulls.Clues:
    return nulls.Clues(lumen, Clamp(axis[0], np.array([0.0, 0.0, 1.0])), 0.2, axis)


def test_the_centreline_is_the_axis_to_half_a_voxel(quarter_torus: tuple[Lumen, np.ndarray]) -> None:
    lumen, axis = quarter_torus
    path = clues_of(lumen, axis).centreline
    assert path is not None
    assert rms(point_to_curve(path, axis)[0]) < 0.5 * VOXEL


def test_a_doubtful_lumen_is_no_warning_of_python(quarter_torus: tuple[Lumen, np.ndarray]) -> None:
    """The case has it among its warnings."""
    lumen, axis = quarter_torus
    steep = lumen_of(2.0 * lumen.distance.values, lumen.distance.origin_mm)
    assert "it changes by 2 per mm" in clues_of(steep, axis).hard_wall.doubts


def test_the_shortest_way_hugs_the_inner_wall(quarter_torus: tuple[Lumen, np.ndarray]) -> None:
    lumen, axis = quarter_torus
    path = clues_of(lumen, axis).shortest
    assert path is not None
    middle = path[len(path) // 2]
    assert np.hypot(middle[0], middle[2]) < BEND - 0.6 * RADIUS
    # from the axis straight along a tangent to the circle at 0.2 mm from the inner wall, round it, and out alike
    inner = BEND - RADIUS + 0.2
    away = np.arccos(inner / BEND)
    shortest = 2 * np.sqrt(BEND**2 - inner**2) + inner * (np.pi / 2 - 2 * away)
    assert arc_length(path)[-1] == pytest.approx(shortest, rel=0.02)  # it ends in the voxel of the target


def test_the_last_digit_of_a_voxel_size_does_not_choose_the_shortest_way(
    quarter_torus: tuple[Lumen, np.ndarray],
) -> None:
    """Of many equally short ways from voxel to voxel: the predictor's error changed by 0.19 mm with 5e-15 mm."""
    lumen, axis = quarter_torus
    grid = lumen.distance
    spacing = grid.spacing_mm + np.array([0.0, 5e-15, 1e-14])
    other = clues_of(Lumen(Grid(grid.values, spacing, grid.origin_mm, grid.direction)), axis)
    np.testing.assert_allclose(other.shortest, clues_of(lumen, axis).shortest, rtol=0.0, atol=1e-9)


def test_the_least_bent_curve_stays_inside_and_bends_less(quarter_torus: tuple[Lumen, np.ndarray]) -> None:
    lumen, axis = quarter_torus
    depth = 0.9 * float(arc_length(axis)[-1])
    path = nulls.min_bending(clues_of(lumen, axis), depth)
    assert path is not None
    assert arc_length(path)[-1] == pytest.approx(depth, abs=1e-6)
    assert np.hypot(np.hypot(path[:, 0], path[:, 2]) - BEND, path[:, 1]).max() < RADIUS - 0.2 + 0.1
    assert bending(path) < bending(nulls.to_length(axis, depth, 1.0))


def bending(path: np.ndarray) -> float:
    chord = np.diff(path, axis=0)
    unit = chord / np.linalg.norm(chord, axis=1)[:, None]
    return float(np.sum(np.linalg.norm(np.diff(unit, axis=0), axis=1) ** 2))


def test_two_vessels_that_do_not_meet_have_no_path() -> None:
    x, y, _ = np.meshgrid(*[np.arange(-6, 6, VOXEL)] * 3, indexing="ij")
    distance = np.minimum(np.hypot(x - 3, y), np.hypot(x + 3, y)) - 1.5
    lumen = lumen_of(distance, np.full(3, -6.0))
    ends = np.array([[-3.0, 0.0, -5.0], [3.0, 0.0, 5.0]])
    found = clues_of(lumen, ends)
    assert found.centreline is None
    assert nulls.NULLS["centreline"](found, 5.0, nulls.PredictorInputs()) is None
    assert nulls.min_bending(found, 5.0) is None


def test_the_previous_wire_is_pushed_on(quarter_torus: tuple[Lumen, np.ndarray]) -> None:
    lumen, axis = quarter_torus
    before = np.array([[0.0, 0, 0], [0.0, 0, 10.0]])
    guess = nulls.NULLS["previous"](clues_of(lumen, axis), 12.0, nulls.PredictorInputs(before))
    assert guess is not None
    np.testing.assert_allclose(guess[-1], [0, 0, 12.0])
    assert nulls.NULLS["previous"](clues_of(lumen, axis), 12.0, nulls.PredictorInputs()) is None


def test_the_least_bent_curve_is_led_to_the_tip_that_it_is_told(quarter_torus: tuple[Lumen, np.ndarray]) -> None:
    lumen, axis = quarter_torus
    clues, depth = clues_of(lumen, axis), 0.9 * float(arc_length(axis)[-1])
    free = nulls.min_bending(clues, depth)
    assert free is not None
    pull = {"entry_mm": free[0], "entry_direction": clues.clamp.direction, "start_mm": free, "load_N": [0.0, 0.03, 0.0]}
    aside = relax(clues.straight_wire, clues.hard_wall, depth_mm=depth, **pull).joints_mm[-1]
    assert np.linalg.norm(aside - free[-1]) > 0.5
    guess = nulls.NULLS["pinned"](clues, depth, nulls.PredictorInputs(tip_mm=aside))
    assert guess is not None
    assert np.linalg.norm(guess[-1] - aside) <= 0.1
    assert arc_length(guess)[-1] == pytest.approx(depth, abs=0.5)
    # a real wire takes a longer way: its tip lies before that of the least bent one of its length
    before = free[-1] - 1.5 * (free[-1] - free[-2]) / np.linalg.norm(free[-1] - free[-2])
    shorter = nulls.NULLS["pinned"](clues, depth, nulls.PredictorInputs(tip_mm=before))
    assert shorter is not None
    assert np.linalg.norm(shorter[-1] - before) <= 0.1
    assert bending(guess) > bending(free)
    assert nulls.NULLS["pinned"](clues, depth, nulls.PredictorInputs()) is None
    assert nulls.NULLS["pinned"](clues, depth, nulls.PredictorInputs(tip_mm=free[-1] + 30.0)) is None, "out of reach"


def test_the_last_try_counts(quarter_torus: tuple[Lumen, np.ndarray], monkeypatch: pytest.MonkeyPatch) -> None:
    """What the last one had found was never looked at."""
    lumen, axis = quarter_torus
    clues, depth = clues_of(lumen, axis), 0.9 * float(arc_length(axis)[-1])
    free, relaxed = nulls.min_bending(clues, depth), []
    assert free is not None
    before = free[-1] - 1.5 * (free[-1] - free[-2]) / np.linalg.norm(free[-1] - free[-2])
    monkeypatch.setattr("pipeline.compare.pinned.relax", lambda *a, **k: relaxed.append(0) or relax(*a, **k))
    told = nulls.PredictorInputs(tip_mm=before)
    assert nulls.NULLS["pinned"](clues, depth, told) is not None
    tries = len(relaxed) - 3  # along three axes before
    monkeypatch.setattr("pipeline.compare.pinned.MOST_TRIES", tries)
    assert nulls.NULLS["pinned"](clues, depth, told) is not None
    monkeypatch.setattr("pipeline.compare.pinned.MOST_TRIES", tries - 1)
    assert nulls.NULLS["pinned"](clues, depth, told) is None


def test_the_ceiling_lies_between_the_frames_around(quarter_torus: tuple[Lumen, np.ndarray]) -> None:
    lumen, axis = quarter_torus
    line = np.array([[0.0, 0, 0], [0.0, 0, 10.0]])
    aside = np.array([1.0, 0.0, 0.0])
    around = nulls.PredictorInputs(previous_mm=line - aside, following_mm=line + aside)
    guess = nulls.NULLS["neighbours"](clues_of(lumen, axis), 10.0, around)
    assert guess is not None
    np.testing.assert_allclose(guess[:, 0], 0.0)
    assert nulls.NULLS["neighbours"](clues_of(lumen, axis), 10.0, nulls.PredictorInputs(previous_mm=line)) is None


def test_what_is_told_of_the_frame_is_no_rival() -> None:
    assert not {"pinned", "neighbours"} & set(nulls.rivals())
    assert {"centreline", "previous", "roll_unknown", "no_tip_curve", "another"} <= set(nulls.rivals())


def test_a_way_through_voxels_ends_in_the_lumen_where_its_ends_lie_outside() -> None:
    """Two rooms with a wall between: from one to the other there is no way; what lies in the wall begins beside it."""
    cost = np.full((5, 5, 9), np.inf)
    cost[2, 2, :4] = cost[2, 2, 5:] = 1.0
    grid = Grid(cost, [0.5, 0.5, 0.5])
    outside, near, far = np.array([1.0, 1.9, 0.0]), np.array([1.0, 1.0, 1.5]), np.array([1.0, 1.0, 4.0])
    path = nulls.voxel_path(grid, cost, outside, near)
    assert path is not None
    np.testing.assert_allclose(path, [outside, [1, 1, 0.5], [1, 1, 1.0], [1, 1, 1.5]], rtol=0.0, atol=1e-12)
    assert nulls.voxel_path(grid, cost, near, far) is None
    assert nulls.voxel_path(grid, np.full(cost.shape, np.inf), near, far) is None
