"""Energy and moment balance of a chain, assembled a second time from what a solution publishes.

Nothing here shares code with the minimiser: joint angles are read back from the frames by a logarithm, forces are
summed from the tip to the clamp, and only the interpolated distance itself is the wall's own.
Valid without friction; the wall is looked up at the joints (trapezium rule, half a weight at the tip).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from solver import GuideWire, VesselWall

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class WallForces:
    """Forces on the wire: points (p, 3) mm, forces (p, 3) N, the node (p,) that carries each, energy N mm."""

    points: Array
    forces: Array
    node: NDArray[np.int64]
    energy: float


@dataclass(frozen=True, eq=False)
class Chain:
    """A wire of k joints at one depth, with its wall and a dead load (k + 1, 3) on its nodes, N.

    length (k,) of the segments; bend, twist and rest (k,): stiffness and rest bend of the joints. Where torsion is
    rigid, twist is 0 and only the first two of the three kinds of angle are free.
    States are nodes (k + 1, 3) mm and frames (k + 1, 3, 3), as a solution publishes them.
    """

    wire: GuideWire
    wall: VesselWall | None
    length: Array
    bend: Array
    twist: Array
    rest: Array
    load: Array

    @property
    def kinds(self) -> int:
        """How many of a joint's angles are free: bend, bend and, where torsion is not rigid, twist."""
        return 3 if self.wire.twists else 2

    def angles(self, frames: Array) -> Array:
        """Joint angles (k, 3) beyond the rest bend, rad, in the material frame: log of Bᵀ Rᵀ R'."""
        turn = np.einsum("nji,njk->nik", frames[:-1], frames[1:])
        return np.asarray((self._bent_at_rest().inv() * Rotation.from_matrix(turn)).as_rotvec())

    def _bent_at_rest(self) -> Rotation:
        zero = np.zeros_like(self.rest)
        return Rotation.from_rotvec(np.column_stack([zero, self.rest, zero]))

    def roll_out(self, angles: Array, base: Array, frame: Array) -> tuple[Array, Array]:
        """Nodes and frames of the chain with these joint angles (k, 3), clamped at ``base`` in ``frame``."""
        k = len(self.length)
        nodes, frames = np.empty((k + 1, 3)), np.empty((k + 1, 3, 3))
        nodes[0], frames[0] = base, frame
        turn = (self._bent_at_rest() * Rotation.from_rotvec(angles)).as_matrix()
        for j in range(k):
            frames[j + 1] = frames[j] @ turn[j]
            nodes[j + 1] = nodes[j] + self.length[j] * frames[j + 1, :, 2]
        return nodes, frames

    def wall_forces(self, nodes: Array, frames: Array) -> WallForces:
        """The wall's forces at the joints, looked up afresh: ½ k w d², w half of either segment."""
        k, wall, reach = len(self.length), self.wall, self.wire.radius_mm
        node, points, count = np.arange(1, k + 1), nodes[1:], 1
        if wall is None:
            return WallForces(points, np.zeros((k, 3)), node, 0.0)
        if wall.samples:
            count, angle = wall.samples, 2 * np.pi * np.arange(wall.samples)[:, None] / wall.samples
            first, second = frames[1:, None, :, 0], frames[1:, None, :, 1]
            across = np.cos(angle) * first + np.sin(angle) * second
            points, reach = (nodes[1:, None] + reach * across).reshape(-1, 3), 0.0
        phi, gradient, _ = wall.look_up(points)
        depth = np.maximum(phi + reach, 0.0)
        weight = 0.5 * (self.length + np.append(self.length[1:], 0.0))
        stiffness = wall.stiffness_N_mm2 * np.repeat(weight, count) / count
        energy = float(0.5 * np.sum(stiffness * depth**2))
        return WallForces(points, -(stiffness * depth)[:, None] * gradient, np.repeat(node, count), energy)

    def moments(self, nodes: Array, frames: Array, wall: WallForces) -> tuple[Array, Array]:
        """Energy gradient (k, 3) by the joint angles, N mm, and the elastic moments (k, 3) that it balances.

        Turning all that lies beyond joint j by δ moves its points by δ × (x - x_j): the gradient is c u_j plus the
        moment of the forces beyond, taken into the material frame and through the right Jacobian of exp.
        Rows hold bend, bend, twist; the twist row is 0 where torsion is rigid.
        """
        u = self.angles(frames)
        force, moment = np.zeros_like(nodes), np.zeros_like(nodes)
        np.add.at(force, wall.node, wall.forces)
        np.add.at(moment, wall.node, np.cross(wall.points, wall.forces))
        force += self.load
        moment += np.cross(nodes, self.load)
        force, moment = np.cumsum(force[::-1], axis=0)[::-1], np.cumsum(moment[::-1], axis=0)[::-1]
        # forces on node j itself have no lever at joint j, so the sum may start at j + 1
        about = moment[1:] - np.cross(nodes[:-1], force[1:])
        body = np.einsum("nji,nj->ni", frames[1:], about)
        elastic = np.column_stack([self.bend, self.bend, self.twist]) * u
        gradient = elastic - np.einsum("nji,nj->ni", _right_jacobian(u), body)
        gradient[:, self.kinds :] = 0.0
        return gradient, elastic

    def energy(self, nodes: Array, frames: Array, wall: WallForces) -> float:
        """Total energy, N mm."""
        u = self.angles(frames)
        bending = 0.5 * float(np.sum(self.bend * (u[:, 0] ** 2 + u[:, 1] ** 2)))
        twisting = 0.5 * float(np.sum(self.twist * u[:, 2] ** 2))
        return bending + wall.energy + twisting - float(np.sum(self.load * nodes))


def assemble(
    wire: GuideWire, wall: VesselWall | None, depth_mm: float, tip_load_N: ArrayLike = (0.0, 0.0, 0.0)
) -> Chain:
    """The chain of a wire at a depth: a joint owns half of either segment, the clamp half of the first only."""
    k, first = wire.segments_at(depth_mm)
    length = np.full(k, wire.segment_mm)
    length[0] = first
    base_arc = np.concatenate([[0.0], np.cumsum(length)])[:-1]
    outer = depth_mm - np.concatenate([[0.0], base_arc[1:] - 0.5 * length[:-1]])
    inner = depth_mm - (base_arc + 0.5 * length)
    profile = wire.profile
    compliance = _integral(profile.stiffness_at, profile.stiffness, inner, outer, _mean_of_reciprocal)
    rest = _integral(profile.rest_at, profile.rest, inner, outer, lambda p, q: 0.5 * (p + q))
    twist = wire.torsional_stiffness_N_mm2 / (outer - inner) if wire.twists else np.zeros(k)
    load = np.zeros((k + 1, 3))
    load[k] = tip_load_N
    return Chain(wire, wall, length, 1.0 / compliance, twist, rest, load)


def _integral(
    at: Array, value: Array, low: Array, high: Array, mean: Callable[[Array, Array], Array]
) -> Array:
    """Integral (k,) over [low, high] of what has this mean where a piecewise linear function goes from p to q.

    The function is constant beyond its ends; two equal places make a jump.
    """
    cuts = np.concatenate([[min(at[0], low.min()) - 1.0], at, [max(at[-1], high.max()) + 1.0]])
    ends = np.concatenate([[value[0]], value, [value[-1]]])
    total = np.zeros(len(low))
    for (start, stop), (first, last) in zip(pairwise(cuts), pairwise(ends), strict=True):
        a, b = np.maximum(low, start), np.minimum(high, stop)
        on = np.flatnonzero(b > a)
        if on.size:
            slope = (last - first) / (stop - start)
            p, q = first + slope * (a[on] - start), first + slope * (b[on] - start)
            total[on] += (b - a)[on] * mean(p, q)
    return total


def _mean_of_reciprocal(p: Array, q: Array) -> Array:
    """Mean of one over a function that goes from p to q in a straight line: log(q / p) / (q - p)."""
    apart = np.abs(q / p - 1) > 1e-6
    ratio = np.where(apart, q / p, 2.0)
    return np.where(apart, np.log(ratio) / (p * (ratio - 1)), 2.0 / (p + q))


def _right_jacobian(u: Array) -> Array:
    """J (n, 3, 3) with exp(u + du) = exp(u) exp(J du)."""
    angle = np.linalg.norm(u, axis=-1)[:, None, None]
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    one = np.where(small, 0.5 - angle**2 / 24, (1 - np.cos(safe)) / safe**2)
    two = np.where(small, 1 / 6 - angle**2 / 120, (safe - np.sin(safe)) / safe**3)
    hat = np.cross(np.eye(3), u[:, None, :])
    return np.asarray(np.eye(3) - one * hat + two * (hat @ hat))
