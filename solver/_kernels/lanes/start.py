"""Where a step of a wire in lanes starts: ``start.chosen``, with eight look-ups at a time.

Eight points of one wire are looked up side by side, as those of eight wires are in a trial.
"""

from typing import Any, NamedTuple

from solver._kernels import wall_law
from solver._kernels.algebra import dot, load3, minus, store3
from solver._kernels.data import Problem
from solver._kernels.energy import at_entry, bending_energy, energy_of, load_energy, placed
from solver._kernels.flags import kernel
from solver._kernels.lanes.field import look_first, look_up
from solver._kernels.lanes.vectors import WIDTH
from solver._kernels.start import chosen


class Desk(NamedTuple):
    """Room for look-ups: lists of points, and what is found of eight, as numbers and as lanes; see ``Block``."""

    asked: Any
    found: Any
    lanes: Any


@kernel
def chosen_start(problem: Problem, desk: Desk, at: Any, k: int, share: float) -> int:
    """``start.chosen`` with eight look-ups at a time."""
    return chosen(problem, at, k, share, total_energy, desk)


@kernel
def total_energy(problem: Problem, desk: Desk, slot: int, k: int) -> float:
    """``energy.total_energy`` without friction."""
    state, reach, touching, total = problem.state, problem.chain.reach, 0, at_entry(problem)
    asking = ask(problem, desk.asked, slot, k)
    for start in range(0, asking, WIDTH):
        some = gather(problem, desk, 1, start, asking)
        look_first(problem.field, desk.lanes)
        for n in range(some):
            p = desk.asked[1, start + n]
            problem.scratch.anchor[p, 3] = desk.found[10, n]
            desk.asked[0, touching] = p
            touching += desk.found[0, n] + reach > 0.0
    for start in range(0, touching, WIDTH):
        some = gather(problem, desk, 0, start, touching)
        look_up(problem.field, desk.lanes)
        for n in range(some):
            keep(problem, desk, slot, desk.asked[0, start + n], n)
    for i in range(touching):
        p = desk.asked[0, i]
        total += wall_law.energy(problem.stiffness, problem.chain.weight[p], state.penetration[slot, p])
    problem.scratch.counters[0].wall_look_ups += asking + touching
    parts = state.energies[slot]
    parts.bending, parts.wall = bending_energy(problem.chain, state.u[slot], k), total
    parts.load, parts.friction = load_energy(problem.chain, state.x[slot], k), 0.0
    return energy_of(problem, slot)


@kernel
def ask(problem: Problem, asked: Any, slot: int, k: int) -> int:
    """List the points that may touch, note where they are, and count them."""
    chain, anchor, x, r = problem.chain, problem.scratch.anchor, problem.state.x[slot], problem.state.r[slot]
    first, offset, penetration = chain.first, chain.offset, problem.state.penetration[slot]
    reach, square, count = chain.reach, problem.field.slope * problem.field.slope, 0
    for n in range(1, k + 1):
        for p in range(first[n], first[n + 1]):
            q, room = placed(load3(x, n), r, n, load3(offset, p)), -anchor[p, 3] - reach
            way = minus(q, load3(anchor, p))
            penetration[p] = 0.0
            if not (room >= 0.0 and square * dot(way, way) <= room * room):
                store3(anchor, p, q)
                asked[1, count] = p
                count += 1
    problem.scratch.counters[0].wall_look_ups_proven_unnecessary += chain.first[k + 1] - count
    return count


@kernel
def gather(problem: Problem, desk: Desk, which: int, start: int, count: int) -> int:
    """Put up to eight points of a list on the desk, from ``start`` on; return how many."""
    for n in range(WIDTH):
        p = desk.asked[which, min(start + n, count - 1)]
        for a in range(3):
            desk.found[a, n] = problem.scratch.anchor[p, a]
    return min(WIDTH, count - start)


@kernel
def keep(problem: Problem, desk: Desk, slot: int, p: int, n: int) -> None:
    """Keep what was found of a point that touches."""
    problem.state.penetration[slot, p] = max(desk.found[0, n] + problem.chain.reach, 0.0)
    for a in range(10):
        problem.state.jet[slot, p, a] = desk.found[a, n]
