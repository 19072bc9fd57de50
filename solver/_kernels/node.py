"""What acts on a node and on its segment: gradient and Hessian of wall, friction and loads, in the node's frame."""

from __future__ import annotations

import math
from typing import Any

from solver._kernels import wall_law
from solver._kernels.algebra import (
    ZERO3,
    ZERO6,
    ZERO9,
    Nine,
    Six,
    Three,
    add3,
    add6,
    add9,
    apply,
    apply_transposed,
    conjugate,
    cross,
    cross_matrix,
    dyad,
    full,
    load3,
    outer,
    scaled,
    times,
    transpose,
)
from solver._kernels.data import Problem
from solver._kernels.flags import inlined
from solver._kernels.friction import friction_derivatives


@inlined
def normal_at(frame: Nine, jet: Any) -> Three:
    """Gradient of the distance at a point, in the frame of its node."""
    return apply_transposed(frame, (jet[1], jet[2], jet[3]))


@inlined
def wall_hessian(frame: Nine, jet: Any, n: Three, law: tuple[float, float], project: bool) -> Six:
    """Hessian of the wall's energy at a point in contact, U'' ∇φ ∇φᵀ + U' ∇²φ; law holds U' and U''.

    ``project`` leaves out the directions in which ∇²φ is negative: a wire pressed on a convex wall.
    """
    f = law[0]
    bend = (f * jet[4], f * jet[5], f * jet[6], f * jet[7], f * jet[8], f * jet[9])
    bend = conjugate(transpose(frame), bend)
    return add6(dyad(law[1], n), without_negative(bend, n) if project else bend)


@inlined
def without_negative(m: Six, n: Three) -> Six:
    """The positive part of a symmetric matrix in the plane across n; nothing along n."""
    size = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    if size < 1e-6:
        return ZERO6
    n = (n[0] / size, n[1] / size, n[2] / size)
    # an orthonormal pair across n (Duff et al. 2017), without a branch at the poles
    sign = math.copysign(1.0, n[2])
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    s = (1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0])
    t = (b, sign + n[1] * n[1] * a, -n[1])
    ms, mt = apply(full(m), s), apply(full(m), t)
    ss = s[0] * ms[0] + s[1] * ms[1] + s[2] * ms[2]
    tt = t[0] * mt[0] + t[1] * mt[1] + t[2] * mt[2]
    st = s[0] * mt[0] + s[1] * mt[1] + s[2] * mt[2]
    # principal directions of the 2x2 block
    angle = 0.5 * math.atan2(2 * st, ss - tt)
    c, d = math.cos(angle), math.sin(angle)
    mean, radius = 0.5 * (ss + tt), math.sqrt(0.25 * (ss - tt) * (ss - tt) + st * st)
    one, two = max(mean + radius, 0.0), max(mean - radius, 0.0)
    v = (c * s[0] + d * t[0], c * s[1] + d * t[1], c * s[2] + d * t[2])
    w = (c * t[0] - d * s[0], c * t[1] - d * s[1], c * t[2] - d * s[2])
    return outer(scaled(one, v), v, scaled(two, w), w)


@inlined
def lever(o: Three, f: Three, stiffness: Six) -> tuple[Nine, Six]:
    """What a force at offset o from the node adds to V_pr and V_rr: its place moves by δr x o, and curves."""
    d = cross_matrix((-o[0], -o[1], -o[2]))
    c = times(full(stiffness), d)
    h = times(transpose(d), c)
    along = f[0] * o[0] + f[1] * o[1] + f[2] * o[2]
    rr = (
        h[0] + f[0] * o[0] - along,
        h[4] + f[1] * o[1] - along,
        h[8] + f[2] * o[2] - along,
        h[1] + 0.5 * (f[0] * o[1] + f[1] * o[0]),
        h[2] + 0.5 * (f[0] * o[2] + f[2] * o[0]),
        h[5] + 0.5 * (f[1] * o[2] + f[2] * o[1]),
    )
    return c, rr


@inlined
def node_gradient(problem: Problem, slot: int, n: int, frame: Nine) -> tuple[Three, Three]:
    """Gradient of everything that acts on a node and its segment: (δp, δr), in the frame of the node."""
    chain, state = problem.chain, problem.state
    load = apply_transposed(frame, load3(chain.load, n))
    f, g = (-load[0], -load[1], -load[2]), ZERO3
    for p in range(chain.first[n], chain.first[n + 1]):
        d = state.penetration[slot, p]
        if d != 0.0:
            size = wall_law.force(problem.stiffness, chain.weight[p], d)
            force = scaled(size, normal_at(frame, state.jet[slot, p]))
            f, g = add3(f, force), add3(g, cross(load3(chain.offset, p), force))
        if problem.friction.coefficient > 0.0 and problem.friction.load[p] > 0.0:
            force, _ = friction_derivatives(problem, slot, n, p, frame)
            f, g = add3(f, force), add3(g, cross(load3(chain.offset, p), force))
    return f, g


@inlined
def node_hessian(problem: Problem, slot: int, n: int, frame: Nine, project: bool) -> tuple[Six, Nine, Six]:
    """Hessian of the same: V_pp, V_pr and V_rr."""
    chain, state, stiffness = problem.chain, problem.state, problem.stiffness
    p, c, h = ZERO6, ZERO9, ZERO6
    for i in range(chain.first[n], chain.first[n + 1]):
        d = state.penetration[slot, i]
        rubbing = problem.friction.coefficient > 0.0 and problem.friction.load[i] > 0.0
        if d == 0.0 and not rubbing:
            continue
        force, hessian = ZERO3, ZERO6
        if d != 0.0:
            jet, weight = state.jet[slot, i], chain.weight[i]
            law = wall_law.force(stiffness, weight, d), wall_law.curvature(stiffness, weight, d)
            normal = normal_at(frame, jet)
            force, hessian = scaled(law[0], normal), wall_hessian(frame, jet, normal, law, project)
        if rubbing:
            more, stiffer = friction_derivatives(problem, slot, n, i, frame)
            force, hessian = add3(force, more), add6(hessian, stiffer)
        p = add6(p, hessian)
        offset = load3(chain.offset, i)
        if offset != ZERO3:
            dc, dh = lever(offset, force, hessian)
            c, h = add9(c, dc), add6(h, dh)
    return p, c, h
