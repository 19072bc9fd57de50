"""The one loop: a method proposes, the total energy decides, and a state that is no minimum is never called one."""

from __future__ import annotations

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.convergence import at_rest, noise_of, rounding_moment, scale_of, stiffest, unloaded
from solver._kernels.data import IDLE, LEVENBERG, RESTED, RUBBING, START, STILL, SWEEPS, WALL, Problem
from solver._kernels.descent import ease, finish, leave_saddle, polish, rest_shape, search, still, venture
from solver._kernels.energy import energy_of
from solver._kernels.flags import cached
from solver._kernels.newton import costate, sweep

# how a relaxation ends
CONVERGED, EXHAUSTED, STALLED, BROKEN = range(4)

REST = 0.5 * tol.REST_ANGLE**2
FIRST_DAMPING = tol.FIRST_DAMPING
LEAST_DAMPING = tol.LEAST_DAMPING
WORST_DAMPING = tol.WORST_DAMPING
SOFTER = tol.SOFTER
SEARCHES = tol.SEARCHES
FINE = tol.FINE
RISE = tol.RISE
FORETOLD = tol.FORETOLD


@cached
def minimise(
    problem: Problem, which: int, k: int, tolerance: float, max_iterations: int, report: Any
) -> tuple[int, int, int, float]:
    """Relax state ``which``, whose energy is known, with Newton's method.

    Returns (outcome, iterations, which of the two states holds the result, energy); report as in ``sweep`` and
    ``costate``, at the result.
    """
    damping, last, patience, settled = 0.0, FIRST_DAMPING, 0, 0
    state, counter = problem.state, problem.scratch.counter
    energy = energy_of(state.parts[which])
    report[START] = energy
    if problem.switch.idle and state.parts[which, WALL] == 0.0 and unloaded(problem.chain, k):
        resting = state.parts[which, RUBBING] == 0.0 and energy <= REST * stiffest(problem.chain, k)
        if resting or rest_shape(problem, which, k):
            counter[IDLE] += 1
            # without a force or a bend there is no gradient
            for i in range(START):
                report[i] = 0.0
            return CONVERGED, 0, which if resting else 1 - which, 0.0
    near = 0 * k
    for iteration in range(max_iterations):
        if not math.isfinite(energy):
            return BROKEN, iteration, which, energy
        definite = sweep(problem, which, near, k, damping, report)
        counter[SWEEPS] += 1
        counter[STILL] += near
        scale = scale_of(problem, which, k)
        noise = noise_of(problem, which, scale)
        if near > 0 and not definite:
            near = 0
            continue
        if damping == 0.0 and definite and report[0] <= max(tolerance * scale, noise):
            before = energy
            which, energy = finish(problem, which, near, k, energy, report)
            if iteration == 0 and not problem.switch.rest:
                continue
            if at_rest(problem, which, k, report):
                counter[RESTED] += iteration == 0
                return CONVERGED, iteration, which, energy
            if near > 0:
                # the whole gradient says what its part did not
                near = 0
                continue
            if report[0] <= noise:
                which, energy = polish(problem, which, k, energy, noise, report)
                flat = report[1] <= rounding_moment(problem, which, k)
                ended = CONVERGED if flat or at_rest(problem, which, k, report) else STALLED
                return ended, iteration, which, energy
            if energy < before:
                continue
            # the full step does not help, as where a contact opens and closes again: search as usual
        if damping > 0.0 and definite and report[0] <= noise and settled < SEARCHES:
            # nothing left to gain with the wire held back: look at it free, then held less, before it is judged
            which, energy = ease(problem, which, k, energy, noise, report)
            damping, patience, settled, last = 0.0, 0, settled + 1, SOFTER * last
            continue
        trial = math.inf
        if definite:
            trial = search(problem, which, near, k, 1.0, energy, report[0], noise)
            if trial == math.inf:
                if damping == 0.0 and near == 0 and report[0] <= FINE * scale:
                    there, trial = venture(problem, which, k, energy, report[0], RISE * scale, report)
                    if trial < math.inf:
                        which, energy = there, trial
                        continue
                trial = search(problem, which, near, k, 0.4, energy, report[0], noise)
        elif damping == 0.0:
            costate(problem, which, k, report)
            if at_rest(problem, which, k, report):
                trial = leave_saddle(problem, which, k, energy, noise, report)
                if trial == math.inf:
                    # the way down is shorter than rounding can tell
                    return CONVERGED, iteration, which, energy
        if trial <= energy:
            missed = energy - trial - report[0]
            foretold = FORETOLD * missed * missed <= tolerance * scale_of(problem, which, k) * report[0]
            which, energy = 1 - which, trial
            if foretold and definite and damping == 0.0:
                costate(problem, which, k, report)
                if at_rest(problem, which, k, report):
                    return CONVERGED, iteration + 1, which, energy
            near = still(problem, which, k) if problem.switch.window and definite and damping == 0.0 else 0
            last, patience = damping if damping > 0.0 else LEAST_DAMPING, patience - 1
            if patience <= 0:
                damping = 0.2 * damping if damping > LEAST_DAMPING else 0.0
        elif near > 0:
            near = 0
        else:
            counter[LEVENBERG] += 1
            patience = 2
            damping = 0.5 * last if damping == 0.0 else 6 * damping
            if damping > WORST_DAMPING:
                costate(problem, which, k, report)
                return STALLED, iteration, which, energy
    costate(problem, which, k, report)
    return EXHAUSTED, max_iterations, which, energy
