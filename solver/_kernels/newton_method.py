"""Newton's method: the ways in which it gets from one state to a lower one, and one iteration that is made of them.

The step comes from ``newton``; the total energy decides whether it is taken whole, in part, or as one of a few whole
steps that lead uphill first.

Where it does not help, Levenberg's term holds the wire back; where the Hessian is not positive and no force is left,
the wire is led out of its saddle. now is the record ``records.DESCENT``: the current state and its
energy; a trial is in the other slot.
"""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.algebra import load3, store3
from solver._kernels.crossing import admissible
from solver._kernels.data import CONVERGED, STALLED, UNFINISHED, Problem
from solver._kernels.energy import energy_of, noise_of, scale_of, stiffest, total_energy
from solver._kernels.flags import cached, inlined, kernel, merged
from solver._kernels.forces import at_rest, rounding_moment
from solver._kernels.newton import costate, sweep
from solver._kernels.rollout import place
from solver._kernels.saddle import off_saddle
from solver._kernels.trial import step


@kernel
def search(problem: Problem, k: int, now: Any, fraction: float, noise: float, report: Any) -> float:
    """Line search along Newton's step: fraction 1 tries the whole step alone, a smaller one is shortened as needed.

    A step is good where the energy falls enough and no wall lies between. Returns the new energy, or inf.
    """
    decrement = report.decrement
    for _ in range(1 if fraction == 1.0 else tol.SEARCHES - 1):
        trial = step(problem, now.slot, now.first_free, k, fraction)
        enough = trial <= now.energy - tol.SUFFICIENT * fraction * decrement
        if (enough or (decrement <= noise and trial <= now.energy)) and admissible(problem, now.slot, k):
            return trial
        fraction *= tol.SHORTER
    return math.inf


@merged
def watchdog(problem: Problem, k: int, now: Any, rise: float, report: Any) -> bool:
    """Follow whole steps of Newton uphill until the energy is below where it started; False and back if it never is.

    Close to a minimum a step fails because contacts open and close on its way. The model of the energy is a
    quadratic for each set of contacts; whole steps find the right set within a few, short ones creep (semismooth
    Newton; the watchdog of Chamberlain et al., 1982). The first whole step is the trial state already.
    rise : how far uphill, N mm.
    """
    state, counters, keep = problem.state, problem.scratch.counters[0], problem.scratch.keep
    slot, start = now.slot, now.slot
    controls = state.u[start]
    for j in range(k):
        store3(keep, j, load3(controls, j))
    goal = now.energy - tol.SUFFICIENT * report.decrement
    for _ in range(tol.WATCHDOG_STEPS):
        trial = energy_of(problem, 1 - slot)
        if not (trial <= now.energy + rise and admissible(problem, slot, k)):
            break
        slot = 1 - slot
        if trial <= goal:
            now.slot, now.energy = slot, trial
            return True
        counters.sweeps += 1
        if not sweep(problem, slot, 0, k, 0.0, report):
            break
        step(problem, slot, 0, k, 1.0)
    for j in range(k):
        store3(controls, j, load3(keep, j))
    place(problem.chain, state, start, k)
    total_energy(problem, start, 0, k)
    sweep(problem, start, 0, k, 0.0, report)
    counters.sweeps += 1
    return False


@merged
def last_step(problem: Problem, k: int, now: Any, noise: float, report: Any) -> None:
    """Take the step that squares the error, and leave the exact gradient of the result in the report.

    The energy may rise by ``noise``: if its last digit decided, 1e-8 mm of the result would hang on that.
    """
    trial = step(problem, now.slot, now.first_free, k, 1.0)
    if trial <= now.energy + noise and admissible(problem, now.slot, k):
        now.slot, now.energy = 1 - now.slot, trial
    costate(problem, now.slot, k, report)


@merged
def polish(problem: Problem, k: int, now: Any, noise: float, report: Any) -> None:
    """Take Newton steps where the energy is flat to its last digit, for as long as the predicted fall decreases."""
    definite = sweep(problem, now.slot, 0, k, 0.0, report)
    for _ in range(tol.POLISHES):
        left = report.decrement
        if not definite or at_rest(problem, now.slot, k, report):
            break
        trial = step(problem, now.slot, 0, k, 1.0)
        if not (trial <= now.energy + noise and admissible(problem, now.slot, k)):
            break
        definite = sweep(problem, 1 - now.slot, 0, k, 0.0, report)
        problem.scratch.counters[0].sweeps += 1
        if not (definite and report.decrement < left):
            break
        now.slot, now.energy = 1 - now.slot, trial
        costate(problem, now.slot, k, report)


@merged
def damped_polish(problem: Problem, k: int, now: Any, noise: float, report: Any) -> None:
    """Take the damped step where the energy is flat to its last digit, if it lowers the largest residual moment."""
    costate(problem, now.slot, k, report)
    moment = report.moment
    trial = step(problem, now.slot, 0, k, 1.0)
    if trial <= now.energy + noise and admissible(problem, now.slot, k):
        costate(problem, 1 - now.slot, k, report)
        if report.moment < moment:
            now.slot, now.energy = 1 - now.slot, trial


@merged
def frozen_joints(problem: Problem, slot: int, k: int) -> int:
    """How many joints, counted from the base, the last step hardly turned; 0 where these are too few to gain by it.

    Hardly: by less than ``tol.UNMOVED`` of the joint that it turned most.
    """
    new, old = problem.state.u[slot], problem.state.u[1 - slot]
    largest = 0.0
    for j in range(k):
        for a in range(3):
            largest = max(largest, abs(new[j, a] - old[j, a]))
    for j in range(k):
        for a in range(3):
            if abs(new[j, a] - old[j, a]) > tol.UNMOVED * largest:
                return j if j > tol.WORTHWHILE * k else 0
    return 0


UNDECIDED = UNFINISHED - 1
"""Result of ``finish`` where the last step did not help, as where a contact opens and closes again: search as usual."""


@cached
def iterate(problem: Problem, k: int, now: Any, tolerance: float, report: Any) -> int:
    """Do one iteration; return how the relaxation ended, or UNFINISHED."""
    counters = problem.scratch.counters[0]
    definite = sweep(problem, now.slot, now.first_free, k, now.damping, report)
    counters.sweeps += 1
    counters.joints_left_still += now.first_free
    tolerance *= tol.SOFT_TOLERANCE if report.pivot < tol.SOFT else 1.0
    scale = scale_of(problem, now.slot, k)
    noise = noise_of(problem, now.slot, k, scale)
    if now.first_free > 0 and not definite:
        now.first_free = 0
        return UNFINISHED
    if definite and now.damping == 0.0 and report.decrement <= max(tolerance * scale, noise):
        outcome = finish(problem, k, now, noise, report)
        if outcome != UNDECIDED:
            return outcome
    if definite and now.damping > 0.0 and report.decrement <= noise and now.released < tol.SEARCHES:
        return release(problem, k, now, noise, report)
    trial = math.inf
    if definite:
        trial = search(problem, k, now, 1.0, noise, report)
        fine = now.damping == 0.0 and now.first_free == 0 and report.decrement <= tol.FINE * scale
        if trial == math.inf and fine and watchdog(problem, k, now, tol.RISE * scale, report):
            return UNFINISHED
        if trial == math.inf:
            trial = search(problem, k, now, tol.SHORTER, noise, report)
    elif now.damping == 0.0:
        now.forked = 1
        costate(problem, now.slot, k, report)
        if at_rest(problem, now.slot, k, report):
            nearly = abs(report.curvature) <= tol.NEUTRAL * stiffest(problem.chain, k)
            trial = off_saddle(problem, k, now, noise, report)
            if trial == math.inf:
                # the way down is shorter than rounding can tell, unless it is steep, or the sweep overflowed
                report.pivot = 0.0
                return CONVERGED if nearly else STALLED
    if trial <= now.energy:
        return take(problem, k, now, trial, definite and now.damping == 0.0, tolerance, report)
    return hold_back(problem, k, now, report)


@merged
def release(problem: Problem, k: int, now: Any, noise: float, report: Any) -> int:
    """Nothing is left to gain with Levenberg's term: take a last step with it, drop it, make the next one smaller."""
    damped_polish(problem, k, now, noise, report)
    now.damping, now.patience, now.released = 0.0, 0, now.released + 1
    now.last_damping *= tol.SOFTER
    return UNFINISHED


@merged
def finish(problem: Problem, k: int, now: Any, noise: float, report: Any) -> int:
    """Take the last step and judge the result; UNDECIDED where the step did not help."""
    before = now.energy
    last_step(problem, k, now, noise, report)
    if now.iterations == 0 and not problem.skips.rest:
        return UNFINISHED
    if whole(now, report) and at_rest(problem, now.slot, k, report):
        problem.scratch.counters[0].starts_at_rest += now.iterations == 0
        return CONVERGED
    if now.first_free > 0:
        # the gradient of all joints shows moments that that of the free joints did not
        now.first_free = 0
        return UNFINISHED
    if report.decrement <= noise:
        polish(problem, k, now, noise, report)
        flat = report.moment <= rounding_moment(problem, now.slot, k)
        return CONVERGED if flat or at_rest(problem, now.slot, k, report) else STALLED
    return UNFINISHED if now.energy < before else UNDECIDED


@inlined
def whole(now: Any, report: Any) -> bool:
    """Whether the last sweep can judge the whole wire: it went through all joints, or the wire is not soft."""
    return bool(now.first_free == 0 or report.pivot > tol.SOFT)


@merged
def take(problem: Problem, k: int, now: Any, trial: float, free: bool, tolerance: float, report: Any) -> int:
    """Take the step to the trial state, of energy ``trial``. free : Newton's own step, not held back."""
    missed = now.energy - trial - report.decrement
    foretold = tol.FORETOLD * missed * missed <= tolerance * scale_of(problem, now.slot, k) * report.decrement
    now.slot, now.energy = 1 - now.slot, trial
    if foretold and free and whole(now, report):
        costate(problem, now.slot, k, report)
        if at_rest(problem, now.slot, k, report):
            now.iterations += 1
            return CONVERGED
    now.first_free = frozen_joints(problem, now.slot, k) if problem.skips.window and free else 0
    now.last_damping = now.damping if now.damping > 0.0 else tol.LEAST_DAMPING
    now.patience -= 1
    if now.patience <= 0:
        now.damping = tol.LESS_DAMPING * now.damping if now.damping > tol.LEAST_DAMPING else 0.0
    return UNFINISHED


@merged
def hold_back(problem: Problem, k: int, now: Any, report: Any) -> int:
    """No step was worth taking: free all joints, or else hold the wire back by more of Levenberg's term."""
    if now.first_free > 0:
        now.first_free = 0
        return UNFINISHED
    problem.scratch.counters[0].levenberg += 1
    now.patience = 2
    now.damping = tol.AGAIN_DAMPED * now.last_damping if now.damping == 0.0 else tol.MORE_DAMPING * now.damping
    if now.damping <= tol.WORST_DAMPING:
        return UNFINISHED
    costate(problem, now.slot, k, report)
    return STALLED
