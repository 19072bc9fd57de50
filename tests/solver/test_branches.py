"""An insertion can be cloned and pickled where it is, and goes one way at a time."""

from __future__ import annotations

import copy
import pickle
import sys
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from solver import Grid, GuideWire, Insertion, Solution, VesselWall
from tests.later import later
from tests.solver.scenes import bend_grid, fork_grid, same_bits

HOOK = [[0, 0.12], [8, 0.12], [8, 0]]


def straight() -> Insertion:
    return Insertion(GuideWire(1.0, 0.18, 10.0), VesselWall(bend_grid(), 1.0), [0.3, 0, 0], [0, 0, 1])


def hooked() -> Insertion:
    wire = GuideWire(1.0, 0.18, lambda s: 1.0 + 0.2 * s, HOOK, torsional_stiffness_N_mm2=8.0)
    wall = VesselWall(bend_grid(), 1.0, friction=0.1, hull="samples:6")
    return Insertion(wire, wall, [0.3, 0, 0], [0, 0, 1], initial="translate", step_mm=0.7)


def free() -> Insertion:
    return Insertion(GuideWire(1.0, 0.18, 10.0, HOOK), None, [0, 0, 0], [0, 0, 1], tip_load_N=[0.01, 0, 0])


COPIES: list[Callable[[Insertion], Insertion]] = [
    Insertion.clone,
    copy.deepcopy,
    lambda insertion: pickle.loads(pickle.dumps(insertion)),
]


@pytest.mark.parametrize("make", [straight, hooked, free])
@pytest.mark.parametrize("at", [[0.4, 31.5, 26.0], *later([], [12.0])], ids=["pulled", "new", "pushed"])
def test_a_copy_goes_on_as_the_original_does(make: Callable[[], Insertion], at: list[float]) -> None:
    """By ``clone``, ``deepcopy`` and ``pickle``, one beside the other; and as one of which nobody made a copy."""
    original, plain = make(), make()
    for _ in zip(original.to_depths(at, 20.0), plain.to_depths(at, 20.0), strict=True):
        pass
    twins = [duplicate(original) for duplicate in COPIES]
    for twin in twins:
        assert (twin.depth_mm, twin.roll_deg) == (original.depth_mm, original.roll_deg)
    # beyond the room that there was at first, back, and rolled
    depths, rolls = [33.3, 40.0, 38.0, 38.0, 5.0], [20.0, 20.0, 25.0, -30.0, -30.0]
    for first, *others in zip(*(i.to_depths(depths, rolls) for i in (original, *twins, plain)), strict=True):
        for other in others:
            same_bits(first, other)


def test_a_clone_is_a_branch_of_its_own() -> None:
    """Rolled into the left and into the right branch from one trunk; neither moves the other."""
    wire = GuideWire(1.0, 0.18, 2.0, [[0, 0.1], [8, 0.1], [8, 0]])
    trunk = Insertion(wire, VesselWall(fork_grid(), 1.0), [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0])
    start = list(trunk.to_depths([12.0]))[-1]
    left, right = trunk.clone(), trunk.clone()
    assert left.wall is trunk.wall
    assert left.wire is trunk.wire
    one, other = (list(i.to_depths([12.0, 35.0], roll))[-1] for i, roll in ((left, 0.0), (right, 180.0)))
    assert one.joints_mm[-1, 0] > 3.0
    assert other.joints_mm[-1, 0] < -3.0
    assert trunk.depth_mm == start.depth_mm == 12.0
    same_bits(list(trunk.to_depths([12.0]))[-1], list(pickle.loads(pickle.dumps(trunk)).to_depths([12.0]))[-1])


def test_a_checkpoint_of_another_solver_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    kept = pickle.dumps(straight())
    monkeypatch.setattr("solver.workspace._VERSION", "another")
    with pytest.raises(ValueError, match=r"checkpoint: .*another version"):
        pickle.loads(kept)


def test_what_is_pickled_stays_read_only() -> None:
    wall, wire = VesselWall(bend_grid(), 1.0), GuideWire(1.0, 0.18, lambda s: 1.0 + s, [[0.0, 0.1]])
    for back in (copy.deepcopy, lambda thing: pickle.loads(pickle.dumps(thing))):
        grid, again = back(wall).distance, back(wire)
        arrays = [grid.values, grid.spacing_mm, grid.direction, *again.profile[:4], again.rest_curvature_per_mm]
        assert not any(array.flags.writeable for array in arrays)
        assert all(np.array_equal(a, b) for a, b in zip(wire.profile, again.profile, strict=True))
    assert isinstance(back(wall).distance, Grid)


def test_a_pickled_solution_stays_read_only() -> None:
    (found,) = straight().to_depths([3.0])
    for back in (copy.deepcopy, lambda thing: pickle.loads(pickle.dumps(thing))):
        again = back(found)
        for name in ("joints_mm", "frames", "contact_force_N", "reaction_force_N"):
            assert not getattr(again, name).flags.writeable, name
            np.testing.assert_array_equal(getattr(again, name), getattr(found, name))


def test_an_earlier_call_is_ended_by_a_later_one() -> None:
    push = straight()
    first, second = push.to_depths([2.0, 4.0, 6.0]), push.to_depths([3.0, 5.0])
    assert next(first).depth_mm == 2.0
    assert next(second).depth_mm == 3.0
    with pytest.raises(RuntimeError, match=r"a later call has begun.*clone"):
        next(first)
    assert next(second).depth_mm == 5.0


def test_one_insertion_in_four_threads_is_right_or_refused() -> None:
    depths = np.arange(1.0, 41.0)
    alone = [s.joints_mm for s in straight().to_depths(depths)]
    refused: list[str] = []
    done: list[list[Solution]] = []

    def work(push: Insertion, start: threading.Barrier) -> None:
        start.wait()
        try:
            done.append(list(push.to_depths(depths)))
        except RuntimeError as error:
            refused.append(str(error))

    switch = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    # without the rule a third of these threads came back with another's wire
    for _ in range(10):
        push, start = straight(), threading.Barrier(4)
        threads = [threading.Thread(target=work, args=(push, start)) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    sys.setswitchinterval(switch)
    assert len(done) + len(refused) == 40
    assert all("clone" in message for message in refused)
    for solutions in done:
        # who came first may have been ended on the way; the next one pulled the wire back and found the same minima
        assert [s.depth_mm for s in solutions] == depths.tolist()
        for solution, joints in zip(solutions, alone, strict=True):
            np.testing.assert_allclose(solution.joints_mm, joints, rtol=0.0, atol=1e-4)


def test_four_clones_in_four_threads_are_right() -> None:
    depths = np.arange(1.0, 41.0)
    alone = [s.joints_mm for s in straight().to_depths(depths)]
    push = straight()
    found: dict[int, list[Any]] = {}

    def work(i: int, own: Insertion) -> None:
        found[i] = [s.joints_mm for s in own.to_depths(depths)]

    threads = [threading.Thread(target=work, args=(i, push.clone())) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for i in range(4):
        assert all(np.array_equal(a, b) for a, b in zip(alone, found[i], strict=True))
