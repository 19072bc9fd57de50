"""What would take hours is refused at the call, and what takes seconds ends at Ctrl-C."""

from __future__ import annotations

import os
import signal
import threading

import pytest

from solver import GuideWire, Insertion, Insertions
from solver import _tolerances as tol

STIFF = GuideWire(1.0, 0.18, 10.0)


def free(wire: GuideWire = STIFF, **how: float) -> Insertion:
    return Insertion(wire, None, [0, 0, 0], [0, 0, 1], **how)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("insertion", "depths", "rolls"),
    [
        (free(step_mm=1e-5), [100.0], 0.0),
        (free(GuideWire(1000.0, 0.1, 1.0)), [1e7], 0.0),
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
    assert not next(insertion.to_depths([1e9])).converged
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
