"""Finite torsional stiffness (eq. 5): the seed's ideal torque control is its limit."""

from __future__ import annotations

import numpy as np
import pytest

from solver import GuideWire, Insertion, VesselWall, relax
from tests.solver.scenes import last, tube_grid

CURVED = [[0, 0.1], [10, 0.1], [10, 0.0]]


def test_stiff_torsion_is_ideal_torque_control() -> None:
    wall = VesselWall(tube_grid(), 2.0)
    tips = []
    for torsion in (1e3, 1e5, np.inf):
        wire = GuideWire(1.0, 0.18, 5.0, CURVED, torsional_stiffness_N_mm2=torsion)
        insertion = Insertion(wire, wall, [0, 0, 0], [0, 0.1, 1], material_axis=[1, 0, 0])
        tips.append(last(insertion, np.arange(1.0, 31.0), roll=30.0).joints_mm[-1])
    off = [np.linalg.norm(t - tips[-1]) for t in tips[:-1]]
    assert off[1] < 0.02 * max(off[0], 1e-9)
    assert off[0] < 0.1


def test_a_twisted_straight_cantilever_turns_by_torque_over_stiffness() -> None:
    """A bent arm at the end of a straight shaft, loaded sideways, twists the shaft by T L/GJ."""
    torsion, shaft, arm, force = 4.0, 40.0, 6.0, 1e-4
    rest = [[0, 0.0], [arm, 0.0], [arm, 0.75], [arm + 2, 0.75], [arm + 2, 0.0]]
    wire = GuideWire(0.5, 0.1, 1e3, rest, torsional_stiffness_N_mm2=torsion)
    free = relax(wire, depth_mm=shaft + arm + 2, material_axis=[1, 0, 0])
    load = relax(wire, depth_mm=shaft + arm + 2, material_axis=[1, 0, 0], load_N=[0, force, 0])
    lever = free.joints_mm[-1, 0]
    twist = force * lever * shaft / torsion
    # the arm twists a little too, and the corner twists and bends: 10 % of the shaft's length
    assert load.joints_mm[-1, 1] / lever == pytest.approx(twist, rel=0.12)
    ideal = relax(
        GuideWire(0.5, 0.1, 1e3, rest), depth_mm=shaft + arm + 2, material_axis=[1, 0, 0], load_N=[0, force, 0]
    )
    assert abs(ideal.joints_mm[-1, 1]) < 0.2 * abs(load.joints_mm[-1, 1])


def test_torsion_delays_the_roll_of_the_tip_against_a_wall() -> None:
    def distance_free_wall() -> VesselWall:
        return VesselWall(tube_grid(), 2.0, friction=0.2)

    angle = []
    for torsion in (np.inf, 0.5):
        wire = GuideWire(1.0, 0.18, 5.0, CURVED, torsional_stiffness_N_mm2=torsion)
        insertion = Insertion(wire, distance_free_wall(), [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0])
        *_, before, after = insertion.to_depths([*np.arange(2.0, 31.0, 2.0), 30.0], [*[0.0] * 15, 40.0])
        assert before.converged
        assert after.converged
        angle.append(np.rad2deg(np.arctan2(after.joints_mm[-1, 1], after.joints_mm[-1, 0])))
    assert angle[1] < angle[0] - 1.0
