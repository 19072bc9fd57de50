"""The one loop: a method proposes, the total energy decides, and a state that is no minimum is never called one."""

from __future__ import annotations

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels import closed_form, newton_method
from solver._kernels.data import CONVERGED, MAX_ITERATIONS, NON_FINITE, UNFINISHED, Limits, Problem
from solver._kernels.energy import energy_of
from solver._kernels.flags import merged
from solver._kernels.forces import forget_forces
from solver._kernels.newton import costate

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
    report.start = now.energy
    if limits.method == NEWTON and newton_method.rests(problem, k, now):
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
