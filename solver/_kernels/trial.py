"""A trial: Newton's step, or a fraction of it, and the energy there."""

from solver._kernels.data import Problem
from solver._kernels.energy import total_energy
from solver._kernels.flags import kernel
from solver._kernels.rollout import rollout


@kernel
def step(problem: Problem, slot: int, first_free: int, k: int, fraction: float) -> float:
    """Take a fraction of Newton's step; return the energy of the trial state, N mm."""
    rollout(problem, slot, first_free, k, fraction)
    problem.scratch.counters[0].rollouts += 1
    return total_energy(problem, 1 - slot, first_free, k)
