"""The shortest proof that the solver solves: elastica, rest circle, bend, roll."""

from __future__ import annotations

import numpy as np
import pytest

from solver import GuideWire, Insertion, Status, VesselWall, relax
from tests.analytic import elastica_tip
from tests.solver.scenes import bend_grid

STIFFNESS = 10.0


@pytest.mark.parametrize("alpha", [1.0, 5.0, 10.0])
def test_elastica_is_met_at_second_order(alpha: float) -> None:
    length, errors = 200.0, []
    for n in (20, 40):
        wire = GuideWire(length / n, 0.18, STIFFNESS)
        solution = relax(wire, depth_mm=length, load_N=[alpha * STIFFNESS / length**2, 0, 0])
        assert solution.status is Status.CONVERGED
        x, y = elastica_tip(alpha)
        errors.append(
            np.hypot(solution.joints_mm[-1, 2] / length - x, solution.joints_mm[-1, 0] / length - y)
        )
    assert errors[0] < 1.5e-3
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.05)


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
    np.testing.assert_allclose(solution.joints_mm[1:], flat @ turn.T, atol=1e-11)


@pytest.mark.parametrize("stiffness", [0.1, 100.0])
def test_bend_goes_through_to_the_end(stiffness: float) -> None:
    wall = VesselWall(bend_grid(), stiffness)
    insertion = Insertion(GuideWire(1.0, 0.18, STIFFNESS), wall, [0, 0, 0], [0, 0, 1])
    for depth, solution in zip(
        np.arange(5.0, 90.0, 5.0), insertion.to_depths(np.arange(5.0, 90.0, 5.0)), strict=True
    ):
        assert solution.converged, solution.sentence
        assert solution.depth_mm == depth
        steps = np.linalg.norm(np.diff(solution.joints_mm, axis=0), axis=1)
        np.testing.assert_allclose(steps, 1.0, atol=1e-12 * depth)
        np.testing.assert_allclose(
            solution.reaction_force_N, -solution.contact_force_N.sum(axis=0), atol=1e-9
        )
    assert solution.joints_mm[-1, 0] > 30.0
