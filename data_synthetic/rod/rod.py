"""Equilibrium of a clamped, stretchable Kirchhoff rod against a wall: Newton's method on node positions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, solveh_banded

from data_synthetic.rod import _kernels as kernels
from data_synthetic.rod.contact import Wall, add_wall, wall_energy
from data_synthetic.rod.wire import RIGID_TORSION_N_MM2, TrueWire, cell_means

Array = NDArray[np.float64]

LONGEST_MOVE_MM = 0.15
"""Most that a node may move in one Newton step: below a wire radius, so that no step jumps a wall."""

TIP_REFINEMENT, TIP_EDGES = 8, 2
"""The last two edges are cut into eight each, to resolve the run over which a pushed tip touches."""


class Extra(Protocol):
    """A further energy of the nodes: friction's sliders."""

    def energy(self, points: Array) -> float:
        """N mm."""
        ...

    def add(self, points: Array, gradient: Array, bands: Array) -> None:
        """Add gradient (4n,) and lower-band Hessian."""
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
    sliders: Extra | None = None


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
        total += wall_energy(rod, rod.wall, points)
    if rod.sliders is not None:
        total += rod.sliders.energy(points)
    if rod.loads_N is not None:
        total -= float(np.sum(rod.loads_N * points))
    return total


def _system(rod: Rod, shape: Shape, gradient: Array, bands: Array) -> Array:
    """Fill gradient and Hessian; returns the wall's force on every node (n + 1, 3)."""
    angles = np.zeros(len(rod.lengths))
    kernels.elastic_system(shape.points, angles, *_elastic(rod, shape), gradient, bands)
    if rod.loads_N is not None:
        gradient.reshape(-1, 4)[:, 1:] -= rod.loads_N[1:]
    if rod.sliders is not None:
        rod.sliders.add(shape.points, gradient, bands)
    if rod.wall is None:
        return np.zeros_like(shape.points)
    return add_wall(rod, rod.wall, shape.points, gradient, bands)


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
