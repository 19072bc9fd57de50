"""Forces of a wire at rest: they fall out of the minimum, as derivatives of the total energy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solver._kernels.energy import slide_of
from solver._kernels.rotation import turn
from solver.chain import Buffers

Array = NDArray[np.float64]


def contact_forces(b: Buffers) -> tuple[Array, float]:
    """The wall's force on the wire at each joint (k + 1, 3), N, friction included, and the deepest penetration, mm."""
    force = np.zeros((b.k + 1, 3))
    if not b.k or not b.stiffness or not b.points:
        return force, 0.0
    depth = b.state.depth[0, : b.points]
    touching = np.flatnonzero(depth)
    size = b.stiffness * b.chain.weight[touching] * depth[touching]
    spread(b, touching, -size[:, None] * b.state.jet[0, touching, 1:4], force)
    if b.friction:
        rubbing = np.flatnonzero(b.problem.friction.load[: b.points])
        spread(b, rubbing, friction_forces(b, rubbing), force)
    return force, float(depth.max())


def node_of(b: Buffers, points: NDArray[np.intp]) -> NDArray[np.intp]:
    """Node that each look-up point belongs to."""
    return np.searchsorted(b.chain.first[: b.k + 2], points, side="right") - 1


def spread(b: Buffers, points: NDArray[np.intp], each: Array, force: Array) -> None:
    """Add point forces to joints; a point inside a segment belongs to its two ends in proportion."""
    node = node_of(b, points)
    share = -b.chain.offset[points, 2] / b.chain.length[node - 1]
    np.add.at(force, node, (1 - share)[:, None] * each)
    np.add.at(force, node - 1, share[:, None] * each)


def friction_forces(b: Buffers, points: NDArray[np.intp]) -> Array:
    """Friction on each of some look-up points (n, 3), N: against the way slid in this step."""
    each = np.zeros((len(points), 3))
    f = b.problem.friction
    for i, (point, node) in enumerate(zip(points, node_of(b, points), strict=True)):
        size = slide_of(b.problem, 0, int(node), int(point), each[i])
        each[i] *= -f.coefficient * f.load[point] / size
    return each


def push_force(b: Buffers) -> float:
    """dU/d(depth) at the minimum, N: the axial force of the hand when the introducer guides without friction.

    The depth grows by the first segment alone: all joints move along it, and the compliance, rest bend and wall
    share of the first two cells change.
    """
    if b.k == 0:
        return 0.0
    c, u, report = b.chain, b.state.u[0], b.report
    force = float(report[6:9] @ b.state.r[0, 1, :, 2])
    depth = float(c.length[: b.k].sum())
    ends = np.array([depth, depth - 0.5 * b.first_mm])
    profile = b.wire.profile
    flexible = 1 / np.interp(ends, profile.stiffness_at, profile.stiffness)
    rest = np.interp(ends, profile.rest_at, profile.rest)
    for j in range(min(b.k, 2)):
        # the first cell is [depth - l/2, depth], the second ends where the first begins
        grows = 1.0 if j == 0 else 0.0
        inner = -0.5 if j == 0 else 0.5
        bend = float(c.bend[j] ** 2 * (u[j, :2] @ u[j, :2]))
        force -= 0.5 * bend * (grows * flexible[0] + inner * flexible[1])
        if b.problem.twisting:
            force -= 0.25 * float((c.twist[j] * u[j, 2]) ** 2) / b.wire.torsional_stiffness_N_mm2
        axis = np.array(turn(0.0, u[j, 0], u[j, 1], u[j, 2])[3:6])
        moment = report[12 + 3 * j : 15 + 3 * j]
        force += float(moment @ axis) * (grows * rest[0] + inner * rest[1])
    return force + own_share(b)


def own_share(b: Buffers) -> float:
    """What the first segment's growth adds to the weights of its look-up points, N: half of node 1's cell."""
    if not b.stiffness or b.k < 2:
        return 0.0
    first, last = b.chain.first[1], b.chain.first[2]
    depth = b.state.depth[0, first:last]
    density = 0.5 * b.stiffness * depth**2
    on_node = b.chain.offset[first:last, 2] == 0.0
    hulls = max(len(b.rule.hull), 1)
    return 0.5 * float(density[on_node].sum()) / hulls
