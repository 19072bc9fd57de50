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
    cross_matrix,
    full,
    gram,
    load3,
    load9,
    times,
    times_transposed,
    transpose,
)
from solver._kernels.data import STRAIGHT, Problem
from solver._kernels.flags import inlined, kernel
from solver._kernels.joint import (
    jacobian,
    joint_hessian,
    least_curvature,
    note_direction,
    solve_block,
    store_gain,
)
from solver._kernels.newton_straight import sweep_straight
from solver._kernels.node import node_gradient, node_hessian
from solver._kernels.rotation import turn

CURVATURE_FLOOR = tol.CURVATURE_FLOOR


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


@kernel
def sweep(problem: Problem, which: int, near: int, k: int, damping: float, report: Any) -> bool:
    """One backward Riccati recursion from the tip to joint ``near`` (0 is the base); gains go to scratch.gain.

    damping holds every node back with that share of its joint's stiffness (Levenberg's term, on positions: it
    leaves the coupling between joints alone, as a viscous bath would) and leaves the wall's negative curvature out.
    Returns False and stops at the first block that is not positive (semi-)definite.
    report: [0] Newton decrement (predicted fall of the energy), [2] joint of that block or -1, [3:5] and
    [19] its direction of negative curvature (bending, twist), [5] that curvature.
    """
    if problem.straight:
        problem.scratch.counter[STRAIGHT] += 1
        return sweep_straight(problem, which, near, k, damping, report)
    chain, state, gain = problem.chain, problem.state, problem.scratch.gain
    bend, length, rest, twisting = chain.bend, chain.length, chain.rest, problem.twisting
    p, c, h, f, g = ZERO6, ZERO9, ZERO6, ZERO3, ZERO3
    decrement = 0.0
    report[2] = -1.0
    for n in range(k, near, -1):
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
