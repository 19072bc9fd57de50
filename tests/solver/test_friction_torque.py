"""Friction against rolling: the torque of a pressed hull, the tip behind the hand, and a shaft that whips in a bend."""

from __future__ import annotations

import math

import numpy as np
import pytest

from solver import GuideWire, Insertion, Solution, VesselWall
from tests.analytic import whipped_tip
from tests.later import later
from tests.solver.scenes import bend_distance, sampled, tube_grid

RADIUS = 0.18


def pressed(coefficient: float, torsion: float, turn: float = 15.0, hull: str = "offset") -> list[Solution]:
    """40 mm of straight wire, its tip pressed sideways with 0.05 N, and rolled by a whole turn at that depth."""
    wall = VesselWall(tube_grid(), 20.0, friction=coefficient, hull=hull)
    wire = GuideWire(1.0, RADIUS, 10.0, torsional_stiffness_N_mm2=torsion)
    insertion = Insertion(wire, wall, [0, 1.8, 0], [0, 0, 1], tip_load_N=[0, 0.05, 0], roll_step_deg=turn)
    depths, rolls = [*np.arange(1.0, 41.0), *[40.0] * 24], [*[0.0] * 40, *(15.0 * np.arange(1, 25))]
    solutions = list(insertion.to_depths(depths, rolls))
    assert all(s.converged for s in solutions)
    return solutions


def tip_behind(solution: Solution) -> float:
    """Roll of the base over that of the tip, rad, of a wire that hardly bends."""
    base, tip = solution.frames[0], solution.frames[-1]
    return -math.atan2(tip[:, 0] @ base[:, 1], tip[:, 0] @ base[:, 0])


@pytest.mark.parametrize("turn", [5.0, 15.0])
@pytest.mark.parametrize("torsion", [math.inf, 5.0])
@pytest.mark.parametrize("coefficient", [0.1, 0.3])
def test_torque_of_a_pressed_wire(coefficient: float, torsion: float, turn: float) -> None:
    """The hand's torque is μ N r, and its work is lost; the tip lags behind by what that torque twists the wire.

    The wall's force has a part N along the normal and μ N against the roll, which drives the wire up the wall.
    """
    *_, before, after = solutions = pressed(coefficient, torsion, turn)
    normal = np.linalg.norm(after.contact_force_N, axis=1).sum() / math.hypot(1.0, coefficient)
    torque = coefficient * normal * RADIUS
    assert after.reaction_torque_N_mm == pytest.approx(torque, rel=1e-3)
    assert normal == pytest.approx(0.05 * math.cos(math.atan(coefficient)), rel=0.02)
    turned = math.radians(after.roll_deg - before.roll_deg)
    # the wire is rolled uphill until it is as far up as friction holds it, and goes on rolling there
    assert after.friction_energy_N_mm == pytest.approx(torque * turned, rel=2e-3)
    assert sum(s.friction_energy_N_mm for s in solutions[40:]) < torque * 2 * math.pi
    # the contact ends half a millimetre before the tip, and there is torque in all of the wire up to it
    lag = torque * 40.0 / torsion
    assert tip_behind(after) == pytest.approx(lag, rel=0.02, abs=1e-4)


def test_sampled_hull_meets_the_torque_of_the_smooth_one() -> None:
    """16 points: between two of them the hull is 2 % flatter, and the torque goes up and down with it."""
    smooth, sampled_hull = (pressed(0.1, 5.0, hull=hull)[-8:] for hull in ("offset", "samples:16"))
    torque = [np.mean([s.reaction_torque_N_mm for s in run]) for run in (smooth, sampled_hull)]
    assert torque[1] == pytest.approx(torque[0], rel=0.05)


def test_without_friction_a_straight_wire_rolls_free() -> None:
    assert all(s.reaction_torque_N_mm == 0.0 and s.friction_energy_N_mm == 0.0 for s in pressed(0.0, 5.0)[40:])


@pytest.mark.quick(1)
@pytest.mark.parametrize(("coefficient", "rest"), [(0.0, 0.08), (0.1, 0.08), *later((0.1, 0.0))])
def test_a_shaft_whips_in_a_bend_as_the_closed_form_says(coefficient: float, rest: float) -> None:
    """Hand and tip of a pulled shaft in a curved tube, with and without a bend of its own, with and without friction.

    The tension F presses F κ on the inner wall everywhere but within (EI/F)^½ = 0.45 mm of the ends: 2 % of 45 mm.
    Voxels of 0.15 mm: with 0.25 the distance alone is 0.8 % of that; segments of 0.125 mm change 0.1 %.
    """
    lumen, length, force, bend, twist = 0.5, 45.0, 0.5, 0.1, 0.4
    inner = 30.0 - (lumen - RADIUS)  # radius that the axis of the wire is bent to
    grid = sampled(lambda p: bend_distance(p, inlet=0.0, lumen=lumen), 0.15, (-3, -3, -3), (34, 3, 34), "float32")
    wire = GuideWire(0.25, RADIUS, bend, rest, torsional_stiffness_N_mm2=twist)
    insertion = Insertion(
        wire,
        VesselWall(grid, 20.0, friction=coefficient),
        [lumen - RADIUS, 0, 0],
        [0, 0, 1],
        material_axis=[1, 0, 0],
        tip_load_N=[force * math.sin(length / inner), 0, force * math.cos(length / inner)],
    )
    rolls = 10.0 * np.arange(1, 16)
    depths = [*np.arange(1.0, 46.0), *[length] * len(rolls)]
    solutions = list(insertion.to_depths(depths, [*[0.0] * 45, *rolls]))
    assert all(s.converged for s in solutions)
    stiffening = bend * rest / inner / twist
    friction = coefficient / math.hypot(1.0, coefficient) * RADIUS * force / inner / twist
    for solution in solutions[-7::3]:
        hand, tip = math.radians(solution.roll_deg), solution.frames[-1]
        inwards = np.cross([0, 1, 0], tip[:, 2])
        found = math.atan2(tip[1, 0], tip[:, 0] @ inwards)
        expected = whipped_tip(stiffening, friction, length, hand)
        assert hand - found == pytest.approx(hand - expected, rel=0.02)
