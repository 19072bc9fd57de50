"""Coulomb friction as an incremental potential: the capstan, the direction, and nothing at all at μ = 0."""

from __future__ import annotations

import numpy as np
import pytest

from solver import GuideWire, Insertion, VesselWall
from tests.solver.scenes import bend_grid, last


def axial(joints: np.ndarray, force: np.ndarray, load: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
    """Axial force in each segment, N: everything that acts on the wire beyond it, along it."""
    along = np.diff(joints, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    ahead = np.cumsum((force + load)[::-1], axis=0)[::-1]
    return np.einsum("na,na->n", ahead[1:], along)


@pytest.mark.parametrize("coefficient", [0.1, 0.3])
def test_capstan(coefficient: float) -> None:
    """A limp wire pulled back around a bend by its tip load: tension grows by exp(μ Θ)."""
    wall = VesselWall(bend_grid(), 5.0, friction=coefficient)
    wire = GuideWire(1.0, 0.18, 0.5)
    tip_load = np.array([0.05, 0.0, 0.0])
    insertion = Insertion(wire, wall, [0, 0, 0], [0, 0, 1], tip_load_N=tip_load, max_iterations=500)
    solution = last(insertion, [*np.arange(1.0, 96.0), 94.0, 93.0, 92.0, 91.0])
    load = np.zeros_like(solution.joints_mm)
    load[-1] = tip_load
    tension = axial(solution.joints_mm, solution.contact_force_N, load)
    along = np.diff(solution.joints_mm, axis=0)
    low, high = 40, 62
    angle = np.arccos(along[low] @ along[high] / np.linalg.norm(along[low]) / np.linalg.norm(along[high]))
    assert angle > 0.6
    assert np.log(tension[low] / tension[high]) == pytest.approx(coefficient * angle, rel=0.03)


def test_friction_raises_the_push_and_is_not_computed_without_a_coefficient() -> None:
    wire = GuideWire(1.0, 0.18, 10.0)
    push, work = [], []
    for coefficient in (0.0, 0.1, 0.2):
        insertion = Insertion(wire, VesselWall(bend_grid(), 1.0, friction=coefficient), [0, 0, 0], [0, 0, 1])
        solution = last(insertion, np.arange(1.0, 61.0))
        push.append(solution.push_force_N)
        work.append(solution.friction_energy_N_mm)
        assert insertion.work.problem.friction.load.size == 0 or coefficient > 0
        np.testing.assert_allclose(solution.reaction_force_N, -solution.contact_force_N.sum(axis=0), atol=1e-6)
    assert push[0] < push[1] < push[2]
    assert work[0] == 0.0 < work[1] < work[2]
