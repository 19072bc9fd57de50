"""Eq. 1-7: the total energy of a wire in a wall, the one place that defines it.

U = Σ ½ c_j (u_0² + u_1²) + ½ t_j u_2²  +  Σ ½ k w_p max(0, φ(x_p) + ρ)²  -  Σ F_n · x_n  +  friction
"""

from __future__ import annotations

import math
from typing import Any

from solver._kernels.chain import Chain
from solver._kernels.data import BENDING, CHEAP, CLEAR, FULL, LOAD, RUBBING, WALL, Problem
from solver._kernels.field import in_grid, indices, locate, set_basis, spline, to_world, trilinear, value
from solver._kernels.flags import inlined, kernel, merged


@kernel
def total_energy(problem: Problem, which: int, near: int, k: int) -> float:
    """Total energy of a state, N mm; its parts go to the state. The wall is not asked where there is none.

    Up to node ``near`` (0 for none) the two states agree, and what the wall said to the other one holds.
    """
    state = problem.state
    parts = state.parts[which]
    parts[BENDING] = bending_energy(problem.chain, state.u[which], k)
    parts[WALL] = wall_energy(problem, which, near, k) if problem.stiffness > 0.0 else 0.0
    parts[LOAD] = load_energy(problem.chain, state.x[which], k)
    parts[RUBBING] = friction_energy(problem, which, k) if problem.friction.coefficient > 0.0 else 0.0
    return energy_of(parts)


@inlined
def energy_of(parts: Any) -> float:
    """The total of a state's parts, N mm."""
    return float(parts[BENDING] + parts[WALL] + parts[LOAD] + parts[RUBBING])


@kernel
def bending_energy(chain: Chain, u: Any, k: int) -> float:
    """Eq. 1, 2 and 5: the sum over the joints, N mm."""
    total = 0.0
    for j in range(k):
        total += 0.5 * chain.bend[j] * (u[j, 0] * u[j, 0] + u[j, 1] * u[j, 1])
        if u[j, 2] != 0.0:
            total += 0.5 * chain.twist[j] * u[j, 2] * u[j, 2]
    return total


@kernel
def load_energy(chain: Chain, x: Any, k: int) -> float:
    """Potential of the dead loads, N mm."""
    total = 0.0
    for n in range(k + 1):
        for a in range(3):
            total -= chain.load[n, a] * x[n, a]
    return total


@inlined
def point_at(problem: Problem, which: int, n: int, p: int, q: Any) -> None:
    """Where look-up point p of node n is, mm, into q (3,)."""
    x, r, o = problem.state.x[which, n], problem.state.r[which, n], problem.chain.offset[p]
    for a in range(3):
        q[a] = x[a] + r[a, 0] * o[0] + r[a, 1] * o[1] + r[a, 2] * o[2]


@kernel
def wall_energy(problem: Problem, which: int, near: int, k: int) -> float:
    """Eq. 6 and 7: look every point beyond node ``near`` up and add its share, N mm; take over the others."""
    total = taken_over(problem, which, near) if near > 0 else 0.0
    # bound once: inside the loop every member would be taken out of the tuple again, with its reference count
    field, switch, chain, state = problem.field, problem.switch, problem.chain, problem.state
    c, m, o, slope = field.coefficients, field.to_index, field.origin, field.slope
    first, offset, weight, reach = chain.first, chain.offset, chain.weight, chain.reach
    x, r, depth, anchor = state.x[which], state.r[which], state.depth[which], problem.scratch.anchor
    jet, weights = state.jet[which], problem.scratch.weights
    clear, cheap, full = 0, 0, 0
    for n in range(near + 1, k + 1):
        for p in range(first[n], first[n + 1]):
            q0, q1, q2 = x[n, 0], x[n, 1], x[n, 2]
            o0, o1, o2 = offset[p, 0], offset[p, 1], offset[p, 2]
            if o0 != 0.0 or o1 != 0.0 or o2 != 0.0:
                q0 += r[n, 0, 0] * o0 + r[n, 0, 1] * o1 + r[n, 0, 2] * o2
                q1 += r[n, 1, 0] * o0 + r[n, 1, 1] * o1 + r[n, 1, 2] * o2
                q2 += r[n, 2, 0] * o0 + r[n, 2, 1] * o1 + r[n, 2, 2] * o2
            depth[p] = 0.0
            place = indices(m, o, q0, q1, q2)
            inside = in_grid(c, place)
            # a point that moved less than its clearance since its last look-up cannot touch
            clearance = -anchor[p, 3] - reach
            if switch.clearance and inside and clearance >= 0.0:
                d0, d1, d2 = q0 - anchor[p, 0], q1 - anchor[p, 1], q2 - anchor[p, 2]
                if slope * slope * (d0 * d0 + d1 * d1 + d2 * d2) <= clearance * clearance:
                    clear += 1
                    continue
            # a point that touched is taken to touch still: its value alone is not asked first
            touched = clearance < 0.0
            anchor[p, 0], anchor[p, 1], anchor[p, 2] = q0, q1, q2
            i, j, h, u, v, w = locate(c, place)
            if switch.cheap and inside and not touched:
                phi = trilinear(c, i, j, h, u, v, w) + field.gap
                if phi + reach <= 0.0:
                    cheap += 1
                    anchor[p, 3] = phi
                    continue
            full += 1
            d = -1.0 if touched else value(c, i, j, h, u, v, w) + reach
            if touched or d > 0.0:
                set_basis(u, v, w, weights)
                d = penetration(c, m, i, j, h, weights, jet[p], reach)
            # a point outside the grid is no anchor: the slope is bounded inside only
            anchor[p, 3] = d - reach if inside else 1.0
            if d > 0.0:
                depth[p] = d
                total += 0.5 * problem.stiffness * weight[p] * d * d
    counter = problem.scratch.counter
    counter[CLEAR] += clear
    counter[CHEAP] += cheap
    counter[FULL] += full
    return total


@kernel
def taken_over(problem: Problem, which: int, near: int) -> float:
    """Wall energy of nodes 1 to ``near``, as the other state has it, N mm."""
    chain, state, total = problem.chain, problem.state, 0.0
    depth, jet, source, from_jet = (
        state.depth[which],
        state.jet[which],
        state.depth[1 - which],
        state.jet[1 - which],
    )
    for p in range(chain.first[1], chain.first[near + 1]):
        d = source[p]
        depth[p] = d
        if d > 0.0:
            total += 0.5 * problem.stiffness * chain.weight[p] * d * d
            for a in range(10):
                jet[p, a] = from_jet[p, a]
    return total


@inlined
def penetration(c: Any, m: Any, i: int, j: int, k: int, weights: Any, jet: Any, reach: float) -> float:
    """How far the wire's hull is beyond the lumen, mm (negative inside); fills the point's jet."""
    spline(c, i, j, k, weights, jet)
    to_world(m, jet)
    return float(jet[0] + reach)


@inlined
def slide_of(problem: Problem, which: int, n: int, p: int, slide: Any) -> float:
    """Tangential way (3,) of a point since the step began; returns its smoothed length, at least ``slip``."""
    friction = problem.friction
    point_at(problem, which, n, p, slide)
    normal = friction.normal[p]
    across = 0.0
    for a in range(3):
        slide[a] -= friction.start[p, a]
        across += slide[a] * normal[a]
    size = friction.slip * friction.slip
    for a in range(3):
        slide[a] -= across * normal[a]
        size += slide[a] * slide[a]
    return float(math.sqrt(size))


@merged
def hold(problem: Problem, k: int) -> None:
    """Friction, where there is any, holds every look-up point where it is now."""
    if problem.friction.coefficient == 0.0:
        return
    now = 0 * k
    for n in range(1, k + 1):
        for p in range(problem.chain.first[n], problem.chain.first[n + 1]):
            point_at(problem, now, n, p, problem.friction.start[p])


@kernel
def friction_energy(problem: Problem, which: int, k: int) -> float:
    """Incremental potential of Coulomb's law, N mm: load times coefficient times the way slid in this step."""
    friction, chain = problem.friction, problem.chain
    slide = problem.scratch.slide
    total = 0.0
    for n in range(1, k + 1):
        for p in range(chain.first[n], chain.first[n + 1]):
            if friction.load[p] > 0.0:
                size = slide_of(problem, which, n, p, slide)
                total += friction.coefficient * friction.load[p] * (size - friction.slip)
    return total


@kernel
def lag_friction(problem: Problem, which: int, k: int) -> float:
    """Take contact loads and normals from a state; return the largest change of a load over the largest load."""
    friction, chain, state = problem.friction, problem.chain, problem.state
    change = 0.0
    largest = 0.0
    for p in range(chain.first[1], chain.first[k + 1]):
        d = state.depth[which, p]
        load = 0.0
        if d != 0.0:
            jet = state.jet[which, p]
            slope = math.sqrt(jet[1] * jet[1] + jet[2] * jet[2] + jet[3] * jet[3])
            load = problem.stiffness * chain.weight[p] * d * slope
            for a in range(3):
                friction.normal[p, a] = jet[1 + a] / max(slope, 1e-12)
        change = max(change, abs(load - friction.load[p]))
        largest = max(largest, load)
        friction.load[p] = load
    return change / largest if largest > 0.0 else 0.0
