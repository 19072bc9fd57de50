"""Rotations of a chain: exp of a rotation vector, its right Jacobian and the curvature of that Jacobian.

With q = |u|², s = sin θ/θ, a = (1 - cos θ)/θ², b = (θ - sin θ)/θ³:
    exp(û) = I + s û + a û²,    J(u) = I - a û + b û²,    exp(û + v̂) = exp(û) exp(Jv + ½ (∂J v) v + ...).
"""

import math

from solver._kernels.algebra import Nine, Six, Three, cross
from solver._kernels.flags import inlined
from solver._kernels.lanes.vectors import anywhere, select

# Below this q a seven-term series is exact to 1e-17 and costs 5 ns; above it sin and cos cost 20 ns.
SERIES_LIMIT = 0.25
# Above this cosine (16 degrees) eleven terms of the series of θ/sin θ in sin²(θ/2) are exact to 1e-18.
COSINE_LIMIT = 0.96


@inlined
def nested(q: float, c: tuple[float, float, float, float, float], rest: float) -> float:
    """Return 1 - c0 q (1 - c1 q (... (1 - c4 q rest))): a series without divisions, which take ten times as long."""
    return 1 - q * c[0] * (1 - q * c[1] * (1 - q * c[2] * (1 - q * c[3] * (1 - q * c[4] * rest))))


@inlined
def sine_terms(q: float) -> tuple[float, float]:
    """Return s = sin θ/θ and a = (1 - cos θ)/θ² of q = θ²."""
    s = nested(q, (1 / 6, 1 / 20, 1 / 42, 1 / 72, 1 / 110), 1 - q * (1 / 156))
    a = 0.5 * nested(q, (1 / 12, 1 / 30, 1 / 56, 1 / 90, 1 / 132), 1 - q * (1 / 182))
    large = q >= SERIES_LIMIT
    if anywhere(large):
        angle = math.sqrt(q)
        half = math.sin(0.5 * angle)
        s, a = select(large, math.sin(angle) / angle, s), select(large, 2 * half * half / q, a)
    return s, a


@inlined
def jacobian_terms(q: float, s: float, a: float) -> Three:
    """Return b = (θ - sin θ)/θ³, a'/θ and b'/θ of q = θ²."""
    b = (1 / 6) * nested(q, (1 / 20, 1 / 42, 1 / 72, 1 / 110, 1 / 156), 1 - q * (1 / 210))
    da = (-1 / 12) * nested(q, (1 / 15, 3 / 112, 2 / 135, 5 / 528, 3 / 455), 1.0)
    db = (-1 / 60) * nested(q, (1 / 21, 1 / 48, 2 / 165, 5 / 624, 1 / 175), 1.0)
    large = q >= SERIES_LIMIT
    if anywhere(large):
        b = select(large, (1 - s) / q, b)
        da, db = select(large, (s - 2 * a) / q, da), select(large, (a - 3 * b) / q, db)
    return b, da, db


@inlined
def jacobian(u: Three) -> Nine:
    """Return the right Jacobian J(u) of exp."""
    u0, u1, u2 = u
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
    """Return the symmetric S with g·(∂_v J) v = vᵀ S v: what a joint's own bend adds to its Hessian."""
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
def with_rest(rest: float, u: Three) -> Three:
    """Return the rotation vector ω = u + w e2 of a joint: its control u and its rest bend w about material axis 2."""
    return u[0], u[1] + rest, u[2]


@inlined
def bent(u: Three) -> Nine:
    """Return exp(û), row by row."""
    u0, u1, u2 = u
    q = u0 * u0 + u1 * u1 + u2 * u2
    s, a = sine_terms(q)
    e0 = (1 - a * (u1 * u1 + u2 * u2), a * u0 * u1 - s * u2, a * u0 * u2 + s * u1)
    e1 = (a * u0 * u1 + s * u2, 1 - a * (u0 * u0 + u2 * u2), a * u1 * u2 - s * u0)
    e2 = (a * u0 * u2 - s * u1, a * u1 * u2 + s * u0, 1 - a * (u0 * u0 + u1 * u1))
    return e0 + e1 + e2


@inlined
def bend_to(p: Three) -> tuple[float, float]:
    """Return the rotation vector without twist, (ω0, ω1), whose exp(ω̂) takes e3 to the unit vector p.

    The angle comes from atan2, exact down to zero, or, where it is small, from the series of θ/sin θ in sin²(θ/2),
    exact to 1e-17 at a quarter of the time; a reversal (p opposite to e3) turns about axis 1.
    """
    p0, t1, p2 = p
    q = p0 * p0 + t1 * t1
    if p2 > COSINE_LIMIT:
        w = 0.5 * q / (1 + p2)
        last = 1 + w * (14 / 15) * (1 + w * (16 / 17) * (1 + w * (18 / 19) * (1 + w * (20 / 21))))
        rest_of_it = 1 + w * (10 / 11) * (1 + w * (12 / 13) * last)
        ratio = 1 + w * (2 / 3) * (1 + w * (4 / 5) * (1 + w * (6 / 7) * (1 + w * (8 / 9) * rest_of_it)))
        return -t1 * ratio, p0 * ratio
    sine = math.sqrt(q)
    angle = math.atan2(sine, p2)
    if sine < 1e-300:
        return (angle, 0.0)
    return -t1 * angle / sine, p0 * angle / sine


@inlined
def bent_to(p: Three) -> Nine:
    """``bent`` of ``bend_to(p)``: the smallest turn that takes e3 to the unit vector p, row by row; p not near -e3."""
    p0, p1, p2 = p
    h = 1 / (1 + p2)
    return 1 - h * p0 * p0, -h * p0 * p1, p0, -h * p0 * p1, 1 - h * p1 * p1, p1, -p0, -p1, p2


@inlined
def with_twist(u0: float, u1: float, twist: float) -> Three:
    """Return the rotation vector of a bend (u0, u1), then a twist about e3: the direction stays, the frame turns."""
    if twist == 0.0:
        return u0, u1, 0.0
    s, _ = sine_terms(0.25 * (u0 * u0 + u1 * u1))
    c = math.cos(0.5 * math.sqrt(u0 * u0 + u1 * u1))
    b0, b1 = 0.5 * s * u0, 0.5 * s * u1
    ct, st = math.cos(0.5 * twist), math.sin(0.5 * twist)
    # product of the two unit quaternions
    w, v0, v1, v2 = c * ct, b0 * ct + b1 * st, b1 * ct - b0 * st, c * st
    size = math.sqrt(v0 * v0 + v1 * v1 + v2 * v2)
    factor = 2 * math.atan2(size, w) / size if size > 0.0 else 2.0
    return factor * v0, factor * v1, factor * v2
