"""Without a wall: elastica, Hencky's chain, rest circle, profiles; order 2 in the segment length."""

from __future__ import annotations

import numpy as np
import pytest

from solver import GuideWire, Status, relax
from tests.analytic import elastica_tip, hencky_load

STIFFNESS = 10.0
LENGTH = 200.0


@pytest.mark.parametrize("alpha", [1.0, 5.0, 10.0])
def test_elastica_is_met_at_second_order(alpha: float) -> None:
    errors = []
    for n in (20, 40, 80):
        wire = GuideWire(LENGTH / n, 0.18, STIFFNESS)
        solution = relax(wire, depth_mm=LENGTH, load_N=[alpha * STIFFNESS / LENGTH**2, 0, 0])
        assert solution.status is Status.CONVERGED
        x, y = elastica_tip(alpha)
        tip = solution.joints_mm[-1] / LENGTH
        errors.append(np.hypot(tip[2] - x, tip[0] - y))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, rtol=0.0, atol=0.05)
    assert errors[0] < 1.5e-3


@pytest.mark.parametrize(("alpha", "x", "y"), [(1, 0.94356676, 0.30172077), (5, 0.61237164, 0.71379152)])
def test_analytic_elastica_has_its_published_values(alpha: float, x: float, y: float) -> None:
    np.testing.assert_allclose(elastica_tip(alpha), (x, y), rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("n", [1, 2, 5, 16])
def test_hencky_chain_buckles_exactly_at_its_load(n: int) -> None:
    wire = GuideWire(10.0, 0.18, STIFFNESS)
    load = hencky_load(STIFFNESS, 10.0, n)
    below = relax(wire, depth_mm=10.0 * n, load_N=[0, 0, -load * (1 - 1e-4)])
    above = relax(wire, depth_mm=10.0 * n, load_N=[0, 0, -load * (1 + 1e-3)])
    assert below.converged
    assert above.converged
    assert np.hypot(*below.joints_mm[-1, :2]) < 1e-6
    # just above, the amplitude grows as the square root of the excess
    assert np.hypot(*above.joints_mm[-1, :2]) > 0.02 * 10.0 * n


@pytest.mark.parametrize("roll", [0.0, 37.0, 180.0, -400.0])
def test_rest_circle_has_no_energy_and_rolls_rigidly(roll: float) -> None:
    radius = 20.0
    wire = GuideWire(1.0, 0.18, STIFFNESS, rest_curvature_per_mm=1 / radius)
    solution = relax(wire, depth_mm=30.0, roll_deg=roll)
    assert solution.converged
    assert solution.energy_N_mm < 1e-20
    angle = (np.arange(30) + 0.5) / radius
    flat = np.array([np.cumsum(np.sin(angle)), np.zeros(30), np.cumsum(np.cos(angle))]).T
    phi = np.deg2rad(roll)
    turn = np.array([[np.cos(phi), -np.sin(phi), 0], [np.sin(phi), np.cos(phi), 0], [0, 0, 1]])
    np.testing.assert_allclose(solution.joints_mm[1:], flat @ turn.T, rtol=0.0, atol=1e-11)


def test_first_segment_takes_up_the_depth_without_a_jump() -> None:
    wire = GuideWire(2.0, 0.18, STIFFNESS, rest_curvature_per_mm=0.05)
    depths = np.linspace(8.9, 13.1, 43)
    tips = np.array([relax(wire, depth_mm=d, load_N=[0.01, 0, 0]).joints_mm[-1] for d in depths])
    second = np.diff(tips, 2, axis=0)
    # the switch from k to k + 1 segments at 9 and 11 and 13 mm moves the tip by the discretisation error only
    assert np.abs(second).max() < 2e-2
    for d in depths:
        k, first = wire.segments_at(d)
        assert 0.5 * 2.0 - 1e-9 <= first <= 1.5 * 2.0 + 1e-9
        assert first + 2.0 * (k - 1) == pytest.approx(d)


def test_stiffness_profile_with_a_jump_is_integrated_not_sampled() -> None:
    # two halves of different stiffness under a tip moment-like small load: beam theory for the tip deflection
    inner, outer, length, force = 40.0, 4.0, 100.0, 1e-6
    a = 37.3
    exact = force * (a**3 / (3 * outer) + (length**3 - a**3) / (3 * inner))
    errors = []
    for n in (50, 100, 200):
        wire = GuideWire(length / n, 0.18, [[0, outer], [a, outer], [a, inner]])
        tip = relax(wire, depth_mm=length, load_N=[force, 0, 0]).joints_mm[-1, 0]
        errors.append(abs(tip - exact) / exact)
    assert errors[-1] < 1e-4
    assert errors[0] / errors[-1] > 8


def test_profile_forms_agree() -> None:
    forms = ([[0, 1.0], [50, 6.0]], lambda s: 1.0 + 0.1 * s)
    tips = [relax(GuideWire(1.0, 0.1, f), depth_mm=40.0, load_N=[0.003, 0, 0]).joints_mm[-1] for f in forms]
    np.testing.assert_allclose(tips[0], tips[1], rtol=0.0, atol=1e-6)


def test_push_and_reaction_differ_by_the_force_on_a_rod_that_leaves_its_sleeve_bent() -> None:
    """M²/2EI (Bosi et al. 2015): the introducer bears the load's axial part, the hand that less what the wire holds."""
    load, errors = np.array([0.02, 0.0, 0.01]), []
    for segment in (1.0, 0.5, 0.25):
        solution = relax(GuideWire(segment, 0.18, STIFFNESS), depth_mm=30.0, load_N=load)
        assert solution.reaction_force_N[2] == pytest.approx(-0.01, rel=1e-9)
        moment = np.linalg.norm(np.cross(solution.joints_mm[-1], load))
        errors.append(solution.push_force_N - (-0.01 - 0.5 * moment**2 / STIFFNESS))
    assert abs(errors[0]) < 2e-3 * 0.01
    np.testing.assert_allclose(np.array(errors[:-1]) / errors[1:], 4.0, rtol=0.0, atol=0.3)  # second order
