"""The way to a depth: steps of the base, each laid along the wire's own curve, relaxed, and taken back if it fails.

One compiled loop, because a step costs a few microseconds per joint and entering a kernel costs ten.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from solver import _tolerances as tol
from solver._kernels.chain import Cut, lay_out, segments_at
from solver._kernels.crossing import free_way
from solver._kernels.data import ROLLS, SPENT, TABLED, Problem
from solver._kernels.energy import hold
from solver._kernels.extrapolation import foresee, note_change
from solver._kernels.flags import cached, entry_point, inlined, kernel, merged
from solver._kernels.follow import follow
from solver._kernels.forces import copy_state, furthest_outside
from solver._kernels.handle import Journey
from solver._kernels.minimise import BROKEN, CONVERGED, EXHAUSTED
from solver._kernels.relaxation import LEFT_GRID, measure, settle

# what an insertion remembers between depths
DEPTH, ROLL, ENERGY, SHRINK, AHEAD = range(5)
AT = 5
NOW, TRIAL, LAST_GOOD = range(3)
"""States: where the wire is, work space, and where it was before the step."""

SMALLEST = tol.SMALLEST_STEP
BUDGET_STEPS = tol.BUDGET_STEPS
MATCH = tol.MATCH_DEPTH_MM
MOST_FORESEEN = tol.MOST_FORESEEN
OVERSHOOT = tol.OVERSHOOT


class Base(NamedTuple):
    """The introducer and how far one step may go.

    entry : (3,) mm.     frame : (3, 3) at roll 0, columns are material axes 1, 2 and the direction.
    load : (3,) dead force on the tip, N.     translate : the seed's start shape instead of sliding.
    idle_roll : rolling changes nothing.     step, turn : longest step, mm and degrees.     rise : see ``free_way``.
    margin : how far a joint may leave the grid, mm.
    """

    entry: Any
    frame: Any
    load: Any
    translate: bool
    idle_roll: bool
    step: float
    turn: float
    rise: float
    margin: float


@entry_point
def advance(journey: Journey, to_depth: float, to_roll: float, laid: int) -> tuple[int, int, int]:
    """Step until the goal is reached or no step succeeds; return the outcome, the iterations and the segments.

    journey.at : (5,) DEPTH mm, ROLL deg, ENERGY N mm, SHRINK, AHEAD mm, updated.
    laid : segments that are laid out already, to be relaxed where they are; 0 to step there.
    """
    problem, cut, base, orders = journey.problem, journey.cut, journey.base, journey.orders
    at, report = journey.at, journey.report
    # a cap on the time that a hopeless scene can take
    steps = abs(to_depth - at[DEPTH]) / base.step + abs(to_roll - at[ROLL]) / base.turn
    limit = orders.max_iterations * (BUDGET_STEPS + 4 * steps)
    outcome, iterations, shrink = CONVERGED, 0, at[SHRINK]
    now = 0 * orders.max_iterations
    kept = np.empty(report.size)
    while True:
        if base.idle_roll and at[ROLL] != to_roll:
            at[ROLL] = to_roll
            problem.scratch.counter[ROLLS] += 1
        ahead, turn = to_depth - at[DEPTH], to_roll - at[ROLL]
        if abs(ahead) < MATCH and turn == 0.0:
            break
        depth, roll, k = to_depth, to_roll, laid
        if laid > 0:
            hold(problem, k)
        else:
            fraction = evenly(shrink * allowed(problem, cut, base, at[DEPTH], ahead, turn))
            depth, roll = at[DEPTH] + fraction * ahead, at[ROLL] + fraction * turn
            k = set_out(problem, cut, base, at, depth, roll, report, kept)
        outcome, used, energy = CONVERGED, 0, 0.0
        if k > 0:
            start = foresee(problem, now, k, likeness(problem, at, depth, roll), at[ENERGY])
            outcome, used, energy = settle(problem, start, k, orders, report)
            if start != now:
                copy_state(problem, start, now, k)
        iterations += used
        if laid == 0 and outcome == CONVERGED and problem.stiffness > 0.0 and left_grid(problem, base, k):
            outcome = LEFT_GRID
        if laid > 0 or outcome == CONVERGED:
            note_change(problem, now, k)
            at[AHEAD] = depth - at[DEPTH] if roll == at[ROLL] else 0.0
            at[DEPTH], at[ROLL], at[ENERGY] = depth, roll, energy
        else:
            take_back(problem, cut, at, report, kept)
        if laid > 0:
            break
        if iterations > limit or problem.scratch.counter[SPENT] >= orders.work:
            outcome = EXHAUSTED
            break
        if outcome == CONVERGED:
            shrink = min(1.0, 2 * shrink)
        elif shrink > SMALLEST and outcome != LEFT_GRID and outcome != BROKEN:
            shrink *= 0.5
        else:
            # outside the grid or without a finite energy a shorter step does not help either
            break
    at[SHRINK] = max(shrink, 8 * SMALLEST)
    k = laid if laid > 0 else segments_at(at[DEPTH], cut.segment)[0]
    measure(problem, cut, k, report, journey.force)
    return outcome, iterations, k


@merged
def allowed(problem: Problem, cut: Cut, base: Base, depth: float, ahead: float, turn: float) -> float:
    """Fraction of the way that one step may take: the longest step and roll, and what the tip can see."""
    fraction = 1.0
    if turn != 0.0:
        fraction = min(fraction, base.turn / abs(turn))
    if ahead != 0.0:
        step = min(base.step, abs(ahead))
        if ahead > 0.0 and problem.stiffness > 0.0:
            k, _ = segments_at(depth, cut.segment)
            tip, along = problem.state.x[NOW, k], problem.state.r[NOW, k, :, 2]
            step = free_way(problem.field, tip, along, step, problem.spacing, base.rise)
        fraction = min(fraction, step / abs(ahead))
    return fraction


@inlined
def likeness(problem: Problem, at: Any, depth: float, roll: float) -> float:
    """How long this step is over the last one, or 0 where it is of another kind: rolled, back, or much longer."""
    if not problem.switch.foresight or at[AHEAD] == 0.0 or roll != at[ROLL]:
        return 0.0
    share = (depth - at[DEPTH]) / at[AHEAD]
    return share if 0.0 < share <= MOST_FORESEEN else 0.0


@inlined
def evenly(fraction: float) -> float:
    """One share of the way in equal steps, none longer than ``fraction`` of it but for a small overshoot."""
    return 1.0 / max(math.ceil((1.0 - OVERSHOOT) / fraction), 1.0)


@merged
def set_out(
    problem: Problem, cut: Cut, base: Base, at: Any, depth: float, roll: float, report: Any, kept: Any
) -> int:
    """Keep the last good state and lay the wire out at a new depth and roll; return its number of segments."""
    now = 0 * report.size
    was, _ = segments_at(at[DEPTH], cut.segment)
    copy_state(problem, now, now + LAST_GOOD, was)
    for i in range(report.size):
        kept[i] = report[i]
    k, first = segments_at(depth, cut.segment)
    clamp(problem, base, roll)
    if k > 2 and cut.tabled:
        problem.scratch.counter[TABLED] += k - 2
    if k > 0:
        lay_along(problem, cut, base, was, k, first, depth - at[DEPTH])
        return k
    for i in range(report.size):
        report[i] = 0.0
    for a in range(4):
        problem.state.parts[NOW, a] = 0.0
    return k


@merged
def take_back(problem: Problem, cut: Cut, at: Any, report: Any, kept: Any) -> None:
    """Put the last good state back."""
    now = 0 * report.size
    was, first = segments_at(at[DEPTH], cut.segment)
    if was > 0:
        lay_out(problem.chain, cut, was, first)
    copy_state(problem, now + LAST_GOOD, now, was)
    for i in range(report.size):
        report[i] = kept[i]


@merged
def left_grid(problem: Problem, base: Base, k: int) -> bool:
    """Whether a joint is further outside the grid than it may be."""
    return bool(furthest_outside(problem.field, problem.state.x[NOW], k) > base.margin)


@merged
def clamp(problem: Problem, base: Base, roll: float) -> None:
    """Put the base frame, rolled right-handed about the wire by ``roll`` degrees, at the entry."""
    angle = math.radians(roll)
    c, s = math.cos(angle), math.sin(angle)
    x, r = problem.state.x[NOW], problem.state.r[NOW]
    for a in range(3):
        one, two = base.frame[a, 0], base.frame[a, 1]
        x[0, a] = base.entry[a]
        r[0, a, 0], r[0, a, 1], r[0, a, 2] = c * one + s * two, c * two - s * one, base.frame[a, 2]


@cached
def lay_along(problem: Problem, cut: Cut, base: Base, was: int, k: int, first: float, ahead: float) -> None:
    """Lay the wire of the last good state, pushed on by ``ahead`` mm, along its own curve: the start of a step."""
    chain, state = problem.chain, problem.state
    before = chain.length[0]
    lay_out(chain, cut, k, first)
    if problem.twisting:
        keep_twist(state.u, was, k)
    for n in range(k + 1):
        for a in range(3):
            chain.load[n, a] = base.load[a] if n == k else 0.0
    source, count = LAST_GOOD, was + 1
    if was == 0:
        source, count = TRIAL, begin(base, state.x[TRIAL])
    elif base.translate and ahead != 0.0:
        source, count = TRIAL, moved(base, cut, state.x, was, before, ahead)
    follow(state.x[source], count, chain, state.u[NOW], state.x[NOW], state.r[NOW], k)
    if problem.friction.coefficient > 0.0:
        anchor_friction(problem, state.x[LAST_GOOD], was, k, ahead)


@merged
def begin(base: Base, curve: Any) -> int:
    """Straight on from the entry, as two points."""
    for a in range(3):
        curve[0, a] = base.entry[a]
        curve[1, a] = base.entry[a] + base.frame[a, 2]
    return 2


@kernel
def moved(base: Base, cut: Cut, x: Any, was: int, first: float, ahead: float) -> int:
    """Section 4.1 of the seed: the last good wire moved by ``ahead`` along the entry direction, from the entry on."""
    curve, count = x[TRIAL], begin(base, x[TRIAL]) - 1
    for n in range(was + 1):
        arc = first + (n - 1) * cut.segment if n > 0 else 0.0
        if ahead > 0.0 or arc > -ahead:
            for a in range(3):
                curve[count, a] = x[LAST_GOOD, n, a] + ahead * base.frame[a, 2]
            count += 1
    return max(count, 2)


@merged
def keep_twist(u: Any, was: int, k: int) -> None:
    """Twist stays with the material, which is counted from the tip."""
    common = min(was, k)
    for j in range(k):
        u[NOW, j, 2] = u[LAST_GOOD, was - k + j, 2] if j >= k - common else 0.0


@kernel
def anchor_friction(problem: Problem, curve: Any, was: int, k: int, ahead: float) -> None:
    """Note where each look-up point was before the step: its material was ``ahead`` mm further back.

    curve : (was + 1, 3), the wire before the step, which continues straight back into the introducer.
    """
    chain, start, back = problem.chain, problem.friction.start, problem.state.r[NOW, 0, :, 2]
    arcs = np.empty(was + 1)
    arcs[0] = 0.0
    for n in range(was):
        square = 0.0
        for a in range(3):
            square += (curve[n + 1, a] - curve[n, a]) ** 2
        arcs[n + 1] = arcs[n] + math.sqrt(square)
    arc, m = 0.0, 0
    for n in range(1, k + 1):
        arc += chain.length[n - 1]
        for p in range(chain.first[n], chain.first[n + 1]):
            s = arc + chain.offset[p, 2] - ahead
            while m + 1 < was and arcs[m + 1] <= s:
                m += 1
            while m > 0 and arcs[m] > s:
                m -= 1
            span = arcs[m + 1] - arcs[m] if was > 0 else 0.0
            t = min(max((s - arcs[m]) / span, 0.0), 1.0) if span > 0.0 else 0.0
            for a in range(3):
                along = t * (curve[m + 1, a] - curve[m, a]) if was > 0 else 0.0
                start[p, a] = curve[m, a] + along + min(s, 0.0) * back[a]
