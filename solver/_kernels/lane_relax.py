"""Relaxations in lock-step: ``newton_method.iterate`` for several wires, each at its own place in it.

In a round all lanes sweep, those that have a step to try do so, and those that may be at rest get their gradient. A
lane whose step failed tries a shorter one in the next round, with the same gains. What is rare (watchdog, polishing,
leaving a saddle) a wire does alone, by ``iterate`` itself.
"""

import math
from typing import Any, NamedTuple

from solver import _tolerances as tol
from solver._kernels import newton_method
from solver._kernels.crossing import free_fraction
from solver._kernels.data import CONVERGED, CURRENT, MAX_ITERATIONS, TRIAL, UNFINISHED, Field
from solver._kernels.energy import FLOOR
from solver._kernels.flags import inlined, kernel
from solver._kernels.forces import copy_state
from solver._kernels.lane_block import (
    ACCEPTED,
    ACTIVE,
    BENDING,
    DAMPING,
    DECREMENT,
    DEFINITE,
    FRACTION,
    JUMP,
    LARGEST,
    LOAD,
    MOMENT,
    START,
    STILL,
    WALL,
    Block,
    put_in,
    take_out,
)
from solver._kernels.lane_newton import costate, sweep
from solver._kernels.lane_trial import accept, rollout, wall_energy
from solver._kernels.lanes import WIDTH
from solver._kernels.newton import costate as costate_alone

IDLE, READY, STOPPED, SWEEP, SEARCH, LAST, TAKEN, FORETOLD, JUDGE, ALONE, RESTED, DONE = range(12)
"""Phases of a lane: nothing left to do; sets out on its next step; no step leads further; waits for gains; tries a step
of its search, or the last one; has taken one, and may be at rest by it; may be at a saddle; goes on alone; its
relaxation has ended, in the lane or in the wire."""


class Team(NamedTuple):
    """Wires side by side.

    wires : a handle for each lane.     lanes, nows, counts : (WIDTH,) records of ``lane_block.LANE``, ``data.DESCENT``
    and ``data.COUNTERS``.     block : numbers of all of them as lanes, and raw : as numbers.
    first : (size + 2,) first look-up point of each node.
    """

    wires: Any
    lanes: Any
    nows: Any
    counts: Any
    block: Block
    raw: Block
    first: Any
    field: Field


@kernel
def do_round(team: Team) -> None:
    """Take every lane that is not idle one step further."""
    lanes, nows, counts, number = team.lanes, team.nows, team.counts, team.raw.number
    size = team.first.size - 2
    base, tries, judged = size, False, False
    for lane in range(WIDTH):
        k, now = lanes[lane].k, nows[lane]
        base = min(base, size - k)
        number[DAMPING, lane], number[START, lane] = now.damping, size - k + now.first_free
    sweep(team.block, team.first, base)
    for lane in range(WIDTH):
        me = lanes[lane]
        if me.phase == SWEEP:
            after_sweep(me, nows[lane], counts[lane], number, lane)
        trying = me.phase == SEARCH or me.phase == LAST
        number[ACTIVE, lane], number[FRACTION, lane] = 1.0 if trying else 0.0, me.fraction
        tries = tries or trying
    if tries:
        try_steps(team, base)
    for lane in range(WIDTH):
        phase = lanes[lane].phase
        judged = judged or phase == LAST or phase == JUDGE or phase == FORETOLD
    if judged:
        costate(team.block, team.first, base)
        for lane in range(WIDTH):
            phase = lanes[lane].phase
            if phase == LAST or phase == JUDGE or phase == FORETOLD:
                after_costate(lanes[lane], nows[lane], counts[lane], number, lane)
    for lane in range(WIDTH):
        if lanes[lane].phase == ALONE:
            go_alone(team, lane)


@kernel
def try_steps(team: Team, base: int) -> None:
    """Lay the trials out, ask for their energies and accept those that lead down."""
    lanes, nows, counts, number = team.lanes, team.nows, team.counts, team.raw.number
    rollout(team.block, base, team.field.spacing)
    wall_energy(team.block, team.raw, team.field, team.first, base)
    taken = False
    for lane in range(WIDTH):
        number[ACCEPTED, lane] = 0.0
        if number[ACTIVE, lane] > 0.0:
            me, now = lanes[lane], nows[lane]
            counts[lane].rollouts += 1
            if leads_down(me, now, number, lane) and (number[JUMP, lane] == 0.0 or reachable(team, lane)):
                take(me, now, number, lane)
                taken = True
            elif me.phase == SEARCH:
                shorten(me, now, counts[lane])
    if taken:
        accept(team.block, team.first, base)
    for lane in range(WIDTH):
        if lanes[lane].phase == TAKEN:
            finish_taking(lanes[lane], nows[lane], number, lane)


@inlined
def next_iteration(me: Any, now: Any) -> None:
    """Go on with the next iteration, if there is one left."""
    now.iterations += 1
    me.phase = SWEEP if now.iterations < me.allowed else ALONE


@kernel
def after_sweep(me: Any, now: Any, counters: Any, number: Any, lane: int) -> None:
    """Decide what to do with new gains, as ``newton_method.iterate`` does."""
    me.decrement = number[DECREMENT, lane]
    definite = number[DEFINITE, lane] > 0.0 and math.isfinite(me.decrement)
    counters.sweeps += 1
    counters.joints_left_still += now.first_free
    me.before, me.tries, me.fraction = now.energy, 0, 1.0
    me.scale = me.bending + me.wall + FLOOR * me.stiffest
    me.noise = tol.ROUND_OFF * (me.scale + abs(me.load))
    if now.first_free > 0 and not definite:
        now.first_free = 0
        next_iteration(me, now)
    elif definite and now.damping == 0.0 and me.decrement <= max(me.tolerance * me.scale, me.noise):
        me.phase = LAST
    elif definite and now.damping > 0.0 and me.decrement <= me.noise and now.released < tol.SEARCHES:
        me.phase = ALONE
    elif definite:
        me.phase = SEARCH
    elif now.damping == 0.0:
        me.phase = JUDGE
    else:
        hold_back(me, now, counters)


@inlined
def leads_down(me: Any, now: Any, number: Any, lane: int) -> bool:
    """Whether a trial's energy is low enough, as ``newton_method.search`` and ``last_step`` ask."""
    trial = number[BENDING, lane] + number[WALL, lane] + number[LOAD, lane]
    lower = trial <= now.energy
    if me.phase == LAST:
        return bool(lower)
    enough = trial <= now.energy - tol.SUFFICIENT * me.fraction * me.decrement
    return bool(enough or (me.decrement <= me.noise and lower))


@kernel
def take(me: Any, now: Any, number: Any, lane: int) -> None:
    """Accept a trial, as ``newton_method.take`` and ``last_step`` do."""
    number[ACCEPTED, lane] = 1.0
    me.bending, me.wall, me.load = number[BENDING, lane], number[WALL, lane], number[LOAD, lane]
    trial = me.bending + me.wall + me.load
    missed = now.energy - trial - me.decrement
    now.energy = trial
    if me.phase == SEARCH:
        foretold = tol.FORETOLD * missed * missed <= me.tolerance * me.scale * me.decrement
        me.phase = FORETOLD if foretold and now.damping == 0.0 else TAKEN


@kernel
def shorten(me: Any, now: Any, counters: Any) -> None:
    """Try a shorter step in the next round, or another way, as ``newton_method.iterate`` does."""
    me.tries += 1
    me.fraction *= 0.4
    if me.tries == 1 and now.damping == 0.0 and now.first_free == 0 and me.decrement <= tol.FINE * me.scale:
        me.phase = ALONE
    elif me.tries == tol.SEARCHES:
        hold_back(me, now, counters)


@kernel
def reachable(team: Team, lane: int) -> bool:
    """``crossing.admissible`` of a lane's trial."""
    x, size, field = team.raw.x, team.first.size - 2, team.field
    limit = 0.25 * field.spacing * field.spacing
    for n in range(size - team.lanes[lane].k + 1, size + 1):
        square = 0.0
        for a in range(3):
            square += (x[TRIAL, n, a, lane] - x[CURRENT, n, a, lane]) ** 2
        if square > limit:
            old, new = x[CURRENT, n, :, lane], x[TRIAL, n, :, lane]
            if free_fraction(field, old, new, math.sqrt(square)) < 1.0:
                return False
    return True


@kernel
def finish_taking(me: Any, now: Any, number: Any, lane: int) -> None:
    """What follows a step that was taken and is not the last one, see ``newton_method.take``."""
    still = int(number[STILL, lane] - number[START, lane]) + now.first_free
    now.first_free = still if now.damping == 0.0 and tol.WORTHWHILE * me.k < still < me.k else 0
    now.last_damping = now.damping if now.damping > 0.0 else tol.LEAST_DAMPING
    now.patience -= 1
    if now.patience <= 0:
        now.damping = 0.2 * now.damping if now.damping > tol.LEAST_DAMPING else 0.0
    next_iteration(me, now)


@kernel
def hold_back(me: Any, now: Any, counters: Any) -> None:
    """``newton_method.hold_back``, but for its end."""
    damping = 0.5 * now.last_damping if now.damping == 0.0 else 6 * now.damping
    if now.first_free > 0:
        now.first_free = 0
    elif damping <= tol.WORST_DAMPING:
        counters.levenberg += 1
        now.patience, now.damping = 2, damping
    else:
        me.phase = ALONE
        return
    next_iteration(me, now)


@kernel
def after_costate(me: Any, now: Any, counters: Any, number: Any, lane: int) -> None:
    """Judge the gradient of a lane, as ``newton_method.finish``, ``take`` and ``iterate`` do."""
    rests = number[MOMENT, lane] <= tol.MOMENT * number[LARGEST, lane]
    if rests and me.phase != JUDGE:
        counters.starts_at_rest += me.phase == LAST and now.iterations == 0
        now.iterations += me.phase == FORETOLD
        me.outcome, me.phase = CONVERGED, RESTED
    elif me.phase == FORETOLD:
        finish_taking(me, now, number, lane)
    elif me.phase == LAST and now.first_free > 0:
        now.first_free = 0
        next_iteration(me, now)
    elif me.phase == LAST and me.decrement > me.noise and now.energy < me.before:
        next_iteration(me, now)
    elif me.phase == JUDGE and not rests:
        hold_back(me, now, counters)
    else:
        me.phase = ALONE


@kernel
def hand_over(team: Team, lane: int) -> None:
    """Give a lane's state back to its wire."""
    me, problem, report, raw = team.lanes[lane], team.wires[lane].problem, team.wires[lane].report[0], team.raw
    take_out(raw, team.first, lane, problem, me.k)
    problem.scratch.descent[0] = team.nows[lane]
    parts = problem.state.energies[CURRENT]
    parts.bending, parts.wall, parts.load, parts.friction = me.bending, me.wall, me.load, 0.0
    report.moment = raw.number[MOMENT, lane]
    for a in range(3):
        report.force[a], report.torque[a] = raw.force[a, lane], raw.torque[a, lane]
        report.turned[0, a], report.turned[1, a] = raw.turned[0, a, lane], raw.turned[1, a, lane]


@kernel
def take_over(team: Team, lane: int) -> None:
    """Take a wire's current state into its lane."""
    me, problem = team.lanes[lane], team.wires[lane].problem
    put_in(team.raw, team.first, lane, problem, me.k)
    team.nows[lane] = problem.scratch.descent[0]
    parts = problem.state.energies[CURRENT]
    me.bending, me.wall, me.load = parts.bending, parts.wall, parts.load


@kernel
def go_alone(team: Team, lane: int) -> None:
    """Do one iteration of a lane by itself, or end its relaxation where none is left."""
    me, wire = team.lanes[lane], team.wires[lane]
    problem, now, report = wire.problem, wire.problem.scratch.descent[0], wire.report[0]
    hand_over(team, lane)
    me.phase, me.outcome = DONE, MAX_ITERATIONS
    if now.iterations >= me.allowed:
        costate_alone(problem, CURRENT, me.k, report)
        return
    me.outcome = newton_method.iterate(problem, me.k, now, wire.limits.tolerance, report)
    if now.slot != CURRENT:
        copy_state(problem, now.slot, CURRENT, me.k)
        now.slot = CURRENT
    if me.outcome == UNFINISHED:
        take_over(team, lane)
        next_iteration(me, team.nows[lane])
