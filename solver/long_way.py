"""Long ways: what would take hours is refused where it is asked for, what takes seconds can be interrupted.

Ctrl-C does not reach a compiled kernel, and no limit on iterations ends the way of a free wire, which needs none.
"""

import math
from concurrent.futures import ThreadPoolExecutor, wait
from typing import NamedTuple

from solver import _tolerances as tol
from solver.doors import Found
from solver.errors import refuse
from solver.solution import Status
from solver.workspace import Workspace


class Goal(NamedTuple):
    """Where a wire is or is to be: depth of its tip, mm, roll, degrees, and the catheter's tip, mm."""

    depth: float
    roll: float
    catheter: float = 0.0


def nearby(step_mm: float, turn_deg: float, segment_mm: float) -> tuple[float, float]:
    """Depth, mm, and roll, degrees, within which no way is long (``tol.LONG_WAY``): such a way needs no check."""
    depth = math.sqrt(0.25 * tol.LONG_WAY * min(step_mm, segment_mm) * segment_mm)
    return depth, 0.25 * tol.LONG_WAY * turn_deg / (1.0 + depth / segment_mm)


def joints_laid(work: Workspace, here: Goal, there: Goal) -> float:
    """How many joints all longest steps of a way lay out together: 1e6 take a third of a second without a wall."""
    introducer = work.introducer
    if introducer is None:
        return 0.0
    turn = 0.0 if introducer.idle_roll else abs(there.roll - here.roll) / introducer.turn
    steps = max(abs(there.depth - here.depth), abs(there.catheter - here.catheter)) / introducer.step
    return max(steps, turn) * (1.0 + max(there.depth, here.depth) / work.wire.segment_mm)


def check_way(work: Workspace, here: Goal, there: Goal) -> None:
    """Refuse a way that takes more than a minute even where the wire touches nothing."""
    if joints_laid(work, here, there) > tol.LONGEST_WAY and work.introducer is not None:
        way = f"from {here.depth:g} mm, {here.roll:g} degrees to {there.depth:g} mm, {there.roll:g} degrees"
        steps = f"steps of {work.introducer.step:g} mm and {work.introducer.turn:g} degrees {way}"
        allowed = f"at most {tol.LONGEST_WAY:g} joints to lay out, all steps together"
        do = "longer steps (with friction 0.1 mm at most) or segments, or depths in several calls"
        refuse("insertion", "step_mm", Found(steps), allowed, do)


def advance(work: Workspace, here: Goal, there: Goal) -> tuple[Status, int]:
    """``Workspace.advance``; a long way in a thread of its own, so that Ctrl-C ends it at its next step."""
    if joints_laid(work, here, there) < tol.LONG_WAY:
        return work.advance(there.depth, there.roll)
    with ThreadPoolExecutor(1) as pool:
        task = pool.submit(work.advance, there.depth, there.roll)
        try:
            return task.result()
        except KeyboardInterrupt:
            while not task.done():
                # call the budget used up until it ends: the kernel checks it after each step, and may just add to it
                work.counters["passed"] = work.limits.work
                wait([task], timeout=0.05)
            raise
