"""One relaxation to its end: the chosen method, friction's rounds around it, and what the result is worth."""

from __future__ import annotations

from typing import Any, NamedTuple

from solver import _tolerances as tol
from solver._kernels.chain import Cut
from solver._kernels.closed_form import minimise_closed_form
from solver._kernels.data import DEEPEST, PUSH, SMOOTH, SPENT, TWISTLESS, Problem
from solver._kernels.energy import lag_friction, total_energy
from solver._kernels.flags import merged
from solver._kernels.forces import contact_forces, copy_state, least_turn_cosine, push_force
from solver._kernels.minimise import BROKEN, CONVERGED, minimise

# how a relaxation ends, beyond the ways of ``minimise``
UNSETTLED, FOLDED, LEFT_GRID = range(BROKEN + 1, BROKEN + 4)

ROUNDS = tol.FRICTION_ROUNDS
CHANGE = tol.FRICTION_CHANGE
FOLD = tol.FOLD_COSINE


class Orders(NamedTuple):
    """How to relax.

    max_iterations : of Newton, or sweeps of the closed form, in one relaxation.     work : joints and look-up points
    passed in all relaxations of a depth together, see ``tol.WORK``.
    """

    closed_form: bool
    tolerance: float
    max_iterations: int
    work: int


@merged
def settle(problem: Problem, which: int, k: int, orders: Orders, report: Any) -> tuple[int, int, float]:
    """Relax state ``which``, whose energy is known, in place; return the outcome, iterations and the energy, N mm.

    With friction the contact loads are taken from the last relaxation until they settle.
    """
    rubs = problem.friction.coefficient > 0.0
    problem.scratch.counter[SMOOTH] += not rubs
    problem.scratch.counter[TWISTLESS] += not problem.twisting
    if rubs:
        for p in range(problem.friction.load.size):
            problem.friction.load[p] = 0.0
        lag_friction(problem, which, k)
    outcome, iterations, energy = UNSETTLED, 0, 0.0
    counter, cost = problem.scratch.counter, k + problem.chain.first[k + 1]
    for _ in range(ROUNDS):
        if rubs:
            total_energy(problem, which, 0 * k, k)
        limit = min(orders.max_iterations, max(orders.work - counter[SPENT], 0) // cost)
        if orders.closed_form:
            result = minimise_closed_form(problem, which, k, orders.tolerance, limit, report)
        else:
            result = minimise(problem, which, k, orders.tolerance, limit, report)
        outcome, iterations, energy = result[0], iterations + result[1], result[3]
        counter[SPENT] += result[1] * cost
        if result[2] != which:
            copy_state(problem, result[2], which, k)
        if outcome != CONVERGED or not rubs or lag_friction(problem, which, k) < CHANGE:
            break
        outcome = UNSETTLED
    if outcome == CONVERGED and least_turn_cosine(problem.state.r[which], k) < FOLD:
        outcome = FOLDED
    return outcome, iterations, energy


@merged
def measure(problem: Problem, cut: Cut, k: int, report: Any, force: Any) -> None:
    """Forces of the wire at rest in state 0: force (capacity + 1, 3) N per joint; deepest contact and push force."""
    for n in range(k + 1):
        force[n, 0] = force[n, 1] = force[n, 2] = 0.0
    report[DEEPEST] = report[PUSH] = 0.0
    if k == 0:
        return
    if problem.stiffness > 0.0:
        report[DEEPEST] = contact_forces(problem, k, force)
    report[PUSH] = push_force(problem, cut, k, report)
