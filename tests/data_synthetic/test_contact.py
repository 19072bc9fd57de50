"""The wall's push on a rod: derivatives of its energy, and an integral that does not care where the nodes lie."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from data_synthetic.anatomy.tubes import Anatomy, ball
from data_synthetic.rod.contact import add_wall, near_wall, wall_energy
from data_synthetic.rod.rod import Rod, TrueWire, make_rod

Array = NDArray[np.float64]
X, Y, Z = np.eye(3)
SAC = Anatomy((ball("sac", [0.0, 0.0, 0.0], 3.0),))


def rod_across(step_mm: float) -> tuple[Rod, Array]:
    """A straight wire that leaves a ball: its last part is pressed."""
    rod = replace(make_rod(TrueWire(), Z, X, 5.5, step_mm), wall=SAC, stiffness_N_mm2=2.0)
    arc = np.concatenate([[0.0], np.cumsum(rod.lengths)])
    return rod, -2.0 * Z + arc[:, None] * Z


def test_energy_is_the_integral_of_half_k_d_squared() -> None:
    exact = 0.5 * 2.0 * 0.68**3 / 3.0  # d = z - 2.82 from there to z = 3.5
    for step in (0.4, 0.2):
        rod, points = rod_across(step)
        assert wall_energy(rod, near_wall(rod, SAC, points)) == pytest.approx(exact, rel=1e-3)


def test_gradient_and_hessian_are_those_of_the_energy() -> None:
    rod, points = rod_across(0.4)
    points = points + np.random.default_rng(0).normal(0, 0.01, points.shape) * [1, 1, 0]
    n = len(points) - 1
    gradient, bands = np.zeros(4 * n), np.zeros((11, 4 * n))
    force = add_wall(rod, SAC, near_wall(rod, SAC, points), gradient, bands)
    np.testing.assert_allclose(gradient.reshape(-1, 4)[:, 1:], -force[1:])
    pressed = np.flatnonzero(np.linalg.norm(force, axis=1) > 0)
    assert len(pressed) > 5
    for node in pressed[::3]:
        for a in range(3):
            step = np.zeros_like(points)
            step[node, a] = 1e-6
            slope = wall_energy(rod, near_wall(rod, SAC, points + step)) - wall_energy(
                rod, near_wall(rod, SAC, points - step)
            )
            assert slope / 2e-6 == pytest.approx(-force[node, a], abs=1e-8)
            column = 4 * (node - 1) + 1 + a
            change = derivative(rod, points, step)
            below = np.arange(column, min(column + 8, 4 * n))
            np.testing.assert_allclose(change[below], bands[below - column, column], rtol=0.0, atol=2e-6)


def derivative(rod: Rod, points: Array, step: Array) -> Array:
    out = []
    for moved in (points + step, points - step):
        gradient = np.zeros(4 * (len(points) - 1))
        add_wall(rod, SAC, near_wall(rod, SAC, moved), gradient, np.zeros((11, len(gradient))))
        out.append(gradient)
    return (out[0] - out[1]) / 2e-6


def test_a_wire_far_from_the_wall_is_not_pushed() -> None:
    rod, points = rod_across(0.4)
    rod, inside = replace(rod, wall=SAC), points[:8]
    shorter = replace(rod, elastic=rod.elastic._replace(lengths=rod.lengths[:7]))
    assert wall_energy(shorter, near_wall(shorter, SAC, inside)) == 0.0
