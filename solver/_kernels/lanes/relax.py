"""Relaxations in lock-step: ``newton_method.iterate`` for several wires, each at its own place in it.

In a round all lanes sweep, those that have a step to try do so, and those that may be at rest get their gradient. A
lane whose step failed tries a shorter one in the next round, with the same gains. What is rare (watchdog, polishing,
leaving a saddle) a wire does alone, by ``iterate`` itself.
"""

import math
from typing import Any, NamedTuple

from solver._kernels import newton_method
from solver._kernels.crossing import free_fraction
from solver._kernels.data import CURRENT, MAX_ITERATIONS, TRIAL, UNFINISHED, Field, Problem
from solver._kernels.energy import at_entry
from solver._kernels.flags import kernel, merged
from solver._kernels.forces import copy_state
from solver._kernels.lanes.block import (
    ACCEPTED,
    ACTIVE,
    AT_ENTRY,
    CLEAR,
    DAMPING,
    FRACTION,
    FULL,
    JUMP,
    MOMENT,
    REACH,
    ROOM,
    START,
    STIFFNESS,
    Block,
    fill_up,
    put_in,
    take_out,
)
from solver._kernels.lanes.decide import (
    ALONE,
    DONE,
    FORETOLD,
    JUDGE,
    LAST,
    SEARCH,
    SWEEP,
    TAKEN,
    after_costate,
    after_sweep,
    finish_taking,
    leads_down,
    most_energy,
    next_iteration,
    shorten,
    take,
)
from solver._kernels.lanes.newton import costate, sweep
from solver._kernels.lanes.start import Desk
from solver._kernels.lanes.trial import accept, rollout, wall_energy
from solver._kernels.lanes.vectors import WIDTH
from solver._kernels.newton import costate as costate_alone

POOL = 32
"""Wires that eight lanes work for: a lane whose wire is at rest takes another one, so that all stay at about the same
depth, and lanes are idle only in the last few steps."""
WORTH_ANOTHER = 4
"""Lanes with a failed step from which on another trial is made at once: a trial costs half a round, and a lane
that waits for the next round loses an eighth of one."""


class Team(NamedTuple):
    """Wires side by side.

    wires : POOL handles.     lanes, nows, counts : (POOL + 1,) records of them, ``block.LANE``, ``DESCENT`` and
    ``COUNTERS`` of ``records``; the last is that of no wire.     seats : (WIDTH,) records ``block.SEAT``.
    first : (size + 2,) first look-up point of each node.     desk : room for the look-ups of one wire.
    """

    wires: Any
    lanes: Any
    nows: Any
    counts: Any
    seats: Any
    first: Any
    desk: Desk
    field: Field


# Merged into the loop whose body it is: to take a block out of a tuple costs as much as a short kernel.
@merged
def do_round(team: Team, block: Block, raw: Block, number: Any) -> None:
    """Take every lane that is not idle one step further. number : that of the raw block."""
    lanes, nows, counts, seats, first = team.lanes, team.nows, team.counts, team.seats, team.first
    base = get_ready(team, raw, number)
    sweep(block, first, base)
    for lane in range(WIDTH):
        w = seats[lane].wire
        if lanes[w].phase == SWEEP:
            after_sweep(lanes[w], nows[w], counts[w], number, lane)
    trying = ask_for_trials(team, number)
    while trying > 0:
        rollout(block, base, team.field.spacing)
        wall_energy(block, raw, team.field, first, base)
        if judge_trials(team, raw.x, number):
            accept(block, first, base)
        for lane in range(WIDTH):
            w = seats[lane].wire
            if lanes[w].phase == TAKEN:
                finish_taking(lanes[w], nows[w], number, lane)
        trying = ask_for_trials(team, number)
        if trying < WORTH_ANOTHER:
            break
    if count_judged(team) > 0:
        costate(block, first, base)
        for lane in range(WIDTH):
            w = seats[lane].wire
            after_costate(lanes[w], nows[w], counts[w], number, lane)
    for lane in range(WIDTH):
        if lanes[seats[lane].wire].phase == ALONE:
            go_alone(team, raw, lane)


@kernel
def get_ready(team: Team, raw: Block, number: Any) -> int:
    """Set each lane's damping and first free joint for the sweep; return the first joint of the longest wire."""
    size = team.first.size - 2
    base = size
    for lane in range(WIDTH):
        w = team.seats[lane].wire
        k, now = team.lanes[w].k, team.nows[w]
        base = min(base, size - k)
        number[DAMPING, lane], number[START, lane] = now.damping, size - k + now.first_free
    for lane in range(WIDTH):
        if team.seats[lane].filled > base:
            fill_up(raw, team.first, lane, base, team.seats[lane].filled)
            team.seats[lane].filled = base
    return int(base)


@kernel
def ask_for_trials(team: Team, number: Any) -> int:
    """Say which lanes want a trial and of what part of their step; return how many do."""
    count = 0
    for lane in range(WIDTH):
        me = team.lanes[team.seats[lane].wire]
        trying = me.phase == SEARCH or (me.phase == LAST and me.tries == 0)
        number[ACTIVE, lane], number[FRACTION, lane] = 1.0 if trying else 0.0, me.fraction
        number[ROOM, lane] = most_energy(me, team.nows[team.seats[lane].wire])
        count += trying
    return count


@kernel
def judge_trials(team: Team, x: Any, number: Any) -> bool:
    """Accept the trials that lead down, or else shorten their steps; say whether any was accepted."""
    taken = False
    for lane in range(WIDTH):
        number[ACCEPTED, lane] = 0.0
        if number[ACTIVE, lane] > 0.0:
            w = team.seats[lane].wire
            me, now, counted = team.lanes[w], team.nows[w], team.counts[w]
            counted.rollouts += 1
            if leads_down(me, now, number, lane) and (number[JUMP, lane] == 0.0 or reachable(team, x, lane)):
                take(me, now, number, lane)
                taken = True
            elif me.phase == SEARCH:
                shorten(me, now, counted)
            me.tries += me.phase == LAST
    return taken


@kernel
def count_judged(team: Team) -> int:
    """How many lanes need their gradient."""
    count = 0
    for lane in range(WIDTH):
        count += team.lanes[team.seats[lane].wire].phase in (LAST, JUDGE, FORETOLD)
    return count


@kernel
def reachable(team: Team, x: Any, lane: int) -> bool:
    """``crossing.admissible`` of a lane's trial; x : that of the raw block."""
    size, field = team.first.size - 2, team.field
    limit = 0.25 * field.spacing * field.spacing
    for n in range(size - team.lanes[team.seats[lane].wire].k + 1, size + 1):
        square = 0.0
        for a in range(3):
            square += (x[TRIAL, n, a, lane] - x[CURRENT, n, a, lane]) ** 2
        if square > limit:
            old = (x[CURRENT, n, 0, lane], x[CURRENT, n, 1, lane], x[CURRENT, n, 2, lane])
            new = (x[TRIAL, n, 0, lane], x[TRIAL, n, 1, lane], x[TRIAL, n, 2, lane])
            if free_fraction(field, old, new, math.sqrt(square)) < 1.0:
                return False
    return True


@merged
def hand_over(team: Team, raw: Block, lane: int, problem: Problem, report: Any) -> None:
    """Give a lane's state back to its wire."""
    w, number = team.seats[lane].wire, raw.number
    me, counted = team.lanes[w], team.counts[w]
    take_out(raw, team.first, lane, problem, me.k)
    problem.scratch.descent[0] = team.nows[w]
    parts = problem.state.energies[CURRENT]
    parts.bending, parts.wall, parts.load, parts.friction = me.bending, me.wall, me.load, 0.0
    report.moment, report.pivot = number[MOMENT, lane], me.pivot
    for a in range(3):
        report.force[a], report.torque[a] = raw.force[a, lane], raw.torque[a, lane]
    counted.wall_look_ups += int(number[FULL, lane])
    counted.wall_look_ups_proven_unnecessary += int(number[CLEAR, lane])


@merged
def take_over(team: Team, raw: Block, lane: int, problem: Problem, report: Any) -> None:
    """Take a wire's current state into its lane."""
    w, number, parts = team.seats[lane].wire, raw.number, problem.state.energies[CURRENT]
    me = team.lanes[w]
    put_in(raw, team.first, lane, problem, me.k)
    team.seats[lane].filled = raw.length.shape[0] - me.k
    team.nows[w] = problem.scratch.descent[0]
    me.bending, me.wall, me.load, me.pivot = parts.bending, parts.wall, parts.load, report.pivot
    number[STIFFNESS, lane], number[REACH, lane] = problem.stiffness, problem.chain.reach
    number[FULL, lane] = number[CLEAR, lane] = 0.0
    number[AT_ENTRY, lane] = at_entry(problem)


@kernel
def go_alone(team: Team, raw: Block, lane: int) -> None:
    """Do one iteration of a lane by itself, or end its relaxation where none is left."""
    w = team.seats[lane].wire
    me, wire = team.lanes[w], team.wires[w]
    problem, report = wire.problem, wire.report[0]
    now = problem.scratch.descent[0]
    hand_over(team, raw, lane, problem, report)
    me.phase, me.outcome = DONE, MAX_ITERATIONS
    if now.iterations >= me.allowed:
        costate_alone(problem, CURRENT, me.k, report)
        return
    me.outcome = newton_method.iterate(problem, me.k, now, wire.limits.tolerance, report)
    if now.slot != CURRENT:
        copy_state(problem, now.slot, CURRENT, me.k)
        now.slot = CURRENT
    if me.outcome == UNFINISHED:
        take_over(team, raw, lane, problem, report)
        next_iteration(me, team.nows[w])
