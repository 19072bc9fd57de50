"""Many insertions at once: each comes to lie as it does by itself, whatever its neighbours do."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from solver import Grid, GuideWire, Insertion, Insertions, Solution, Status, VesselWall, skips
from solver._kernels.lanes.relax import POOL
from solver._kernels.lanes.vectors import WIDTH, room
from solver.crew import Job, first_points
from solver.insertions import kind_of
from tests.solver.entry_points import look_up_eight
from tests.solver.scenes import bend_grid, fork_grid, sampled, sheath_grid
from tests.solver.test_snaps import ringed

SAME_MM, STRAIGHT_MM = 1e-9, 2e-8
"""Curved wires: rounding (1e-14 mm here) with room. Straight ones describe a joint by its direction where they go
alone, and by its frame beside others: the same steps to second order, within what ``solver.tolerance`` leaves, 2e-6."""
CURVED = [[0, 0.12], [8, 0.12], [8, 0.0]]


@cache
def bend_wall(stiffness: float = 1.0) -> VesselWall:
    return VesselWall(bend_grid(), stiffness)


def wires_in_the_bend(**options: Any) -> list[Insertion]:
    """Eleven wires, no two alike: more than one team, the last of which is not full."""
    rng, made = np.random.default_rng(5), []
    for n in range(11):
        stiffness = [[0.0, 0.5 + rng.random()], [20.0, 4.0 + 8.0 * rng.random()]]
        wire = GuideWire(0.8 + 0.4 * rng.random(), 0.15 + 0.06 * rng.random(), stiffness, CURVED if n % 3 else 0.0)
        wall = bend_wall().like(stiffness_N_mm2=float(10.0 ** rng.uniform(-1.0, 1.0)))
        direction = np.array([0.0, 0.0, 1.0]) + 0.05 * rng.standard_normal(3)
        made.append(Insertion(wire, wall, 0.3 * rng.standard_normal(3), direction, **options))
    return made


def assert_same(together: list[list[Solution]], alone: list[list[Solution]]) -> None:
    for n, (ours, theirs) in enumerate(zip(together, alone, strict=True)):
        straight = any(s.work["sweeps_without_roll"] for s in theirs)
        same = STRAIGHT_MM if straight else SAME_MM
        for a, b in zip(ours, theirs, strict=True):
            where = str((n, b.depth_mm, straight))
            assert (a.status, a.depth_mm, a.roll_deg) == (b.status, b.depth_mm, b.roll_deg), where
            np.testing.assert_allclose(a.joints_mm, b.joints_mm, rtol=0, atol=same, err_msg=where)
            np.testing.assert_allclose(a.frames, b.frames, rtol=0, atol=same, err_msg=where)
            forces = 1e-3 + np.abs(b.contact_force_N).max()
            np.testing.assert_allclose(a.contact_force_N, b.contact_force_N, rtol=0, atol=1e2 * same * forces)
            np.testing.assert_allclose(a.reaction_force_N, b.reaction_force_N, rtol=0, atol=1e3 * same * forces)
            assert a.push_force_N == pytest.approx(b.push_force_N, abs=1e3 * same * forces), where
            # a torque is a force times a lever that is no longer than the wire
            torque = pytest.approx(b.reaction_torque_N_mm, abs=1e3 * same * forces * max(b.depth_mm, 1.0))
            assert a.reaction_torque_N_mm == torque, where
            assert a.energy_N_mm == pytest.approx(b.energy_N_mm, rel=1e-9, abs=1e-15), where
            assert a.least_pivot == pytest.approx(b.least_pivot, abs=1e2 * same), where
            assert a.dissipated_N_mm == pytest.approx(b.dissipated_N_mm, abs=1e3 * same * forces), where
            assert (a.uncertain, len(a.snaps)) == (b.uncertain, len(b.snaps)), where
            for ours_is, theirs_is in zip(a.snaps, b.snaps, strict=True):
                # a wire about to snap lies where its energy is flat: a place is known to the root of what an energy is
                np.testing.assert_allclose(ours_is[:3], theirs_is[:3], rtol=1e-8, atol=1e2 * same, err_msg=where)
                np.testing.assert_allclose(ours_is[3:], theirs_is[3:], rtol=1e-4, atol=1e2 * same, err_msg=where)
            assert a.max_penetration_mm == pytest.approx(b.max_penetration_mm, abs=same)
            # how often a wire is held back hangs on the last place of its numbers where that takes many iterations
            if not straight and b.work["levenberg"] < 20:
                counted = ("rest_shapes", "levenberg", "relaxations_without_friction", "starts_foreseen")
                assert [a.work[name] for name in counted] == [b.work[name] for name in counted], where


def both(make: Any, depths: Any, rolls: Any, threads: int = 1) -> list[list[Solution]]:
    """The same insertions together and one after the other: they must agree; what they found together."""
    together = Insertions(make(), threads=threads).to_depths(depths, rolls)
    alone = [list(one.to_depths(d, r)) for one, d, r in zip(make(), depths, rolls, strict=True)]
    assert_same(together, alone)
    return together


@pytest.mark.parametrize("threads", [1, 2])
def test_each_comes_to_lie_as_by_itself(threads: int) -> None:
    rng = np.random.default_rng(8)
    depths = [np.arange(2.0, 30.0 + 3 * n, 2.0 + 0.1 * n) for n in range(11)]
    rolls = [float(r) for r in rng.uniform(-180, 180, 11)]
    found = both(wires_in_the_bend, depths, rolls, threads)
    assert all(s.converged for solutions in found for s in solutions)
    assert max(s.max_penetration_mm for solutions in found for s in solutions) > 0.01, "they must touch"


def tips_at_a_septum() -> list[Insertion]:
    """Eight curved tips turned towards the next lumen, behind a wall of 0.6 mm that most are stiff enough to pass."""
    axes = (np.arange(-3, 7, 0.3), np.arange(-3, 3.1, 0.3), np.arange(-3, 30, 0.3))
    x, y, _ = np.meshgrid(*axes, indexing="ij")
    distance = np.minimum(np.hypot(x, y) - 1.2, np.hypot(x - 3, y) - 1.2)
    wall, made = VesselWall(Grid(distance, [0.3] * 3, [-3, -3, -3]), 1.0), []
    for n in range(8):
        wire = GuideWire(0.5, 0.18, [[0, 1.0], [15, 4.0]], [[0, 0.2 + 0.05 * n], [6, 0.2 + 0.05 * n], [6, 0]])
        own = wall.like(stiffness_N_mm2=(0.3, 1.0, 3.0, 10.0)[n % 4])
        made.append(Insertion(wire, own, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0]))
    return made


def test_tips_that_a_septum_stops_or_does_not() -> None:
    found = both(tips_at_a_septum, [np.arange(1.0, 26.0)] * 8, [0.0] * 8)
    statuses = {solution.status for solutions in found for solution in solutions}
    assert statuses >= {Status.CONVERGED, Status.THROUGH_WALL}


def test_back_again_rolled_and_to_no_depth_at_all() -> None:
    depths = [[20.0 + n, 35.0, 12.0, 0.0, 30.0] for n in range(11)]
    rolls = [[10.0 * n, 10.0 * n, 10.0 * n + 40.0, 0.0, 5.0] for n in range(11)]
    depths[3], rolls[3] = [], []
    depths[4], rolls[4] = [33.0], [50.0]
    both(wires_in_the_bend, depths, rolls)


def test_a_roll_that_moves_nothing_turns_the_frames_all_the_same() -> None:
    """A straight wire rolled in place, which takes no step; and a curved one at depth 0."""

    def made() -> list[Insertion]:
        wall = wires_in_the_bend()[0].wall
        wires = [GuideWire(1.0, 0.18, 1.0, rest) for rest in (0.0, 0.0, 0.01)]
        return [Insertion(wire, wall, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0]) for wire in wires]

    rolls = [30.0, 60.0, 90.0, 120.0]
    found = both(made, [[3.0, 3.0, 3.0, 4.0], [0.0, 0.0, 2.0, 2.0], [0.0, 0.0, 2.0, 2.0]], [rolls] * 3)
    for solution, roll in zip(found[0] + found[1], rolls * 2, strict=True):
        turned = np.degrees(np.arctan2(solution.frames[-1, 1, 0], solution.frames[-1, 0, 0]))
        assert turned == pytest.approx(roll, abs=1e-3)
    assert np.degrees(np.arccos(found[2][1].frames[0, 0, 0])) == pytest.approx(60.0)


def test_a_way_may_be_gone_in_parts_and_alone_in_between() -> None:
    insertions, whole = wires_in_the_bend(), wires_in_the_bend()
    many = Insertions(insertions, threads=1)
    parts = many.to_depths([10.0, 20.0], 30.0)
    for n, insertion in enumerate(insertions):
        parts[n] += list(insertion.to_depths([25.0], 30.0))
    for n, more in enumerate(many.to_depths([30.0, 40.0], 30.0)):
        parts[n] += more
    assert_same(parts, [list(one.to_depths([10.0, 20.0, 25.0, 30.0, 40.0], 30.0)) for one in whole])


def test_more_wires_than_a_pool_some_in_some_out() -> None:
    """Forty wires, in and out, of all lengths: lanes take others over, and a second pool follows."""
    wall = bend_wall()

    def make() -> list[Insertion]:
        wires = [GuideWire(1.0, 0.18, [[0, 0.5 + 0.05 * n], [20, 6.0]], CURVED) for n in range(POOL + 8)]
        return [Insertion(wire, wall, [0.01 * n, 0, 0], [0, 0, 1]) for n, wire in enumerate(wires)]

    count = POOL + 8
    depths = [np.linspace(1.0, 4.0 + n, 4) if n % 2 else np.linspace(4.0 + n, 1.0, 3) for n in range(count)]
    depths[7] = np.zeros(2)
    both(make, depths, [9.0 * n for n in range(count)])


@pytest.mark.parametrize("away", [0.0, 100.0])
def test_eight_places_are_looked_up_as_one_by_one(away: float) -> None:
    """Eight places beside each other, in the grid and beyond it: the jets that ``VesselWall.look_up`` finds."""
    wall, found = bend_wall(), room(11)
    points = np.random.default_rng(3).uniform(-2.0, 20.0, (WIDTH, 3)) + away
    value, slope, bend = wall.look_up(points)
    second = bend[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    found[:3] = (points - wall.middle_mm).T
    look_up_eight(wall.field, found, False)
    np.testing.assert_allclose(found[:10].T, np.column_stack([value, slope, second]), rtol=1e-12, atol=1e-12)
    # beyond the grid it counts as touching
    assert np.all((found[10] >= value - 1e-12) | (found[10] == 1.0))
    assert np.all(found[10] == 1.0) == (away > 0.0)
    found[:3] = (points - wall.middle_mm).T
    look_up_eight(wall.field, found, True)
    np.testing.assert_allclose(found[0], value, rtol=1e-12, atol=1e-12)


def test_one_that_can_go_no_further_holds_nobody_up() -> None:
    """A closed tube: some wires jam at its end, by the iteration limit or stalled; the others stop before it."""

    def distance(p: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
        return np.maximum(np.hypot(p[..., 0], p[..., 1]) - 0.5, p[..., 2] - 20.0)

    wall = VesselWall(sampled(distance, 0.25, (-3, -3, -4), (3, 3, 24)), 200.0)

    def make() -> list[Insertion]:
        wires = [GuideWire(1.0, 0.18, 15.0 + n) for n in range(5)]
        return [Insertion(wire, wall, [0.01, 0.02, 0], [0, 0, 1], max_iterations=20) for wire in wires]

    depths = [[10.0, 18.0, 60.0 if n < 2 else 19.0, 15.0] for n in range(5)]
    together = Insertions(make(), threads=1).to_depths(depths)
    alone = [list(one.to_depths(d)) for one, d in zip(make(), depths, strict=True)]
    # a jammed wire is at a snap after another: how it is jammed hangs on the last place of its numbers
    for ours, theirs in zip(together, alone, strict=True):
        assert_same([ours[:2]], [theirs[:2]])
        assert [s.converged for s in ours[:3]] == [s.converged for s in theirs[:3]]
    assert_same(together[2:], alone[2:])
    assert not together[0][2].converged
    assert together[0][2].depth_mm < 60.0


def test_joints_that_are_left_alone_and_branches() -> None:
    """A long sheath, where the joints near the base stay as they are; and a fork, each roll into its own branch."""
    sheath, fork = VesselWall(sheath_grid(0.25, 150.0), 1.0), VesselWall(fork_grid(), 2.0)

    def make() -> list[Insertion]:
        straight = [GuideWire(1.0, 0.18, 10.0 + n) for n in range(3)]
        curved = GuideWire(1.0, 0.18, [[0, 1.0], [30, 8.0]], CURVED)
        made = [Insertion(wire, sheath, [0, 0, -150.0], [0, 0, 1]) for wire in straight]
        return made + [Insertion(curved, fork, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0]) for _ in range(4)]

    depths = [[150.0, *np.arange(151.0, 206.0)]] * 3 + [np.arange(1.0, 41.0)] * 4
    found = both(make, depths, [0.0, 0.0, 0.0, 5.0, -20.0, 175.0, 190.0])
    assert sum(s.work["joints_left_still"] for s in found[0]) > 0
    assert [np.sign(solutions[-1].joints_mm[-1, 0]) for solutions in found[3:]] == [1, 1, -1, -1]


def test_a_snap_is_the_same_event_beside_others() -> None:
    """A ring on the tube's wall, on which curved tips catch, each elsewhere: steps taken again, events, doubts."""
    wall = VesselWall(sampled(ringed, 0.3, (-4, -4, -3), (4, 4, 34), "float32"), 3.0)

    def make() -> list[Insertion]:
        wires = [
            GuideWire(1.0, 0.18, [[0, 0.5 + 0.1 * n], [15, 2.0]], [[0, 0.3], [6, 0.3], [6, 0.0]]) for n in range(8)
        ]
        return [Insertion(wire, wall, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0]) for wire in wires]

    found = both(make, [np.arange(1.0, 31.0)] * 8, [10.0 * n for n in range(8)])
    assert sum(len(s.snaps) for solutions in found for s in solutions) > 3
    assert 3 < sum(s.uncertain for solutions in found for s in solutions) < 100


def test_a_wire_that_is_moved_elsewhere_is_refused_and_ways_before_are_over() -> None:
    first, second = wires_in_the_bend()[:2]
    way = first.to_depths([2.0, 4.0])
    next(way)
    first._hold()
    with pytest.raises(RuntimeError, match="another thread"):
        Insertions([second, first]).to_depths([5.0])
    first._release()
    Insertions([second, first]).to_depths([5.0])
    assert (first.depth_mm, second.depth_mm) == (5.0, 5.0)
    with pytest.raises(RuntimeError, match="later call"):
        next(way)
    clone = first.clone()
    (ours, _), (theirs, _) = Insertions([first, second]).to_depths([9.0, 12.0])
    np.testing.assert_array_equal(ours.joints_mm, next(clone.to_depths([9.0])).joints_mm)
    assert theirs.depth_mm == 9.0


def test_those_that_cannot_go_in_lock_step_go_by_themselves() -> None:
    wall = bend_wall()

    def make() -> list[Insertion]:
        wire, twisting = GuideWire(2.0, 0.18, 10.0, CURVED), GuideWire(2.0, 0.18, 10.0, CURVED, 4.0)
        with skips.off("foresight"):
            slow = Insertion(wire, wall, [0, 0, 0], [0, 0, 1])
        return [
            Insertion(wire, wall.like(friction=0.1), [0, 0, 0], [0, 0, 1]),
            Insertion(twisting, wall, [0, 0, 0], [0, 0, 1]),
            Insertion(wire, VesselWall(bend_grid(), 1.0, hull="samples:8"), [0, 0, 0], [0, 0, 1]),
            Insertion(wire, None, [0, 0, 0], [0, 0, 1]),
            Insertion(wire, wall, [9, 9, 9], [0, 0, 1]),
            Insertion(wire, wall, [0, 0, 0], [0, 0, 1], max_joints=5),
            Insertion(wire, wall, [0, 0, 0], [0, 0, 1], shaft_mm=100.0, shaft_friction_N=0.01),
            Insertion(GuideWire(2.0, 0.18, 10.0, weight_N_per_mm=1e-5), wall, [0, 0, 0], [0, 0, 1], down=[0, -1, 0]),
            slow,
        ]

    assert [kind_of(Job(one, [30.0], [0.0], [])) for one in make()] == [None] * 9
    both(make, [[10.0, 30.0]] * 9, [0.0] * 9)


@pytest.mark.parametrize("quadrature", ["tip", "joints", "segments"])
def test_look_up_points_stand_in_line(quadrature: str) -> None:
    work = Insertion(GuideWire(1.0, 0.18, 10.0), bend_wall(), [0, 0, 0], [0, 0, 1], quadrature=quadrature)._work
    for k in (1, 3, 5, 6, 20):
        work.lay_out(float(k))
        np.testing.assert_array_equal(first_points(work, k), work.problem.chain.first[: k + 2])


def test_a_wall_made_from_another_shares_its_grid() -> None:
    wall = bend_wall()
    other = wall.like(stiffness_N_mm2=7.0, friction=0.2)
    assert (other.stiffness_N_mm2, other.friction, wall.stiffness_N_mm2) == (7.0, 0.2, 1.0)
    assert other.field.coefficients is wall.field.coefficients
    with pytest.raises(ValueError, match="stiffness_N_mm2"):
        wall.like(stiffness_N_mm2=-1.0)


def test_a_wall_shifted_by_a_smooth_offset_is_the_wall_of_the_sum() -> None:
    wall = bend_wall()
    x, y, z = np.indices(wall.distance.shape)
    offset = 0.05 * np.sin(0.4 * x + 1.0) * np.cos(0.3 * y) * np.cos(0.2 * z)
    values = np.asarray(wall.distance.values)
    shifted, whole = wall.shifted(offset), VesselWall(wall.distance.with_values(values + offset), 1.0)
    points = wall.distance.to_mm(np.random.default_rng(0).uniform(-2.0, np.array(wall.distance.shape) + 1.0, (200, 3)))
    pairs = zip(shifted.look_up(points), whole.look_up(points), (1e-5, 1e-4, 1e-3), strict=True)
    for got, wanted, rounding in pairs:  # coefficients are float32: 1e-6 mm
        np.testing.assert_allclose(got, wanted, rtol=0.0, atol=rounding)
    assert shifted.field.slope == pytest.approx(whole.field.slope, rel=1e-4)
    assert np.array_equal(np.asarray(wall.distance.values), values), "the wall that it is made from stays"
    wires = [
        next(Insertion(GuideWire(1.0, 0.18, 10.0), one, [0, 0, 0], [0, 0, 1]).to_depths([50.0]))
        for one in (shifted, whole, wall)
    ]
    np.testing.assert_allclose(wires[0].joints_mm, wires[1].joints_mm, rtol=0.0, atol=1e-4)
    assert np.abs(wires[0].joints_mm - wires[2].joints_mm).max() > 0.005  # fifty times the tolerance above


def test_a_wire_that_went_beside_others_is_whole_where_its_next_depth_is_refused() -> None:
    """It had one joint, at the entry: its workspace did not know how far it had come."""
    made = [Insertion(GuideWire(1.0, 0.18, 10.0), bend_wall(), [0, 0, 0], [0, 0, 1], max_joints=20) for _ in range(2)]
    there = Insertions(made, threads=1).to_depths([15.0])[0][0]
    refused = next(made[0].to_depths([25.0]))
    assert refused.status is Status.TOO_LONG
    np.testing.assert_array_equal(refused.joints_mm, there.joints_mm)


def test_one_insertion_twice_and_no_threads_are_refused() -> None:
    insertion = Insertion(GuideWire(1.0, 0.18, 10.0), bend_wall(), [0, 0, 0], [0, 0, 1])
    with pytest.raises(ValueError, match="insertions"):
        Insertions([insertion, insertion])
    with pytest.raises(ValueError, match="threads"):
        Insertions([insertion], threads=0)
    assert Insertions([]).to_depths([10.0]) == []
    assert Insertions([]).to_depths([10.0], np.array(5.0)) == [], "one number for all, as Insertion takes it"
