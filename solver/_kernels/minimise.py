"""The one loop: a method proposes, the total energy decides, and a state that is no minimum is never called one."""

from __future__ import annotations

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.energy import energy_of, total_energy
from solver._kernels.flags import kernel, once
from solver._kernels.layout import Chain
from solver._kernels.newton import costate, sweep
from solver._kernels.passage import crossed
from solver._kernels.problem import (
    BENDING,
    IDLE,
    LEVENBERG,
    LOAD,
    ROLLOUTS,
    RUBBING,
    START,
    SWEEPS,
    WALL,
    Problem,
)
from solver._kernels.rollout import copy_base, place, rollout

# how a relaxation ends
CONVERGED, EXHAUSTED, STALLED, BROKEN = range(4)

ROUND_OFF = tol.ROUND_OFF
SUFFICIENT = tol.SUFFICIENT
FLOOR = tol.ENERGY_FLOOR_ANGLE**2
FLOOR_ANGLE = tol.ENERGY_FLOOR_ANGLE
REST = 0.5 * tol.REST_ANGLE**2
MOMENT = tol.MOMENT
FIRST_DAMPING = tol.FIRST_DAMPING
LEAST_DAMPING = tol.LEAST_DAMPING
WORST_DAMPING = tol.WORST_DAMPING
SEARCHES = tol.SEARCHES
POLISHES = tol.POLISHES
FORETOLD = tol.FORETOLD


@kernel
def scale_of(problem: Problem, which: int, k: int) -> float:
    """The energy that tolerances are relative to, N mm."""
    parts = problem.state.parts[which]
    return float(parts[BENDING] + parts[WALL] + parts[RUBBING] + FLOOR * stiffest(problem.chain, k))


@kernel
def stiffest(chain: Chain, k: int) -> float:
    """Largest joint stiffness, N mm/rad."""
    largest = 0.0
    for j in range(k):
        largest = max(largest, chain.bend[j])
    return largest


@kernel
def largest_moment(chain: Chain, u: Any, k: int) -> float:
    """Largest bending moment in the wire, N mm, with a floor."""
    largest = 0.0
    for j in range(k):
        largest = max(largest, chain.bend[j] * max(abs(u[j, 0]), abs(u[j, 1]), FLOOR_ANGLE))
    return largest


@kernel
def admissible(problem: Problem, which: int, k: int) -> bool:
    """Whether the trial state can be reached from the current one without passing through a wall."""
    return problem.stiffness == 0.0 or not crossed(problem, which, k)


@once
def search(problem: Problem, which: int, k: int, energy: float, decrement: float, noise: float) -> float:
    """Shorten Newton's step until the energy falls enough; return the new energy, or inf when it never does."""
    fraction = 1.0
    for _ in range(SEARCHES):
        rollout(problem, which, k, 0 * k, fraction)
        problem.scratch.counter[ROLLOUTS] += 1
        trial = total_energy(problem, 1 - which, k)
        enough = trial <= energy - SUFFICIENT * fraction * decrement
        if (enough or (decrement <= noise and trial <= energy)) and admissible(problem, which, k):
            return trial
        fraction *= 0.4
    return math.inf


@once
def leave_saddle(problem: Problem, which: int, k: int, energy: float, report: Any) -> float:
    """Leave a stationary point along its direction of negative curvature; return the new energy, or inf."""
    j = int(report[2])
    gain = problem.scratch.gain
    for a in range(3):
        for b in range(7):
            gain[j, a, b] = 0.0
    for i in range(j + 1, k):
        gain[i, 0, 0] = gain[i, 1, 0] = gain[i, 2, 0] = 0.0
    size = 0.3
    while size > 1e-6:
        for side in (1.0, -1.0):
            for a in range(2):
                gain[j, a, 0] = side * size * report[3 + a]
            gain[j, 2, 0] = side * size * report[19]
            rollout(problem, which, k, j, 1.0)
            problem.scratch.counter[ROLLOUTS] += 1
            trial = total_energy(problem, 1 - which, k)
            if trial < energy - 0.1 * abs(report[5]) * size * size and admissible(problem, which, k):
                return trial
        size *= 0.25
    return math.inf


@once
def rest_shape(problem: Problem, which: int, k: int) -> bool:
    """Try the wire's own rest shape: where it touches nothing it is the answer, and nothing is iterated."""
    state = problem.state
    for j in range(k):
        state.u[1 - which, j, 0] = state.u[1 - which, j, 1] = state.u[1 - which, j, 2] = 0.0
    copy_base(state, which, 1 - which)
    place(problem.chain, state, 1 - which, k)
    total_energy(problem, 1 - which, k)
    parts = state.parts[1 - which]
    return parts[WALL] == 0.0 and parts[RUBBING] == 0.0 and admissible(problem, which, k)


@kernel
def unloaded(chain: Chain, k: int) -> bool:
    """No dead load on any joint."""
    for n in range(k + 1):
        if chain.load[n, 0] != 0.0 or chain.load[n, 1] != 0.0 or chain.load[n, 2] != 0.0:
            return False
    return True


@once
def finish(problem: Problem, which: int, k: int, energy: float, report: Any) -> tuple[int, float]:
    """Take the last step, which squares the error, and leave the exact gradient of the result in the report."""
    rollout(problem, which, k, 0 * k, 1.0)
    problem.scratch.counter[ROLLOUTS] += 1
    trial = total_energy(problem, 1 - which, k)
    if trial <= energy and admissible(problem, which, k):
        which, energy = 1 - which, trial
    costate(problem, which, k, report)
    return which, energy


@kernel
def at_rest(problem: Problem, which: int, k: int, report: Any) -> bool:
    """Whether the residual moments that ``costate`` left are nothing beside the moments in the wire."""
    return bool(report[1] <= MOMENT * largest_moment(problem.chain, problem.state.u[which], k))


@once
def polish(
    problem: Problem, which: int, k: int, energy: float, noise: float, report: Any
) -> tuple[int, float]:
    """Newton's steps where the energy is flat to its last place: the fall that is left to foretell decides."""
    definite = sweep(problem, which, k, 0.0, report)
    for _ in range(POLISHES):
        left = report[0]
        if not definite or at_rest(problem, which, k, report):
            break
        rollout(problem, which, k, 0 * k, 1.0)
        problem.scratch.counter[ROLLOUTS] += 1
        trial = total_energy(problem, 1 - which, k)
        if not (trial <= energy + noise and admissible(problem, which, k)):
            break
        definite = sweep(problem, 1 - which, k, 0.0, report)
        problem.scratch.counter[SWEEPS] += 1
        if not (definite and report[0] < left):
            break
        which, energy = 1 - which, trial
        costate(problem, which, k, report)
    return which, energy


@kernel
def rounding_moment(problem: Problem, which: int, k: int) -> float:
    """Moment that the last place of wall forces and loads makes with the whole wire as its lever, N mm."""
    chain, depth = problem.chain, problem.state.depth
    force, lever = 0.0, 0.0
    for n in range(1, k + 1):
        lever += chain.length[n - 1]
        for a in range(3):
            force += abs(chain.load[n, a])
        for i in range(chain.first[n], chain.first[n + 1]):
            force += problem.stiffness * chain.weight[i] * depth[which, i]
    return ROUND_OFF * force * lever


@kernel
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
    for iteration in range(max_iterations):
        if not math.isfinite(energy):
            return BROKEN, iteration, which, energy
        definite = sweep(problem, which, k, damping, report)
        counter[SWEEPS] += 1
        noise = ROUND_OFF * (scale_of(problem, which, k) + abs(state.parts[which, LOAD]))
        if damping == 0.0 and definite and report[0] <= max(tolerance * scale_of(problem, which, k), noise):
            before = energy
            which, energy = finish(problem, which, k, energy, report)
            if at_rest(problem, which, k, report):
                return CONVERGED, iteration, which, energy
            if report[0] <= noise:
                which, energy = polish(problem, which, k, energy, noise, report)
                flat = report[1] <= rounding_moment(problem, which, k)
                ended = CONVERGED if flat or at_rest(problem, which, k, report) else STALLED
                return ended, iteration, which, energy
            if energy < before:
                continue
            # the full step does not help, as where a contact opens and closes again: search as usual
        if damping > 0.0 and definite and report[0] <= noise and settled < SEARCHES:
            # nothing left to gain with the wire held back: look at it free before it is judged
            damping, patience, settled = 0.0, 0, settled + 1
            continue
        trial = math.inf
        if definite:
            trial = search(problem, which, k, energy, report[0], noise)
        elif damping == 0.0:
            costate(problem, which, k, report)
            if at_rest(problem, which, k, report):
                trial = leave_saddle(problem, which, k, energy, report)
                if trial == math.inf:
                    return STALLED, iteration, which, energy
        if trial <= energy:
            missed = energy - trial - report[0]
            foretold = FORETOLD * missed * missed <= tolerance * scale_of(problem, which, k) * report[0]
            which, energy = 1 - which, trial
            if foretold and definite and damping == 0.0:
                costate(problem, which, k, report)
                if at_rest(problem, which, k, report):
                    return CONVERGED, iteration + 1, which, energy
            last, patience = max(damping, LEAST_DAMPING), patience - 1
            if patience <= 0:
                damping = 0.2 * damping if damping > LEAST_DAMPING else 0.0
        else:
            counter[LEVENBERG] += 1
            patience = 2
            damping = 0.5 * last if damping == 0.0 else 6 * damping
            if damping > WORST_DAMPING:
                costate(problem, which, k, report)
                return STALLED, iteration, which, energy
    costate(problem, which, k, report)
    return EXHAUSTED, max_iterations, which, energy
