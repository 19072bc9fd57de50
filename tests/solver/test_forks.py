"""To which of two equal sides a wire turns is decided by rounding: that there are two is told."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solver import Grid, GuideWire, Insertion, Insertions, Solution, VesselWall
from solver import _tolerances as tol
from tests.solver.entry_points import softest_way, sweep, term_at
from tests.solver.scenes import Array, fork_grid, sampled

DEPTHS = np.arange(1.0, 31.0)
FLAGGED_MM = 5.0
"""How long a wire is uncertain after it took one of two sides, at least."""


def into_fork(aside: float, seed: int | None = None, friction: float = 0.0, **how: Any) -> Insertion:
    """A straight wire that meets a symmetric fork ``aside`` mm from its middle; with a seed the scene is turned."""
    turn = np.eye(3) if seed is None else Rotation.random(random_state=seed).as_matrix()
    grid = fork_grid()
    turned = Grid(grid.values, grid.spacing_mm, turn @ grid.origin_mm, turn @ grid.direction)
    wall = VesselWall(turned, 1.0, friction=friction)
    return Insertion(GuideWire(1.0, 0.18, 10.0), wall, turn @ [aside, 0, 0], turn @ [0, 0, 1], **how)


def told(found: list[Solution]) -> tuple[list[int], list[float]]:
    """Depths that are uncertain, and how far off the other side is at each event that has one."""
    assert all(s.converged for s in found)
    events = [snap.other_mm for s in found for snap in s.snaps if snap.other_mm > 0.0]
    return [round(s.depth_mm) for s in found if s.uncertain], events


@pytest.mark.parametrize("aside", [0.0, 1e-6])
@pytest.mark.parametrize("seed", [None, 0, 1, 2])
def test_the_middle_of_a_fork_is_uncertain(aside: float, seed: int | None) -> None:
    """It took a side at 24 mm, at rest and firm, and nothing said that the other was as good."""
    found = list(into_fork(aside, seed).to_depths(DEPTHS))
    uncertain, (other,) = told(found)
    assert uncertain[0] == 24
    assert uncertain[-1] >= 24 + FLAGGED_MM - 1.0
    # the tip is 0.42 mm off the middle there, and so it is on the other side
    mine = np.abs(np.linalg.norm(found[23].joints_mm[-1] - 24.0 * found[23].frames[0, :, 2]))
    assert other == pytest.approx(2.0 * mine, rel=0.02)


@pytest.mark.parametrize("seed", [None, 0])
def test_a_hundredth_of_a_millimetre_decides(seed: int | None) -> None:
    for aside in (0.01, -0.01):
        found = list(into_fork(aside, seed).to_depths(DEPTHS))
        assert told(found) == ([], [])


def test_steps_of_any_length_tell_of_the_fork() -> None:
    for step in (0.5, 0.05):
        uncertain, events = told(list(into_fork(0.0, step_mm=step).to_depths(DEPTHS)))
        assert uncertain
        assert len(events) == 1


def test_friction_hides_no_fork() -> None:
    rubbing, plain = (list(into_fork(0.0, friction=mu).to_depths(DEPTHS)) for mu in (1e-9, 0.0))
    first = told(plain)[0]
    assert first
    assert told(rubbing)[0][: len(first)] == first  # with friction a doubt lasts longer
    # the look at the other side leaves the wire, its loads and what it holds on to as they were
    for one, other in zip(rubbing, plain, strict=True):
        np.testing.assert_allclose(np.abs(one.joints_mm), np.abs(other.joints_mm), rtol=0.0, atol=1e-4)


def slot(p: Array) -> Array:
    """A slot 1 mm wide, closed at 20 mm: a wire that stands on its floor buckles to one of two sides."""
    return np.asarray(np.maximum(np.abs(p[..., 1]) - 0.5, p[..., 2] - 20.0))


@pytest.mark.parametrize("lean", [0.0, 1e-7])
def test_a_column_says_that_it_buckles_to_one_of_two_sides(lean: float) -> None:
    wall = VesselWall(sampled(slot, 0.25, (-12, -2, -2), (12, 2, 24)), 5.0)
    found = list(Insertion(GuideWire(1.0, 0.18, 2.0), wall, [0, 0, 0], [lean, 0, 1]).to_depths(np.arange(1.0, 25.0)))
    first = next(s for s in found if abs(s.joints_mm[-1, 0]) > 0.1)
    assert first.uncertain
    assert not any(s.uncertain for s in found[:19])


def test_in_lanes_the_same_is_told() -> None:
    places = [0.0, 1e-6, -1e-6, 0.01, -0.01, 0.1, 1e-5, 0.0, 0.02]
    alone = [list(into_fork(aside).to_depths(DEPTHS)) for aside in places]
    wall = into_fork(0.0).wall
    assert wall is not None
    wires = [Insertion(GuideWire(1.0, 0.18, 10.0), wall, [aside, 0, 0], [0, 0, 1]) for aside in places]
    for one, other in zip(alone, Insertions(wires, threads=1).to_depths(DEPTHS), strict=True):
        assert told(one)[0] == told(other)[0]
        # to which side is rounding's choice, and lanes round otherwise
        np.testing.assert_allclose(told(one)[1], told(other)[1], rtol=1e-3)


@pytest.mark.slow
def test_the_softest_mode_is_the_same_wherever_its_search_begins() -> None:
    """The rung above which a wire gives way, climbed one after the other, and the direction that it gives way in."""
    insertion = into_fork(0.01)
    list(insertion.to_depths([20.0, 30.0]))
    work = insertion._work
    problem, report, now = work.problem, work.report[0], work.problem.scratch.descent[0]
    firm = [sweep(work.handle, 0, work.k, -term_at(rung), report) for rung in range(tol.RUNGS)]
    gives = firm.index(False)
    assert not any(firm[gives:])
    found = []
    for begun in (0, gives - 1, gives, gives + 1, gives + 20, tol.RUNGS):
        now.rung = begun
        assert softest_way(work.handle, work.k, report)
        assert now.rung == gives
        found.append((int(report.joint), *report.bend, problem.scratch.gain[: work.k].copy()))
    for joint, *bend, gain in found:
        assert joint == found[0][0]
        np.testing.assert_array_equal(bend, found[0][1:3])
        # of the joints beyond the one that gives way; those before it keep what earlier sweeps left
        np.testing.assert_array_equal(gain[joint + 1 :], found[0][3][joint + 1 :])
