"""Equilibrium of a clamped, stretchable Kirchhoff rod against a wall: Newton's method on node positions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, solveh_banded

from data_synthetic import _rod_kernels as kernels
from data_synthetic.wire import RIGID_TORSION_N_MM2, TrueWire, cell_means

Array = NDArray[np.float64]

LONGEST_MOVE_MM = 0.15
"""Most that a node may move in one Newton step: below a wire radius, so that no step jumps a wall."""

TIP_REFINEMENT, TIP_EDGES = 8, 2
"""The last two edges are cut into eight each, to resolve the run over which a pushed tip touches."""

CURVATURE_STEP_MM = 1e-4
"""Step of the central difference of the wall's gradient; its Hessian is only needed to a few digits."""


class Wall(Protocol):
    """Anything that gives a signed distance (n,) and its gradient (n, 3) at points (n, 3), negative inside."""

    def distance_and_gradient(self, points_mm: Array) -> tuple[Array, Array]:
        """Signed distance and gradient."""
        ...


@dataclass(frozen=True, eq=False)
class Rod:
    """A wire cut into edges: everything that stays while it relaxes. n edges, n + 1 nodes, node 0 at the entry."""

    entry_mm: Array
    direction: Array
    director: Array
    lengths: Array
    cells: Array
    bend: Array
    rest: Array
    twist: Array
    axial: float
    radius_mm: float
    wall: Wall | None = None
    stiffness_N_mm2: float = 0.0
    loads_N: Array | None = None


@dataclass(frozen=True, eq=False)
class Shape:
    """Nodes (n + 1, 3), tangents and directors (n + 1, 3) of the introducer and the n edges."""

    points: Array
    tangents: Array
    directors: Array


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """A relaxed shape with the largest unbalanced nodal force, the wall's force on every node, and the effort."""

    shape: Shape
    residual_N: float
    contact_N: Array
    energy_N_mm: float
    iterations: int


def edge_lengths(depth_mm: float, step_mm: float) -> Array:
    """Edges counted from the tip: fine ones, then ``step_mm``; the first takes what is left, half to 1.5 steps.

    A tip pushed by F at an angle a touches over sqrt(2 F / (k a)), 0.05 to 0.2 mm: nodes must be closer there.
    """
    fine = np.full(TIP_REFINEMENT * TIP_EDGES, step_mm / TIP_REFINEMENT)
    rest = depth_mm - TIP_EDGES * step_mm
    whole = max(int((rest - 0.5 * step_mm) / step_mm), 0)
    return np.concatenate([[rest - whole * step_mm], np.full(whole, step_mm), fine])


def make_rod(
    wire: TrueWire,
    entry: Array,
    direction: Array,
    director: Array,
    depth_mm: float,
    step_mm: float,
    **extra: object,
) -> Rod:
    """Cut a wire inserted to ``depth_mm`` into edges of ``step_mm``; the clamp owns half a cell."""
    lengths = edge_lengths(depth_mm, step_mm)
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    middle = 0.5 * (ends[1:] + ends[:-1])
    low, high = np.concatenate([[0.0], middle[:-1]]), middle
    cells = high - low
    from_tip = depth_mm - high, depth_mm - low
    stiffness = cell_means(wire.bending_N_mm2, *from_tip)
    rest = cell_means(wire.rest_curvature_per_mm, *from_tip)
    torsion = min(wire.torsional_N_mm2, RIGID_TORSION_N_MM2)
    return Rod(
        entry,
        direction,
        director,
        lengths,
        np.append(0.5 * (lengths[:-1] + lengths[1:]), 0.5 * lengths[-1]),
        stiffness / cells,
        rest * cells,
        torsion / cells,
        wire.axial_N,
        wire.radius_mm,
        **extra,  # type: ignore[arg-type]
    )


def shape_from_points(rod: Rod, points: Array) -> Shape:
    """The twist-free shape through given nodes."""
    points = np.ascontiguousarray(points)
    tangents, directors = np.empty_like(points), np.empty_like(points)
    tangents[0], directors[0] = rod.direction, rod.director
    kernels.twist_free(points, tangents, directors)
    return Shape(points, tangents, directors)


def relax(rod: Rod, start: Shape, force_N: float, max_iterations: int = 400) -> Equilibrium:
    """Newton's method with a Levenberg shift where the Hessian is not positive definite, to ``force_N``."""
    shape, shift = start, 0.0
    n = len(rod.lengths)
    gradient, bands = np.empty(4 * n), np.empty((kernels.BANDS, 4 * n))
    energy = _energy(rod, shape, shape.points, np.zeros(n))
    residual, contact, count = np.inf, np.zeros((n + 1, 3)), 0
    for count in range(max_iterations):  # noqa: B007 - the count is reported
        contact = _system(rod, shape, gradient, bands)
        residual = float(np.abs(gradient).max())
        if residual < force_N:
            break
        step, shift = _newton_step(gradient, bands, shift)
        moved = _line_search(rod, shape, energy, gradient, step)
        if moved is None:
            if shift > 1e6:
                break
            shift = max(10.0 * shift, 1e-3)
            continue
        shape, energy, share = moved
        shift = shift * 0.2 if share > 0.5 and shift > 1e-6 else (0.0 if share > 0.5 else shift)
    return Equilibrium(shape, residual, contact, energy, count)


def _elastic(rod: Rod, shape: Shape) -> tuple[Array, Array, Array, Array, Array, Array, float, Array]:
    return (
        rod.direction,
        shape.tangents,
        shape.directors,
        rod.bend,
        rod.rest,
        rod.twist,
        rod.axial,
        rod.lengths,
    )


def _energy(rod: Rod, shape: Shape, points: Array, angles: Array) -> float:
    total = float(kernels.elastic_energy(points, angles, *_elastic(rod, shape)))
    if rod.wall is not None:
        depth = np.maximum(rod.wall.distance_and_gradient(points[1:])[0] + rod.radius_mm, 0.0)
        total += 0.5 * rod.stiffness_N_mm2 * float(rod.cells @ depth**2)
    if rod.loads_N is not None:
        total -= float(np.sum(rod.loads_N * points))
    return total


def _system(rod: Rod, shape: Shape, gradient: Array, bands: Array) -> Array:
    """Fill gradient and Hessian; returns the wall's force on every node (n + 1, 3)."""
    angles = np.zeros(len(rod.lengths))
    kernels.elastic_system(shape.points, angles, *_elastic(rod, shape), gradient, bands)
    if rod.loads_N is not None:
        gradient.reshape(-1, 4)[:, 1:] -= rod.loads_N[1:]
    contact = np.zeros_like(shape.points)
    if rod.wall is not None:
        contact[1:] = -_add_wall(rod, rod.wall, shape.points, gradient, bands)
    return contact


def _add_wall(rod: Rod, wall: Wall, points: Array, gradient: Array, bands: Array) -> Array:
    """Add the wall's gradient (n, 3), which is returned, and Hessian k w (n n' + d grad grad phi)."""
    phi, normal = wall.distance_and_gradient(points[1:])
    depth = np.maximum(phi + rod.radius_mm, 0.0)
    weight = rod.stiffness_N_mm2 * rod.cells
    force = (weight * depth)[:, None] * normal
    gradient.reshape(-1, 4)[:, 1:] += force
    touching = np.flatnonzero(depth > 0)
    if len(touching):
        block = np.einsum("na,nb->nab", normal[touching], normal[touching])
        block += depth[touching, None, None] * _wall_curvature(wall, points[1:][touching])
        block *= weight[touching, None, None]
        for a in range(3):
            for b in range(a + 1):
                bands[a - b, 4 * touching + 1 + b] += block[:, a, b]
    return force


def _wall_curvature(wall: Wall, points: Array) -> Array:
    """Hessian (n, 3, 3) of the signed distance."""
    offsets = CURVATURE_STEP_MM * np.concatenate([np.eye(3), -np.eye(3)])
    stencil = (points[None] + offsets[:, None]).reshape(-1, 3)
    g = wall.distance_and_gradient(stencil)[1].reshape(6, len(points), 3)
    hessian = np.moveaxis((g[:3] - g[3:]) / (2.0 * CURVATURE_STEP_MM), 0, 1)
    return np.asarray(0.5 * (hessian + np.swapaxes(hessian, 1, 2)))


def _newton_step(gradient: Array, bands: Array, shift: float) -> tuple[Array, float]:
    """The step and the shift (N/mm) that made the Hessian positive definite."""
    while True:
        trial = bands.copy()
        trial[0] += shift
        try:
            return np.asarray(solveh_banded(trial, -gradient, lower=True, check_finite=False)), shift
        except LinAlgError:
            shift = max(4.0 * shift, 1e-3)


def _line_search(
    rod: Rod, shape: Shape, energy: float, gradient: Array, step: Array
) -> tuple[Shape, float, float] | None:
    """The first shortened step that lowers the energy enough; None when none does."""
    move = step.reshape(-1, 4)
    longest = float(np.max(np.linalg.norm(move[:, 1:], axis=1)))
    share = min(1.0, LONGEST_MOVE_MM / longest) if longest > 0 else 1.0
    slope = float(gradient @ step)
    # rounding of the energy: below this a Newton step is taken on trust
    noise = 1e-13 * (abs(energy) + 1.0)
    while share > 1e-6:
        points = shape.points.copy()
        points[1:] += share * move[:, 1:]
        angles = np.ascontiguousarray(share * move[:, 0])
        trial = _energy(rod, shape, points, angles)
        if trial <= energy + 1e-4 * share * slope + noise:
            tangents, directors = shape.tangents.copy(), shape.directors.copy()
            kernels.update_directors(points, angles, rod.direction, tangents, directors)
            return Shape(points, tangents, directors), trial, share
        share *= 0.5
    return None
