"""Insertion: independence of the step, branches, retraction, tunnelling, the last good state."""

from __future__ import annotations

import numpy as np
import pytest

from solver import GuideWire, Insertion, Solution, Status, VesselWall, skips
from tests.later import later
from tests.solver.scenes import bend_grid, fork_grid, last, sampled, sheath_grid, tube_grid

CURVED = [[0, 0.12], [8, 0.12], [8, 0.0]]


@pytest.mark.parametrize("stiffness", [1.0, 100.0])
def test_number_of_sub_steps_does_not_change_the_minimum(stiffness: float) -> None:
    wall = VesselWall(bend_grid(), stiffness)
    wire = GuideWire(1.0, 0.18, 10.0)
    energies = []
    for per_mm in (1, 2, 3, 4, 8):
        insertion = Insertion(wire, wall, [0, 0, 0], [0, 0, 1], step_mm=1 / per_mm)
        solution = last(insertion, np.arange(1.0, 61.0))
        energies.append(solution.energy_N_mm)
        turn = np.einsum("na,na->n", *(np.diff(solution.joints_mm, axis=0)[s] for s in (slice(1, None), slice(-1))))
        assert turn.min() > 0.9, "no fold"
    assert np.ptp(energies) < 1e-6 * energies[0]


def test_slide_and_translate_reach_the_same_minimum() -> None:
    wall = VesselWall(bend_grid(), 1.0)
    shapes = [
        last(Insertion(GuideWire(1.0, 0.18, 10.0), wall, [0, 0, 0], [0, 0, 1], initial=way), np.arange(1.0, 56.0))
        for way in ("slide", "translate")
    ]
    np.testing.assert_allclose(shapes[0].joints_mm, shapes[1].joints_mm, rtol=0.0, atol=1e-5)


def test_retraction_returns_along_the_same_states_without_friction() -> None:
    wall = VesselWall(bend_grid(), 1.0)
    insertion = Insertion(GuideWire(1.0, 0.18, 10.0), wall, [0, 0, 0], [0, 0, 1])
    depths = list(np.arange(2.0, 61.0, 2.0))
    solutions = list(insertion.to_depths(depths + depths[-2::-1]))
    assert all(s.converged for s in solutions)
    for into, out in zip(solutions[: len(depths) - 1], solutions[: len(depths) - 1 : -1], strict=True):
        assert into.depth_mm == out.depth_mm
        np.testing.assert_allclose(into.joints_mm, out.joints_mm, rtol=0.0, atol=1e-4)


@pytest.mark.parametrize(("roll", "side"), [(0.0, 1.0), (180.0, -1.0)])
def test_curved_tip_chooses_its_branch_by_roll_and_keeps_it(roll: float, side: float) -> None:
    wire = GuideWire(1.0, 0.18, [[0, 1.0], [30, 8.0]], CURVED)
    insertion = Insertion(wire, VesselWall(fork_grid(), 2.0), [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0])
    for solution in insertion.to_depths(np.arange(1.0, 41.0), roll_deg=roll):
        assert solution.converged
        tip = solution.joints_mm[-1]
        if tip[2] > 26.0:
            assert side * tip[0] > 0.5


def test_a_rolled_wire_turns_about_its_axis_in_steps() -> None:
    wall = VesselWall(tube_grid(), 2.0)
    wire = GuideWire(1.0, 0.18, 5.0, CURVED)
    insertion = Insertion(wire, wall, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0])
    solutions = list(insertion.to_depths([30.0, 30.0, 30.0], roll_deg=[0.0, 90.0, 720.0 + 45.0]))
    for solution, roll in zip(solutions, (0.0, 90.0, 45.0), strict=True):
        assert solution.converged
        tip = solution.joints_mm[-1]
        assert np.rad2deg(np.arctan2(tip[1], tip[0])) == pytest.approx(roll, abs=1.0)


def test_tip_cannot_tunnel_into_a_neighbouring_vessel() -> None:
    """Two parallel tubes, 0.5 mm of wall between them; a tip bent hard towards the other one."""

    def distance(p: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
        here = np.hypot(p[..., 0], p[..., 1]) - 1.25
        there = np.hypot(p[..., 0] - 3.0, p[..., 1]) - 1.25
        return np.minimum(here, there)

    wall = VesselWall(sampled(distance, 0.25, (-4, -4, -3), (7, 4, 45)), 1.0)
    wire = GuideWire(1.0, 0.18, 0.5, [[0, 0.2], [6, 0.2], [6, 0.0]])
    insertion = Insertion(wire, wall, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0], step_mm=5.0)
    for solution in insertion.to_depths(np.arange(5.0, 41.0, 5.0)):
        assert solution.joints_mm[:, 0].max() < 1.6
        assert solution.converged


def test_dead_end_keeps_the_last_good_state() -> None:
    """A closed tube of hard wall: the wire buckles until no step goes on; what is returned is at rest."""

    def distance(p: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
        return np.maximum(np.hypot(p[..., 0], p[..., 1]) - 0.5, p[..., 2] - 20.0)

    wall = VesselWall(sampled(distance, 0.25, (-3, -3, -4), (3, 3, 24)), 200.0)
    insertion = Insertion(GuideWire(1.0, 0.18, 20.0), wall, [0, 0, 0], [0, 0, 1], max_iterations=60)
    before, after = list(insertion.to_depths([18.0, 200.0]))
    assert before.converged
    assert not after.converged
    assert 18.0 <= after.depth_mm < 200.0
    assert np.isfinite(after.joints_mm).all()
    assert after.sentence
    steps = np.linalg.norm(np.diff(after.joints_mm, axis=0), axis=1)
    assert steps.sum() == pytest.approx(after.depth_mm)


@pytest.mark.quick(1)
@pytest.mark.parametrize(
    ("bore", "stiffness", "segment"), [(0.3, 1.0, 1.0), (0.4, 100.0, 2.0), *later((0.5, 1.0, 2.0))]
)
def test_wire_in_a_long_sheath_comes_to_rest(bore: float, stiffness: float, segment: float) -> None:
    """Pushed through 400 mm of sheath the wire buckles in it, by less than a tenth of a millimetre.

    Its softest mode is 1e-11 as stiff as a joint: held back by more the wire creeps, and stops at a saddle.
    """
    wall, wire = VesselWall(sheath_grid(bore, 400.0), stiffness), GuideWire(segment, 0.18, 10.0)
    insertion = Insertion(wire, wall, [0, 0, -400.0], [0, 0, 1])
    solutions = list(insertion.to_depths([400.0, *np.arange(401.0, 461.0)]))
    assert all(s.converged for s in solutions), [s.sentence for s in solutions if not s.converged]
    assert solutions[-1].depth_mm == pytest.approx(460.0)
    # buckled: away from the axis inside the sheath, on the far side of where the tip pulls it
    inside = solutions[-1].joints_mm[:, 2] < -10.0
    assert np.abs(solutions[-1].joints_mm[inside, :2]).max() > 0.5 * (bore - 0.18)


SKIPS = {
    "clearance": "wall_look_ups_proven_unnecessary",
    "cheap": "wall_look_ups_cheap",
    "idle": "rest_shapes",
    "roll": "rolls_proven_idle",
    "direction": "sweeps_without_roll",
    "window": "joints_left_still",
    "foresight": "starts_foreseen",
    "rest": "starts_at_rest",
    "profile": "joints_without_profile_look_up",
}
"""What counts how often each skip is taken."""
EXACT = ("clearance", "cheap", "profile")
"""Skips of look-ups: bit by bit the same. The others save iterations."""


def bend_solutions(wire: GuideWire, wall: VesselWall, behind: float = 0.0) -> list[Solution]:
    """The wire at every millimetre of 55, then rolled; ``behind`` mm of sheath come first."""
    # tight, so that where an iteration stops does not show: 1e-9, the default, leaves 2e-6 mm
    insertion = Insertion(wire, wall, [0, 0, -behind], [0, 0, 1], tolerance=1e-13)
    depths = [*(behind + np.arange(1.0, 56.0)), behind + 55.0]
    return list(insertion.to_depths(depths, [0.0] * 55 + [77.0]))


@pytest.mark.parametrize("skip", SKIPS)
def test_skips_change_nothing_and_are_counted(skip: str) -> None:
    # what the tip meets dies out on its way to the base in a long sheath, and hardly anywhere else
    behind = 150.0 if skip == "window" else 0.0
    wall = VesselWall(sheath_grid(0.25, behind) if behind else bend_grid(), 1.0)
    wire = GuideWire(1.0, 0.18, 10.0)
    # a wire that is rolled though it is round starts each step at rest
    always_off = ["roll"] if skip == "rest" else []
    both = []
    for names in ([], [skip]):
        with skips.off(*always_off, *names):
            both.append(bend_solutions(wire, wall, behind))
    on_count, off_count = (sum(s.work[SKIPS[skip]] for s in run) for run in both)
    assert on_count > off_count == 0
    # look-ups are skipped exactly; iterations are saved within the solver's tolerance
    tolerance = 1e-12 if skip in EXACT else 1e-6
    for with_skip, without in zip(*both, strict=True):
        np.testing.assert_allclose(with_skip.joints_mm, without.joints_mm, rtol=0.0, atol=tolerance)
    if skip in EXACT:
        assert all(a.energy_N_mm == b.energy_N_mm for a, b in zip(*both, strict=True))
    if skip in ("clearance", "cheap"):
        saved = [sum(s.work["wall_look_ups"] for s in run) for run in both]
        assert saved[0] < saved[1]


ALMOST_NOTHING = {
    "friction": ({"friction": 1e-200}, {}, "relaxations_without_friction"),
    "twist": ({}, {"torsional_stiffness_N_mm2": 1e10}, "relaxations_without_twist"),
}
"""Friction that is computed and moves nothing; torsion 1e9 times as stiff as bending, which turns as one."""


@pytest.mark.parametrize("what", ALMOST_NOTHING)
def test_friction_and_twist_are_left_out_where_there_is_none(what: str) -> None:
    """None at all gives the wire that almost none gives, without the work."""
    of_wall, of_wire, counter = ALMOST_NOTHING[what]
    without = bend_solutions(GuideWire(1.0, 0.18, 10.0), VesselWall(bend_grid(), 1.0))
    with_it = bend_solutions(GuideWire(1.0, 0.18, 10.0, **of_wire), VesselWall(bend_grid(), 1.0, **of_wall))
    counts = [sum(s.work[counter] for s in run) for run in (without, with_it)]
    assert counts[0] > counts[1] == 0
    for a, b in zip(without, with_it, strict=True):
        np.testing.assert_allclose(a.joints_mm, b.joints_mm, rtol=0.0, atol=1e-6)


def test_depth_zero_and_repeated_depths_are_no_work() -> None:
    wall = VesselWall(tube_grid(), 1.0)
    insertion = Insertion(GuideWire(1.0, 0.18, 10.0), wall, [0, 0, 0], [0, 0, 1])
    zero, five, again, back = list(insertion.to_depths([0.0, 5.0, 5.0, 0.0]))
    assert [s.joints_mm.shape for s in (zero, five, back)] == [(1, 3), (6, 3), (1, 3)]
    assert again.iterations == 0
    assert all(s.status is Status.CONVERGED for s in (zero, five, again, back))
    np.testing.assert_array_equal(again.joints_mm, five.joints_mm)


def test_solution_is_read_only() -> None:
    solution = last(Insertion(GuideWire(1.0, 0.18, 10.0), None, [0, 0, 0], [0, 0, 1]), [5.0])
    with pytest.raises(ValueError, match="read-only"):
        solution.joints_mm[0] = 1.0


def test_what_is_printed_says_where_the_wire_is() -> None:
    insertion = Insertion(GuideWire(1.0, 0.18, 10.0), None, [0, 0, 0], [0, 0, 1])
    assert repr(insertion).startswith("Insertion(at 0 mm, roll 0 degrees, no wall, GuideWire(")
    (solution,) = insertion.to_depths([12.5])
    assert repr(solution) == "Solution(converged at 12.5 mm, tip [0.00, 0.00, 12.50] mm, push 0 N)"
    assert "at 12.5 mm" in repr(insertion)
