"""When a relaxation ends: no moment left where it says converged, and never more work than a depth may cost."""

from __future__ import annotations

import numpy as np
import pytest

from solver import GuideWire, Insertion, Solution, Status, VesselWall, relax, skips
from solver import _tolerances as tol
from tests.solver.scenes import tube_grid

METHODS = ("newton", "closed_form")
STIFFNESS = 5.0
LENGTH = 15.0


def left_over(solution: Solution) -> float:
    """Moment at the clamp of a uniform straight wire that the forces beyond do not balance, relative to its own."""
    x, force = solution.joints_mm, solution.contact_force_N
    turn = np.cross(solution.frames[0, :, 2], solution.frames[1, :, 2])
    angle = np.arctan2(np.linalg.norm(turn), solution.frames[0, :, 2] @ solution.frames[1, :, 2])
    own = 2 * STIFFNESS / 1.0 * angle * turn / np.linalg.norm(turn)
    across = np.cross(x - x[0], force).sum(axis=0)
    # a joint bends about the axis of its turn; the rest goes into the introducer
    axis = turn / np.linalg.norm(turn)
    return float(abs((across - own) @ axis) / np.linalg.norm(own))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("stiffness", [1.0, 1e6])
def test_a_wire_called_converged_has_no_moment_left(method: str, stiffness: float) -> None:
    """On a wall of 1e6 N/mm² the energy is flat to its last place long before the moments balance."""
    wall = VesselWall(tube_grid(lumen=0.3, length=20.0), stiffness)
    direction = [np.sin(0.02), 0.0, np.cos(0.02)]
    wire = GuideWire(1.0, 0.5, STIFFNESS)
    solution = relax(
        wire, wall, depth_mm=LENGTH, entry_direction=direction, method=method, quadrature="joints",
        max_iterations=2000,
    )  # fmt: skip
    # the seed's method may have to say that it can go no further
    assert solution.converged or (method == "closed_form" and solution.status is Status.STALLED)
    assert left_over(solution) < 1e-4 or not solution.converged
    assert solution.energy_N_mm <= solution.work["start_energy_N_mm"]


def test_closed_form_far_from_the_origin_does_as_at_the_origin() -> None:
    """Its sweep turns directions: differences of joints at 1e6 mm would bend a segment of 1 mm by 1e-10 rad."""
    wire = GuideWire(1.0, 0.18, STIFFNESS, rest_curvature_per_mm=0.05)
    for at in ([0.0, 0.0, 0.0], [2.0**20, -(2.0**20), 2.0**19]):
        # from straight to the rest shape, with no short cut
        with skips.off("idle"):
            solution = relax(wire, depth_mm=LENGTH, entry_mm=at, method="closed_form", max_iterations=2000)
        assert solution.converged, solution.sentence
        assert solution.work["start_energy_N_mm"] > 0.05
        # 3e-11 rad at each joint, see CLOSED_FORM_IDLE_ANGLE
        assert solution.energy_N_mm < 2 * STIFFNESS * LENGTH * 3e-11**2


def test_a_long_way_has_the_work_of_its_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """A depth of 250 mm with friction ended at 176 mm, at rest in every step; asked for by 5 mm it was reached."""
    monkeypatch.setattr(tol, "WORK_PER_ITERATION", 0)
    monkeypatch.setattr(tol, "WORK", 20_000)
    wall = VesselWall(tube_grid(), 20.0, 0.1)
    (there,) = Insertion(GuideWire(0.5, 0.175, 5.0, 0.05), wall, [0, 0, 2.0], [0, 0, 1.0]).to_depths([25.0])
    assert there.converged


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_the_work_of_a_depth_is_limited(method: str, friction: float, monkeypatch: pytest.MonkeyPatch) -> None:
    wire = GuideWire(1.0, 0.18, STIFFNESS)
    wall = VesselWall(tube_grid(), 100.0, friction)
    direction = [np.sin(0.3), 0.0, np.cos(0.3)]

    def run() -> list[Solution]:
        way = Insertion(wire, wall, [0, 0, 0], direction, method=method, quadrature="joints")
        return list(way.to_depths([20.0, 21.0]))

    if method == "newton" or friction == 0.0:
        assert all(s.converged for s in run())
    monkeypatch.setattr(tol, "WORK_PER_ITERATION", 0)
    monkeypatch.setattr(tol, "WORK", 80)
    stopped = run()
    assert {s.status for s in stopped} == {Status.MAX_ITERATIONS}
    # the second depth has an allowance of its own, and the last good state is kept
    assert 0.0 < stopped[0].depth_mm < stopped[1].depth_mm < 20.0
    # a joint and its look-up point count one each: 2 joints at least
    assert all(0 < s.iterations <= 80 / 2 for s in stopped)
    assert all(s.energy_N_mm <= s.work["start_energy_N_mm"] for s in stopped)
