"""Energy and moment balance of a chain, assembled a second time from what a solution publishes.

Nothing here shares code with the minimiser: joint angles are read back from the frames by a logarithm, forces are
summed from the tip to the clamp, and only the interpolated distance itself is the wall's own.
The wall is looked up at the joints (trapezium rule, half a weight at either end); friction is no part of it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from solver import GuideWire, VesselWall
from solver.at_entry import AROUND

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StaticChain:
    """A wire of k joints at one depth, with its wall and a dead load (k + 1, 3) on its nodes, N.

    length (k,) of the segments; bend and twist (k,): stiffness of the joints; rest (k,): their rest bend, rad, about
    material axis 2.     kinds : how many of a joint's angles are free: bend, bend and, where torsion is not
    rigid, twist.
    States are nodes (k + 1, 3) mm and frames (k + 1, 3, 3), as a solution publishes them.
    """

    wire: GuideWire
    wall: VesselWall | None
    length: Array
    bend: Array
    twist: Array
    rest: Array
    load: Array
    kinds: int

    def angles(self, frames: Array) -> Array:
        """Joint angles (k, 3) beyond the rest bend, rad, in the material frame: log of Rᵀ R', less that bend."""
        turn = Rotation.from_matrix(np.einsum("nji,njk->nik", frames[:-1], frames[1:]))
        return np.asarray(turn.as_rotvec() - self.at_rest)

    @property
    def at_rest(self) -> Array:
        """Joint angles (k, 3) of the wire at rest, rad."""
        return np.outer(self.rest, [0.0, 1.0, 0.0])

    def roll_out(self, angles: Array, base: Array, frame: Array) -> tuple[Array, Array]:
        """Nodes and frames of the chain with these joint angles (k, 3), clamped at ``base`` in ``frame``."""
        k = len(self.length)
        nodes, frames = np.empty((k + 1, 3)), np.empty((k + 1, 3, 3))
        nodes[0], frames[0] = base, frame
        turn = Rotation.from_rotvec(self.at_rest + angles).as_matrix()
        for j in range(k):
            frames[j + 1] = frames[j] @ turn[j]
            nodes[j + 1] = nodes[j] + self.length[j] * frames[j + 1, :, 2]
        return nodes, frames

    def contact(self, nodes: Array, frames: Array) -> tuple[Array, Array, float]:
        """Force and moment about the origin on each node, (k + 1, 3), N and N mm, and energy: ½ k w d² at the joints.

        The wall is looked up afresh; w is half of either segment, at the clamp of the first one.
        """
        wall, reach, k = self.wall, self.wire.radius_mm, len(self.length)
        force, moment, points, count = np.zeros_like(nodes), np.zeros_like(nodes), nodes[1:], 1
        if wall is None:
            return force, moment, 0.0
        if wall.samples:
            count, angle = wall.samples, 2 * np.pi * np.arange(wall.samples)[:, None] / wall.samples
            first, second = frames[1:, None, :, 0], frames[1:, None, :, 1]
            across = np.cos(angle) * first + np.sin(angle) * second
            points, reach = (nodes[1:, None] + reach * across).reshape(-1, 3), 0.0
        phi, gradient, _ = wall.look_up(points)
        depth = np.maximum(phi + reach, 0.0)
        weight = 0.5 * (self.length + np.append(self.length[1:], 0.0))
        stiffness = wall.stiffness_N_mm2 * np.repeat(weight, count) / count
        each, node = -(stiffness * depth)[:, None] * gradient, np.repeat(np.arange(1, k + 1), count)
        np.add.at(force, node, each)
        np.add.at(moment, node, np.cross(points, each))
        force[0], held = self._at_clamp(nodes[0], frames[0])
        return force, moment, held + float(0.5 * np.sum(stiffness * depth**2))

    def _at_clamp(self, node: Array, frame: Array) -> tuple[Array, float]:
        """Force and energy of the wall on the half segment that is held; a sampled hull is a whole circle there."""
        assert self.wall is not None
        # as many as the solver's: where the hull just touches, other points change what is held by 4e-6 of it
        angle = np.linspace(0.0, 2 * np.pi, AROUND, endpoint=False)[:, None]
        ring = np.cos(angle) * frame[:, 0] + np.sin(angle) * frame[:, 1]
        points, reach = (node + self.wire.radius_mm * ring, 0.0) if self.wall.samples else (node, self.wire.radius_mm)
        phi, gradient, _ = self.wall.look_up(points)
        depth, weight = np.maximum(phi + reach, 0.0), 0.5 * self.length[0] * self.wall.stiffness_N_mm2
        return -weight * np.mean(depth[:, None] * gradient, axis=0), float(0.5 * weight * np.mean(depth**2))

    def moments(
        self, nodes: Array, frames: Array, contact_N: Array | None = None, held_mm: Array | None = None
    ) -> tuple[Array, Array]:
        """Energy gradient (k, 3) by the joint angles, N mm, and the elastic moments (k, 3) that it balances.

        Turning all that lies beyond joint j by δ moves its points by δ × (x - x_j): the gradient is c u_j plus the
        moment of the forces beyond, taken into the material frame and through the right Jacobian of exp.
        Rows hold bend, bend, twist; the twist row is 0 where torsion is rigid.
        contact_N : the wall's forces (k + 1, 3) on the nodes, where they are known better than by a look-up.
        held_mm : (k + 1, 3), where they act if not at the nodes.
        """
        if contact_N is None:
            force, moment, _ = self.contact(nodes, frames)
        else:
            force, moment = contact_N, np.cross(nodes if held_mm is None else held_mm, contact_N)
        force, moment = force + self.load, moment + np.cross(nodes, self.load)
        force, moment = np.cumsum(force[::-1], axis=0)[::-1], np.cumsum(moment[::-1], axis=0)[::-1]
        # forces on node j itself have no lever at joint j, so the sum may start at j + 1
        about = moment[1:] - np.cross(nodes[:-1], force[1:])
        body = np.einsum("nji,nj->ni", frames[1:], about)
        u = self.angles(frames)
        elastic = np.column_stack([self.bend, self.bend, self.twist]) * u
        gradient = elastic - np.einsum("nji,nj->ni", _right_jacobian(self.at_rest + u), body)
        gradient[:, self.kinds :] = 0.0
        return gradient, elastic

    def energy(self, nodes: Array, frames: Array) -> float:
        """Total energy, N mm; the loads' is counted from the entry."""
        u = self.angles(frames)
        bending = 0.5 * float(np.sum(self.bend * (u[:, 0] ** 2 + u[:, 1] ** 2)))
        twisting = 0.5 * float(np.sum(self.twist * u[:, 2] ** 2))
        return bending + self.contact(nodes, frames)[2] + twisting - float(np.sum(self.load * (nodes - nodes[0])))


def assemble(
    wire: GuideWire, wall: VesselWall | None, depth_mm: float, tip_load_N: ArrayLike = (0.0, 0.0, 0.0)
) -> StaticChain:
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
    kinds = 3 if wire.twists else 2
    return StaticChain(wire, wall, length, 1.0 / compliance, twist, rest, load, kinds)


def _integral(at: Array, value: Array, low: Array, high: Array, mean: Callable[[Array, Array], Array]) -> Array:
    """Integral (k,) over [low, high] of a function whose mean is ``mean(p, q)`` where a profile goes from p to q.

    The profile is piecewise linear and constant beyond its ends; two equal places make a jump.
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
