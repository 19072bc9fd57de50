"""Newton's step for the whole chain in O(k): a backward Riccati recursion and a forward rollout.

The chain is a discrete optimal-control problem: state (x_j, R_j), control u_j, dynamics
    R_{j+1} = R_j B_j exp(û_j),    x_{j+1} = x_j + l_j R_{j+1} e3.
The value function is expanded to second order in (δp, δr), both in the frame of the node, R -> R exp(δr̂).
Crossing a segment in its own frame, δp' = δp + A δr with A = l [[0, 1, 0], [-1, 0, 0], [0, 0, 0]], so that
    g = v_r + Aᵀ f,   C = V_pr + V_pp A,   H = V_rr + Aᵀ V_pr + (Aᵀ C)ᵀ + l [½ (f e3ᵀ + e3 fᵀ) - f_3 I]
with f = v_p; the last term is tension and compression: buckling lives there. Crossing a joint,
    Q_u = Jᵀ g + c u,   Q_uu = Jᵀ H J + c I + g·∂J/∂u,   Q_ur = Jᵀ (H + ½ [g]x),   Q_up = Jᵀ Cᵀ.
"""

from __future__ import annotations

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.energy import slide_of
from solver._kernels.flags import inlined, kernel
from solver._kernels.layout import Chain
from solver._kernels.problem import Problem, State
from solver._kernels.rotation import jacobian_terms, sine_terms, turn
from solver._kernels.small import (
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
    gram,
    load3,
    load9,
    store9,
    times,
    times_transposed,
    transpose,
)

CURVATURE_FLOOR = tol.CURVATURE_FLOOR
STEP_ANGLE = tol.STEP_ANGLE
CONTROL_ANGLE = tol.CONTROL_ANGLE

ZERO3 = (0.0, 0.0, 0.0)
ZERO6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
ZERO9 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


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
def jacobian(u0: float, u1: float, u2: float) -> Nine:
    """Right Jacobian of exp at u."""
    q = u0 * u0 + u1 * u1 + u2 * u2
    s, a = sine_terms(q)
    b, _, _ = jacobian_terms(q, s, a)
    return (
        1 - b * (u1 * u1 + u2 * u2),
        a * u2 + b * u0 * u1,
        -a * u1 + b * u0 * u2,
        -a * u2 + b * u0 * u1,
        1 - b * (u0 * u0 + u2 * u2),
        a * u0 + b * u1 * u2,
        a * u1 + b * u0 * u2,
        -a * u0 + b * u1 * u2,
        1 - b * (u0 * u0 + u1 * u1),
    )


@inlined
def jacobian_curvature(g: Three, u: Three) -> Six:
    """The symmetric S with g·(∂_v J) v = vᵀ S v: the part of a joint's Hessian that its own bend makes."""
    q = u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
    s, a = sine_terms(q)
    b, da, db = jacobian_terms(q, s, a)
    w = cross(g, u)
    gu = g[0] * u[0] + g[1] * u[1] + g[2] * u[2]
    # y collects everything that is multiplied with u from the left and symmetrised
    y0 = -da * w[0] - db * q * g[0] - b * g[0] + db * gu * u[0]
    y1 = -da * w[1] - db * q * g[1] - b * g[1] + db * gu * u[1]
    y2 = -da * w[2] - db * q * g[2] - b * g[2] + db * gu * u[2]
    return (
        u[0] * y0 + b * gu,
        u[1] * y1 + b * gu,
        u[2] * y2 + b * gu,
        0.5 * (u[0] * y1 + u[1] * y0),
        0.5 * (u[0] * y2 + u[2] * y0),
        0.5 * (u[1] * y2 + u[2] * y1),
    )


@inlined
def cross_segment(length: float, p: Six, c: Nine, h: Six, f: Three, g: Three) -> tuple[Nine, Six, Three]:
    """Carry V from the far end of a segment to its near end, at the same frame."""
    # C = V_pr + V_pp A: A moves columns, (M A)[:, 0] = -l M[:, 1], (M A)[:, 1] = l M[:, 0]
    n = (
        c[0] - length * p[3],
        c[1] + length * p[0],
        c[2],
        c[3] - length * p[1],
        c[4] + length * p[3],
        c[5],
        c[6] - length * p[5],
        c[7] + length * p[4],
        c[8],
    )
    # Aᵀ M moves rows: row 0 = -l M[1, :], row 1 = l M[0, :], row 2 = 0
    rr = (
        h[0] - length * (c[3] + n[3]) - length * f[2],
        h[1] + length * (c[1] + n[1]) - length * f[2],
        h[2],
        h[3] - length * n[4] + length * c[0],
        h[4] - length * c[5] + 0.5 * length * f[0],
        h[5] + length * c[2] + 0.5 * length * f[1],
    )
    return n, rr, (g[0] - length * f[1], g[1] + length * f[0], g[2])


@inlined
def least_curvature(q: Six, twisting: bool) -> float:
    """Least eigenvalue of the bending block of Q_uu; -inf where the twist entry makes the whole indefinite."""
    half = 0.5 * (q[0] - q[1])
    least = 0.5 * (q[0] + q[1]) - math.sqrt(half * half + q[3] * q[3])
    if twisting and least > 0.0:
        det = q[0] * q[1] - q[3] * q[3]
        if not q[2] * det > q[4] * q[4] * q[1] - 2 * q[3] * q[4] * q[5] + q[5] * q[5] * q[0]:
            return -math.inf
    return least


@inlined
def solve_block(q: Six, twisting: bool) -> Nine:
    """Minus the inverse of Q_uu; without a twist variable its last row and column are zero."""
    if not twisting:
        det = q[0] * q[1] - q[3] * q[3]
        return -q[1] / det, q[3] / det, 0.0, q[3] / det, -q[0] / det, 0.0, 0.0, 0.0, 0.0
    c00 = q[1] * q[2] - q[5] * q[5]
    c01 = q[4] * q[5] - q[3] * q[2]
    c02 = q[3] * q[5] - q[4] * q[1]
    c11 = q[0] * q[2] - q[4] * q[4]
    c12 = q[3] * q[4] - q[0] * q[5]
    c22 = q[0] * q[1] - q[3] * q[3]
    det = -(q[0] * c00 + q[3] * c01 + q[4] * c02)
    return (
        c00 / det,
        c01 / det,
        c02 / det,
        c01 / det,
        c11 / det,
        c12 / det,
        c02 / det,
        c12 / det,
        c22 / det,
    )


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


@inlined
def joint_hessian(
    chain: Chain, j: int, u: Three, jac: Nine, h: Six, g: Three, twisting: bool, damping: float
) -> Six:
    """Q_uu of a joint; damping adds that share of the joint's own stiffness."""
    q = add6(conjugate(transpose(jac), h), jacobian_curvature(g, u))
    bend = chain.bend[j] * (1.0 + damping)
    twist = chain.twist[j] * (1.0 + damping) if twisting else 0.0
    return q[0] + bend, q[1] + bend, q[2] + twist, q[3], q[4], q[5]


@kernel
def sweep(problem: Problem, which: int, k: int, damping: float, report: Any) -> bool:
    """One backward Riccati recursion from the tip to the base; gains go to scratch.gain, see ``rollout``.

    damping holds every node back with that share of its joint's stiffness (Levenberg's term, on positions: it
    leaves the coupling between joints alone, as a viscous bath would) and leaves the wall's negative curvature out.
    Returns False and stops at the first block that is not positive (semi-)definite.
    report: [0] Newton decrement (predicted fall of the energy), [2] joint of that block or -1, [3:5] and
    [19] its direction of negative curvature (bending, twist), [5] that curvature.
    """
    chain, state, gain = problem.chain, problem.state, problem.scratch.gain
    bend, length, rest, twisting = chain.bend, chain.length, chain.rest, problem.twisting
    p, c, h, f, g = ZERO6, ZERO9, ZERO6, ZERO3, ZERO3
    decrement = 0.0
    report[2] = -1.0
    for n in range(k, 0, -1):
        j = n - 1
        frame = load9(state.r[which, n])
        df, dg = node_gradient(problem, which, n, frame)
        dp, dc, dh = node_hessian(problem, which, n, frame, damping > 0.0)
        p, c, h, f, g = add6(p, dp), add9(c, dc), add6(h, dh), add3(f, df), add3(g, dg)
        held = damping * bend[j] / (length[j] * length[j])
        p = (p[0] + held, p[1] + held, p[2] + held, p[3], p[4], p[5])
        c, h, g = cross_segment(length[j], p, c, h, f, g)
        u = load3(state.u[which, j])
        jac = jacobian(u[0], u[1], u[2])
        if not twisting:
            jac = (jac[0], jac[1], 0.0, jac[3], jac[4], 0.0, jac[6], jac[7], 0.0)
        q_uu = joint_hessian(chain, j, u, jac, h, g, twisting, 0.01 * damping)
        floor, least = CURVATURE_FLOOR * bend[j], least_curvature(q_uu, twisting)
        # written so that NaN, from an overflow in a long compressed chain, fails too
        if not least > -floor:
            note_direction(q_uu, j, least, report)
            return False
        if least < floor:
            # neutral, e.g. turning a buckled wire about its axis: no force there, so any stiffness will do
            q_uu = (q_uu[0] + 2 * floor, q_uu[1] + 2 * floor, q_uu[2], q_uu[3], q_uu[4], q_uu[5])
        inverse = solve_block(q_uu, twisting)
        twist = chain.twist[j] * u[2] if twisting else 0.0
        q_u = add3(apply_transposed(jac, g), (bend[j] * u[0], bend[j] * u[1], twist))
        jac_t = transpose(jac)
        q_up = times_transposed(jac_t, c)
        q_ur = times(jac_t, add9(full(h), cross_matrix((0.5 * g[0], 0.5 * g[1], 0.5 * g[2]))))
        feed, gain_p, gain_r = apply(inverse, q_u), times(inverse, q_up), times(inverse, q_ur)
        store_gain(gain, j, feed, gain_p, gain_r)
        decrement -= 0.5 * (q_u[0] * feed[0] + q_u[1] * feed[1] + q_u[2] * feed[2])
        e = turn(rest[j], u[0], u[1], u[2])
        p, h = conjugate(e, add6(p, gram(q_up, gain_p))), conjugate(e, add6(h, gram(q_ur, gain_r)))
        c = times_transposed(times(e, add9(c, times(transpose(q_up), gain_r))), e)
        f = apply(e, add3(f, apply_transposed(q_up, feed)))
        g = apply(e, add3(g, apply_transposed(q_ur, feed)))
    report[0] = decrement
    return math.isfinite(decrement)


@kernel
def note_direction(q: Six, j: int, least: float, report: Any) -> None:
    """Keep the direction of negative curvature of an indefinite block: the way off a saddle."""
    report[2] = j
    if least == -math.inf:
        # bending alone is stable, together with twist it is not: bending follows the twist as it likes best
        det = q[0] * q[1] - q[3] * q[3]
        v0, v1 = (q[3] * q[5] - q[1] * q[4]) / det, (q[3] * q[4] - q[0] * q[5]) / det
        size = math.sqrt(v0 * v0 + v1 * v1 + 1.0)
        report[3], report[4], report[19] = v0 / size, v1 / size, 1.0 / size
        report[5] = (q[2] + q[4] * v0 + q[5] * v1) / (size * size)
        return
    half = 0.5 * (q[0] - q[1])
    angle = 0.5 * math.atan2(q[3], half) + 0.5 * math.pi
    report[3], report[4], report[19] = math.cos(angle), math.sin(angle), 0.0
    report[5] = 0.5 * (q[0] + q[1]) - math.sqrt(half * half + q[3] * q[3])


@inlined
def store_gain(gain: Any, j: int, feed: Three, gain_p: Nine, gain_r: Nine) -> None:
    """Write joint j's gains: column 0 the step, 1-3 the answer to δp, 4-6 to δr."""
    gain[j, 0, 0], gain[j, 1, 0], gain[j, 2, 0] = feed
    gain[j, 0, 1], gain[j, 0, 2], gain[j, 0, 3] = gain_p[0], gain_p[1], gain_p[2]
    gain[j, 1, 1], gain[j, 1, 2], gain[j, 1, 3] = gain_p[3], gain_p[4], gain_p[5]
    gain[j, 2, 1], gain[j, 2, 2], gain[j, 2, 3] = gain_p[6], gain_p[7], gain_p[8]
    gain[j, 0, 4], gain[j, 0, 5], gain[j, 0, 6] = gain_r[0], gain_r[1], gain_r[2]
    gain[j, 1, 4], gain[j, 1, 5], gain[j, 1, 6] = gain_r[3], gain_r[4], gain_r[5]
    gain[j, 2, 4], gain[j, 2, 5], gain[j, 2, 6] = gain_r[6], gain_r[7], gain_r[8]


@kernel
def place(chain: Chain, state: State, which: int, k: int) -> None:
    """Joints and frames of the controls u, from the base frame and entry point of the same state."""
    u, x, r = state.u[which], state.x[which], state.r[which]
    frame = load9(r[0])
    for j in range(k):
        frame = times(frame, turn(chain.rest[j], u[j, 0], u[j, 1], u[j, 2]))
        store9(r[j + 1], frame)
        length = chain.length[j]
        for a in range(3):
            x[j + 1, a] = x[j, a] + length * r[j + 1, a, 2]


@kernel
def rollout(problem: Problem, which: int, k: int, near: int, fraction: float) -> None:
    """Take a fraction of Newton's step forward with feedback, from joint ``near`` on: the trial state.

    Feedback answers the true displacement of each node, so the trial stays close to the plan even where the
    second-order model of a thousand rotations would not.
    """
    chain, state = problem.chain, problem.state
    old_u, old_x, old_r = state.u[which], state.x[which], state.r[which]
    u, x, r = state.u[1 - which], state.x[1 - which], state.r[1 - which]
    for n in range(near + 1):
        x[n, 0], x[n, 1], x[n, 2] = old_x[n, 0], old_x[n, 1], old_x[n, 2]
        store9(r[n], load9(old_r[n]))
        if n < near:
            u[n, 0], u[n, 1], u[n, 2] = old_u[n, 0], old_u[n, 1], old_u[n, 2]
    frame = load9(old_r[near])
    at = load3(x[near])
    for j in range(near, k):
        moved = (at[0] - old_x[j, 0], at[1] - old_x[j, 1], at[2] - old_x[j, 2])
        turned = relative(load9(old_r[j]), frame)
        ahead = load9(old_r[j + 1])
        s = answer(
            problem.scratch.gain[j], fraction, apply_transposed(ahead, moved), apply_transposed(ahead, turned)
        )
        v = limited(old_u[j, 0], old_u[j, 1], old_u[j, 2], s[0], s[1], s[2])
        u[j, 0], u[j, 1], u[j, 2] = v
        frame = times(frame, turn(chain.rest[j], v[0], v[1], v[2]))
        store9(r[j + 1], frame)
        length = chain.length[j]
        at = (at[0] + length * frame[2], at[1] + length * frame[5], at[2] + length * frame[8])
        x[j + 1, 0], x[j + 1, 1], x[j + 1, 2] = at


@inlined
def answer(gain: Any, fraction: float, dp: Three, dr: Three) -> Three:
    """Change of a joint's control: a fraction of its own step, plus feedback to where its node came to be."""
    s = (fraction * gain[0, 0], fraction * gain[1, 0], fraction * gain[2, 0])
    out = (
        s[0] + gain[0, 1] * dp[0] + gain[0, 2] * dp[1] + gain[0, 3] * dp[2],
        s[1] + gain[1, 1] * dp[0] + gain[1, 2] * dp[1] + gain[1, 3] * dp[2],
        s[2] + gain[2, 1] * dp[0] + gain[2, 2] * dp[1] + gain[2, 3] * dp[2],
    )
    return (
        out[0] + gain[0, 4] * dr[0] + gain[0, 5] * dr[1] + gain[0, 6] * dr[2],
        out[1] + gain[1, 4] * dr[0] + gain[1, 5] * dr[1] + gain[1, 6] * dr[2],
        out[2] + gain[2, 4] * dr[0] + gain[2, 5] * dr[1] + gain[2, 6] * dr[2],
    )


@inlined
def relative(old: Nine, new: Nine) -> Three:
    """Rotation vector (world) from an old frame to a new one, to first order: sin of the angle times the axis."""
    a = cross((old[0], old[3], old[6]), (new[0], new[3], new[6]))
    b = cross((old[1], old[4], old[7]), (new[1], new[4], new[7]))
    c = cross((old[2], old[5], old[8]), (new[2], new[5], new[8]))
    return 0.5 * (a[0] + b[0] + c[0]), 0.5 * (a[1] + b[1] + c[1]), 0.5 * (a[2] + b[2] + c[2])


@inlined
def limited(u0: float, u1: float, u2: float, s0: float, s1: float, s2: float) -> Three:
    """u + s with the step kept below STEP_ANGLE and the result below CONTROL_ANGLE."""
    size = s0 * s0 + s1 * s1 + s2 * s2
    if size > STEP_ANGLE * STEP_ANGLE:
        scale = STEP_ANGLE / math.sqrt(size)
        s0, s1, s2 = s0 * scale, s1 * scale, s2 * scale
    v0, v1, v2 = u0 + s0, u1 + s1, u2 + s2
    size = v0 * v0 + v1 * v1 + v2 * v2
    if size > CONTROL_ANGLE * CONTROL_ANGLE:
        scale = CONTROL_ANGLE / math.sqrt(size)
        v0, v1, v2 = v0 * scale, v1 * scale, v2 * scale
    return v0, v1, v2


@kernel
def costate(problem: Problem, which: int, k: int, report: Any) -> None:
    """Exact gradient of the total energy: the first-order part of ``sweep``, without elimination.

    report: [1] largest component with respect to a joint, N mm, [6:9] with respect to the entry point, N,
    [9:12] to turning the base frame, N mm, [12:15], [15:18] to turning segments 0 and 1, in their own frames.
    """
    chain, state = problem.chain, problem.state
    f, g = ZERO3, ZERO3
    largest = 0.0
    for n in range(k, 0, -1):
        j = n - 1
        df, dg = node_gradient(problem, which, n, load9(state.r[which, n]))
        f, g = add3(f, df), add3(g, dg)
        length = chain.length[j]
        g = (g[0] - length * f[1], g[1] + length * f[0], g[2])
        u = load3(state.u[which, j])
        moment = apply_transposed(jacobian(u[0], u[1], u[2]), g)
        largest = max(largest, abs(moment[0] + chain.bend[j] * u[0]), abs(moment[1] + chain.bend[j] * u[1]))
        if problem.twisting:
            largest = max(largest, abs(moment[2] + chain.twist[j] * u[2]))
        if j < 2:
            at = 12 + 3 * j
            report[at], report[at + 1], report[at + 2] = g
        e = turn(chain.rest[j], u[0], u[1], u[2])
        f, g = apply(e, f), apply(e, g)
    report[1] = largest
    report[6], report[7], report[8] = apply(load9(state.r[which, 0]), f)
    report[9], report[10], report[11] = g
