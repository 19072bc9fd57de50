"""Swept tubes: signed distance against brute force, gradient against differences, smooth unions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from data_synthetic.anatomy.tubes import Anatomy, ball, sweep
from tests.naive.tubes import tube_distance

ARC = np.linspace(0.0, np.pi / 2, 20)
QUARTER = np.column_stack([10 * np.sin(ARC), 10 - 10 * np.cos(ARC), 0 * ARC])


@pytest.fixture(scope="module")
def junction() -> Anatomy:
    branch = sweep("branch", [[5.0, 0.5, 0.0], [5.0, -4.0, 4.0], [5.0, -8.0, 8.0]], [1.0, 0.9, 0.7])
    return Anatomy((sweep("trunk", QUARTER, 1.5), branch, ball("sac", [12.0, 12.0, 0.0], 3.0)))


def test_distance_of_a_tapered_tube_is_that_of_its_balls() -> None:
    tube = sweep("taper", QUARTER, np.linspace(2.0, 1.0, len(QUARTER)))
    points = np.random.default_rng(0).uniform(-3, 14, (300, 3))
    oracle = tube_distance(tube.points_mm, tube.radii_mm, points)
    # the oracle samples balls every 0.1 um; both splines interpolate the same samples
    np.testing.assert_allclose(Anatomy((tube,)).distance(points), oracle, rtol=0.0, atol=2e-4)


def test_straight_tube_is_a_capsule() -> None:
    capsule = Anatomy((sweep("c", [[0, 0, 0], [0, 0, 10.0]], 2.0),))
    points = np.array([[3.0, 0, 5.0], [0, 1.0, 5.0], [0, 0, 13.0], [0, 4.0, -3.0]])
    np.testing.assert_allclose(capsule.distance(points), [1.0, -1.0, 1.0, 3.0], rtol=0.0, atol=1e-9)


def test_gradient_is_the_derivative(junction: Anatomy) -> None:
    points = np.random.default_rng(1).uniform(-3, 15, (2000, 3))
    gradient = junction.distance_and_gradient(points)[1]
    for a in range(3):
        step = np.zeros(3)
        step[a] = 1e-6
        slope = (junction.distance(points + step) - junction.distance(points - step)) / 2e-6
        assert np.quantile(np.abs(slope - gradient[:, a]), 0.99) < 1e-7  # the rest lies on ridges


@pytest.mark.parametrize("spread_mm", [0.02, 0.5, 30.0])
def test_a_place_is_as_far_whatever_comes_before_it(junction: Anatomy, spread_mm: float) -> None:
    """Tubes that the place before shows to be too far are not looked at: that must change no bit."""
    along = junction.tubes[1].points_mm
    points = along + np.random.default_rng(3).normal(0.0, spread_mm, along.shape)
    points[7, 0] = np.nan
    together = junction.distance_and_gradient(points)
    alone = [junction.distance_and_gradient(point) for point in points]
    np.testing.assert_array_equal(together[0], np.concatenate([phi for phi, _ in alone]))
    np.testing.assert_array_equal(together[1], np.concatenate([slope for _, slope in alone]))


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(-15, 15), min_size=6, max_size=6))
def test_distance_is_one_lipschitz(junction_points: list[float]) -> None:
    anatomy = Anatomy((sweep("trunk", QUARTER, 1.5), ball("sac", [12.0, 12.0, 0.0], 3.0)))
    a, b = np.array(junction_points).reshape(2, 3)
    difference = abs(float(anatomy.distance([a])[0] - anatomy.distance([b])[0]))
    assert difference <= np.linalg.norm(a - b) + 1e-9


def test_smooth_union_only_adds_and_only_near_the_junction(junction: Anatomy) -> None:
    points = np.random.default_rng(2).uniform(-3, 15, (5000, 3))
    single = np.array([Anatomy((t,)).distance(points) for t in junction.tubes])
    nearest = np.sort(single, axis=0)
    united = junction.distance(points)
    assert np.all(united <= nearest[0] + 1e-12)
    far = nearest[1] - nearest[0] > 0.6
    np.testing.assert_allclose(united[far], nearest[0][far], rtol=0.0, atol=1e-12)
    assert np.max(nearest[0] - united) <= 2 * 0.6 / 6 + 1e-12


def test_a_radius_that_is_not_positive_is_refused() -> None:
    with pytest.raises(ValueError, match="tube x: got points"):
        sweep("x", [[0, 0, 0], [0, 0, 1.0]], 0.0)
