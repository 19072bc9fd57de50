"""One joint's part of Newton's step: the Jacobian of its rotation, its Hessian block, and that block's inverse."""

from __future__ import annotations

import math
from typing import Any

from solver._kernels.algebra import Nine, Six, Three, add6, conjugate, cross, transpose
from solver._kernels.chain import Chain
from solver._kernels.flags import inlined, kernel
from solver._kernels.rotation import jacobian_terms, sine_terms


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
def joint_hessian(
    chain: Chain, j: int, u: Three, jac: Nine, h: Six, g: Three, twisting: bool, damping: float
) -> Six:
    """Q_uu of a joint; damping adds that share of the joint's own stiffness."""
    q = add6(conjugate(transpose(jac), h), jacobian_curvature(g, u))
    bend = chain.bend[j] * (1.0 + damping)
    twist = chain.twist[j] * (1.0 + damping) if twisting else 0.0
    return q[0] + bend, q[1] + bend, q[2] + twist, q[3], q[4], q[5]


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
