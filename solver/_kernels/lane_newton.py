"""Newton's step and the exact gradient of wires in lanes: ``newton`` in lock-step, for wires that do not twist.

A joint has two controls, so that what is a matrix of three rows there is two rows here, one for each of them.
"""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels import wall_law
from solver._kernels.algebra import (
    Nine,
    Pair,
    Six,
    Three,
    add3,
    add6,
    add9,
    apply,
    apply_transposed,
    conjugate,
    cross,
    dot,
    full,
    load9,
    mix,
    outer,
    scaled,
    store3,
    times,
    times_transposed,
)
from solver._kernels.blocks import least_bending, lever, wall_hessian
from solver._kernels.data import CURRENT
from solver._kernels.flags import inlined, kernel
from solver._kernels.lane_block import (
    ALONG,
    DAMPING,
    DECREMENT,
    DEFINITE,
    LARGEST,
    MOMENT,
    PIVOT,
    START,
    STIFFNESS,
    WEIGHT,
    Block,
)
from solver._kernels.lanes import anywhere, greater, select, select3, size, spread
from solver._kernels.newton import Value, cross_segment
from solver._kernels.rotation import bent, from_rest, jacobian, jacobian_curvature

Rows = tuple[Three, Three]
"""One row for each control of a joint."""
Gains = tuple[Pair, Rows, Rows]
"""Of a joint: its step, and its answers to δp and δr."""


@inlined
def turn_of(b: Block, j: int, u: Three) -> Nine:
    """``rotation.turn`` of a joint."""
    e, sine = bent(u), b.sine[j]
    return from_rest(b.cosine[j], sine, e) if anywhere(sine != 0.0) else e


@inlined
def touch_of(b: Block, p: int, frame: Nine) -> tuple[Three, Three, Any]:
    """Force of the wall at a look-up point in the frame of its node, the normal there and the jet; 0 off contact."""
    touch, weight = b.touch, b.site[p, WEIGHT]
    jet = (touch[CURRENT, p, 1], touch[CURRENT, p, 2], touch[CURRENT, p, 3], touch[CURRENT, p, 4],
           touch[CURRENT, p, 5], touch[CURRENT, p, 6], touch[CURRENT, p, 7], touch[CURRENT, p, 8],
           touch[CURRENT, p, 9], touch[CURRENT, p, 10])  # fmt: skip
    normal = apply_transposed(frame, (jet[1], jet[2], jet[3]))
    return scaled(wall_law.force(b.number[STIFFNESS], weight, touch[CURRENT, p, 0]), normal), normal, jet


@inlined
def add_touch(b: Block, p: int, frame: Nine, value: Value) -> Value:
    """Add the wall at a look-up point to the value function."""
    vp, vc, vh, vf, vg = value
    d, stiffness, weight, zero = b.touch[CURRENT, p, 0], b.number[STIFFNESS], b.site[p, WEIGHT], spread(0.0)
    force, normal, jet = touch_of(b, p, frame)
    law = wall_law.force(stiffness, weight, d), select(d > 0.0, wall_law.curvature(stiffness, weight, d), zero)
    # asked of lanes that touch here: what is left out takes as long as all the rest
    hessian = wall_hessian(frame, jet, normal, law, (b.number[DAMPING] > 0.0) & (d > 0.0))
    vp, vf = add6(vp, hessian), add3(vf, force)
    along = b.site[p, ALONG]
    if anywhere(along != 0.0):
        o = (zero, zero, along)
        dc, dh = lever(o, force, hessian)
        vc, vh, vg = add9(vc, dc), add6(vh, dh), add3(vg, cross(o, force))
    return vp, vc, vh, vf, vg


@inlined
def at_tip(b: Block, k: int, frame: Nine) -> Value:
    """The value function beyond the tip, with the load on it."""
    zero = spread(0.0)
    three = (zero, zero, zero)
    load = apply_transposed(frame, (-b.load[0], -b.load[1], -b.load[2]))
    return three + three, three + three + three, three + three, load, three


@inlined
def joint_rows(bend: Any, u: Three, value: Value) -> tuple[Six, Rows, Rows, tuple[Any, Any]]:
    """A joint's Q_uu, rows of Q_up and Q_ur, and its two moments Q_u."""
    _, c, h, _, g = value
    jac, more = jacobian(u), jacobian_curvature(g, u)
    one, two = (jac[0], jac[3], jac[6]), (jac[1], jac[4], jac[7])
    h_one, h_two = apply(full(h), one), apply(full(h), two)
    xx, yy, xy = dot(one, h_one) + more[0] + bend, dot(two, h_two) + more[1] + bend, dot(one, h_two) + more[3]
    q_ur = mix(1.0, h_one, 0.5, cross(one, g)), mix(1.0, h_two, 0.5, cross(two, g))
    zero = spread(0.0)
    return (xx, yy, zero, xy, zero, zero), (apply(c, one), apply(c, two)), q_ur, (dot(one, g), dot(two, g))


@inlined
def best_answer(q_uu: Six, w: Pair, q_up: Rows, q_ur: Rows) -> Gains:
    """Minus the inverse of Q_uu times Q_u, Q_up and Q_ur."""
    per_det = -1.0 / (q_uu[0] * q_uu[1] - q_uu[3] * q_uu[3])
    i0, i1, i2 = q_uu[1] * per_det, q_uu[0] * per_det, -q_uu[3] * per_det
    feed = (i0 * w[0] + i2 * w[1], i2 * w[0] + i1 * w[1])
    gain_p = mix(i0, q_up[0], i2, q_up[1]), mix(i2, q_up[0], i1, q_up[1])
    return feed, gain_p, (mix(i0, q_ur[0], i2, q_ur[1]), mix(i2, q_ur[0], i1, q_ur[1]))


@inlined
def cross_joint(e: Nine, value: Value, rows: tuple[Rows, Rows], gains: Gains) -> Value:
    """``newton.cross_joint`` from the rows of two controls."""
    p, c, h, f, g = value
    (p0, p1), (r0, r1) = rows
    feed, (kp0, kp1), (kr0, kr1) = gains
    p, h = conjugate(e, add6(p, outer(p0, kp0, p1, kp1))), conjugate(e, add6(h, outer(r0, kr0, r1, kr1)))
    c = add9(c, mix(p0[0], kr0, p1[0], kr1) + mix(p0[1], kr0, p1[1], kr1) + mix(p0[2], kr0, p1[2], kr1))
    f, g = add3(f, mix(feed[0], p0, feed[1], p1)), add3(g, mix(feed[0], r0, feed[1], r1))
    return p, times_transposed(times(e, c), e), h, apply(e, f), apply(e, g)


@inlined
def store_gains(gain: Any, j: int, gains: Gains) -> None:
    """Write joint j's gains, (2, 7), see ``blocks.store_gains``."""
    feed, (p0, p1), (r0, r1) = gains
    gain[j, 0, 0], gain[j, 0, 1], gain[j, 0, 2], gain[j, 0, 3] = feed[0], p0[0], p0[1], p0[2]
    gain[j, 1, 0], gain[j, 1, 1], gain[j, 1, 2], gain[j, 1, 3] = feed[1], p1[0], p1[1], p1[2]
    gain[j, 0, 4], gain[j, 0, 5], gain[j, 0, 6] = r0
    gain[j, 1, 4], gain[j, 1, 5], gain[j, 1, 6] = r1


@kernel
def sweep(b: Block, first: Any, base: int) -> None:
    """``newton.sweep`` of every lane, from the tip to joint ``base``: the gains, and what they foretell."""
    k, u, r, damping, start = b.length.shape[0], b.u[CURRENT], b.r[CURRENT], b.number[DAMPING], b.number[START]
    zero, touch = spread(0.0), b.touch
    value, decrement, definite, lowest = at_tip(b, k, load9(r, k)), zero, zero == 0.0, spread(math.inf)
    for n in range(k, base, -1):
        j = n - 1
        frame, bend, v = load9(r, n), b.bend[j], (u[j, 0], u[j, 1], zero)
        for p in range(first[n], first[n + 1]):
            if anywhere(touch[CURRENT, p, 0] != 0.0):
                value = add_touch(b, p, frame, value)
        vp, vc, vh, vf, vg = value
        held = damping * b.hold[j]
        vp = (vp[0] + held, vp[1] + held, vp[2] + held, vp[3], vp[4], vp[5])
        value = cross_segment(b.length[j], (vp, vc, vh, vf, vg))
        q_uu, q_up, q_ur, moment = joint_rows(bend * (1.0 + 0.01 * damping), v, value)
        floor, least, free = tol.CURVATURE_FLOOR * bend, least_bending(q_uu), start <= float(j)
        definite = definite & ((least > -floor) | ~free)
        lowest = select(free & (least < lowest * bend), least / bend, lowest)
        more = select(least < floor, 2 * floor, zero)
        q_uu = (q_uu[0] + more, q_uu[1] + more, zero, q_uu[3], zero, zero)
        w = (moment[0] + bend * v[0], moment[1] + bend * v[1])
        gains = best_answer(q_uu, w, q_up, q_ur)
        store_gains(b.gain, j, gains)
        feed = gains[0]
        decrement = decrement - select(free, 0.5 * (w[0] * feed[0] + w[1] * feed[1]), zero)
        value = cross_joint(turn_of(b, j, v), value, (q_up, q_ur), gains)
    b.number[DECREMENT], b.number[DEFINITE], b.number[PIVOT] = decrement, select(definite, 1.0, 0.0), lowest


@kernel
def costate(b: Block, first: Any, base: int) -> None:
    """``newton.costate`` of every lane: the exact gradient, and the largest moment in the wire."""
    k, u, r, zero = b.length.shape[0], b.u[CURRENT], b.r[CURRENT], spread(0.0)
    _, _, _, f, g = at_tip(b, k, load9(r, k))
    left, largest, one, two, touch = zero, zero, g, g, b.touch
    for n in range(k, base, -1):
        j = n - 1
        frame, v, bend, length = load9(r, n), (u[j, 0], u[j, 1], zero), b.bend[j], b.length[j]
        for p in range(first[n], first[n + 1]):
            if anywhere(touch[CURRENT, p, 0] != 0.0):
                force, _, _ = touch_of(b, p, frame)
                f, g = add3(f, force), add3(g, cross((zero, zero, b.site[p, ALONG]), force))
        g = (g[0] - length * f[1], g[1] + length * f[0], g[2])
        moment = apply_transposed(jacobian(v), g)
        # a joint of length 0 carries the moment of the wire beyond it and has none of its own
        real = length > 0.0
        here = greater(size(moment[0] + bend * v[0]), size(moment[1] + bend * v[1]))
        left = select(real, greater(left, here), left)
        angle = greater(greater(size(v[0]), size(v[1])), tol.ENERGY_FLOOR_ANGLE)
        largest = select(real, greater(largest, bend * angle), largest)
        one, two = select3(real, g, one), select3(real, one, two)
        e = turn_of(b, j, v)
        f, g = apply(e, f), apply(e, g)
    b.number[MOMENT], b.number[LARGEST] = left, largest
    b.force[0], b.force[1], b.force[2] = apply(load9(r, base), f)
    b.torque[0], b.torque[1], b.torque[2] = g
    store3(b.turned, 0, one)
    store3(b.turned, 1, two)
