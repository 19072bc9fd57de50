"""Eq. 1-7: the total energy of a wire in a wall, the one place that defines it.

U = Σ ½ c_j (u_0² + u_1²) + ½ t_j u_2²  +  Σ ½ k w_p max(0, φ(x_p) + ρ)²  -  Σ F_n · x_n  +  friction
"""

from __future__ import annotations

from typing import Any

import numpy as np

from solver._kernels.flags import inlined, kernel
from solver._kernels.layout import Chain
from solver._kernels.problem import BENDING, CHEAP, CLEAR, FULL, LOAD, RUBBING, WALL, Problem
from solver._kernels.spline import basis, locate, spline, to_world, trilinear


@kernel
def total_energy(problem: Problem, which: int, k: int) -> float:
    """Total energy of a state, N mm; its parts go to the state. The wall is not asked where there is none."""
    state = problem.state
    parts = state.parts[which]
    parts[BENDING] = bending_energy(problem.chain, state.u[which], k)
    parts[WALL] = wall_energy(problem, which, k) if problem.stiffness > 0.0 else 0.0
    parts[LOAD] = load_energy(problem.chain, state.x[which], k)
    parts[RUBBING] = friction_energy(problem, which, k) if problem.friction.coefficient > 0.0 else 0.0
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
def wall_energy(problem: Problem, which: int, k: int) -> float:
    """Eq. 6 and 7: look every point up and add its share, N mm."""
    total = 0.0
    chain = problem.chain
    depth = problem.state.depth[which]
    q = problem.scratch.fraction[3:]
    for n in range(1, k + 1):
        for p in range(chain.first[n], chain.first[n + 1]):
            point_at(problem, which, n, p, q)
            d = penetration(problem, which, p, q)
            depth[p] = d
            if d != 0.0:
                total += 0.5 * problem.stiffness * chain.weight[p] * d * d
    return total


@inlined
def penetration(problem: Problem, which: int, p: int, q: Any) -> float:
    """How far the wire's hull is beyond the lumen at q, mm; fills the point's jet where it is.

    An anchor holds the place of the last look-up and an upper bound of the distance there: a point that has
    moved less than its clearance since then cannot touch.
    """
    field, scratch, reach = problem.field, problem.scratch, problem.chain.reach
    anchor = scratch.anchor[p]
    i, j, k, inside = locate(field, q[0], q[1], q[2], scratch.fraction)
    if problem.switch.clearance and inside and anchor[3] < 0.0:
        d0, d1, d2 = q[0] - anchor[0], q[1] - anchor[1], q[2] - anchor[2]
        if anchor[3] + field.slope * np.sqrt(d0 * d0 + d1 * d1 + d2 * d2) + reach <= 0.0:
            scratch.counter[CLEAR] += 1
            return 0.0
    anchor[0], anchor[1], anchor[2] = q[0], q[1], q[2]
    if problem.switch.cheap and inside:
        phi = trilinear(field, i, j, k, scratch.fraction) + field.gap
        if phi + reach <= 0.0:
            scratch.counter[CHEAP] += 1
            anchor[3] = phi
            return 0.0
    scratch.counter[FULL] += 1
    for a in range(3):
        basis(scratch.fraction[a], scratch.weights[a])
    jet = problem.state.jet[which, p]
    spline(field, i, j, k, scratch.weights, jet)
    # a point outside the grid is no anchor: the slope is bounded inside only
    anchor[3] = jet[0] if inside else 1.0
    if jet[0] + reach <= 0.0:
        return 0.0
    to_world(field, jet)
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
    return float(np.sqrt(size))


@kernel
def friction_energy(problem: Problem, which: int, k: int) -> float:
    """Incremental potential of Coulomb's law, N mm: load times coefficient times the way slid in this step."""
    friction, chain = problem.friction, problem.chain
    slide = problem.scratch.fraction[3:]
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
            slope = np.sqrt(jet[1] * jet[1] + jet[2] * jet[2] + jet[3] * jet[3])
            load = problem.stiffness * chain.weight[p] * d * slope
            for a in range(3):
                friction.normal[p, a] = jet[1 + a] / max(slope, 1e-12)
        change = max(change, abs(load - friction.load[p]))
        largest = max(largest, load)
        friction.load[p] = load
    return change / largest if largest > 0.0 else 0.0
