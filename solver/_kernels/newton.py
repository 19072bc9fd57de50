"""Newton's step for the whole chain in O(k): a backward Riccati recursion and a forward rollout.

The chain is a discrete optimal-control problem: state (x_j, R_j), control u_j, dynamics
    R_{j+1} = R_j exp(ω̂_j),  ω_j = u_j + w_j e2 (``joint``),    x_{j+1} = x_j + l_j R_{j+1} e3.
The value function is expanded to second order in (δp, δr), both in the frame of the node, R -> R exp(δr̂): V_pp (p),
V_pr (c), V_rr (h), V_p (f) and V_r (g). Crossing a segment in its own frame, δp' = δp + A δr with
A = l [[0, 1, 0], [-1, 0, 0], [0, 0, 0]], so that
    g = v_r + Aᵀ f,   C = V_pr + V_pp A,   H = V_rr + Aᵀ V_pr + (Aᵀ C)ᵀ + l [½ (f e3ᵀ + e3 fᵀ) - f_3 I]
with f = v_p; the last term is tension and compression: buckling lives there. Crossing a joint,
    Q_u = Jᵀ g + c u,   Q_uu = Jᵀ H J + c I + g·∂J/∂u,   Q_ur = Jᵀ (H + ½ [g]x),   Q_up = Jᵀ Cᵀ.
"""

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
from solver._kernels.blocks import (
    Gains,
    joint_hessian,
    least_curvature,
    node_gradient,
    node_hessian,
    note_direction,
    note_pivot,
    pivot_of,
    pivot_of_shaft,
    solve_block,
    stiffened,
    store_gains,
)
from solver._kernels.data import Problem
from solver._kernels.flags import inlined, kernel
from solver._kernels.joint import jacobian_of, turn_of
from solver._kernels.newton_straight import sweep_straight

Value = tuple[Six, Nine, Six, Three, Three]
"""The value function at a node: p, c, h, f, g."""


@inlined
def add_node(value: Value, gradient: tuple[Three, Three], hessian: tuple[Six, Nine, Six], held: float) -> Value:
    """Add what acts on a node and its segment, see ``blocks``, and Levenberg's term ``held`` on its position."""
    p, c, h, f, g = value
    p = add6(p, hessian[0])
    p = (p[0] + held, p[1] + held, p[2] + held, p[3], p[4], p[5])
    return p, add9(c, hessian[1]), add6(h, hessian[2]), add3(f, gradient[0]), add3(g, gradient[1])


@inlined
def cross_segment(length: float, value: Value) -> Value:
    """Carry the value function from the far end of a segment to its near end, at the same frame."""
    p, c, h, f, g = value
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
    return p, n, rr, f, (g[0] - length * f[1], g[1] + length * f[0], g[2])


@inlined
def cross_joint(e: Nine, value: Value, q_up: Nine, q_ur: Nine, gains: Gains) -> Value:
    """Carry the value function over a joint, which takes its best step."""
    p, c, h, f, g = value
    feed, gain_p, gain_r = gains
    p, h = conjugate(e, add6(p, gram(q_up, gain_p))), conjugate(e, add6(h, gram(q_ur, gain_r)))
    c = times_transposed(times(e, add9(c, times(transpose(q_up), gain_r))), e)
    f = apply(e, add3(f, apply_transposed(q_up, feed)))
    return p, c, h, f, apply(e, add3(g, apply_transposed(q_ur, feed)))


@kernel
def sweep(problem: Problem, slot: int, first_free: int, k: int, damping: float, report: Any) -> bool:
    """One backward Riccati recursion from the tip to joint ``first_free``: fills the gains and report.decrement.

    damping : Levenberg's term, a share of each joint's stiffness that holds its node in place; the coupling between
    joints stays, as in a viscous bath, and the wall's negative curvature is left out. Below 0 it pushes nodes away.
    Returns False and stops at the first block that is not positive (semi-)definite, which the report then describes.
    """
    if problem.straight:
        problem.scratch.counters[0].sweeps_without_roll += 1
        return sweep_straight(problem, slot, first_free, k, damping, report)
    chain, state, gain = problem.chain, problem.state, problem.scratch.gain
    bend, length, twisting = chain.bend, chain.length, problem.twisting
    value = (ZERO6, ZERO9, ZERO6, ZERO3, ZERO3)
    decrement, lowest = 0.0, math.inf
    for n in range(k, first_free, -1):
        j = n - 1
        frame = load9(state.r[slot], n)
        df, dg = node_gradient(problem, slot, n, frame)
        dp, dc, dh = node_hessian(problem, slot, n, frame, damping > 0.0)
        held = damping * bend[j] / (length[j] * length[j]) if damping != 0.0 else 0.0
        value = cross_segment(length[j], add_node(value, (df, dg), (dp, dc, dh), held))
        _, c, h, _, g = value
        u = load3(state.u[slot], j)
        jac = jacobian_of(chain, j, u)
        if not twisting:
            jac = (jac[0], jac[1], 0.0, jac[3], jac[4], 0.0, jac[6], jac[7], 0.0)
        q_uu = joint_hessian(chain, j, u, jac, (h, g), twisting, 0.01 * damping)
        floor, least = tol.CURVATURE_FLOOR * bend[j], least_curvature(q_uu, twisting)
        lowest = min(lowest, pivot_of(q_uu, least, bend[j], chain.twist[j] if twisting else 0.0))
        if not least > -floor:
            note_direction(q_uu, j, least, report)
            return False
        if least < floor:
            q_uu = stiffened(q_uu, 2 * floor)
        inverse = solve_block(q_uu, twisting)
        twist = chain.twist[j] * u[2] if twisting else 0.0
        q_u = add3(apply_transposed(jac, g), (bend[j] * u[0], bend[j] * u[1], twist))
        jac_t = transpose(jac)
        q_up = times_transposed(jac_t, c)
        q_ur = times(jac_t, add9(full(h), cross_matrix((0.5 * g[0], 0.5 * g[1], 0.5 * g[2]))))
        feed, gain_p, gain_r = apply(inverse, q_u), times(inverse, q_up), times(inverse, q_ur)
        store_gains(gain, j, (feed, gain_p, gain_r))
        decrement -= 0.5 * (q_u[0] * feed[0] + q_u[1] * feed[1] + q_u[2] * feed[2])
        value = cross_joint(turn_of(chain, j, u), value, q_up, q_ur, (feed, gain_p, gain_r))
    report.decrement = decrement
    if twisting and first_free == 0:
        lowest = min(lowest, pivot_of_shaft(chain, k, value[2][2]))
    note_pivot(lowest, first_free, damping, report)
    return math.isfinite(decrement)


@kernel
def costate(problem: Problem, slot: int, k: int, report: Any) -> None:
    """Exact gradient of the total energy: the first-order part of ``sweep``, without elimination.

    Fills moment, force and torque of the report.
    """
    chain, controls, frames = problem.chain, problem.state.u[slot], problem.state.r[slot]
    f, g = ZERO3, ZERO3
    largest = 0.0
    for n in range(k, 0, -1):
        j = n - 1
        df, dg = node_gradient(problem, slot, n, load9(frames, n))
        f, g = add3(f, df), add3(g, dg)
        length = chain.length[j]
        g = (g[0] - length * f[1], g[1] + length * f[0], g[2])
        u = load3(controls, j)
        moment = apply_transposed(jacobian_of(chain, j, u), g)
        largest = max(largest, abs(moment[0] + chain.bend[j] * u[0]), abs(moment[1] + chain.bend[j] * u[1]))
        if problem.twisting:
            largest = max(largest, abs(moment[2] + chain.twist[j] * u[2]))
        e = turn_of(chain, j, u)
        f, g = apply(e, f), apply(e, g)
    report.moment = largest
    report.force[0], report.force[1], report.force[2] = apply(load9(frames, 0), f)
    report.torque[0], report.torque[1], report.torque[2] = g
