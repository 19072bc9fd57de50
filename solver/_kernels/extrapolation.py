"""A better start for a step: what relaxing the last one changed will change again, counted from the tip.

A wire pushed on goes straight ahead of its tip into the wall and has to be bent there, much as in the step before.
"""

from __future__ import annotations

from solver import _tolerances as tol
from solver._kernels.crossing import crossed
from solver._kernels.data import Problem
from solver._kernels.energy import total_energy
from solver._kernels.flags import kernel, merged
from solver._kernels.rollout import copy_base, place


@kernel
def extrapolate_start(problem: Problem, slot: int, k: int, share: float, last: float) -> int:
    """Return the slot to start from: ``slot``, or the other one, with a share of the last change, if it is lower.

    Both lie in the same lumen (no wall between them), and their energies decide; that of the answer is known then.
    last : energy of the wire before the step, N mm; what ``slot`` has more must at least be halved.
    """
    state, scratch = problem.state, problem.scratch
    u, tried = state.u[slot], state.u[1 - slot]
    for j in range(k):
        for a in range(3):
            scratch.start[j, a] = u[j, a]
            tried[j, a] = u[j, a] + share * scratch.change[k - 1 - j, a]
    energy = total_energy(problem, slot, 0, k)
    if share == 0.0 or state.energies[slot].wall == 0.0:
        return slot
    copy_base(state, slot, 1 - slot)
    place(problem.chain, state, 1 - slot, k)
    better = total_energy(problem, 1 - slot, 0, k) - last < tol.WORTH_FORESEEING * (energy - last)
    if better and not crossed(problem, slot, k):
        scratch.counters[0].starts_foreseen += 1
        return 1 - slot
    return slot


@merged
def note_change(problem: Problem, slot: int, k: int) -> None:
    """Remember how relaxing changed the start of this step."""
    u, scratch = problem.state.u[slot], problem.scratch
    for j in range(k):
        for a in range(3):
            scratch.change[k - 1 - j, a] = u[j, a] - scratch.start[j, a]
    for m in range(k, scratch.change.shape[0]):
        scratch.change[m, 0] = scratch.change[m, 1] = scratch.change[m, 2] = 0.0
