"""Newton's step for a wire that is straight at rest and bends alike all around: its state is (x, direction).

The value function then has five variables instead of six: position, and the two components of a turn across the
wire. A roll of the frame that enters a joint is undone by the joint, so V_r3 = 0, V_pr3 = 0 and
V_rr[:, 3] = ½ (g_1, -g_0, 0): the same recursion as ``newton.sweep`` with 0.6 of its work. V_pr (c) is (3, 2) row by
row, V_rr (h) is (xx, yy, xy), V_r (g) has two components.
"""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.algebra import (
    ZERO3,
    ZERO6,
    Nine,
    Pair,
    Six,
    Three,
    add3,
    add6,
    apply,
    conjugate,
    dot,
    load9,
    mix,
    outer,
)
from solver._kernels.blocks import (
    Gains,
    least_curvature,
    node_gradient,
    node_hessian,
    note_direction,
    note_pivot,
    stiffened,
    store_gains,
)
from solver._kernels.data import Problem
from solver._kernels.flags import inlined, kernel
from solver._kernels.rotation import jacobian_terms, sine_terms

Value = tuple[Six, Six, Three, Three, Pair]
"""The value function at a node: p, c, h, f, g."""
Turn = tuple[Six, Nine]
"""Of a joint: the Jacobian J of its rotation, (3, 2) row by row, and the rotation itself."""


@inlined
def add_node(value: Value, gradient: tuple[Three, Three], hessian: tuple[Six, Nine, Six], held: float) -> Value:
    """``newton.add_node`` without the roll."""
    p, c, h, f, g = value
    (df, dg), (dp, dc, dh) = gradient, hessian
    p = add6(add6(p, dp), (held, held, held, 0.0, 0.0, 0.0))
    c = add6(c, (dc[0], dc[1], dc[3], dc[4], dc[6], dc[7]))
    return p, c, add3(h, (dh[0], dh[1], dh[3])), add3(f, df), (g[0] + dg[0], g[1] + dg[1])


@inlined
def cross_segment(length: float, value: Value) -> Value:
    """``newton.cross_segment`` without the roll."""
    p, c, h, f, g = value
    n = (
        c[0] - length * p[3],
        c[1] + length * p[0],
        c[2] - length * p[1],
        c[3] + length * p[3],
        c[4] - length * p[5],
        c[5] + length * p[4],
    )
    rr = (
        h[0] - length * (c[2] + n[2]) - length * f[2],
        h[1] + length * (c[1] + n[1]) - length * f[2],
        h[2] - length * n[3] + length * c[0],
    )
    return p, n, rr, f, (g[0] - length * f[1], g[1] + length * f[0])


@inlined
def joint_block(bend: float, u: Pair, value: Value) -> tuple[Turn, Six]:
    """Turn of a joint, and its block Q_uu of the Hessian, without an entry for twist; bend : stiffness, N mm/rad."""
    _, _, h, _, g = value
    q = u[0] * u[0] + u[1] * u[1]
    s, a = sine_terms(q)
    b, _, db = jacobian_terms(q, s, a)
    jac = (1 - b * u[1] * u[1], b * u[0] * u[1], b * u[0] * u[1], 1 - b * u[0] * u[0], a * u[1], -a * u[0])
    e0 = (1 - a * u[1] * u[1], a * u[0] * u[1], s * u[1])
    e1 = (a * u[0] * u[1], 1 - a * u[0] * u[0], -s * u[0])
    e = e0 + e1 + (-s * u[1], s * u[0], 1 - a * q)
    gu = g[0] * u[0] + g[1] * u[1]
    y0 = db * gu * u[0] - (db * q + b) * g[0]
    y1 = db * gu * u[1] - (db * q + b) * g[1]
    s0, s1 = 0.5 * (g[1] * jac[0] - g[0] * jac[2]), 0.5 * (g[1] * jac[1] - g[0] * jac[3])
    a0, a1 = h[0] * jac[0] + h[2] * jac[2], h[2] * jac[0] + h[1] * jac[2]
    b0, b1 = h[0] * jac[1] + h[2] * jac[3], h[2] * jac[1] + h[1] * jac[3]
    xx = jac[0] * a0 + jac[2] * a1 + 2 * jac[4] * s0 + u[0] * y0 + b * gu + bend
    yy = jac[1] * b0 + jac[3] * b1 + 2 * jac[5] * s1 + u[1] * y1 + b * gu + bend
    xy = jac[1] * a0 + jac[3] * a1 + jac[4] * s1 + jac[5] * s0 + 0.5 * (u[0] * y1 + u[1] * y0)
    return (jac, e), (xx, yy, 0.0, xy, 0.0, 0.0)


@inlined
def cross_joint(turn: Turn, moment: Pair, q_uu: Six, value: Value) -> tuple[Value, Gains, float]:
    """``newton.cross_joint`` without the roll."""
    p, c, h, f, g = value
    jac, e = turn
    e0, e1 = e[:3], e[3:6]
    per_det = -1.0 / (q_uu[0] * q_uu[1] - q_uu[3] * q_uu[3])
    i0, i1, i2 = q_uu[1] * per_det, q_uu[0] * per_det, -q_uu[3] * per_det
    w0 = jac[0] * g[0] + jac[2] * g[1] + moment[0]
    w1 = jac[1] * g[0] + jac[3] * g[1] + moment[1]
    # rows of Q_up and of Q_ur, the latter with the answer to a roll of the outgoing frame
    p0 = (jac[0] * c[0] + jac[2] * c[1], jac[0] * c[2] + jac[2] * c[3], jac[0] * c[4] + jac[2] * c[5])
    p1 = (jac[1] * c[0] + jac[3] * c[1], jac[1] * c[2] + jac[3] * c[3], jac[1] * c[4] + jac[3] * c[5])
    r0 = (jac[0] * h[0] + jac[2] * h[2], jac[0] * h[2] + jac[2] * h[1], jac[0] * g[1] - jac[2] * g[0])
    r1 = (jac[1] * h[0] + jac[3] * h[2], jac[1] * h[2] + jac[3] * h[1], jac[1] * g[1] - jac[3] * g[0])
    feed0, feed1 = i0 * w0 + i2 * w1, i2 * w0 + i1 * w1
    kp0, kp1 = mix(i0, p0, i2, p1), mix(i2, p0, i1, p1)
    kr0, kr1 = mix(i0, r0, i2, r1), mix(i2, r0, i1, r1)
    gains = ((feed0, feed1, 0.0), kp0 + kp1 + ZERO3, kr0 + kr1 + ZERO3)
    fall = 0.5 * (w0 * feed0 + w1 * feed1)
    # H, then C, seen from the incoming frame: a turn of it is E-transposed times as seen from the outgoing one
    m = add6((h[0], h[1], 0.0, h[2], 0.5 * g[1], -0.5 * g[0]), outer(r0, kr0, r1, kr1))
    m0 = (m[0] * e0[0] + m[3] * e0[1] + m[4] * e0[2], m[3] * e0[0] + m[1] * e0[1] + m[5] * e0[2],
          m[4] * e0[0] + m[5] * e0[1] + m[2] * e0[2])  # fmt: skip
    m1 = (m[0] * e1[0] + m[3] * e1[1] + m[4] * e1[2], m[3] * e1[0] + m[1] * e1[1] + m[5] * e1[2],
          m[4] * e1[0] + m[5] * e1[1] + m[2] * e1[2])  # fmt: skip
    d0 = apply(e, column(c, e0, p0, dot(kr0, e0), p1, dot(kr1, e0)))
    d1 = apply(e, column(c, e1, p0, dot(kr0, e1), p1, dot(kr1, e1)))
    p = conjugate(e, add6(p, outer(p0, kp0, p1, kp1)))
    f = apply(e, add3(f, mix(feed0, p0, feed1, p1)))
    turned = add3((g[0], g[1], 0.0), mix(feed0, r0, feed1, r1))
    h, g = (dot(e0, m0), dot(e1, m1), dot(e1, m0)), (dot(e0, turned), dot(e1, turned))
    c = (d0[0], d1[0], d0[1], d1[1], d0[2], d1[2])
    return (p, c, h, f, g), gains, fall


@inlined
def column(c: Six, e: Three, p: Three, a: float, q: Three, b: float) -> Three:
    """One column of (C + Q_upᵀ K_r) Eᵀ, where e is the row of E; p and q are the rows of Q_up."""
    return (
        c[0] * e[0] + c[1] * e[1] + p[0] * a + q[0] * b,
        c[2] * e[0] + c[3] * e[1] + p[1] * a + q[1] * b,
        c[4] * e[0] + c[5] * e[1] + p[2] * a + q[2] * b,
    )


@kernel
def sweep_straight(problem: Problem, slot: int, first_free: int, k: int, damping: float, report: Any) -> bool:
    """``newton.sweep`` of a straight wire; same arguments, gains, report and result."""
    chain, gain = problem.chain, problem.scratch.gain
    bend, length, controls, frames = chain.bend, chain.length, problem.state.u[slot], problem.state.r[slot]
    value, decrement, lowest = (ZERO6, ZERO6, ZERO3, ZERO3, (0.0, 0.0)), 0.0, math.inf
    for n in range(k, first_free, -1):
        j = n - 1
        frame, u = load9(frames, n), (controls[j, 0], controls[j, 1])
        gradient = node_gradient(problem, slot, n, frame)
        hessian = node_hessian(problem, slot, n, frame, damping > 0.0)
        held = damping * bend[j] / (length[j] * length[j]) if damping != 0.0 else 0.0
        value = cross_segment(length[j], add_node(value, gradient, hessian, held))
        turn, q_uu = joint_block(bend[j] * (1.0 + 0.01 * damping), u, value)
        floor, least = tol.CURVATURE_FLOOR * bend[j], least_curvature(q_uu, False)
        lowest = min(lowest, least / bend[j])
        # written so that NaN, from an overflow in a long compressed chain, fails too
        if not least > -floor:
            note_direction(q_uu, j, least, report)
            return False
        if least < floor:
            # neutral, e.g. turning a buckled wire about its axis: no force there, so any stiffness will do
            q_uu = stiffened(q_uu, 2 * floor)
        value, gains, fall = cross_joint(turn, (bend[j] * u[0], bend[j] * u[1]), q_uu, value)
        store_gains(gain, j, gains)
        decrement -= fall
    report.decrement = decrement
    note_pivot(lowest, first_free, damping, report)
    return math.isfinite(decrement)
