"""One joint's part of Newton's step: its block Q_uu of the Hessian, that block's inverse, and the joint's gains."""

from __future__ import annotations

import math
from typing import Any

from solver._kernels.algebra import Nine, Six, Three, add6, conjugate, transpose
from solver._kernels.data import Chain
from solver._kernels.flags import inlined, kernel
from solver._kernels.rotation import jacobian_curvature

Gains = tuple[Three, Nine, Nine]
"""Of a joint: its step, and its answers to δp and δr."""


@inlined
def joint_hessian(
    chain: Chain, j: int, u: Three, jac: Nine, hg: tuple[Six, Three], twisting: bool, damping: float
) -> Six:
    """Q_uu of a joint, from V_rr and V_r beyond it; damping adds that share of the joint's own stiffness."""
    h, g = hg
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
def stiffened(q: Six, more: float) -> Six:
    """Q_uu with more stiffness against bending."""
    return q[0] + more, q[1] + more, q[2], q[3], q[4], q[5]


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
    report.joint = j
    if least == -math.inf:
        # bending alone is stable, together with twist it is not: bending follows the twist as it likes best
        det = q[0] * q[1] - q[3] * q[3]
        v0, v1 = (q[3] * q[5] - q[1] * q[4]) / det, (q[3] * q[4] - q[0] * q[5]) / det
        size = math.sqrt(v0 * v0 + v1 * v1 + 1.0)
        report.bend[0], report.bend[1], report.twist = v0 / size, v1 / size, 1.0 / size
        report.curvature = (q[2] + q[4] * v0 + q[5] * v1) / (size * size)
        return
    half = 0.5 * (q[0] - q[1])
    angle = 0.5 * math.atan2(q[3], half) + 0.5 * math.pi
    report.bend[0], report.bend[1], report.twist = math.cos(angle), math.sin(angle), 0.0
    report.curvature = 0.5 * (q[0] + q[1]) - math.sqrt(half * half + q[3] * q[3])


@inlined
def store_gains(gain: Any, j: int, gains: Gains) -> None:
    """Write joint j's gains, (3, 7): column 0 its step, 1-3 the answer to δp, 4-6 to δr."""
    feed, p, r = gains
    gain[j, 0, 0], gain[j, 1, 0], gain[j, 2, 0] = feed
    gain[j, 0, 1], gain[j, 0, 2], gain[j, 0, 3] = p[:3]
    gain[j, 1, 1], gain[j, 1, 2], gain[j, 1, 3] = p[3:6]
    gain[j, 2, 1], gain[j, 2, 2], gain[j, 2, 3] = p[6:]
    gain[j, 0, 4], gain[j, 0, 5], gain[j, 0, 6] = r[:3]
    gain[j, 1, 4], gain[j, 1, 5], gain[j, 1, 6] = r[3:6]
    gain[j, 2, 4], gain[j, 2, 5], gain[j, 2, 6] = r[6:]
