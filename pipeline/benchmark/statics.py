"""Energy and moment balance of a chain, assembled a second time from what a solution publishes.

Nothing here shares code with the minimiser: joint angles are read back from the frames by a logarithm, forces are
summed from the tip to the clamp, and only the interpolated distance itself is the wall's own.
Valid without friction; the wall is looked up at the joints (trapezium rule, half a weight at the tip).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from solver import GuideWire, VesselWall

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Joints:
    """Constants of the k joints of a wire at one depth: lengths (k,), stiffness and twist (k,), rest bend (k,)."""

    length: Array
    bend: Array
    twist: Array
    rest: Array


def joints_of(wire: GuideWire, depth_mm: float) -> Joints:
    """Cells of a wire at a depth: a joint owns half of either segment, the clamp half of the first only."""
    k, first = wire.segments_at(depth_mm)
    length = np.full(k, wire.segment_mm)
    length[0] = first
    base_arc = np.concatenate([[0.0], np.cumsum(length)])[:-1]
    outer = depth_mm - np.concatenate([[0.0], base_arc[1:] - 0.5 * length[:-1]])
    inner = depth_mm - (base_arc + 0.5 * length)
    profile = wire.profile
    compliance = _integral(profile.stiffness_at, profile.stiffness, inner, outer, reciprocal=True)
    rest = _integral(profile.rest_at, profile.rest, inner, outer, reciprocal=False)
    return Joints(length, 1.0 / compliance, wire.torsional_stiffness_N_mm2 / (outer - inner), rest)


def _integral(at: Array, value: Array, low: Array, high: Array, *, reciprocal: bool) -> Array:
    """Integral (k,) over [low, high] of a piecewise linear function (constant beyond its ends) or of one over it."""
    cuts = np.concatenate([[-np.inf], at, [np.inf]])
    ends = np.concatenate([[value[0]], value, [value[-1]]])
    total = np.zeros(len(low))
    for i in range(len(cuts) - 1):
        a, b = np.maximum(low, cuts[i]), np.minimum(high, cuts[i + 1])
        on = np.flatnonzero(b > a)
        if on.size:
            total[on] += _piece(cuts[i : i + 2], ends[i : i + 2], a[on], b[on], reciprocal=reciprocal)
    return total


def _piece(span: Array, ends: Array, a: Array, b: Array, *, reciprocal: bool) -> Array:
    """One linear piece; of the reciprocal the closed form (b - a) * log(q / p) / (q - p)."""
    if not np.all(np.isfinite(span)):
        p = q = np.full(len(a), ends[1] if np.isinf(span[0]) else ends[0])
    else:
        slope = (ends[1] - ends[0]) / (span[1] - span[0])
        p, q = ends[0] + slope * (a - span[0]), ends[0] + slope * (b - span[0])
    if not reciprocal:
        return np.asarray(0.5 * (b - a) * (p + q))
    ratio = np.where(np.abs(q / p - 1) > 1e-6, q / p, 2.0)
    mean = np.where(np.abs(q / p - 1) > 1e-6, np.log(ratio) / (p * (ratio - 1)), 2.0 / (p + q))
    return np.asarray((b - a) * mean)


def angles_of(frames: Array, joints: Joints) -> Array:
    """Joint angles (k, 3) beyond the rest bend, rad, in the material frame: log of Bᵀ Rᵀ R'."""
    turn = np.einsum("nji,njk->nik", frames[:-1], frames[1:])
    zero = np.zeros_like(joints.rest)
    rest = Rotation.from_rotvec(np.column_stack([zero, joints.rest, zero]))
    return np.asarray((rest.inv() * Rotation.from_matrix(turn)).as_rotvec())


def right_jacobian(u: Array) -> Array:
    """J (n, 3, 3) with exp(u + du) = exp(u) exp(J du)."""
    angle = np.linalg.norm(u, axis=-1)[:, None, None]
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    one = np.where(small, 0.5 - angle**2 / 24, (1 - np.cos(safe)) / safe**2)
    two = np.where(small, 1 / 6 - angle**2 / 120, (safe - np.sin(safe)) / safe**3)
    hat = hat_of(u)
    return np.asarray(np.eye(3) - one * hat + two * (hat @ hat))


def hat_of(v: Array) -> Array:
    """Cross-product matrices (n, 3, 3)."""
    out = np.zeros((len(v), 3, 3))
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    return out - out.transpose(0, 2, 1)


@dataclass(frozen=True, eq=False)
class WallForces:
    """Forces on the wire: points (p, 3) mm, forces (p, 3) N, the node (p,) that carries each, energy N mm."""

    points: Array
    forces: Array
    node: NDArray[np.int64]
    energy: float


def wall_forces(
    wall: VesselWall | None, wire: GuideWire, joints: Joints, nodes: Array, frames: Array
) -> WallForces:
    """The wall's forces at the joints, looked up afresh: ½ k w d², w half of either segment."""
    k = len(joints.length)
    node = np.arange(1, k + 1)
    if wall is None:
        return WallForces(nodes[1:], np.zeros((k, 3)), node, 0.0)
    weight = 0.5 * (joints.length + np.append(joints.length[1:], 0.0))
    points, reach, count = nodes[1:], wire.radius_mm, 1
    if wall.samples:
        count, reach = wall.samples, 0.0
        angle = 2 * np.pi * np.arange(count) / count
        across = (
            np.cos(angle)[:, None] * frames[1:, None, :, 0] + np.sin(angle)[:, None] * frames[1:, None, :, 1]
        )
        points = (nodes[1:, None] + wire.radius_mm * across).reshape(-1, 3)
    phi, gradient, _ = wall.look_up(points)
    depth = np.maximum(phi + reach, 0.0)
    stiffness = wall.stiffness_N_mm2 * np.repeat(weight, count) / count
    energy = float(0.5 * np.sum(stiffness * depth**2))
    return WallForces(points, -(stiffness * depth)[:, None] * gradient, np.repeat(node, count), energy)


def residual_moments(
    joints: Joints, nodes: Array, frames: Array, wall: WallForces, load: Array | None = None
) -> tuple[Array, Array]:
    """Energy gradient (k, 3) by the joint angles, N mm, and the elastic moments (k, 3) that it balances.

    Turning all that lies beyond joint j by δ moves its points by δ × (x - x_j): the gradient is c u_j plus the
    moment of the forces beyond, taken into the material frame and through the right Jacobian of exp.
    Rows hold bend, bend, twist; the twist row is 0 where torsion is rigid.
    """
    u = angles_of(frames, joints)
    k = len(joints.length)
    force = np.zeros((k + 1, 3))
    moment = np.zeros((k + 1, 3))
    np.add.at(force, wall.node, wall.forces)
    np.add.at(moment, wall.node, np.cross(wall.points, wall.forces))
    if load is not None:
        force += load
        moment += np.cross(nodes, load)
    force, moment = np.cumsum(force[::-1], axis=0)[::-1], np.cumsum(moment[::-1], axis=0)[::-1]
    # forces on node j itself have no lever at joint j, so the sum may start at j + 1
    about = moment[1:] - np.cross(nodes[:-1], force[1:])
    body = np.einsum("nji,nj->ni", frames[1:], about)
    through = np.einsum("nji,nj->ni", right_jacobian(u), body)
    stiffness = np.column_stack(
        [joints.bend, joints.bend, np.where(np.isfinite(joints.twist), joints.twist, 0.0)]
    )
    elastic = stiffness * u
    gradient = elastic - through
    if not np.all(np.isfinite(joints.twist)):
        gradient[:, 2] = 0.0
    return gradient, elastic


def energy_of(
    joints: Joints, frames: Array, wall_energy: float, nodes: Array, load: Array | None = None
) -> float:
    """Total energy, N mm."""
    u = angles_of(frames, joints)
    total = 0.5 * float(np.sum(joints.bend * (u[:, 0] ** 2 + u[:, 1] ** 2))) + wall_energy
    if np.all(np.isfinite(joints.twist)):
        total += 0.5 * float(np.sum(joints.twist * u[:, 2] ** 2))
    if load is not None:
        total -= float(np.sum(load * nodes))
    return total


def roll_out(joints: Joints, u: Array, base: Array, frame: Array) -> tuple[Array, Array]:
    """Nodes (k + 1, 3) and frames (k + 1, 3, 3) of a chain with joint angles u (k, 3)."""
    k = len(joints.length)
    nodes, frames = np.empty((k + 1, 3)), np.empty((k + 1, 3, 3))
    nodes[0], frames[0] = base, frame
    zero = np.zeros(k)
    turn = Rotation.from_rotvec(np.column_stack([zero, joints.rest, zero])) * Rotation.from_rotvec(u)
    each = turn.as_matrix()
    for j in range(k):
        frames[j + 1] = frames[j] @ each[j]
        nodes[j + 1] = nodes[j] + joints.length[j] * frames[j + 1, :, 2]
    return nodes, frames
