"""Newton's step for a wire that is straight at rest and bends alike all around: its state is (x, direction).

The value function then has five variables instead of six: position, and the two components of a turn across the
wire. A roll of the frame that enters a joint is undone by the joint, so V_r3 = 0, V_pr3 = 0 and
V_rr[:, 3] = ½ (g_1, -g_0, 0): the same recursion as ``newton.sweep`` with 0.6 of its work.
"""

from __future__ import annotations

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.algebra import (
    ZERO3,
    ZERO6,
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
from solver._kernels.data import Problem
from solver._kernels.flags import inlined, kernel
from solver._kernels.joint import note_direction
from solver._kernels.node import node_gradient, node_hessian
from solver._kernels.rotation import jacobian_terms, sine_terms

CURVATURE_FLOOR = tol.CURVATURE_FLOOR

Pair = tuple[float, float]


@inlined
def cross_straight(length: float, p: Six, c: Six, h: Three, f: Three, g: Pair) -> tuple[Six, Three, Pair]:
    """``newton.cross_segment`` without the roll: C is (3, 2) row by row, H is (xx, yy, xy)."""
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
    return n, rr, (g[0] - length * f[1], g[1] + length * f[0])


@inlined
def block(bend: float, u: Pair, jac: Six, h: Three, g: Pair, b: float, db: float) -> Three:
    """Q_uu of a joint (xx, yy, xy); jac is (3, 2) row by row, b and db as in ``rotation.jacobian_terms``."""
    gu, q = g[0] * u[0] + g[1] * u[1], u[0] * u[0] + u[1] * u[1]
    y0 = db * gu * u[0] - (db * q + b) * g[0]
    y1 = db * gu * u[1] - (db * q + b) * g[1]
    s0, s1 = 0.5 * (g[1] * jac[0] - g[0] * jac[2]), 0.5 * (g[1] * jac[1] - g[0] * jac[3])
    a0, a1 = h[0] * jac[0] + h[2] * jac[2], h[2] * jac[0] + h[1] * jac[2]
    b0, b1 = h[0] * jac[1] + h[2] * jac[3], h[2] * jac[1] + h[1] * jac[3]
    return (
        jac[0] * a0 + jac[2] * a1 + 2 * jac[4] * s0 + u[0] * y0 + b * gu + bend,
        jac[1] * b0 + jac[3] * b1 + 2 * jac[5] * s1 + u[1] * y1 + b * gu + bend,
        jac[1] * a0 + jac[3] * a1 + jac[4] * s1 + jac[5] * s0 + 0.5 * (u[0] * y1 + u[1] * y0),
    )


@kernel
def sweep_straight(problem: Problem, which: int, near: int, k: int, damping: float, report: Any) -> bool:
    """``newton.sweep`` of a straight wire; same arguments, gains, report and result."""
    chain, state, gain = problem.chain, problem.state, problem.scratch.gain
    bend, length, r, controls = chain.bend, chain.length, state.r[which], state.u[which]
    p, c, h, f, g = ZERO6, ZERO6, ZERO3, ZERO3, (0.0, 0.0)
    decrement = 0.0
    report[2] = -1.0
    for n in range(k, near, -1):
        j = n - 1
        frame = load9(r[n])
        df, dg = node_gradient(problem, which, n, frame)
        dp, dc, dh = node_hessian(problem, which, n, frame, damping > 0.0)
        held = damping * bend[j] / (length[j] * length[j])
        p = add6(add6(p, dp), (held, held, held, 0.0, 0.0, 0.0))
        c = add6(c, (dc[0], dc[1], dc[3], dc[4], dc[6], dc[7]))
        h, f, g = add3(h, (dh[0], dh[1], dh[3])), add3(f, df), (g[0] + dg[0], g[1] + dg[1])
        c, h, g = cross_straight(length[j], p, c, h, f, g)
        u = (controls[j, 0], controls[j, 1])
        q = u[0] * u[0] + u[1] * u[1]
        s, a = sine_terms(q)
        b, _, db = jacobian_terms(q, s, a)
        jac = (
            1 - b * u[1] * u[1],
            b * u[0] * u[1],
            b * u[0] * u[1],
            1 - b * u[0] * u[0],
            a * u[1],
            -a * u[0],
        )
        q_uu = block(bend[j] * (1.0 + 0.01 * damping), u, jac, h, g, b, db)
        half = 0.5 * (q_uu[0] - q_uu[1])
        least = 0.5 * (q_uu[0] + q_uu[1]) - math.sqrt(half * half + q_uu[2] * q_uu[2])
        floor = CURVATURE_FLOOR * bend[j]
        # written so that NaN, from an overflow in a long compressed chain, fails too
        if not least > -floor:
            note_direction((q_uu[0], q_uu[1], 0.0, q_uu[2], 0.0, 0.0), j, least, report)
            return False
        if least < floor:
            # neutral, e.g. turning a buckled wire about its axis: no force there, so any stiffness will do
            q_uu = (q_uu[0] + 2 * floor, q_uu[1] + 2 * floor, q_uu[2])
        det = -(q_uu[0] * q_uu[1] - q_uu[2] * q_uu[2])
        i0, i1, i2 = q_uu[1] / det, q_uu[0] / det, -q_uu[2] / det
        w0 = jac[0] * g[0] + jac[2] * g[1] + bend[j] * u[0]
        w1 = jac[1] * g[0] + jac[3] * g[1] + bend[j] * u[1]
        # rows of Q_up and of Q_ur, the latter with the answer to a roll of the outgoing frame
        p0 = (jac[0] * c[0] + jac[2] * c[1], jac[0] * c[2] + jac[2] * c[3], jac[0] * c[4] + jac[2] * c[5])
        p1 = (jac[1] * c[0] + jac[3] * c[1], jac[1] * c[2] + jac[3] * c[3], jac[1] * c[4] + jac[3] * c[5])
        r0 = (jac[0] * h[0] + jac[2] * h[2], jac[0] * h[2] + jac[2] * h[1], jac[0] * g[1] - jac[2] * g[0])
        r1 = (jac[1] * h[0] + jac[3] * h[2], jac[1] * h[2] + jac[3] * h[1], jac[1] * g[1] - jac[3] * g[0])
        feed0, feed1 = i0 * w0 + i2 * w1, i2 * w0 + i1 * w1
        decrement -= 0.5 * (w0 * feed0 + w1 * feed1)
        kp0, kp1 = mix(i0, p0, i2, p1), mix(i2, p0, i1, p1)
        kr0, kr1 = mix(i0, r0, i2, r1), mix(i2, r0, i1, r1)
        store_rows(gain, j, (feed0, feed1), kp0, kp1, kr0, kr1)
        e0 = (1 - a * u[1] * u[1], a * u[0] * u[1], s * u[1])
        e1 = (a * u[0] * u[1], 1 - a * u[0] * u[0], -s * u[0])
        e = (e0[0], e0[1], e0[2], e1[0], e1[1], e1[2], -s * u[1], s * u[0], 1 - a * q)
        # H, then C, seen from the incoming frame: a turn of it is E-transposed times as seen from the outgoing one
        m = add6((h[0], h[1], 0.0, h[2], 0.5 * g[1], -0.5 * g[0]), outer(r0, kr0, r1, kr1))
        m0 = (m[0] * e0[0] + m[3] * e0[1] + m[4] * e0[2], m[3] * e0[0] + m[1] * e0[1] + m[5] * e0[2],
              m[4] * e0[0] + m[5] * e0[1] + m[2] * e0[2])  # fmt: skip
        m1 = (m[0] * e1[0] + m[3] * e1[1] + m[4] * e1[2], m[3] * e1[0] + m[1] * e1[1] + m[5] * e1[2],
              m[4] * e1[0] + m[5] * e1[1] + m[2] * e1[2])  # fmt: skip
        h = (dot(e0, m0), dot(e1, m1), dot(e1, m0))
        a0, a1, b0, b1 = dot(kr0, e0), dot(kr0, e1), dot(kr1, e0), dot(kr1, e1)
        d0 = apply(e, column(c[0], c[2], c[4], c[1], c[3], c[5], e0, p0, a0, p1, b0))
        d1 = apply(e, column(c[0], c[2], c[4], c[1], c[3], c[5], e1, p0, a1, p1, b1))
        c = (d0[0], d1[0], d0[1], d1[1], d0[2], d1[2])
        p = conjugate(e, add6(p, outer(p0, kp0, p1, kp1)))
        f = apply(e, add3(f, mix(feed0, p0, feed1, p1)))
        turned = add3((g[0], g[1], 0.0), mix(feed0, r0, feed1, r1))
        g = (dot(e0, turned), dot(e1, turned))
    report[0] = decrement
    return math.isfinite(decrement)


@inlined
def column(
    x0: float, y0: float, z0: float, x1: float, y1: float, z1: float, e: Three, p: Three, a: float, q: Three, b: float
) -> Three:  # fmt: skip
    """One column of (C + Q_upᵀ K_r) Eᵀ; x, y, z are C's two columns and e is the row of E."""
    return (
        x0 * e[0] + x1 * e[1] + p[0] * a + q[0] * b,
        y0 * e[0] + y1 * e[1] + p[1] * a + q[1] * b,
        z0 * e[0] + z1 * e[1] + p[2] * a + q[2] * b,
    )


@inlined
def store_rows(gain: Any, j: int, feed: Pair, kp0: Three, kp1: Three, kr0: Three, kr1: Three) -> None:
    """Write joint j's gains as ``joint.store_gain``; a joint without twist has no third row."""
    gain[j, 0, 0], gain[j, 0, 1], gain[j, 0, 2], gain[j, 0, 3] = feed[0], kp0[0], kp0[1], kp0[2]
    gain[j, 0, 4], gain[j, 0, 5], gain[j, 0, 6] = kr0
    gain[j, 1, 0], gain[j, 1, 1], gain[j, 1, 2], gain[j, 1, 3] = feed[1], kp1[0], kp1[1], kp1[2]
    gain[j, 1, 4], gain[j, 1, 5], gain[j, 1, 6] = kr1
    for m in range(7):
        gain[j, 2, m] = 0.0
