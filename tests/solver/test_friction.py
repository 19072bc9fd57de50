"""Coulomb friction from step to step: the capstan, work and its loss, what is remembered; nothing at all at μ = 0."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from solver import Grid, GuideWire, Insertion, Solution, Status, VesselWall
from tests.later import later
from tests.solver.scenes import bend_distance, bend_grid, held_by_friction, last, sampled, winding

Array = NDArray[np.float64]
WIRE = GuideWire(1.0, 0.18, 10.0)
CURVED = GuideWire(1.0, 0.18, 10.0, [[0, 0.05], [10, 0.05], [15, 0.0]])


def in_bend(wire: GuideWire, coefficient: float, step: float = 1.0, hull: str = "offset") -> Insertion:
    wall = VesselWall(bend_grid(), 1.0, friction=coefficient, hull=hull)
    return Insertion(wire, wall, [0, 0, 0], [0, 0, 1], step_mm=step)


def all_of(insertion: Insertion, depths: Sequence[float] | Array) -> list[Solution]:
    solutions = list(insertion.to_depths(depths))
    assert all(s.converged for s in solutions)
    return solutions


def axial(joints: Array, force: Array, load: Array) -> Array:
    """Axial force in each segment, N: everything that acts on the wire beyond it, along it."""
    along = np.diff(joints, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    ahead = np.cumsum((force + load)[::-1], axis=0)[::-1]
    return np.asarray(np.einsum("na,na->n", ahead[1:], along))


@pytest.mark.parametrize("coefficient", [0.1, 0.3])
def test_capstan(coefficient: float) -> None:
    """A limp wire pulled back around a bend by its tip load: tension grows by exp(μ Θ).

    It rubs on the inside of the bend, where it is 28.18 mm from the axis of the bend and its hull 28 mm: it slides
    less there by that share, and the moment of friction about the axis carries 0.6 % of the tension.
    """
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
    exponent = np.log(tension[low] / tension[high])
    assert exponent == pytest.approx(coefficient * angle, rel=0.01)
    assert exponent == pytest.approx(coefficient * angle * 28.0 / 28.18, rel=1e-3)


def test_friction_raises_the_push_and_is_not_computed_without_a_coefficient() -> None:
    push, work = [], []
    for coefficient in (0.0, 0.1, 0.2):
        insertion = in_bend(WIRE, coefficient)
        solution = last(insertion, np.arange(1.0, 61.0))
        push.append(solution.push_force_N)
        work.append(solution.friction_energy_N_mm)
        assert insertion._work.problem.friction.load.size == 0 or coefficient > 0
        np.testing.assert_allclose(
            solution.reaction_force_N, -solution.contact_force_N.sum(axis=0), rtol=0.0, atol=1e-6
        )
    assert push[0] < push[1] < push[2]
    assert work[0] == 0.0 < work[1] < work[2]


@pytest.mark.quick(1)
@pytest.mark.parametrize(
    ("wire", "hull"),
    [(WIRE, "offset"), (CURVED, "samples:16"), *later((WIRE, "samples:16"), (CURVED, "offset"))],
    ids=["straight-offset", "curved-samples", "straight-samples", "curved-offset"],
)
def test_push_and_loss_do_not_depend_on_the_step(wire: GuideWire, hull: str) -> None:
    """Steps of 0.1 (the longest with friction) to 0.01 mm over the last 5 mm; the hull's own radius is no way slid."""
    push, lost = [], []
    for step in (0.1, 0.05, 0.02, 0.01):
        insertion = in_bend(wire, 0.2, step, hull)
        last(insertion, np.arange(1.0, 56.0))
        solution = last(insertion, [60.0])
        push.append(solution.push_force_N)
        lost.append(solution.friction_energy_N_mm)
    np.testing.assert_allclose(push, push[-1], rtol=2e-3)
    # a wire that bends back at rest creeps to and fro in a step: it slides further the closer one looks
    np.testing.assert_allclose(lost, lost[-1], rtol=2e-2 if hull != "offset" else 1e-2)


def test_steps_shorter_than_the_spring_lose_no_friction() -> None:
    """30 steps of 0.3 µm where a contact slips after 1 µm; the push grows by what 9 µm of depth give."""
    insertion = in_bend(WIRE, 0.3)
    before, ahead = all_of(insertion, np.arange(1.0, 72.0))[-2:]
    after = last(insertion, 71.0 + 3e-4 * np.arange(1, 31))
    slope = ahead.push_force_N - before.push_force_N
    assert after.push_force_N == pytest.approx(ahead.push_force_N + 0.009 * slope, rel=5e-3)


def test_a_wire_pulled_back_sticks_first() -> None:
    """0.2 µm back is less than the springs give way: nothing slips, the push falls a little, and comes back."""
    insertion = in_bend(WIRE, 0.3)
    there = all_of(insertion, np.arange(1.0, 61.0))[-1]
    back, again = all_of(insertion, [60.0 - 2e-4, 60.0])
    assert back.friction_energy_N_mm < 0.1 * there.friction_energy_N_mm * 2e-4
    assert 0.5 * there.push_force_N < back.push_force_N < there.push_force_N
    assert again.push_force_N == pytest.approx(there.push_force_N, rel=1e-2)


def test_loss_of_a_depth_is_that_of_all_its_steps() -> None:
    one, many = in_bend(WIRE, 0.2), in_bend(WIRE, 0.2)
    for insertion in (one, many):
        last(insertion, np.arange(1.0, 51.0))
    total = sum(s.friction_energy_N_mm for s in all_of(many, np.arange(51.0, 61.0)))
    assert last(one, [60.0]).friction_energy_N_mm == pytest.approx(total, rel=1e-3)


@pytest.mark.parametrize("wire", [WIRE, CURVED], ids=["straight", "curved"])
@pytest.mark.parametrize("coefficient", [0.0, 0.3, *later(0.1)])
def test_work_is_change_of_energy_and_loss(wire: GuideWire, coefficient: float) -> None:
    """75 mm in and 30 mm out by 0.25 mm: the hand's work is what the wire stores and what friction takes.

    Its push is integrated by the trapezium rule; where the hand turns back the push falls within half a millimetre, and
    the first millimetre is looked at in 20 steps.
    """
    way_in = 0.25 * np.arange(1, 301)
    way_out = 75.0 - np.concatenate([0.05 * np.arange(1, 20), 0.25 * np.arange(4, 121)])
    solutions = all_of(in_bend(wire, coefficient), [*way_in, *way_out])
    push, energy = (np.array([0.0, *(getattr(s, n) for s in solutions)]) for n in ("push_force_N", "energy_N_mm"))
    work = 0.5 * (push[1:] + push[:-1]) * np.diff([0.0, *way_in, *way_out])
    lost = np.array([s.friction_energy_N_mm for s in solutions])
    gap = work - np.diff(energy) - lost
    assert abs(gap[:300].sum()) < 5e-3 * abs(work[:300]).sum()
    assert abs(gap[300:].sum()) < 5e-3 * abs(work[300:]).sum()
    assert (lost >= 0.0).all()


@pytest.mark.parametrize("wire", [WIRE, CURVED], ids=["straight", "curved"])
def test_work_and_loss_agree_where_the_hand_turns_back(wire: GuideWire) -> None:
    """By whole millimetres: the push turns into a pull within a tenth of one, and back, and a roll turns it aside.

    The trapezium rule over that millimetre found 0.00009 N mm of 0.0055.
    """
    insertion = in_bend(wire, 0.2)
    last(insertion, np.arange(1.0, 61.0))
    for depth, roll in ((59.0, 0.0), (55.0, 0.0), (56.0, 0.0), (60.0, 0.0), (60.0, 30.0), (60.0, 0.0), (61.0, 0.0)):
        solution = next(insertion.to_depths([depth], roll))
        assert solution.converged
        rubbed = solution.friction_energy_N_mm
        assert solution.dissipated_N_mm == pytest.approx(rubbed, rel=0.02, abs=2e-5), (depth, roll)


def test_forces_after_a_failed_step_are_those_of_the_state_that_is_kept() -> None:
    """The tip leaves the grid within the last step: that step's length, loads and friction are forgotten."""
    grid = sampled(bend_distance, 0.3, (-5, -5, -5), (15, 5, 65), "float32")
    wall = VesselWall(grid, 1.0, friction=0.3)
    insertion = Insertion(WIRE, wall, [0, 0, 0], [0, 0, 1], tip_load_N=[0.0, 0.004, 0.0], finest_mm=1.0)
    good = None
    depths = np.arange(1.0, 90.0, 0.05)  # less than the longest step with friction: each is one step, or none
    for depth in depths:
        solution = next(insertion.to_depths([depth]))
        if not solution.converged:
            break
        good = solution
    assert good is not None
    assert solution.status is Status.LEFT_GRID
    assert solution.depth_mm == good.depth_mm > 50.0
    np.testing.assert_array_equal(solution.contact_force_N, good.contact_force_N)
    assert solution.push_force_N == pytest.approx(good.push_force_N, rel=1e-12)
    # and the wire goes on from there as if nothing had been tried
    again = Insertion(WIRE, wall, [0, 0, 0], [0, 0, 1], tip_load_N=[0.0, 0.004, 0.0], finest_mm=1.0)
    last(again, depths[depths < good.depth_mm + 0.01])
    one, other = last(insertion, [good.depth_mm - 1.0]), last(again, [good.depth_mm - 1.0])
    np.testing.assert_allclose(one.contact_force_N, other.contact_force_N, rtol=0.0, atol=1e-12)


def test_room_for_a_longer_wire_keeps_contact_and_friction() -> None:
    """Asked for again with room for more joints made meanwhile, a wire is what it was."""
    insertion = in_bend(CURVED, 0.3)
    there = last(insertion, np.arange(1.0, 61.0))
    again = next(insertion.to_depths([60.0, 500.0]))
    assert np.abs(there.contact_force_N).max() > 1e-3
    np.testing.assert_array_equal(again.contact_force_N, there.contact_force_N)
    assert again.push_force_N == pytest.approx(there.push_force_N, rel=1e-12)


def test_a_wire_that_leaves_the_wall_takes_no_friction_along() -> None:
    """A hook rolled on a wall of high friction until it lets go, in few and in many turns: then nothing bends it."""
    wall = VesselWall(sampled(lambda p: np.abs(p[..., 1]) - 2.2, 0.6, (-16, -7, -6), (16, 7, 40)), 0.7, friction=0.4)
    wire = GuideWire(0.68, 0.18, [[0, 3.0], [30, 5.6]], [[0, 0.08], [10, 0.08], [10, 0.0]])
    insertion = Insertion(wire, wall, [0, 0, 0], [0, 0, 1], material_axis=[0, 1, 0])
    free = 0
    for solution in insertion.to_depths([12.0] * 30, np.arange(30) * 30.0):
        if solution.converged and not solution.contact_force_N.any():
            free += 1
            # rest, but for the last place of a tip that may touch without a load
            assert solution.energy_N_mm < 1e-12
    assert free > 5


@pytest.mark.parametrize("segment_mm", [1.0, 0.25])
@pytest.mark.parametrize("step_mm", [1.0, 0.25])
def test_what_leaves_the_lumen_has_rubbed_on_its_way(segment_mm: float, step_mm: float) -> None:
    """A stiff wire pressed evenly loses mu k d (L1^2 - L2^2)/2 in and out, whatever the step; out it was 3 % short.

    What is left are the springs that turn round: 1e-3 mm of way.
    """
    x, _, _ = np.meshgrid(np.arange(-4, 4.1, 0.5), np.arange(-3, 3.1, 0.5), np.arange(-3, 34, 0.5), indexing="ij")
    wall = VesselWall(Grid(x, [0.5] * 3, [-4, -3, -3]), 1.0, friction=0.1)
    wire = GuideWire(segment_mm, 0.18, 1e7)
    how = {"step_mm": step_mm, "finest_mm": step_mm}
    insertion = Insertion(wire, wall, [-0.08, 0, 0], [0, 0, 1], quadrature="segments", **how)
    list(insertion.to_depths([10.0]))
    for ends in ((10.0, 20.0), (20.0, 10.0)):
        depths = np.linspace(*ends, round(10.0 / step_mm) + 1)[1:]
        lost = sum(s.friction_energy_N_mm for s in insertion.to_depths(depths.tolist()))
        assert lost == pytest.approx(0.1 * 0.1 * (20.0**2 - 10.0**2) / 2, rel=2e-3)


@pytest.mark.parametrize("longest_mm", [0.1, 1.0])
def test_a_wire_that_friction_holds_stays_where_it_is(longest_mm: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """One step of 0.05 mm let it go by 8 mm, of which "it gave way" was said; five of 0.01 mm from there did not.

    longest_mm : of steps with friction; after longer ones, too, it is the loads of the step before that hold the wire.
    """
    monkeypatch.setattr("solver.insertion.RUBBING_STEP_MM", longest_mm)
    wire, wall, roll = held_by_friction()
    insertion = Insertion(wire, wall, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0])
    there = list(insertion.to_depths(np.arange(2.0, 29.0, 2.0), roll))[-1]
    ways = [28.05], [28.01, 28.02, 28.03, 28.04, 28.05]
    one, other = (list(insertion.clone().to_depths(way, roll))[-1] for way in ways)
    assert not one.snaps
    np.testing.assert_allclose(one.joints_mm[-1], there.joints_mm[-1], rtol=0.0, atol=0.2)
    np.testing.assert_allclose(one.joints_mm, other.joints_mm, rtol=0.0, atol=0.01)


@pytest.mark.quick(1)
@pytest.mark.parametrize("step_mm", [0.05, 0.02, 0.01])
def test_a_wire_that_friction_lets_go_is_followed(step_mm: float) -> None:
    """Loads that fall ever faster had not settled after 60 rounds: steps of 0.02 mm ended at 14.9 mm, for good."""
    wire, wall, roll = held_by_friction()
    insertion = Insertion(wire, wall, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0], step_mm=step_mm)
    assert all(s.converged for s in insertion.to_depths([14.0, 16.0, 12.0], roll))


def test_where_friction_may_have_let_go_is_doubted_for_a_centimetre() -> None:
    """2.5 mm on, the wire of longer steps was still on the other side, 5 mm off, and nothing said so."""
    wire, wall, roll = held_by_friction()
    found = list(
        Insertion(wire, wall, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0]).to_depths(np.arange(1.0, 40.0), roll)
    )
    doubted = np.array([s.depth_mm for s in found if s.uncertain])
    assert len(doubted) > 5
    ends = doubted[np.append(np.diff(doubted) > 1.5, True)]
    begins = doubted[np.insert(np.diff(doubted) > 1.5, 0, True)]
    assert all(end - begin > 7.0 or end == found[-1].depth_mm for begin, end in zip(begins, ends, strict=True))


def test_a_wire_in_a_tight_lumen_keeps_to_the_steps_that_succeed() -> None:
    """0.05 mm of room: steps of 0.1 mm fail there, and were tried again after every shorter one until 36,000 iterations
    were spent at 7.15 mm.
    """
    axis = winding(np.random.default_rng([17, 27]), 12.0, 6.0, 1.2)
    low, high = axis.min(axis=0) - 1.5, axis.max(axis=0) + 1.5
    grid = sampled(lambda p: cKDTree(axis).query(p)[0] - 0.228, 0.2, low, high)
    wire = GuideWire(1.0, 0.18, [[0, 0.5], [6, 0.5], [14, 6.0]], [[0, 0.07], [6, 0.07], [6, 0.0]])
    wall = VesselWall(grid, 98.0, friction=0.1)
    insertion, fine = (Insertion(wire, wall, axis[0], [0, 0, 1], step_mm=step) for step in (1.0, 0.02))
    found, other = last(insertion, [4.0, 8.0, 12.0]), last(fine, [4.0, 8.0, 12.0])
    assert found.converged
    np.testing.assert_allclose(found.joints_mm, other.joints_mm, rtol=0.0, atol=1e-3)
