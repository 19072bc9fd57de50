"""Newton's method: one iteration. The step comes from ``newton``, and the total energy decides whether it is taken.

Where it does not help, Levenberg's term holds the wire back; where the Hessian is not positive and no force is left,
the wire is led out of its saddle. now is the record ``data.DESCENT``.
"""

from __future__ import annotations

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.convergence import at_rest, noise_of, rounding_moment, scale_of, stiffest, unloaded
from solver._kernels.data import CONVERGED, STALLED, UNFINISHED, Problem
from solver._kernels.flags import cached, merged
from solver._kernels.newton import costate, sweep
from solver._kernels.newton_moves import (
    accept,
    damped_polish,
    frozen_joints,
    last_step,
    leave_saddle,
    polish,
    rest_shape,
    search,
    watchdog,
)

REST = 0.5 * tol.REST_ANGLE**2
UNDECIDED = UNFINISHED - 1
"""The last step does not help, as where a contact opens and closes again: search as usual."""


@merged
def rests(problem: Problem, k: int, now: Any) -> bool:
    """Whether the wire touches nothing and carries nothing: then its rest shape is the answer, and is made current."""
    parts = problem.state.energies[now.slot]
    if not (problem.skips.idle and parts.wall == 0.0 and unloaded(problem.chain, k)):
        return False
    resting = parts.friction == 0.0 and now.energy <= REST * stiffest(problem.chain, k)
    if not resting and not rest_shape(problem, now.slot, k):
        return False
    problem.scratch.counters[0].rest_shapes += 1
    now.slot, now.energy = now.slot if resting else 1 - now.slot, 0.0
    return True


@cached
def iterate(problem: Problem, k: int, now: Any, tolerance: float, report: Any) -> int:
    """Do one iteration; return how the relaxation ended, or UNFINISHED."""
    counters = problem.scratch.counters[0]
    definite = sweep(problem, now.slot, now.first_free, k, now.damping, report)
    counters.sweeps += 1
    counters.joints_left_still += now.first_free
    scale = scale_of(problem, now.slot, k)
    noise = noise_of(problem, now.slot, scale)
    if now.first_free > 0 and not definite:
        now.first_free = 0
        return UNFINISHED
    if definite and now.damping == 0.0 and report.decrement <= max(tolerance * scale, noise):
        outcome = finish(problem, k, now, noise, report)
        if outcome != UNDECIDED:
            return outcome
    if definite and now.damping > 0.0 and report.decrement <= noise and now.released < tol.SEARCHES:
        # nothing left to gain with the wire held back: look at it free, then held less, before it is judged
        damped_polish(problem, k, now, noise, report)
        now.damping, now.patience, now.released = 0.0, 0, now.released + 1
        now.last_damping *= tol.SOFTER
        return UNFINISHED
    trial = math.inf
    if definite:
        trial = search(problem, k, now, 1.0, noise, report)
        fine = now.damping == 0.0 and now.first_free == 0 and report.decrement <= tol.FINE * scale
        if trial == math.inf and fine and watchdog(problem, k, now, tol.RISE * scale, report):
            return UNFINISHED
        if trial == math.inf:
            trial = search(problem, k, now, 0.4, noise, report)
    elif now.damping == 0.0:
        costate(problem, now.slot, k, report)
        if at_rest(problem, now.slot, k, report):
            trial = leave_saddle(problem, k, now, noise, report)
            if trial == math.inf:
                # the way down is shorter than rounding can tell
                return CONVERGED
    if trial <= now.energy:
        return take(problem, k, now, trial, definite and now.damping == 0.0, tolerance, report)
    return hold_back(problem, k, now, report)


@merged
def finish(problem: Problem, k: int, now: Any, noise: float, report: Any) -> int:
    """Take the last step and judge the result; UNDECIDED where the step did not help."""
    before = now.energy
    last_step(problem, k, now, report)
    if now.iterations == 0 and not problem.skips.rest:
        return UNFINISHED
    if at_rest(problem, now.slot, k, report):
        problem.scratch.counters[0].starts_at_rest += now.iterations == 0
        return CONVERGED
    if now.first_free > 0:
        # the whole gradient says what its part did not
        now.first_free = 0
        return UNFINISHED
    if report.decrement <= noise:
        polish(problem, k, now, noise, report)
        flat = report.moment <= rounding_moment(problem, now.slot, k)
        return CONVERGED if flat or at_rest(problem, now.slot, k, report) else STALLED
    return UNFINISHED if now.energy < before else UNDECIDED


@merged
def take(problem: Problem, k: int, now: Any, trial: float, free: bool, tolerance: float, report: Any) -> int:
    """Take the step to the trial state, of energy ``trial``. free : Newton's own step, not held back."""
    missed = now.energy - trial - report.decrement
    foretold = tol.FORETOLD * missed * missed <= tolerance * scale_of(problem, now.slot, k) * report.decrement
    accept(now, trial)
    if foretold and free:
        costate(problem, now.slot, k, report)
        if at_rest(problem, now.slot, k, report):
            now.iterations += 1
            return CONVERGED
    now.first_free = frozen_joints(problem, now.slot, k) if problem.skips.window and free else 0
    now.last_damping = now.damping if now.damping > 0.0 else tol.LEAST_DAMPING
    now.patience -= 1
    if now.patience <= 0:
        now.damping = 0.2 * now.damping if now.damping > tol.LEAST_DAMPING else 0.0
    return UNFINISHED


@merged
def hold_back(problem: Problem, k: int, now: Any, report: Any) -> int:
    """No step was worth taking: free all joints, or else hold the wire back by more of Levenberg's term."""
    if now.first_free > 0:
        now.first_free = 0
        return UNFINISHED
    problem.scratch.counters[0].levenberg += 1
    now.patience = 2
    now.damping = 0.5 * now.last_damping if now.damping == 0.0 else 6 * now.damping
    if now.damping <= tol.WORST_DAMPING:
        return UNFINISHED
    costate(problem, now.slot, k, report)
    return STALLED
