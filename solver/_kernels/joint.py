"""The rotation of a joint: its control and its rest bend, as one rotation vector, after the twist of the shaft.

One after the other, B exp(û), hands half of every rest bend on as twist to a wire that may not twist: 9 % too soft
across the plane of a tip of 0.15 per mm in segments of 1 mm. But the shaft outside the body, whose twist is part of the
first joint's (``chain.lay_out``), lies before all bends: in one rotation vector with them, its lag of 62 degrees left a
tip of 10 mm 0.18 mm off where it leaves it 0.02.
"""

import math

from solver._kernels.algebra import Nine, Six, Three, cross, dot, scaled, times
from solver._kernels.data import Chain
from solver._kernels.flags import inlined
from solver._kernels.rotation import bent, jacobian, jacobian_curvature, with_rest


@inlined
def spin(angle: float) -> Nine:
    """Rotation by an angle about e3, row by row."""
    c, s = math.cos(angle), math.sin(angle)
    return c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0


@inlined
def vector_of(chain: Chain, j: int, u: Three) -> Three:
    """Rotation vector of joint j, without the twist of the shaft."""
    return with_rest(chain.rest[j], (u[0], u[1], u[2] * (1.0 - chain.early[0])) if j == 0 else u)


@inlined
def turn_of(chain: Chain, j: int, u: Three) -> Nine:
    """Rotation of joint j, row by row, from the frame before it to the one after it."""
    e = bent(vector_of(chain, j, u))
    if j == 0 and chain.early[0] > 0.0:
        return times(spin(chain.early[0] * u[2]), e)
    return e


@inlined
def jacobian_of(chain: Chain, j: int, u: Three) -> Nine:
    """Right Jacobian of ``turn_of`` by the control: a twist before the bend E turns all beyond it about Eᵀ e3."""
    turn = vector_of(chain, j, u)
    jac = jacobian(turn)
    if j > 0 or chain.early[0] == 0.0:
        return jac
    early, late, e = chain.early[0], 1.0 - chain.early[0], bent(turn)
    last = (early * e[6] + late * jac[2], early * e[7] + late * jac[5], early * e[8] + late * jac[8])
    return jac[0], jac[1], last[0], jac[3], jac[4], last[1], jac[6], jac[7], last[2]


@inlined
def curvature_of(chain: Chain, j: int, u: Three, g: Three) -> Six:
    """The symmetric S of ``rotation.jacobian_curvature`` for ``turn_of``; g : gradient by turning all beyond joint j.

    Early twist a and the rest J v are turns one after the other: exp(a) exp(J v) = exp(a + J v + ½ a x J v + ...).
    """
    turn = vector_of(chain, j, u)
    s = jacobian_curvature(g, turn)
    if j > 0 or chain.early[0] == 0.0:
        return s
    early, late, jac, e = chain.early[0], 1.0 - chain.early[0], jacobian(turn), bent(turn)
    w = scaled(early, cross(g, (e[6], e[7], e[8])))
    one, two, three = (
        dot(w, (jac[0], jac[3], jac[6])),
        dot(w, (jac[1], jac[4], jac[7])),
        dot(w, (jac[2], jac[5], jac[8])),
    )
    return s[0], s[1], late * (late * s[2] + three), s[3], late * s[4] + 0.5 * one, late * s[5] + 0.5 * two
