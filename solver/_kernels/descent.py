"""The ways from one state to a lower one: parts of Newton's step, a run of whole ones, out of a saddle, to rest."""

from __future__ import annotations

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.convergence import admissible, at_rest
from solver._kernels.data import ROLLOUTS, RUBBING, SWEEPS, WALL, Problem
from solver._kernels.energy import energy_of, total_energy
from solver._kernels.flags import kernel, merged
from solver._kernels.newton import costate, sweep
from solver._kernels.rollout import copy_base, place, rollout

SUFFICIENT = tol.SUFFICIENT
SEARCHES = tol.SEARCHES
POLISHES = tol.POLISHES
VENTURES = tol.VENTURES
UNMOVED = tol.UNMOVED
WORTHWHILE = tol.WORTHWHILE


@kernel
def step(problem: Problem, which: int, near: int, k: int, fraction: float) -> float:
    """Take a fraction of Newton's step; return the energy of the trial state, N mm."""
    rollout(problem, which, k, near, fraction)
    problem.scratch.counter[ROLLOUTS] += 1
    return total_energy(problem, 1 - which, near, k)


@kernel
def search(
    problem: Problem,
    which: int,
    near: int,
    k: int,
    fraction: float,
    energy: float,
    decrement: float,
    noise: float,
) -> float:
    """Try Newton's whole step, or shorten it until the energy falls enough; return the new energy, or inf."""
    for _ in range(1 if fraction == 1.0 else SEARCHES - 1):
        trial = step(problem, which, near, k, fraction)
        enough = trial <= energy - SUFFICIENT * fraction * decrement
        if (enough or (decrement <= noise and trial <= energy)) and admissible(problem, which, k):
            return trial
        fraction *= 0.4
    return math.inf


@merged
def venture(
    problem: Problem, which: int, k: int, energy: float, decrement: float, rise: float, report: Any
) -> tuple[int, float]:
    """Follow whole steps of Newton uphill until the energy is below where it started; inf and back if it never is.

    Close to a minimum a step fails because contacts open and close on its way. The model of the energy is a
    quadratic for each set of contacts; whole steps find the right set within a few, short ones creep (semismooth
    Newton; the watchdog of Chamberlain et al., 1982). The whole step from ``which`` is the trial state already.
    rise : how far uphill, N mm.
    """
    state, counter, keep = problem.state, problem.scratch.counter, problem.scratch.keep
    for j in range(k):
        for a in range(3):
            keep[j, a] = state.u[which, j, a]
    at, goal = which, energy - SUFFICIENT * decrement
    for _ in range(VENTURES):
        trial = energy_of(state.parts[1 - at])
        if not (trial <= energy + rise and admissible(problem, at, k)):
            break
        at = 1 - at
        if trial <= goal:
            return at, trial
        counter[SWEEPS] += 1
        if not sweep(problem, at, 0 * k, k, 0.0, report):
            break
        step(problem, at, 0 * k, k, 1.0)
    for j in range(k):
        for a in range(3):
            state.u[which, j, a] = keep[j, a]
    place(problem.chain, state, which, k)
    total_energy(problem, which, 0 * k, k)
    sweep(problem, which, 0 * k, k, 0.0, report)
    counter[SWEEPS] += 1
    return which, math.inf


@merged
def leave_saddle(problem: Problem, which: int, k: int, energy: float, noise: float, report: Any) -> float:
    """Leave a stationary point along its direction of negative curvature; return the new energy, or inf."""
    j = int(report[2])
    gain = problem.scratch.gain
    for a in range(3):
        for b in range(7):
            gain[j, a, b] = 0.0
    for i in range(j + 1, k):
        gain[i, 0, 0] = gain[i, 1, 0] = gain[i, 2, 0] = 0.0
    size, least = 0.3, 0.1 * abs(report[5])
    # joints further on may answer with a thousand times as much: nothing but rounding ends the search
    while least * size * size > noise:
        for side in (1.0, -1.0):
            for a in range(2):
                gain[j, a, 0] = side * size * report[3 + a]
            gain[j, 2, 0] = side * size * report[19]
            trial = step(problem, which, j, k, 1.0)
            if trial < energy - least * size * size and admissible(problem, which, k):
                return trial
        size *= 0.25
    return math.inf


@merged
def rest_shape(problem: Problem, which: int, k: int) -> bool:
    """Try the wire's own rest shape: where it touches nothing it is the answer, and nothing is iterated."""
    state = problem.state
    for j in range(k):
        state.u[1 - which, j, 0] = state.u[1 - which, j, 1] = state.u[1 - which, j, 2] = 0.0
    copy_base(state, which, 1 - which)
    place(problem.chain, state, 1 - which, k)
    total_energy(problem, 1 - which, 0 * k, k)
    parts = state.parts[1 - which]
    return parts[WALL] == 0.0 and parts[RUBBING] == 0.0 and admissible(problem, which, k)


@merged
def finish(problem: Problem, which: int, near: int, k: int, energy: float, report: Any) -> tuple[int, float]:
    """Take the last step, which squares the error, and leave the exact gradient of the result in the report."""
    trial = step(problem, which, near, k, 1.0)
    if trial <= energy and admissible(problem, which, k):
        which, energy = 1 - which, trial
    costate(problem, which, k, report)
    return which, energy


@merged
def polish(
    problem: Problem, which: int, k: int, energy: float, noise: float, report: Any
) -> tuple[int, float]:
    """Newton's steps where the energy is flat to its last place: the fall that is left to foretell decides."""
    definite = sweep(problem, which, 0 * k, k, 0.0, report)
    for _ in range(POLISHES):
        left = report[0]
        if not definite or at_rest(problem, which, k, report):
            break
        trial = step(problem, which, 0 * k, k, 1.0)
        if not (trial <= energy + noise and admissible(problem, which, k)):
            break
        definite = sweep(problem, 1 - which, 0 * k, k, 0.0, report)
        problem.scratch.counter[SWEEPS] += 1
        if not (definite and report[0] < left):
            break
        which, energy = 1 - which, trial
        costate(problem, which, k, report)
    return which, energy


@merged
def ease(problem: Problem, which: int, k: int, energy: float, noise: float, report: Any) -> tuple[int, float]:
    """Take the damped step where the energy is flat to its last place, if that lowers the moments that are left."""
    costate(problem, which, k, report)
    moment = report[1]
    trial = step(problem, which, 0 * k, k, 1.0)
    if trial <= energy + noise and admissible(problem, which, k):
        costate(problem, 1 - which, k, report)
        if report[1] < moment:
            return 1 - which, trial
    return which, energy


@merged
def still(problem: Problem, which: int, k: int) -> int:
    """Joints from the base on that the last step left as they were, all but; 0 where that is no good part of them."""
    new, old = problem.state.u[which], problem.state.u[1 - which]
    largest = 0.0
    for j in range(k):
        for a in range(3):
            largest = max(largest, abs(new[j, a] - old[j, a]))
    for j in range(k):
        for a in range(3):
            if abs(new[j, a] - old[j, a]) > UNMOVED * largest:
                return j if j > WORTHWHILE * k else 0
    return 0
