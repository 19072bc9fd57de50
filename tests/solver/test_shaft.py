"""The shaft outside the body: how far it lets the tip be behind the hand, and what its own friction takes."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_bvp, solve_ivp
from scipy.spatial.transform import Rotation

from solver import Grid, GuideWire, Insertion, Insertions, Solution, VesselWall
from tests.solver.scenes import last, tube_grid

RADIUS, DRAG, SHAFT, TORSION = 0.18, 0.02, 1000.0, 5.0


def inserted(coefficient: float = 0.0, torsion: float = TORSION, rest: float = 0.0, **shaft: Any) -> Insertion:
    """40 mm of wire in a straight tube, its tip pressed to the wall with 0.05 N."""
    wall = VesselWall(tube_grid(), 20.0, friction=coefficient)
    wire = GuideWire(1.0, RADIUS, 10.0, rest, torsional_stiffness_N_mm2=torsion)
    where = {"material_axis": [1, 0, 0], "tip_load_N": [0, 0.05, 0]} | shaft
    insertion = Insertion(wire, wall, [0, 1.8, 0], [0, 0, 1], **where)
    last(insertion, np.arange(1.0, 41.0))
    return insertion


def roll(insertion: Insertion, rolls: list[float]) -> Solution:
    *_, solution = solutions = list(insertion.to_depths([40.0] * len(rolls), rolls))
    assert all(s.converged for s in solutions)
    return solution


def behind(solution: Solution) -> float:
    """Roll of the hand over that of the tip, rad."""
    hand, tip = solution.frames[0], solution.frames[-1]
    return -math.atan2(tip[:, 0] @ hand[:, 1], tip[:, 0] @ hand[:, 0])


@pytest.mark.parametrize(("coefficient", "drag"), [(0.1, 0.0), (0.0, DRAG), (0.1, DRAG)])
def test_the_shaft_twists_by_the_torques_along_it(coefficient: float, drag: float) -> None:
    """T L/GJ by what the wire meets inside, and D r L/2GJ by friction that is alike all along the shaft."""
    insertion = inserted(coefficient, shaft_mm=SHAFT, shaft_friction_N=drag)
    solution = roll(insertion, [15.0 * i for i in range(1, 37)])
    normal = np.linalg.norm(solution.contact_force_N, axis=1).sum() / math.hypot(1.0, coefficient)
    inside, outside = coefficient * normal * RADIUS, drag * RADIUS
    assert solution.reaction_torque_N_mm == pytest.approx(inside + outside, rel=1e-3)
    lag = (inside * (40.0 + SHAFT) + outside * SHAFT / 2) / TORSION
    assert behind(solution) == pytest.approx(lag, rel=5e-3)
    lost = solution.friction_energy_N_mm
    assert lost == pytest.approx((inside + outside) * math.radians(15.0), rel=5e-3)


def test_ideal_torque_control_feels_the_friction_of_the_shaft_alone() -> None:
    solution = roll(inserted(torsion=math.inf, shaft_mm=SHAFT, shaft_friction_N=DRAG), [15.0, 30.0])
    assert solution.reaction_torque_N_mm == pytest.approx(DRAG * RADIUS, rel=1e-6)
    assert abs(behind(solution)) < 1e-3


@pytest.mark.parametrize("torsion", [0.5, 2.0])
def test_a_tip_behind_a_shaft_that_rubs_follows_the_hand_as_it_is_pushed(torsion: float) -> None:
    """(GJ/L) (hand - tip) = (D r / 2) r tip' / sqrt(1 + (r tip')^2) per mm pushed, in free space.

    With steps of 1 mm and 15 degrees the tip was up to 3 degrees off, 0.28 mm, converged and without a flag.
    """
    depths, rolls = np.array([20.0, 22.0, 23.0, 24.0]), np.radians([0.0, 90.0, 120.0, 240.0])
    spring, moment = torsion / SHAFT, 0.1 * RADIUS / 2

    def turn(depth: float, tip: np.ndarray) -> np.ndarray:
        share = np.clip(spring * (np.interp(depth, depths, rolls) - tip) / moment, -1.0 + 1e-6, 1.0 - 1e-6)
        return np.asarray(share / np.sqrt(1.0 - share**2) / RADIUS)

    own = solve_ivp(turn, (20.0, 24.0), [0.0], t_eval=depths, rtol=1e-9, atol=1e-11, max_step=0.01).y[0]
    wire = GuideWire(1.0, RADIUS, 1.0, [[0, 0.12], [10, 0.12], [10, 0.0]], torsional_stiffness_N_mm2=torsion)
    insertion = Insertion(
        wire, None, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0], shaft_mm=SHAFT, shaft_friction_N=0.1
    )
    found = list(insertion.to_depths(depths.tolist(), np.degrees(rolls).tolist()))
    seen = [math.atan2(*solution.joints_mm[-1, 1::-1]) for solution in found]
    # first order in steps of 0.1 mm and a degree: 0.22 degrees
    np.testing.assert_allclose(np.degrees(seen), np.degrees(own), rtol=0.0, atol=0.3)


def test_the_hand_pushes_against_the_friction_of_the_shaft() -> None:
    free, held = (inserted(shaft_mm=SHAFT, shaft_friction_N=drag) for drag in (0.0, DRAG))
    for depths, sign in (([41.0, 45.0], 1.0), ([44.0, 41.0], -1.0)):
        for a, b in zip(free.to_depths(depths), held.to_depths(depths), strict=True):
            np.testing.assert_allclose(a.joints_mm, b.joints_mm, rtol=0.0, atol=1e-6)
            assert b.push_force_N - a.push_force_N == pytest.approx(sign * DRAG, abs=1e-6)
    # the way there in four steps of 1 mm, but for the springs, which give way by 1 µm when the hand turns back
    assert b.friction_energy_N_mm == pytest.approx(3.0 * DRAG, rel=1e-3)


def test_a_shaft_that_is_pushed_turns_freely() -> None:
    """Friction acts against the whole motion: 5 mm of push let out the twist that the hand put in."""
    insertion = inserted(shaft_mm=SHAFT, shaft_friction_N=DRAG)
    twisted = roll(insertion, [15.0 * i for i in range(1, 25)])
    assert behind(twisted) == pytest.approx(DRAG * RADIUS * SHAFT / 2 / TORSION, rel=5e-3)
    *_, pushed = list(insertion.to_depths([41.0, 42.0, 43.0, 44.0, 45.0], 360.0))
    assert pushed.converged
    assert abs(behind(pushed)) < 0.02 * behind(twisted)
    assert pushed.push_force_N == pytest.approx(DRAG, rel=0.02)


def test_a_bent_tip_follows_the_hand_later() -> None:
    """The same roll of the hand turns the tip less the longer the shaft is."""
    angle = []
    for length in (0.0, 100.0, 1000.0):
        insertion = inserted(0.2, rest=0.02, shaft_mm=length, tip_load_N=[0, 0, 0])
        solution = roll(insertion, [20.0, 40.0])
        angle.append(behind(solution))
    assert 0.0 < angle[0] < angle[1] < angle[2]


def way_of_the_hand() -> tuple[list[float], list[float]]:
    """Depths and rolls: in, out, turned, and both; the first step of each is short, as friction turns round there."""
    inwards = np.arange(5.0, 15.01, 0.25)
    outwards = np.append(14.99, np.arange(14.75, 12.0, -0.25))
    turned = np.append(0.02, np.arange(2.0, 60.0, 2.0))
    onwards = np.append(outwards[-1] + 0.01, np.arange(12.5, 15.0, 0.25))
    depths = [*inwards, *outwards, *np.full(len(turned), outwards[-1]), *onwards]
    rolls = [*np.zeros(len(inwards) + len(outwards)), *turned, *(turned[-1] + 8.0 * (onwards - outwards[-1]))]
    return depths, rolls


@pytest.mark.parametrize("coefficient", [0.0, 0.2])
@pytest.mark.parametrize("rest", [0.0, 0.02])
@pytest.mark.parametrize("torsion", [TORSION, math.inf])
def test_the_work_of_the_hand_is_stored_or_dissipated(coefficient: float, rest: float, torsion: float) -> None:
    wire = GuideWire(1.0, RADIUS, 10.0, rest, torsional_stiffness_N_mm2=torsion)
    where = {"material_axis": [1, 0, 0], "tip_load_N": [0, 0.05, 0], "shaft_mm": 500.0, "shaft_friction_N": DRAG}
    one = Insertion(wire, VesselWall(tube_grid(), 20.0, friction=coefficient), [0, 1.8, 0], [0, 0, 1], **where)
    twin = one.clone()
    depths, rolls = way_of_the_hand()
    found = list(one.to_depths(depths, rolls))
    work = [0.0]
    for a, b in pairwise(found):
        turn = math.radians(b.roll_deg - a.roll_deg)
        pushed = 0.5 * (a.push_force_N + b.push_force_N) * (b.depth_mm - a.depth_mm)
        work.append(pushed + 0.5 * (a.reaction_torque_N_mm + b.reaction_torque_N_mm) * turn)
    taken_up = [s.energy_N_mm - found[0].energy_N_mm for s in found] + np.cumsum([s.dissipated_N_mm for s in found])
    np.testing.assert_allclose(taken_up - found[0].dissipated_N_mm, np.cumsum(work), rtol=0.0, atol=5e-3 * sum(work))
    assert not any(s.snaps for s in found)
    (beside,) = Insertions([twin]).to_depths([depths], [rolls])
    assert [s.dissipated_N_mm for s in beside] == [s.dissipated_N_mm for s in found]


def test_a_shaft_alone_dissipates_all_that_the_hand_does() -> None:
    """All of 0.1 N mm went without a word: the shaft's friction was in friction_energy_N_mm alone."""
    insertion = Insertion(
        GuideWire(0.5, RADIUS, 2.0), None, [0, 0, 0], [0, 0, 1], shaft_mm=500.0, shaft_friction_N=0.01
    )
    for solution in insertion.to_depths([10.0, 20.0, 30.0, 25.0]):
        assert solution.dissipated_N_mm == pytest.approx(solution.friction_energy_N_mm, rel=1e-9)
        assert solution.dissipated_N_mm == pytest.approx(0.1 if solution.depth_mm != 25.0 else 0.05, rel=1e-3)


@pytest.mark.parametrize("name", ["shaft_mm", "shaft_friction_N"])
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_a_shaft_that_cannot_be_is_refused(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"insertion: {name}: got"):
        Insertion(GuideWire(1.0, RADIUS, 10.0), None, [0, 0, 0], [0, 0, 1], **{name: value})


def rod_behind_a_shaft(depth: float, rest: float, load: tuple[float, float, float], shaft: float) -> Any:
    """Joints at arcs s, and the torque in the shaft, of a continuous rod (EI = GJ = 1) whose clamp turns with it."""
    frame = slice(0, 9)

    def slopes(_: Any, y: Any, share: float) -> Any:
        r, m = y[frame].reshape(3, 3, -1), y[12:15]
        bend = np.stack([m[0], m[1] + rest, m[2]])
        zero = np.zeros_like(m[0])
        turn = np.array([[zero, -bend[2], bend[1]], [bend[2], zero, -bend[0]], [-bend[1], bend[0], zero]])
        force = share * np.einsum("jin,j->in", r, np.array(load))
        rise = -np.cross(bend, m, axis=0) - np.stack([-force[1], force[0], zero])
        return np.concatenate([np.einsum("ijn,jkn->ikn", r, turn).reshape(9, -1), r[:, 2], rise])

    def ends(a: Any, b: Any, share: float) -> Any:
        base = Rotation.from_rotvec([0, 0, a[14] * shaft * share]).as_matrix()
        return np.concatenate([a[frame] - base.ravel(), a[9:12], b[12:15]])

    s = np.linspace(0.0, depth, 201)
    y = np.zeros((15, s.size))
    y[frame] = Rotation.from_rotvec(np.outer(rest * s, [0, 1, 0])).as_matrix().reshape(-1, 9).T
    y[9:12] = np.cumsum(y[[2, 5, 8]], axis=1) * depth / 200
    for share in np.linspace(0.1, 1.0, 10):
        found = solve_bvp(
            lambda x, y, c=share: slopes(x, y, c), lambda a, b, c=share: ends(a, b, c), s, y, tol=1e-7, max_nodes=5000
        )
        assert found.status == 0
        s, y = found.x, found.y
    return lambda at: found.sol(at)[9:12].T, float(found.sol(0.0)[14])


@pytest.mark.quick(1)
@pytest.mark.parametrize(("rest", "shaft"), [(0.15, 0.0), (0.15, 30.0), (0.3, 50.0)])
def test_a_shaft_twists_before_the_wire_bends(rest: float, shaft: float) -> None:
    """In one rotation vector with the bend a lag of 62 degrees made it of first order, 0.18 mm at 1 mm."""
    load = (-0.01, 0.02, 0.0)
    joints, torque = rod_behind_a_shaft(10.0, rest, load, shaft)
    off = []
    for segment in (0.5, 0.25):
        wire = GuideWire(segment, 0.18, 1.0, rest, 1.0)
        insertion = Insertion(
            wire, None, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0], tip_load_N=load, shaft_mm=shaft, tolerance=1e-12
        )
        (found,) = insertion.to_depths([10.0])
        assert found.converged
        assert abs(found.reaction_torque_N_mm) == pytest.approx(abs(torque), rel=2e-3)
        off.append(np.abs(found.joints_mm - joints(wire.arcs_at(10.0))).max())
    assert off[0] < 0.01
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.05)


def test_a_long_shaft_lags_by_more_than_half_a_turn() -> None:
    """A meter of wire pressed into a flat wall sticks until the torque is mu N r, after 285 degrees; it stalled."""
    x, _, _ = np.meshgrid(np.arange(-2, 2.1, 0.5), np.arange(-2, 2.1, 0.5), np.arange(-3, 26, 0.5), indexing="ij")
    wall = VesselWall(Grid(x - 0.08, [0.5] * 3, [-2, -2, -3]), 1.0, friction=0.3)
    wire = GuideWire(1.0, 0.18, 1e5, 0.0, 20.0)
    insertion = Insertion(wire, wall, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0], shaft_mm=1000.0)
    hands = [0.0, 90.0, 240.0, 330.0, 360.0]
    _, *found = insertion.to_depths([20.0] * 5, hands)
    assert all(s.converged for s in found)
    for solution in found[:2]:
        stuck = 20.0 / 1010.0 * np.radians(solution.roll_deg)
        assert solution.reaction_torque_N_mm == pytest.approx(stuck, rel=0.03)
    slips = 0.3 / np.hypot(1.0, 0.3) * 0.18 * np.linalg.norm(found[-1].contact_force_N.sum(axis=0))
    assert [s.reaction_torque_N_mm for s in found[2:]] == pytest.approx([slips] * 2, rel=0.1)
