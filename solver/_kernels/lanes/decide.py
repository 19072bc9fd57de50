"""What a lane does next: the decisions of ``newton_method.iterate``, one at a time, on nothing but its records.

me, now, counters : records of ``block.LANE``, ``records.DESCENT`` and ``records.COUNTERS``.     number :
``Block.number``, in which the lane's column is read.
"""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.data import CONVERGED
from solver._kernels.energy import FLOOR
from solver._kernels.flags import inlined, kernel
from solver._kernels.lanes.block import (
    ACCEPTED,
    BENDING,
    DECREMENT,
    DEFINITE,
    LARGEST,
    LOAD,
    MOMENT,
    PIVOT,
    START,
    STILL,
    WALL,
)
from solver._kernels.newton_method import whole

IDLE, READY, STOPPED, SWEEP, SEARCH, LAST, TAKEN, FORETOLD, JUDGE, ALONE, RESTED, DONE, NEW, WAITING = range(14)
"""Phases of a wire. IDLE: nothing is left to do; READY: sets out on its next step; STOPPED: no step leads further;
SWEEP: waits for gains; SEARCH: tries a step of its line search; LAST: tries the last step; TAKEN: has taken a step;
FORETOLD: has taken one and may be at rest by it; JUDGE: may be at a saddle; ALONE: goes on alone; RESTED, DONE: its
relaxation has ended, in the lane or in the wire; NEW: is to begin; WAITING: has a start, but no lane yet."""


@inlined
def next_iteration(me: Any, now: Any) -> None:
    """Go on with the next iteration, if there is one left."""
    now.iterations += 1
    me.phase = SWEEP if now.iterations < me.allowed else ALONE


@kernel
def after_sweep(me: Any, now: Any, counters: Any, number: Any, lane: int) -> None:
    """Decide what to do with new gains, as ``newton_method.iterate`` does."""
    me.decrement = number[DECREMENT, lane]
    definite = number[DEFINITE, lane] > 0.0
    if definite and now.damping == 0.0:
        me.pivot = number[PIVOT, lane] if now.first_free == 0 else min(number[PIVOT, lane], me.pivot)
    definite = definite and math.isfinite(me.decrement)
    me.accuracy = me.tolerance * (tol.SOFT_TOLERANCE if me.pivot < tol.SOFT else 1.0)
    counters.sweeps += 1
    counters.joints_left_still += now.first_free
    me.before, me.tries, me.fraction = now.energy, 0, 1.0
    me.scale = me.bending + me.wall + FLOOR * me.stiffest
    me.noise = tol.ROUND_OFF * (me.scale + abs(me.load) + me.moved)
    if now.first_free > 0 and not definite:
        now.first_free = 0
        next_iteration(me, now)
    elif definite and now.damping == 0.0 and me.decrement <= max(me.accuracy * me.scale, me.noise):
        me.phase = LAST
    elif definite and now.damping > 0.0 and me.decrement <= me.noise and now.released < tol.SEARCHES:
        me.phase = ALONE
    elif definite:
        me.phase = SEARCH
    elif now.damping == 0.0:
        now.forked, me.phase = 1, JUDGE
    else:
        hold_back(me, now, counters)


@inlined
def most_energy(me: Any, now: Any) -> float:
    """The energy that a trial must not exceed, as ``newton_method.search`` and ``last_step`` ask."""
    if me.phase == LAST:
        return now.energy + me.noise  # type: ignore[no-any-return]
    enough = now.energy - tol.SUFFICIENT * me.fraction * me.decrement
    return now.energy if me.decrement <= me.noise else enough  # type: ignore[no-any-return]


@inlined
def leads_down(me: Any, now: Any, number: Any, lane: int) -> bool:
    """Whether a trial's energy is low enough."""
    return bool(number[BENDING, lane] + number[WALL, lane] + number[LOAD, lane] <= most_energy(me, now))


@kernel
def take(me: Any, now: Any, number: Any, lane: int) -> None:
    """Accept a trial, as ``newton_method.take`` and ``last_step`` do."""
    number[ACCEPTED, lane] = 1.0
    me.bending, me.wall, me.load = number[BENDING, lane], number[WALL, lane], number[LOAD, lane]
    trial = me.bending + me.wall + me.load
    missed = now.energy - trial - me.decrement
    now.energy = trial
    if me.phase == SEARCH:
        foretold = tol.FORETOLD * missed * missed <= me.accuracy * me.scale * me.decrement
        me.phase = FORETOLD if foretold and now.damping == 0.0 and whole(now, me) else TAKEN


@kernel
def shorten(me: Any, now: Any, counters: Any) -> None:
    """Try a shorter step in the next round, or another way, as ``newton_method.iterate`` does."""
    me.tries += 1
    me.fraction *= tol.SHORTER
    if me.tries == 1 and now.damping == 0.0 and now.first_free == 0 and me.decrement <= tol.FINE * me.scale:
        me.phase = ALONE
    elif me.tries == tol.SEARCHES:
        hold_back(me, now, counters)


@kernel
def finish_taking(me: Any, now: Any, number: Any, lane: int) -> None:
    """What follows a step that was taken and is not the last one, see ``newton_method.take``."""
    still = int(number[STILL, lane] - number[START, lane]) + now.first_free
    now.first_free = still if now.damping == 0.0 and tol.WORTHWHILE * me.k < still < me.k else 0
    now.last_damping = now.damping if now.damping > 0.0 else tol.LEAST_DAMPING
    now.patience -= 1
    if now.patience <= 0:
        now.damping = tol.LESS_DAMPING * now.damping if now.damping > tol.LEAST_DAMPING else 0.0
    next_iteration(me, now)


@kernel
def hold_back(me: Any, now: Any, counters: Any) -> None:
    """``newton_method.hold_back``; where no useful step is left the wire goes on alone."""
    damping = tol.AGAIN_DAMPED * now.last_damping if now.damping == 0.0 else tol.MORE_DAMPING * now.damping
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
    if me.phase not in (LAST, JUDGE, FORETOLD):
        return
    rests = number[MOMENT, lane] <= tol.MOMENT * number[LARGEST, lane]
    if rests and me.phase != JUDGE and whole(now, me):
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
