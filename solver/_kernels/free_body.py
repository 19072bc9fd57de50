"""The wire beyond a node as a free body: what the rest of the wire does to it there, and what becomes of that work.

The force and the moment in a cross-section balance all that acts beyond it (Landau and Lifshitz, Theory of Elasticity,
section 19). So a soft tip is judged by its own energy, wherever it is pushed from: by a hand, or by a wire in a
catheter that holds a hundred times as much.
"""

from typing import Any

from solver._kernels import wall_law
from solver._kernels.algebra import Three, add3, cross, dot, load3, minus, scaled
from solver._kernels.data import CURRENT, LAST_GOOD, Problem
from solver._kernels.energy import placed
from solver._kernels.flags import inlined, kernel


@kernel
def free_body(problem: Problem, slot: int, cut: int, k: int, back: int) -> tuple[float, Three, Three]:
    """Energy beyond node ``cut``, N mm, and its gradient by moving, N, and turning, N mm, that part about the node.

    back : how many nodes fewer the wire in the slot has at its base, 0 or more.
    """
    chain, state = problem.chain, problem.state
    x, r, u, shift = state.x[slot], state.r[slot], state.u[slot], chain.first[back + 1]
    penetration, jet, entry, base = state.penetration[slot], state.jet[slot], load3(x, 0), load3(x, cut - back)
    energy, force, moment = 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for j in range(cut, k):
        v = load3(u, j - back)
        energy += 0.5 * chain.bend[j] * (v[0] * v[0] + v[1] * v[1])
        if v[2] != 0.0:
            energy += 0.5 * chain.twist[j] * v[2] * v[2]
    for n in range(cut + 1, k + 1):
        at, load = load3(x, n - back), load3(chain.load, n)
        energy -= dot(load, minus(at, entry))
        force, moment = minus(force, load), minus(moment, cross(minus(at, base), load))
        for p in range(chain.first[n], chain.first[n + 1]):
            d = penetration[p - shift]
            if d > 0.0:
                energy += wall_law.energy(problem.stiffness, chain.weight[p], d)
                size = wall_law.force(problem.stiffness, chain.weight[p], d)
                slope = scaled(size, (jet[p - shift, 1], jet[p - shift, 2], jet[p - shift, 3]))
                lever = minus(placed(at, r, n - back, load3(chain.offset, p)), base)
                force, moment = add3(force, slope), add3(moment, cross(lever, slope))
    return energy, force, moment


@inlined
def turn_between(one: Any, m: int, other: Any, n: int) -> Three:
    """Rotation, rad, from frame m of one wire to frame n of the other, times sin(angle)/angle."""
    way = (0.0, 0.0, 0.0)
    for c in range(3):
        a, b = (one[m, 0, c], one[m, 1, c], one[m, 2, c]), (other[n, 0, c], other[n, 1, c], other[n, 2, c])
        way = add3(way, cross(a, b))
    return scaled(0.5, way)


@kernel
def work_on(problem: Problem, cut: int, k: int, back: int) -> tuple[float, float, float, float]:
    """Work done in a step on the wire beyond node ``cut``, by the trapezium rule, and what became of it, all N mm.

    Returns the work less the change of energy, the size of that work, the change of the force and moment times their
    ways, and the larger energy of the two. back : how many nodes the step added at the base.
    """
    x, r = problem.state.x, problem.state.r
    was, force, moment = free_body(problem, LAST_GOOD, cut, k, back)
    now, force_now, moment_now = free_body(problem, CURRENT, cut, k, 0)
    way = minus(load3(x[CURRENT], cut), load3(x[LAST_GOOD], cut - back))
    turn = turn_between(r[LAST_GOOD], cut - back, r[CURRENT], cut)
    pushed, pushed_now = dot(force, way), dot(force_now, way)
    turned, turned_now = dot(moment, turn), dot(moment_now, turn)
    missing = 0.5 * (pushed + pushed_now + turned + turned_now) - (now - was)
    size = max(abs(pushed), abs(pushed_now)) + max(abs(turned), abs(turned_now))
    return missing, size, abs(pushed_now - pushed) + abs(turned_now - turned), max(abs(now), abs(was))
