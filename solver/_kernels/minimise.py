"""One relaxation to its end: the one loop around either method, friction's rounds around it.

A method proposes, the total energy decides, and a state that is no minimum is never called one.
"""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels import closed_form, newton_method
from solver._kernels.data import CONVERGED, FOLDED, FRICTION, MAX_ITERATIONS, NON_FINITE, UNFINISHED, Limits, Problem
from solver._kernels.energy import energy_of, total_energy
from solver._kernels.flags import cached, inlined, kernel, merged
from solver._kernels.forces import copy_state, forget_forces, least_turn_cosine
from solver._kernels.friction import hold_on, take_loads
from solver._kernels.newton import costate
from solver._kernels.spring_back import rests

METHODS = ("newton", "closed_form")
NEWTON, CLOSED_FORM = range(2)
"""``Limits.method`` of each."""


@merged
def minimise(problem: Problem, slot: int, k: int, limits: Limits, report: Any) -> tuple[int, int, int, float]:
    """Relax the state in a slot, whose energy is known; the report is that of the result.

    Returns how it ended (see ``data.OUTCOMES``), the iterations, the slot of the result and its energy, N mm.
    """
    now = problem.scratch.descent[0]
    begin(now, slot, energy_of(problem, slot))
    report.start, report.pivot = now.energy, 1.0
    if limits.method == NEWTON and rests(problem, k, now):
        forget_forces(report)
        return CONVERGED, 0, now.slot, now.energy
    for iteration in range(limits.max_iterations):
        now.iterations = iteration
        if not math.isfinite(now.energy):
            return NON_FINITE, iteration, now.slot, now.energy
        if limits.method == NEWTON:
            outcome = newton_method.iterate(problem, k, now, limits.tolerance, report)
        else:
            outcome = closed_form.iterate(problem, k, now, limits.tolerance, report)
        if outcome != UNFINISHED:
            return outcome, now.iterations, now.slot, now.energy
    costate(problem, now.slot, k, report)
    return MAX_ITERATIONS, limits.max_iterations, now.slot, now.energy


@merged
def begin(now: Any, slot: int, energy: float) -> None:
    """Fill the record that the iterations hand on."""
    now.slot, now.energy, now.iterations = slot, energy, 0
    now.first_free, now.patience, now.released = 0, 0, 0
    now.damping, now.last_damping = 0.0, tol.FIRST_DAMPING
    now.share, now.next_check, now.checked_energy = 1.0, tol.FIRST_CHECK, math.inf


@kernel
def relax_with_friction(
    problem: Problem, slot: int, k: int, limits: Limits, report: Any
) -> tuple[int, int, int, float]:
    """Relax the state in a slot, whose energy is known, in place.

    With friction the contact loads are taken from the last relaxation until they settle. Returns the outcome, the
    iterations of all and of the longest of these relaxations, and the energy, N mm.
    """
    rubs, counters = problem.friction.coefficient > 0.0, problem.scratch.counters[0]
    counters.relaxations_without_friction += not rubs
    counters.relaxations_without_twist += not problem.twisting
    problem.scratch.descent[0].forked = problem.scratch.descent[0].sprung = 0
    if rubs:
        take_loads(problem, slot, k, 1.0)
        hold_on(problem, k)
    outcome, iterations, most, energy = FRICTION, 0, 0, 0.0
    share, change, total = 1.0, math.inf, 0.0
    cost = k + problem.chain.first[k + 1]
    for _ in range(tol.FRICTION_ROUNDS):
        if rubs:
            look_again(problem, slot, k)
        allowed = min(limits.max_iterations, max(limits.work - counters.passed, 0) // cost)
        own = Limits(limits.method, limits.tolerance, allowed, limits.work)
        outcome, used, result, energy = minimise(problem, slot, k, own, report)
        iterations, most = iterations + used, max(most, used)
        counters.passed += used * cost
        if result != slot:
            copy_state(problem, result, slot, k)
        if outcome != CONVERGED or not rubs:
            break
        was, before = change, total
        change, total = take_loads(problem, slot, k, share)
        if change < tol.FRICTION_CHANGE:
            break
        share = next_share(share, change / was, total * before)
        outcome = FRICTION
    return shape_of(problem, slot, k) if outcome == CONVERGED else outcome, iterations, most, energy


@inlined
def next_share(share: float, growth: float, same: float) -> float:
    """Share of the next change of the loads that is taken, by how the last one grew and whether its sign was the same.

    Loads that fall ever faster are a wire that friction lets go of: it is followed. Loads that swing are damped.
    """
    if same < 0.0:
        return max(0.5 * min(share, 1.0), tol.FRICTION_SHARES[0])
    return min(tol.FRICTION_FASTER * share, tol.FRICTION_SHARES[1]) if growth > tol.FRICTION_CREEPS else 1.0


@cached
def look_again(problem: Problem, slot: int, k: int) -> None:
    """Compute the energy of a state again, with the contact loads that friction has now."""
    total_energy(problem, slot, 0, k)


@kernel
def shape_of(problem: Problem, slot: int, k: int) -> int:
    """Judge the shape of a wire at rest: NON_FINITE, FOLDED, or CONVERGED where there is nothing wrong with it."""
    tip = problem.state.x[slot, k]
    # whatever is undefined along the wire is so at its tip
    if not math.isfinite(tip[0] + tip[1] + tip[2]):
        return NON_FINITE
    return FOLDED if least_turn_cosine(problem.state.r[slot], k) < tol.FOLD_COSINE else CONVERGED
