"""What Newton's step is made of, node by node and joint by joint.

What acts on a node and on its segment: gradient and Hessian of wall, friction and loads, in the node's frame. And a
joint's block Q_uu of the Hessian, that block's inverse, and the joint's gains.
"""

import math
from typing import Any

from solver._kernels import wall_law
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
    cross,
    cross_matrix,
    dot,
    dyad,
    full,
    load3,
    mix,
    outer,
    scaled,
    times,
    transpose,
)
from solver._kernels.data import Chain, Problem
from solver._kernels.flags import inlined, kernel
from solver._kernels.friction import friction_derivatives, lever_of
from solver._kernels.joint import curvature_of
from solver._kernels.lanes.vectors import anywhere, select, select3


@inlined
def wall_hessian(frame: Nine, jet: Any, n: Three, law: tuple[float, float], project: bool) -> Six:
    """Hessian of the wall's energy at a point in contact, U'' ∇φ ∇φᵀ + U' ∇²φ; law holds U' and U''.

    ``project`` leaves out the directions in which ∇²φ is negative: a wire pressed on a convex wall.
    """
    f = law[0]
    bend = (f * jet[4], f * jet[5], f * jet[6], f * jet[7], f * jet[8], f * jet[9])
    bend = conjugate(transpose(frame), bend)
    if anywhere(project):
        rest = without_negative(bend, n)
        bend = select3(project, rest[:3], bend[:3]) + select3(project, rest[3:], bend[3:])
    return add6(dyad(scaled(law[1], n), n), bend)


@inlined
def without_negative(m: Six, n: Three) -> Six:
    """The positive part of a symmetric matrix in the plane across n; nothing along n."""
    size = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    flat = size < 1e-6
    size = select(flat, 1.0, size)
    n = (n[0] / size, n[1] / size, n[2] / size)
    # an orthonormal pair across n (Duff et al. 2017), without a branch at the poles
    sign = select(n[2] < 0.0, -1.0, 1.0)
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    s = (1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0])
    t = (b, sign + n[1] * n[1] * a, -n[1])
    ms, mt = apply(full(m), s), apply(full(m), t)
    half, st, mean = 0.5 * (dot(s, ms) - dot(t, mt)), dot(s, mt), 0.5 * (dot(s, ms) + dot(t, mt))
    radius = math.sqrt(half * half + st * st)
    one, two = positive(mean + radius), positive(mean - radius)
    # the mean of the two eigenvalues that are left, and how far they are from it along the principal directions
    mean, share = 0.5 * (one + two), 0.5 * (one - two) / select(radius > 0.0, radius, 1.0)
    mean, share = select(flat, 0.0, mean), select(flat, 0.0, share)
    v, w = mix(mean + share * half, s, share * st, t), mix(share * st, s, mean - share * half, t)
    return outer(v, s, w, t)


@inlined
def positive(x: float) -> float:
    """X, or 0 where it is negative."""
    return select(x > 0.0, x, 0.0)  # type: ignore[no-any-return]


@inlined
def lever(o: Three, f: Three, stiffness: Six) -> tuple[Nine, Six]:
    """What a force at offset o from the node adds to V_pr and V_rr: its place moves by δr x o, and curves."""
    d = cross_matrix((-o[0], -o[1], -o[2]))
    c = times(full(stiffness), d)
    h = times(transpose(d), c)
    along = f[0] * o[0] + f[1] * o[1] + f[2] * o[2]
    rr = (
        h[0] + f[0] * o[0] - along,
        h[4] + f[1] * o[1] - along,
        h[8] + f[2] * o[2] - along,
        h[1] + 0.5 * (f[0] * o[1] + f[1] * o[0]),
        h[2] + 0.5 * (f[0] * o[2] + f[2] * o[0]),
        h[5] + 0.5 * (f[1] * o[2] + f[2] * o[1]),
    )
    return c, rr


@inlined
def node_gradient(problem: Problem, slot: int, n: int, frame: Nine) -> tuple[Three, Three]:
    """Gradient of everything that acts on a node and its segment: (δp, δr), in the frame of the node."""
    chain, state = problem.chain, problem.state
    load, f, g = load3(chain.load, n), ZERO3, ZERO3
    # as a rule only the tip is loaded
    if load != ZERO3:
        f = scaled(-1.0, apply_transposed(frame, load))
    for p in range(chain.first[n], chain.first[n + 1]):
        d = state.penetration[slot, p]
        if d != 0.0:
            size = wall_law.force(problem.stiffness, chain.weight[p], d)
            jet = state.jet[slot, p]
            force = scaled(size, apply_transposed(frame, (jet[1], jet[2], jet[3])))
            f, g = add3(f, force), add3(g, cross(load3(chain.offset, p), force))
        if problem.friction.coefficient > 0.0 and problem.friction.load[p] > 0.0:
            force, _ = friction_derivatives(problem, slot, n, p, frame)
            f, g = add3(f, force), add3(g, cross(lever_of(problem, p), force))
    if n == 1:
        g = add3(g, load3(state.held[slot], 0))
    return f, g


@inlined
def node_hessian(problem: Problem, slot: int, n: int, frame: Nine, project: bool) -> tuple[Six, Nine, Six]:
    """Hessian of the same: V_pp, V_pr and V_rr."""
    chain, state, stiffness = problem.chain, problem.state, problem.stiffness
    p, c, h = ZERO6, ZERO9, ZERO6
    for i in range(chain.first[n], chain.first[n + 1]):
        d = state.penetration[slot, i]
        rubbing = problem.friction.coefficient > 0.0 and problem.friction.load[i] > 0.0
        if d == 0.0 and not rubbing:
            continue
        if d != 0.0:
            jet, weight = state.jet[slot, i], chain.weight[i]
            law = wall_law.force(stiffness, weight, d), wall_law.curvature(stiffness, weight, d)
            normal = apply_transposed(frame, (jet[1], jet[2], jet[3]))
            force, hessian = scaled(law[0], normal), wall_hessian(frame, jet, normal, law, project)
            p = add6(p, hessian)
            offset = load3(chain.offset, i)
            if offset != ZERO3:
                dc, dh = lever(offset, force, hessian)
                c, h = add9(c, dc), add6(h, dh)
        if rubbing:
            rub, stiffer = friction_derivatives(problem, slot, n, i, frame)
            dc, dh = lever(lever_of(problem, i), rub, stiffer)
            p, c, h = add6(p, stiffer), add9(c, dc), add6(h, dh)
    if n == 1:
        h = add6(h, load3(state.held[slot], 1) + load3(state.held[slot], 2))
    return p, c, h


Gains = tuple[Three, Nine, Nine]
"""Of a joint: its step, and its answers to δp and δr."""


@inlined
def joint_hessian(
    chain: Chain, j: int, u: Three, jac: Nine, hg: tuple[Six, Three], twisting: bool, damping: float
) -> Six:
    """Q_uu of a joint, from V_rr and V_r beyond it; damping adds that share of the joint's own stiffness."""
    h, g = hg
    q = add6(conjugate(transpose(jac), h), curvature_of(chain, j, u, g))
    bend = chain.bend[j] * (1.0 + damping)
    twist = chain.twist[j] * (1.0 + damping) if twisting else 0.0
    return q[0] + bend, q[1] + bend, q[2] + twist, q[3], q[4], q[5]


@inlined
def least_curvature(q: Six, twisting: bool) -> float:
    """Least eigenvalue of the bending block of Q_uu; -inf where the twist entry makes the whole indefinite."""
    least = least_bending(q)
    if twisting and least > 0.0:
        det = q[0] * q[1] - q[3] * q[3]
        if not q[2] * det > q[4] * q[4] * q[1] - 2 * q[3] * q[4] * q[5] + q[5] * q[5] * q[0]:
            return -math.inf
    return least


@inlined
def pivot_of(q: Six, least: float, bend: float, twist: float) -> float:
    """Stiffness Q_uu of a joint over its own: of bending, or of twist with bending free to follow, whichever is less.

    least : see ``least_curvature``.     bend, twist : the joint's own, N mm/rad; twist 0 where torsion is rigid. By
    bending alone a wire that whips had a pivot of 1.003 a quarter of a degree before.
    """
    pivot = least / bend
    if twist > 0.0 and least > 0.0:
        det = q[0] * q[1] - q[3] * q[3]
        taken = q[4] * q[4] * q[1] - 2 * q[3] * q[4] * q[5] + q[5] * q[5] * q[0]
        pivot = min(pivot, (q[2] - taken / det) / twist)
    return pivot


@inlined
def least_bending(q: Six) -> float:
    """Least eigenvalue of the bending block of Q_uu."""
    half = 0.5 * (q[0] - q[1])
    return 0.5 * (q[0] + q[1]) - math.sqrt(half * half + q[3] * q[3])


@inlined
def stiffened(q: Six, more: float) -> Six:
    """Q_uu with more stiffness against bending."""
    return q[0] + more, q[1] + more, q[2], q[3], q[4], q[5]


@inlined
def solve_block(q: Six, twisting: bool) -> Nine:
    """Minus the inverse of Q_uu; without a twist variable its last row and column are zero."""
    if not twisting:
        per_det = -1.0 / (q[0] * q[1] - q[3] * q[3])
        i2 = -q[3] * per_det
        return q[1] * per_det, i2, 0.0, i2, q[0] * per_det, 0.0, 0.0, 0.0, 0.0
    c00 = q[1] * q[2] - q[5] * q[5]
    c01 = q[4] * q[5] - q[3] * q[2]
    c02 = q[3] * q[5] - q[4] * q[1]
    c11 = q[0] * q[2] - q[4] * q[4]
    c12 = q[3] * q[4] - q[0] * q[5]
    c22 = q[0] * q[1] - q[3] * q[3]
    det = -(q[0] * c00 + q[3] * c01 + q[4] * c02)
    return full((c00 / det, c11 / det, c22 / det, c01 / det, c02 / det, c12 / det))


@kernel
def pivot_of_shaft(chain: Chain, k: int, stiffness: float) -> float:
    """Pivot of the twist of the whole wire, as if it were one joint before all the rest.

    stiffness : dT/d(roll) of the hand's torque T, N mm/rad. With a compliance C, rad/(N mm), before a rest whose own
    is κ it is κ/(1 + κ C), so that the pivot 1 + κ C is 1/(1 - C dT/d(roll)). That of each joint by itself is near 0
    in the last hundredth of a degree before a whip alone, the less the shorter the segments are.
    """
    compliance = 0.0
    for j in range(k):
        compliance += 1.0 / chain.twist[j]
    share = stiffness * compliance
    # a wire that is held on its way, not at its end, resists more than its whole length would
    return 1.0 / (1.0 - share) if share < 1.0 else math.inf


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
def note_pivot(lowest: float, first_free: int, damping: float, report: Any) -> None:
    """Keep the least pivot of an undamped sweep; one that left out joints near the base can only lower it."""
    if damping == 0.0:
        report.pivot = lowest if first_free == 0 else min(lowest, report.pivot)


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
