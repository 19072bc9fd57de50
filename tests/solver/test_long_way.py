"""What would take hours is refused at the call, and what takes seconds ends at Ctrl-C."""

from __future__ import annotations

import os
import signal
import threading
import time

import numpy as np
import pytest

from solver import Grid, GuideWire, Insertion, Insertions, Solution, VesselWall
from solver import _tolerances as tol

STIFF = GuideWire(1.0, 0.18, 10.0)


def free(wire: GuideWire = STIFF, **how: float) -> Insertion:
    return Insertion(wire, None, [0, 0, 0], [0, 0, 1], **how)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("insertion", "depths", "rolls"),
    [
        (free(step_mm=1e-5), [100.0], 0.0),
        (free(GuideWire(20.0, 0.1, 1.0), step_mm=1e-4), [3e4], 0.0),
        (free(GuideWire(1.0, 0.1, 1.0, 0.02), roll_step_deg=1e-6), [10.0, 10.0], [0.0, 1e4]),
        (free(step_mm=1e-5), [0.01, 0.02, 100.0], 0.0),
    ],
)
def test_a_way_without_end_is_refused_at_the_call(
    insertion: Insertion, depths: list[float], rolls: list[float]
) -> None:
    with pytest.raises(ValueError, match=r"insertion: step_mm: got steps of .* from .* to .*; allowed: at most 1e\+08"):
        insertion.to_depths(depths, rolls)
    with pytest.raises(ValueError, match="step_mm"):
        Insertions([insertion]).to_depths(depths, [rolls] if isinstance(rolls, list) else rolls)
    assert insertion.depth_mm == 0.0
    assert next(insertion.to_depths([0.01])).converged


def test_ways_back_count_too() -> None:
    insertion = free(step_mm=0.01)
    assert [s.depth_mm for s in insertion.to_depths([50.0, 1.0])] == [50.0, 1.0]
    with pytest.raises(ValueError, match="from 1 mm, 0 degrees to 2000 mm"):
        insertion.to_depths([2000.0])
    # a depth that no wire is tried at takes no time, and a straight wire rolls at once
    assert not next(insertion.to_depths([1e5])).converged
    assert next(insertion.to_depths([1.0], 1e6)).converged


def test_a_long_way_ends_at_ctrl_c_and_goes_on_later() -> None:
    insertion = free(step_mm=0.0005)
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        list(insertion.to_depths([190.0]))
    timer.join()
    reached = insertion.depth_mm
    assert 0.0 < reached < 190.0
    assert next(insertion.clone().to_depths([reached + 0.25])).converged
    assert next(insertion.to_depths([reached - 0.25])).depth_mm == reached - 0.25


def test_a_long_way_leads_where_short_ones_do() -> None:
    depth = 0.9 * (0.25 * tol.LONG_WAY * 0.01) ** 0.5
    wire = GuideWire(1.0, 0.18, 10.0, 0.02)
    one, other = free(wire, step_mm=0.01), free(wire, step_mm=0.01)
    assert other._near[0] > depth
    other._near = 0.0, 0.0
    for a, b in zip(one.to_depths([depth, 2.0]), other.to_depths([depth, 2.0]), strict=True):
        assert (a.joints_mm == b.joints_mm).all()
        assert a.counts == b.counts


def test_wires_in_threads_are_held_until_the_threads_end_however_often_ctrl_c_is_pressed() -> None:
    x, y, _ = np.meshgrid(*(np.arange(-3.0, end, 0.4) for end in (3.0, 3.0, 40.0)), indexing="ij")
    wall = VesselWall(Grid(np.hypot(x - 0.3, y) - 1.0, [0.4] * 3, [-3.0] * 3), 5.0)
    wires = [Insertion(GuideWire(0.25, 0.18, 1.0), wall, [0, 0, 0], [0, 0, 1], step_mm=0.01) for _ in range(40)]
    together = Insertions(wires)
    together.to_depths([0.5])
    press = [threading.Timer(t, os.kill, (os.getpid(), signal.SIGINT)) for t in (0.2, 0.4)]
    for timer in press:
        timer.start()
    with pytest.raises(KeyboardInterrupt):
        together.to_depths(np.arange(1.0, 30.0))
    depths = [wire.depth_mm for wire in wires]
    time.sleep(0.2)
    assert [wire.depth_mm for wire in wires] == depths, "nothing moves when the call has ended"
    assert all(not wire._lock.locked() for wire in wires)


def test_wires_with_friction_go_no_further_than_to_their_next_depth() -> None:
    """Each was taken from its queue before it began, and all were finished: calibrate took 20 s to end."""
    x, y, _ = np.meshgrid(*(np.arange(-3.0, end, 0.4) for end in (3.0, 3.0, 40.0)), indexing="ij")
    wall = VesselWall(Grid(np.hypot(x - 0.3, y) - 1.0, [0.4] * 3, [-3.0] * 3), 5.0, 0.1)
    wires = [Insertion(GuideWire(0.5, 0.18, 1.0), wall, [0, 0, 0], [0, 0, 1]) for _ in range(4)]
    go = wires[0]._go

    def pressed(depth: float, roll: float) -> Solution:
        time.sleep(0.1)
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.1)
        return go(depth, roll)

    wires[0]._go = pressed  # type: ignore[method-assign]
    with pytest.raises(KeyboardInterrupt):
        Insertions(wires, threads=1).to_depths([0.5, 1.0, 1.5])
    assert [wire.depth_mm for wire in wires] == [0.5, 0.0, 0.0, 0.0]
    assert not any(wire._lock.locked() for wire in wires)
