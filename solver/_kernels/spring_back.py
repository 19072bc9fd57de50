"""A wire that touches nothing and carries nothing: it springs back to its rest shape, or to the first wall on its way.

The slide that begins a step may lift a wire off the lip that holds it, by less than the wire pressed into it. Newton's
first step from there is the rest shape, of less energy, whatever lies on the way: tips hopped by 1.2 to 3 mm over lips
that hold them, in 6 of 400 sacs and forks, with steps of any length.
"""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.algebra import dot, load3, scaled, store3
from solver._kernels.data import Problem
from solver._kernels.energy import energy_of, stiffest, total_energy
from solver._kernels.flags import cached, kernel, merged
from solver._kernels.forces import unloaded
from solver._kernels.rollout import copy_base, place

REST = 0.5 * tol.REST_ANGLE**2


@merged
def rests(problem: Problem, k: int, now: Any) -> bool:
    """Whether the wire's rest shape is the answer, and is current; a wall on the way to it is where it is current."""
    parts = problem.state.energies[now.slot]
    if not (parts.wall == 0.0 and parts.friction == 0.0 and unloaded(problem.chain, k)):
        return False
    if now.energy > REST * stiffest(problem.chain, k):
        free = spring_back(problem, now.slot, k)
        now.slot, now.sprung = 1 - now.slot, 1
        now.energy = energy_of(problem, now.slot)
        if not free:
            return False
    if not problem.skips.idle:
        return False
    problem.scratch.counters[0].rest_shapes += 1
    now.energy = 0.0
    return True


@cached
def spring_back(problem: Problem, slot: int, k: int) -> bool:
    """Lead the wire to its rest shape, into the trial state, and stop where it touches; whether it never does.

    No joint goes on by more than half a voxel at a time, between which the grid has no wall.
    """
    parts, steps = problem.state.energies[1 - slot], 1
    if problem.stiffness > 0.0:
        steps = max(1, math.ceil(2.0 * longest_way(problem, slot, k) / problem.field.spacing))
    for i in range(1, steps + 1):
        towards_rest(problem, slot, k, i / steps)
        if parts.wall > 0.0 or parts.friction > 0.0:
            meet(problem, slot, k, (i - 1) / steps, i / steps)
            return False
    return True


@kernel
def longest_way(problem: Problem, slot: int, k: int) -> float:
    """No joint goes a longer way to the rest shape, mm: each turn swings all that lies beyond it."""
    way, beyond = 0.0, 0.0
    for j in range(k - 1, -1, -1):
        beyond += problem.chain.length[j]
        u = load3(problem.state.u[slot], j)
        way += math.sqrt(dot(u, u)) * beyond
    return way


@kernel
def meet(problem: Problem, slot: int, k: int, free: float, touching: float) -> None:
    """Find a place between a free and a touching share of the way at which the wire has no more energy than before."""
    for _ in range(tol.MEETINGS):
        if energy_of(problem, 1 - slot) <= energy_of(problem, slot):
            return
        touching = 0.5 * (free + touching)
        towards_rest(problem, slot, k, touching)
    towards_rest(problem, slot, k, free)


@kernel
def towards_rest(problem: Problem, slot: int, k: int, share: float) -> None:
    """Make the trial state: the current one after a share of the way to the rest shape."""
    state, u, new = problem.state, problem.state.u[slot], problem.state.u[1 - slot]
    for j in range(k):
        store3(new, j, scaled(1.0 - share, load3(u, j)))
    copy_base(state, slot, 1 - slot)
    place(problem.chain, state, 1 - slot, k)
    total_energy(problem, 1 - slot, 0, k)
