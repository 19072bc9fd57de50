"""Forces of a wire at rest: they fall out of the minimum, as derivatives of the total energy."""

from __future__ import annotations

import math
from typing import Any

from solver._kernels.algebra import load9, store9
from solver._kernels.chain import Cut
from solver._kernels.data import Problem
from solver._kernels.energy import slide_of
from solver._kernels.field import Field
from solver._kernels.flags import cached, kernel
from solver._kernels.rotation import turn


@cached
def contact_forces(problem: Problem, k: int, force: Any) -> float:
    """Add the wall's force on the wire to each joint, force (k + 1, 3), N; return the deepest penetration, mm.

    A point inside a segment belongs to its two ends in proportion. Friction acts against the way slid.
    """
    chain, state, friction = problem.chain, problem.state, problem.friction
    deepest = 0.0
    slide = problem.scratch.slide
    now = 0 * k
    for n in range(1, k + 1):
        for p in range(chain.first[n], chain.first[n + 1]):
            share = -chain.offset[p, 2] / chain.length[n - 1]
            d = state.depth[0, p]
            deepest = max(deepest, d)
            if d != 0.0:
                size = -problem.stiffness * chain.weight[p] * d
                for a in range(3):
                    force[n, a] += (1 - share) * size * state.jet[0, p, 1 + a]
                    force[n - 1, a] += share * size * state.jet[0, p, 1 + a]
            if friction.coefficient > 0.0 and friction.load[p] > 0.0:
                size = -friction.coefficient * friction.load[p] / slide_of(problem, now, n, p, slide)
                for a in range(3):
                    force[n, a] += (1 - share) * size * slide[a]
                    force[n - 1, a] += share * size * slide[a]
    return deepest


@kernel
def profile_at(at: Any, value: Any, s: float) -> float:
    """A piecewise linear function of the distance from the tip; at a jump the value further out."""
    n = at.size
    if s < at[0]:
        return float(value[0])
    for i in range(n - 1):
        if s < at[i + 1]:
            return float(value[i] + (value[i + 1] - value[i]) * (s - at[i]) / (at[i + 1] - at[i]))
    return float(value[n - 1])


@cached
def push_force(problem: Problem, cut: Cut, k: int, report: Any) -> float:
    """dU/d(depth) at the minimum, N: the hand's axial force where the introducer guides without friction.

    The depth grows by the first segment alone: all joints move along it, and compliance, rest bend and wall
    share of the first two cells change. The first cell is [depth - l/2, depth], the second ends where it begins.
    """
    chain, profile, u = problem.chain, cut.profile, problem.state.u
    depth = 0.0
    for j in range(k):
        depth += chain.length[j]
    ahead = problem.state.r[0, 1]
    force = report[6] * ahead[0, 2] + report[7] * ahead[1, 2] + report[8] * ahead[2, 2]
    inner = depth - 0.5 * chain.length[0]
    flexible = 1.0 / profile_at(profile.stiffness_at, profile.stiffness, inner)
    rest = profile_at(profile.rest_at, profile.rest, inner)
    for j in range(min(k, 2)):
        compliance, bend = 0.5 * flexible, 0.5 * rest
        if j == 0:
            compliance = 1.0 / profile_at(profile.stiffness_at, profile.stiffness, depth) - compliance
            bend = profile_at(profile.rest_at, profile.rest, depth) - bend
        moment = chain.bend[j] ** 2 * (u[0, j, 0] ** 2 + u[0, j, 1] ** 2)
        force -= 0.5 * moment * compliance
        if problem.twisting:
            force -= 0.25 * (chain.twist[j] * u[0, j, 2]) ** 2 / profile.twist
        e = turn(0.0, u[0, j, 0], u[0, j, 1], u[0, j, 2])
        at = 12 + 3 * j
        force += bend * (report[at] * e[3] + report[at + 1] * e[4] + report[at + 2] * e[5])
    if k > 1:
        # half of node 1's cell lies on the first segment
        for p in range(chain.first[1], chain.first[2]):
            if chain.offset[p, 2] == 0.0:
                force += 0.25 * problem.stiffness * problem.state.depth[0, p] ** 2 / cut.rule.hull.shape[0]
    return float(force)


@kernel
def furthest_outside(field: Field, x: Any, k: int) -> float:
    """How far joints 1 to k are outside the grid's voxels (half a voxel beyond their centres) at most, mm."""
    m, o, shape = field.to_index, field.origin, field.coefficients.shape
    furthest = 0.0
    for n in range(1, k + 1):
        d0, d1, d2 = x[n, 0] - o[0], x[n, 1] - o[1], x[n, 2] - o[2]
        square = 0.0
        for a in range(3):
            f = m[a, 0] * d0 + m[a, 1] * d1 + m[a, 2] * d2
            per_mm = m[a, 0] * m[a, 0] + m[a, 1] * m[a, 1] + m[a, 2] * m[a, 2]
            beyond = max(-0.5 - f, f - (shape[a] - 2.5), 0.0)
            square += beyond * beyond / per_mm
        furthest = max(furthest, square)
    return math.sqrt(furthest)


@kernel
def least_turn_cosine(r: Any, k: int) -> float:
    """Cosine of the sharpest turn between consecutive segments."""
    least = 1.0
    for n in range(1, k + 1):
        cosine = r[n, 0, 2] * r[n - 1, 0, 2] + r[n, 1, 2] * r[n - 1, 1, 2] + r[n, 2, 2] * r[n - 1, 2, 2]
        least = min(least, cosine)
    return least


@kernel
def copy_state(problem: Problem, source: int, target: int, k: int) -> None:
    """Copy one of the states over another."""
    s = problem.state
    u, x, r, depth, jet = s.u[source], s.x[source], s.r[source], s.depth[source], s.jet[source]
    to_u, to_x, to_r, to_depth, to_jet = s.u[target], s.x[target], s.r[target], s.depth[target], s.jet[target]
    for n in range(k + 1):
        to_x[n, 0], to_x[n, 1], to_x[n, 2] = x[n, 0], x[n, 1], x[n, 2]
        store9(to_r[n], load9(r[n]))
        if n < k:
            to_u[n, 0], to_u[n, 1], to_u[n, 2] = u[n, 0], u[n, 1], u[n, 2]
    for a in range(4):
        s.parts[target, a] = s.parts[source, a]
    for p in range(problem.chain.first[k + 1]):
        to_depth[p] = depth[p]
        if depth[p] != 0.0:
            for a in range(10):
                to_jet[p, a] = jet[p, a]
