"""How long the steps to a goal are: doubled where one came to rest, shortened where one is rough or fails.

A way has a limit on its iterations, and a place on the way one on its work.
"""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels import data
from solver._kernels.algebra import load3
from solver._kernels.chain import segments_at
from solver._kernels.crossing import free_way
from solver._kernels.data import Introducer, Problem, WireTable
from solver._kernels.flags import cached, inlined, merged


@merged
def prepare(handle: Any, to_depth: float, to_roll: float) -> float:
    """Get ready for a goal; return how many iterations it may take: a cap on the time of a hopeless scene."""
    at, introducer = handle.place[0], handle.introducer
    at.rubbed, at.dissipated, at.snaps, at.rough_depth, at.refining_failed = 0.0, 0.0, 0, math.nan, 0.0
    if reverses(handle, to_depth - at.inserted, to_roll - at.roll):
        at.shrink = min(at.shrink, tol.REFINE * introducer.finest)
    steps = abs(to_depth - at.inserted) / introducer.step + abs(to_roll - at.roll) / introducer.turn
    steps += abs(at.goal - at.catheter) / introducer.step
    if introducer.idle_roll and at.roll != to_roll:
        at.roll = to_roll
        handle.problem.scratch.counters[0].rolls_proven_idle += 1
    return float(handle.limits.max_iterations * (tol.BUDGET_STEPS + 4 * steps))


@merged
def reverses(handle: Any, ahead: float, turn: float) -> bool:
    """Whether the hand moves the wire in another direction than before: friction on it then changes within micrometres.

    Over a step in which that happens the trapezium rule does not give the hand's work. ahead, turn : mm, degrees.
    """
    at, problem = handle.place[0], handle.problem
    if (problem.friction.coefficient == 0.0 and problem.shaft.drag == 0.0) or handle.introducer.finest == 1.0:
        return False
    around = math.radians(problem.shaft.radius)
    turn, before = around * turn, around * at.last_turn
    both = math.sqrt((ahead * ahead + turn * turn) * (at.last_step * at.last_step + before * before))
    return bool(ahead * at.last_step + turn * before < tol.SAME_WAY * both)


@inlined
def at_goal(at: Any, depth: float, roll: float) -> bool:
    """Whether wire, roll and catheter are where they are to go."""
    return bool(abs(depth - at.inserted) < tol.MATCH_DEPTH_MM and at.roll == roll and at.catheter == at.goal)


@merged
def adapt_step(handle: Any, outcome: int, iterations: int, limit: float) -> tuple[bool, int]:
    """Whether to take another step after one with this outcome, and the outcome if not; adapts the step's length."""
    at = handle.place[0]
    if iterations > limit or handle.problem.scratch.counters[0].passed >= handle.limits.work:
        return False, data.MAX_ITERATIONS
    # without a finite energy a shorter step does not help. With friction, where several states are at rest, one out of
    # the grid may be a hop: shorter steps are tried down to the finest (a share of the longest)
    least = handle.introducer.finest if handle.problem.friction.coefficient > 0.0 else 1.0
    helps = at.shrink > (least if outcome == data.LEFT_GRID else tol.SMALLEST_STEP) and outcome != data.NON_FINITE
    if outcome == data.CONVERGED:
        go_on(handle)
        at.waits = max(at.waits - 1, 0)
        at.shrink = min(1.0, 2 * at.shrink) if at.waits == 0 else at.shrink
    elif outcome == data.ROUGH:
        at.shrink = max(tol.REFINE * at.shrink, handle.introducer.finest)
    elif helps and at.refining_failed == 0.0 and not math.isnan(at.rough_depth) and outcome != data.THROUGH_WALL:
        # short steps only check what a long one leads to: where they fail, the long one is all there is
        at.refining_failed, at.shrink = 1.0, 1.0
    elif helps:
        at.shrink *= 0.5
        at.waits = tol.RUBBING_WAITS if handle.problem.friction.coefficient > 0.0 else 0
    return outcome == data.CONVERGED or outcome == data.ROUGH or helps, outcome


@merged
def go_on(handle: Any) -> None:
    """Take what a step that came to rest may cost off the work of its depth: only what is hard there counts."""
    at, problem = handle.place[0], handle.problem
    k, _ = segments_at(at.inserted, handle.table.segment)
    free = int(tol.FREE_ITERATIONS * at.shrink * (k + problem.chain.first[k + 1]))
    problem.scratch.counters[0].passed = max(problem.scratch.counters[0].passed - free, 0)


@cached
def next_target(handle: Any, to_depth: float, to_roll: float) -> tuple[float, float]:
    """Depth, mm, and roll, degrees, that the next step leads to; a catheter goes on in proportion."""
    at, goal = handle.place[0], handle.place[0].goal
    if not math.isnan(at.rough_depth):
        # to where a rough step led, for the two ways to be compared there
        to_depth, to_roll, goal = at.rough_depth, at.rough_roll, at.rough_catheter
    ahead, turn = to_depth - at.inserted, to_roll - at.roll
    longest = longest_step(handle.problem, handle.table, handle.introducer, at.inserted, ahead, turn)
    if goal != at.catheter:
        longest = min(longest, handle.introducer.step / abs(goal - at.catheter))
    longest *= at.shrink
    # the way in equal steps, none longer than that but for a small overshoot
    share = 1.0 / max(math.ceil((1.0 - tol.OVERSHOOT) / longest), 1.0)
    at.next = at.catheter + share * (goal - at.catheter) if share < 1.0 else goal
    return at.inserted + share * ahead, at.roll + share * turn


@merged
def longest_step(
    problem: Problem, table: WireTable, introducer: Introducer, depth: float, ahead: float, turn: float
) -> float:
    """Fraction of the way that one step may take: the longest step and roll, and what the tip can see."""
    fraction = min(1.0, introducer.turn / abs(turn)) if turn != 0.0 else 1.0
    if ahead != 0.0:
        longest = min(introducer.step, abs(ahead))
        if ahead > 0.0 and problem.stiffness > 0.0:
            k, _ = segments_at(depth, table.segment)
            r, tip = problem.state.r[data.CURRENT], load3(problem.state.x[data.CURRENT], k)
            along = (r[k, 0, 2], r[k, 1, 2], r[k, 2, 2])
            longest = free_way(problem.field, tip, along, longest, introducer.rise)
        fraction = min(fraction, longest / abs(ahead))
    return fraction
