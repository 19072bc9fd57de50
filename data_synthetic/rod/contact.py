"""The wall's push on a rod, integrated along every edge that may touch, not only at its nodes.

A wire bears on a crest (an aneurysm's neck, a fork) over sqrt(2 d rho), 0.2 to 0.3 mm: summed over nodes as far apart
as that, the wall's energy would depend on where the nodes happen to lie, and the truth would converge in first order.
"""

from typing import NamedTuple

import numpy as np

from data_synthetic.geometry import Array, Index
from data_synthetic.rod._kernels import add_blocks
from data_synthetic.rod.rod import Rod, Wall

PLACES, WEIGHTS = (0.5 * (v + shift) for v, shift in zip(np.polynomial.legendre.leggauss(4), (1.0, 0.0), strict=True))
"""Gauss points of an edge, as shares of it, and their weights, which add up to one."""
STEEPEST = 1.1
"""Largest slope of a signed distance: 1 for the analytic anatomy, a little more for a spline through distances."""
CURVATURE_STEP_MM = 1e-4
"""Step of the central difference of the wall's gradient; its Hessian is only needed to a few digits."""


class Near(NamedTuple):
    """Edges (m,) that may touch, the Gauss points (4 m, 3) on them, signed distance (4 m,) and gradient there."""

    edges: Index
    samples: Array
    phi: Array
    normal: Array


def near_wall(rod: Rod, wall: Wall, points: Array) -> Near:
    """Where nodes (n + 1, 3) lie to the wall: energy and forces of one shape are both made of it."""
    edges = _near(rod, wall, points)
    samples = _samples(points, edges)
    return Near(edges, samples, *wall.distance_and_gradient(samples))


def wall_energy(rod: Rod, near: Near) -> float:
    """Energy of the wall, N mm: half k d squared per mm of wire that lies d mm too deep in it."""
    depth = np.maximum(near.phi + rod.radius_mm, 0.0)
    weight = np.repeat(rod.lengths[near.edges], len(PLACES)) * np.tile(WEIGHTS, len(near.edges))
    return 0.5 * rod.stiffness_N_mm2 * float(weight @ depth**2)


def add_wall(rod: Rod, wall: Wall, near: Near, gradient: Array, bands: Array) -> Array:
    """Add the wall's gradient and Hessian k w (n n' + d grad grad phi); returns its force on every node (n + 1, 3)."""
    edges, samples, phi, normal = near
    force = np.zeros((len(rod.lengths) + 1, 3))
    touching = np.flatnonzero(phi + rod.radius_mm > 0)
    if not len(touching):
        return force
    place = np.tile(PLACES, len(edges))[touching]
    edge = np.repeat(edges, len(PLACES))[touching]
    weight = rod.stiffness_N_mm2 * rod.lengths[edge] * np.tile(WEIGHTS, len(edges))[touching]
    normal, depth = normal[touching], (phi + rod.radius_mm)[touching]
    push = (weight * depth)[:, None] * normal
    shares = {0: 1.0 - place, 1: place}
    for end, share in shares.items():
        np.add.at(force, edge + end, -share[:, None] * push)
    gradient.reshape(-1, 4)[:, 1:] -= force[1:]
    block = depth[:, None, None] * _curvature(wall, samples[touching])
    block += np.einsum("na,nb->nab", normal, normal)
    block *= weight[:, None, None]
    for low, high in ((0, 0), (1, 1), (0, 1)):
        add_blocks(bands, edge + low, edge + high, block * (shares[low] * shares[high])[:, None, None])
    return force


def _near(rod: Rod, wall: Wall, points: Array) -> Index:
    """Edges that may touch: a distance rises by at most STEEPEST per mm, so the others cannot."""
    phi = wall.distance_and_gradient(points)[0]
    most = 0.5 * (phi[1:] + phi[:-1] + STEEPEST * rod.lengths)
    return np.flatnonzero(most + rod.radius_mm > 0)


def _samples(points: Array, edges: Index) -> Array:
    """The Gauss points (4 m, 3) of edges (m,)."""
    start, along = points[edges], points[edges + 1] - points[edges]
    return np.asarray((start[:, None] + PLACES[None, :, None] * along[:, None]).reshape(-1, 3))


def _curvature(wall: Wall, points: Array) -> Array:
    """Hessian (n, 3, 3) of the signed distance."""
    offsets = CURVATURE_STEP_MM * np.concatenate([np.eye(3), -np.eye(3)])
    stencil = (points[None] + offsets[:, None]).reshape(-1, 3)
    g = wall.distance_and_gradient(stencil)[1].reshape(6, len(points), 3)
    hessian = np.moveaxis((g[:3] - g[3:]) / (2.0 * CURVATURE_STEP_MM), 0, 1)
    return np.asarray(0.5 * (hessian + np.swapaxes(hessian, 1, 2)))
