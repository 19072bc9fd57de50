"""What acts on a node and on its segment: gradient and Hessian of wall, friction and loads, in the node's frame."""

from __future__ import annotations

import math
from typing import Any

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
    full,
    load3,
    times,
    transpose,
)
from solver._kernels.data import Problem
from solver._kernels.energy import slide_of
from solver._kernels.flags import inlined


@inlined
def point_force(frame: Nine, jet: Any, force: float) -> Three:
    """The wall's energy gradient at a point in contact, in the frame of its node; force = k w d."""
    n = apply_transposed(frame, (jet[1], jet[2], jet[3]))
    return force * n[0], force * n[1], force * n[2]


@inlined
def point_stiffness(frame: Nine, jet: Any, force: float, curvature: float, project: bool) -> Six:
    """The wall's energy Hessian at a point in contact, k w (∇φ ∇φᵀ + d ∇²φ), in the frame of its node.

    ``project`` leaves out the directions in which ∇²φ is negative: a wire pressed on a convex wall.
    """
    n = apply_transposed(frame, (jet[1], jet[2], jet[3]))
    own = (
        curvature * n[0] * n[0],
        curvature * n[1] * n[1],
        curvature * n[2] * n[2],
        curvature * n[0] * n[1],
        curvature * n[0] * n[2],
        curvature * n[1] * n[2],
    )
    bend = (force * jet[4], force * jet[5], force * jet[6], force * jet[7], force * jet[8], force * jet[9])
    bend = conjugate(transpose(frame), bend)
    return add6(own, without_negative(bend, n) if project else bend)


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
    return (
        one * v[0] * v[0] + two * w[0] * w[0],
        one * v[1] * v[1] + two * w[1] * w[1],
        one * v[2] * v[2] + two * w[2] * w[2],
        one * v[0] * v[1] + two * w[0] * w[1],
        one * v[0] * v[2] + two * w[0] * w[2],
        one * v[1] * v[2] + two * w[1] * w[2],
    )


@inlined
def lever(offset: Three, force: Three, stiffness: Six) -> tuple[Nine, Six]:
    """What a point off its node adds to V_pr and V_rr: its place moves by δr x offset, and curves."""
    d = cross_matrix((-offset[0], -offset[1], -offset[2]))
    c = times(full(stiffness), d)
    h = times(transpose(d), c)
    f, o = force, offset
    dot = f[0] * o[0] + f[1] * o[1] + f[2] * o[2]
    rr = (
        h[0] + f[0] * o[0] - dot,
        h[4] + f[1] * o[1] - dot,
        h[8] + f[2] * o[2] - dot,
        h[1] + 0.5 * (f[0] * o[1] + f[1] * o[0]),
        h[2] + 0.5 * (f[0] * o[2] + f[2] * o[0]),
        h[5] + 0.5 * (f[1] * o[2] + f[2] * o[1]),
    )
    return c, rr


@inlined
def node_gradient(problem: Problem, which: int, n: int, frame: Nine) -> tuple[Three, Three]:
    """Gradient of everything that acts on a node and its segment: (δp, δr), in the frame of the node."""
    chain, state = problem.chain, problem.state
    load = apply_transposed(frame, load3(chain.load[n]))
    f, g = (-load[0], -load[1], -load[2]), ZERO3
    for i in range(chain.first[n], chain.first[n + 1]):
        d = state.depth[which, i]
        if d != 0.0:
            force = point_force(frame, state.jet[which, i], problem.stiffness * chain.weight[i] * d)
            f, g = add3(f, force), add3(g, cross(load3(chain.offset[i]), force))
        if problem.friction.coefficient > 0.0 and problem.friction.load[i] > 0.0:
            force, _ = rubbing(problem, which, n, i, frame)
            f, g = add3(f, force), add3(g, cross(load3(chain.offset[i]), force))
    return f, g


@inlined
def node_hessian(problem: Problem, which: int, n: int, frame: Nine, project: bool) -> tuple[Six, Nine, Six]:
    """Hessian of the same: V_pp, V_pr and V_rr."""
    chain, state = problem.chain, problem.state
    p, c, h = ZERO6, ZERO9, ZERO6
    for i in range(chain.first[n], chain.first[n + 1]):
        d = state.depth[which, i]
        rubs = problem.friction.coefficient > 0.0 and problem.friction.load[i] > 0.0
        if d == 0.0 and not rubs:
            continue
        force, hessian = ZERO3, ZERO6
        if d != 0.0:
            curvature = problem.stiffness * chain.weight[i]
            jet = state.jet[which, i]
            force = point_force(frame, jet, curvature * d)
            hessian = point_stiffness(frame, jet, curvature * d, curvature, project)
        if rubs:
            more, stiffer = rubbing(problem, which, n, i, frame)
            force, hessian = add3(force, more), add6(hessian, stiffer)
        p = add6(p, hessian)
        offset = load3(chain.offset[i])
        if offset != ZERO3:
            dc, dh = lever(offset, force, hessian)
            c, h = add9(c, dc), add6(h, dh)
    return p, c, h


@inlined
def rubbing(problem: Problem, which: int, n: int, i: int, frame: Nine) -> tuple[Three, Six]:
    """Gradient and Hessian of a point's friction, in the frame of its node."""
    way = problem.scratch.slide
    size = slide_of(problem, which, n, i, way)
    s = apply_transposed(frame, load3(way))
    m = apply_transposed(frame, load3(problem.friction.normal[i]))
    w = problem.friction.coefficient * problem.friction.load[i] / size
    q = w / (size * size)
    hessian = (
        w * (1 - m[0] * m[0]) - q * s[0] * s[0],
        w * (1 - m[1] * m[1]) - q * s[1] * s[1],
        w * (1 - m[2] * m[2]) - q * s[2] * s[2],
        -w * m[0] * m[1] - q * s[0] * s[1],
        -w * m[0] * m[2] - q * s[0] * s[2],
        -w * m[1] * m[2] - q * s[1] * s[2],
    )
    return (w * s[0], w * s[1], w * s[2]), hessian
