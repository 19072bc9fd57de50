"""Finite torsional stiffness (eq. 5): the seed's ideal torque control is its limit."""

from __future__ import annotations

import numpy as np
import pytest

from solver import GuideWire, Insertion, Solution, VesselWall, relax
from tests.solver.scenes import Array, last, sampled, tube_grid

CURVED = [[0, 0.1], [10, 0.1], [10, 0.0]]


def ring_distance(p: Array) -> Array:
    """A tube of radius 0.45 mm that bends with 30 mm of radius from the entry on."""
    x, y, z = p[..., 0], p[..., 1], p[..., 2]
    return np.asarray(np.hypot(np.where(z > 0, 30.0 - np.hypot(x - 30.0, z), x), y) - 0.45)


def in_ring(**how: float) -> Insertion:
    """A wire that is curved at rest nearly as the tube is: turned by 180 degrees it wants to whip round."""
    wall = VesselWall(sampled(ring_distance, 0.25, (-3, -2, -3), (33, 2, 36)), 100.0)
    wire = GuideWire(0.5, 0.18, 5.0, 0.03, torsional_stiffness_N_mm2=2.0)
    return Insertion(wire, wall, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0], **how)  # type: ignore[arg-type]


def rolled(insertion: Insertion, rolls: list[float]) -> list[Solution]:
    return list(insertion.to_depths([40.0] * len(rolls), rolls))


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


def test_a_whip_is_foreseen() -> None:
    """By bending alone the pivot was 1.003 a quarter of a degree before; it is below 0.1 for a degree and a half."""
    insertion = in_ring(finest_mm=0.01)
    list(insertion.to_depths(np.arange(1.0, 41.0)))
    found = rolled(insertion, [*np.arange(10.0, 187.0, 10.0), *np.arange(187.0, 189.1, 0.25)])
    whip = next(n for n, s in enumerate(found) if s.snaps)
    assert 188.0 < found[whip].roll_deg <= 188.5
    assert found[whip].snaps[0].released_N_mm > 0.03
    before = [s.least_pivot for s in found[:whip]]
    assert found[0].least_pivot > 0.9
    assert np.all(np.diff(before[14:]) < 0.0), "softer and softer once the torque falls, beyond 145 degrees"
    assert before[-1] < 0.02
    assert before[-6] < 0.1
    assert found[whip].least_pivot > 0.3


@pytest.mark.parametrize(("shaft", "middle"), [(0.0, 170.0), (30.0, 290.0)])
def test_the_pivot_of_twist_is_the_compliance_by_the_slope_of_the_torque(shaft: float, middle: float) -> None:
    insertion = in_ring(shaft_mm=shaft, tolerance=1e-13)
    list(insertion.to_depths(np.arange(1.0, 41.0)))
    step = 0.1
    low, here, high = rolled(insertion, [0.5 * middle, middle - step, middle, middle + step])[1:]
    slope = (high.reaction_torque_N_mm - low.reaction_torque_N_mm) / np.deg2rad(2 * step)
    # the last half segment has no joint
    compliance = (shaft + 40.0 - 0.25) / 2.0
    assert slope < 0.0
    # above 0.5 the pivot may be that of an iteration before the last
    assert here.least_pivot == pytest.approx(1.0 / (1.0 - compliance * slope), rel=0.01)


def test_a_fork_of_torsion_is_told() -> None:
    """At 180 degrees the tip turns to one of two sides, 140 degrees apart, at 35 mm: not a word was said of it."""
    sides = [list(in_ring().to_depths(np.arange(1.0, 46.0), 180.0 + aside)) for aside in (1e-3, -1e-3)]
    for found in sides:
        assert all(s.converged for s in found)
        apart = [float(a.frames[-1, :, 0] @ b.frames[-1, :, 0]) for a, b in zip(*sides, strict=True)]
        forked = next(n for n, cosine in enumerate(apart) if cosine < 0.99)
        assert 33.0 < found[forked].depth_mm < 37.0
        assert all(s.uncertain for s in found[forked:])
        assert not any(s.uncertain for s in found[: forked - 3])
        assert found[forked - 1].least_pivot < 0.1
    assert not any(s.uncertain for s in in_ring().to_depths(np.arange(1.0, 46.0), 179.5)), "there the side is sure"
