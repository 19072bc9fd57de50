"""When a state counts as a minimum: what its energy, moments and rounding are measured by."""

from __future__ import annotations

from typing import Any

from solver import _tolerances as tol
from solver._kernels import wall_law
from solver._kernels.crossing import crossed
from solver._kernels.data import Chain, Problem
from solver._kernels.flags import kernel

FLOOR = tol.ENERGY_FLOOR_ANGLE**2


@kernel
def scale_of(problem: Problem, slot: int, k: int) -> float:
    """The energy that tolerances are relative to, N mm."""
    parts = problem.state.energies[slot]
    return float(parts.bending + parts.wall + parts.friction + FLOOR * stiffest(problem.chain, k))


@kernel
def noise_of(problem: Problem, slot: int, scale: float) -> float:
    """Energy below which a difference is rounding, N mm. scale : see ``scale_of``."""
    return float(tol.ROUND_OFF * (scale + abs(problem.state.energies[slot].load)))


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
        angle = max(abs(u[j, 0]), abs(u[j, 1]), tol.ENERGY_FLOOR_ANGLE)
        largest = max(largest, chain.bend[j] * angle)
    return largest


@kernel
def admissible(problem: Problem, slot: int, k: int) -> bool:
    """Whether the trial state can be reached from the current one without passing through a wall."""
    return problem.stiffness == 0.0 or not crossed(problem, slot, k)


@kernel
def unloaded(chain: Chain, k: int) -> bool:
    """No dead load on any joint."""
    for n in range(k + 1):
        if chain.load[n, 0] != 0.0 or chain.load[n, 1] != 0.0 or chain.load[n, 2] != 0.0:
            return False
    return True


@kernel
def at_rest(problem: Problem, slot: int, k: int, report: Any) -> bool:
    """Whether the moments that ``costate`` found left are nothing beside the moments in the wire."""
    return bool(report.moment <= tol.MOMENT * largest_moment(problem.chain, problem.state.u[slot], k))


@kernel
def rounding_moment(problem: Problem, slot: int, k: int) -> float:
    """Moment that the last place of wall forces and loads makes with the whole wire as its lever, N mm."""
    chain, penetration = problem.chain, problem.state.penetration[slot]
    force, lever = 0.0, 0.0
    for n in range(1, k + 1):
        lever += chain.length[n - 1]
        for a in range(3):
            force += abs(chain.load[n, a])
        for p in range(chain.first[n], chain.first[n + 1]):
            force += wall_law.force(problem.stiffness, chain.weight[p], penetration[p])
    return tol.ROUND_OFF * force * lever
