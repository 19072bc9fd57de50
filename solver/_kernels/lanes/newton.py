"""Newton's step and the exact gradient of wires in lanes: ``newton`` in lock-step, for wires that do not twist.

A joint has two controls, so that what is a matrix of three rows there is two rows here, one for each of them. And the
value function is expanded in displacements and turns as seen from the world, not from the node, R -> exp(δr̂) R: nothing
of it has to be turned from one frame into the next, which is a third of the work. With a the segment, as a vector,
    g = v_r + a x f,   C = V_pr + V_pp A,   A δr = δr x a,   H = V_rr + Aᵀ V_pr + (Aᵀ C)ᵀ + ½ (f aᵀ + a fᵀ) - (f·a) I.
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
    dot,
    dyad,
    full,
    load9,
    mix,
    outer,
    scaled,
)
from solver._kernels.blocks import least_bending, lever, without_negative
from solver._kernels.data import CURRENT
from solver._kernels.flags import inlined, kernel
from solver._kernels.lanes.block import (
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
from solver._kernels.lanes.vectors import anywhere, greater, select, select3, size, spread
from solver._kernels.newton import Value
from solver._kernels.rotation import jacobian, jacobian_curvature, with_rest

Rows = tuple[Three, Three]
"""One row for each control of a joint."""
Gains = tuple[Pair, Rows, Rows]
"""Of a joint: its step, and its answers to δp and δr."""


@inlined
def direction(frame: Nine) -> Three:
    """Direction of the segment that ends at a node with this frame."""
    return frame[2], frame[5], frame[8]


@inlined
def plus_cross(c: Three, a: Three, b: Three) -> Three:
    """C + a x b."""
    return c[0] + a[1] * b[2] - a[2] * b[1], c[1] + a[2] * b[0] - a[0] * b[2], c[2] + a[0] * b[1] - a[1] * b[0]


@inlined
def pressing(b: Block, p: int) -> tuple[Three, Three]:
    """Force of the wall at a look-up point, and the normal there; 0 off contact."""
    touch = b.touch
    normal = touch[CURRENT, p, 2], touch[CURRENT, p, 3], touch[CURRENT, p, 4]
    return scaled(wall_law.force(b.number[STIFFNESS], b.site[p, WEIGHT], touch[CURRENT, p, 0]), normal), normal


@inlined
def wall_hessian(b: Block, p: int, n: Three) -> Six:
    """``blocks.wall_hessian`` as seen from the world; n : the normal."""
    touch, stiffness, weight, zero = b.touch, b.number[STIFFNESS], b.site[p, WEIGHT], spread(0.0)
    d = touch[CURRENT, p, 0]
    f = wall_law.force(stiffness, weight, d)
    bend = (f * touch[CURRENT, p, 5], f * touch[CURRENT, p, 6], f * touch[CURRENT, p, 7],
            f * touch[CURRENT, p, 8], f * touch[CURRENT, p, 9], f * touch[CURRENT, p, 10])  # fmt: skip
    # only lanes that touch here are asked: leaving the negative part out takes as long as all the rest
    project = (b.number[DAMPING] > 0.0) & (d > 0.0)
    if anywhere(project):
        rest = without_negative(bend, n)
        bend = select3(project, rest[:3], bend[:3]) + select3(project, rest[3:], bend[3:])
    return add6(dyad(scaled(select(d > 0.0, wall_law.curvature(stiffness, weight, d), zero), n), n), bend)


@inlined
def add_touch(b: Block, p: int, frame: Nine, value: Value) -> Value:
    """Add the wall at a look-up point to the value function."""
    vp, vc, vh, vf, vg = value
    force, normal = pressing(b, p)
    hessian = wall_hessian(b, p, normal)
    vp, vf = add6(vp, hessian), add3(vf, force)
    along = b.site[p, ALONG]
    if anywhere(along != 0.0):
        o = scaled(along, direction(frame))
        dc, dh = lever(o, force, hessian)
        vc, vh, vg = add9(vc, dc), add6(vh, dh), plus_cross(vg, o, force)
    return vp, vc, vh, vf, vg


@inlined
def at_tip(b: Block) -> Value:
    """The value function beyond the tip, with the load on it."""
    zero = spread(0.0)
    three = (zero, zero, zero)
    return three + three, three + three + three, three + three, (-b.load[0], -b.load[1], -b.load[2]), three


@inlined
def cross_segment(a: Three, value: Value) -> Value:
    """``newton.cross_segment`` as seen from the world; a : the segment, mm."""
    p, c, h, f, g = value
    rows = full(p)
    n = plus_cross(c[:3], a, rows[:3]) + plus_cross(c[3:6], a, rows[3:6]) + plus_cross(c[6:], a, rows[6:])
    x, y, z = f[0] * a[0], f[1] * a[1], f[2] * a[2]
    h = (
        h[0] + a[1] * (c[6] + n[6]) - a[2] * (c[3] + n[3]) - (y + z),
        h[1] + a[2] * (c[1] + n[1]) - a[0] * (c[7] + n[7]) - (x + z),
        h[2] + a[0] * (c[5] + n[5]) - a[1] * (c[2] + n[2]) - (x + y),
        h[3] + a[1] * c[7] + a[2] * (n[0] - c[4]) - a[0] * n[6] + 0.5 * (f[0] * a[1] + f[1] * a[0]),
        h[4] + a[1] * (c[8] - n[0]) - a[2] * c[5] + a[0] * n[3] + 0.5 * (f[0] * a[2] + f[2] * a[0]),
        h[5] + a[2] * c[2] + a[0] * (n[4] - c[8]) - a[1] * n[1] + 0.5 * (f[1] * a[2] + f[2] * a[1]),
    )
    return p, n, h, f, plus_cross(g, a, f)


@inlined
def joint_rows(bend: Any, turn: Three, frame: Nine, value: Value) -> tuple[Six, Rows, Rows, tuple[Any, Any]]:
    """Of a joint turned by ``turn``: Q_uu, rows of Q_up and Q_ur, and the two moments Q_u of what is beyond it."""
    _, c, h, _, g = value
    jac, more = jacobian(turn), jacobian_curvature(apply_transposed(frame, g), turn)
    one, two = apply(frame, (jac[0], jac[3], jac[6])), apply(frame, (jac[1], jac[4], jac[7]))
    h_one, h_two = apply(full(h), one), apply(full(h), two)
    xx, yy, xy = dot(one, h_one) + more[0] + bend, dot(two, h_two) + more[1] + bend, dot(one, h_two) + more[3]
    half = scaled(0.5, g)
    q_ur = plus_cross(h_one, one, half), plus_cross(h_two, two, half)
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
def cross_joint(value: Value, rows: tuple[Rows, Rows], gains: Gains) -> Value:
    """``newton.cross_joint`` from the rows of two controls."""
    p, c, h, f, g = value
    (p0, p1), (r0, r1) = rows
    feed, (kp0, kp1), (kr0, kr1) = gains
    c = add9(c, mix(p0[0], kr0, p1[0], kr1) + mix(p0[1], kr0, p1[1], kr1) + mix(p0[2], kr0, p1[2], kr1))
    f, g = add3(f, mix(feed[0], p0, feed[1], p1)), add3(g, mix(feed[0], r0, feed[1], r1))
    return add6(p, outer(p0, kp0, p1, kp1)), c, add6(h, outer(r0, kr0, r1, kr1)), f, g


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
    """``newton.sweep`` of every lane, from the tip to joint ``base``: fills gains, DECREMENT, DEFINITE and PIVOT."""
    k, u, r, damping, start = b.length.shape[0], b.u[CURRENT], b.r[CURRENT], b.number[DAMPING], b.number[START]
    zero, touch = spread(0.0), b.touch
    value, decrement, definite, lowest = at_tip(b), zero, zero == 0.0, spread(math.inf)
    for n in range(k, base, -1):
        j = n - 1
        frame, bend, v = load9(r, n), b.bend[j], (u[j, 0], u[j, 1], zero)
        for p in range(first[n], first[n + 1]):
            if anywhere(touch[CURRENT, p, 0] != 0.0):
                value = add_touch(b, p, frame, value)
        vp, vc, vh, vf, vg = value
        held = damping * b.hold[j]
        vp = (vp[0] + held, vp[1] + held, vp[2] + held, vp[3], vp[4], vp[5])
        value = cross_segment(scaled(b.length[j], direction(frame)), (vp, vc, vh, vf, vg))
        q_uu, q_up, q_ur, moment = joint_rows(bend * (1.0 + 0.01 * damping), with_rest(b.rest[j], v), frame, value)
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
        value = cross_joint(value, (q_up, q_ur), gains)
    b.number[DECREMENT], b.number[DEFINITE], b.number[PIVOT] = decrement, select(definite, 1.0, 0.0), lowest


@kernel
def costate(b: Block, first: Any, base: int) -> None:
    """``newton.costate`` of every lane: the exact gradient, and the largest moment in the wire."""
    k, u, r, zero = b.length.shape[0], b.u[CURRENT], b.r[CURRENT], spread(0.0)
    _, _, _, f, g = at_tip(b)
    left, largest, touch = zero, zero, b.touch
    for n in range(k, base, -1):
        j = n - 1
        frame, v, bend = load9(r, n), (u[j, 0], u[j, 1], zero), b.bend[j]
        for p in range(first[n], first[n + 1]):
            if anywhere(touch[CURRENT, p, 0] != 0.0):
                force, _ = pressing(b, p)
                f, g = add3(f, force), plus_cross(g, scaled(b.site[p, ALONG], direction(frame)), force)
        length = b.length[j]
        g = plus_cross(g, scaled(length, direction(frame)), f)
        moment = apply_transposed(jacobian(with_rest(b.rest[j], v)), apply_transposed(frame, g))
        # a joint of length 0 carries the moment of the wire beyond it and has none of its own
        real = length > 0.0
        here = greater(size(moment[0] + bend * v[0]), size(moment[1] + bend * v[1]))
        left = select(real, greater(left, here), left)
        angle = greater(greater(size(v[0]), size(v[1])), tol.ENERGY_FLOOR_ANGLE)
        largest = select(real, greater(largest, bend * angle), largest)
    b.number[MOMENT], b.number[LARGEST] = left, largest
    b.force[0], b.force[1], b.force[2] = f
    b.torque[0], b.torque[1], b.torque[2] = apply_transposed(load9(r, base), g)
