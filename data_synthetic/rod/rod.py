"""A wire cut into edges, and the shape that its nodes give it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from data_synthetic.geometry.vectors import Array, ends_of
from data_synthetic.rod import _kernels as kernels
from data_synthetic.rod.wire import RIGID_TORSION_N_MM2, TrueWire, cell_means

TIP_REFINEMENT, TIP_EDGES = 8, 2
"""The last two edges are cut into eight each, to resolve the run over which a pushed tip touches."""


class Wall(Protocol):
    """Anything that gives a signed distance (n,) and its gradient (n, 3) at points (n, 3), negative inside."""

    def distance_and_gradient(self, points_mm: Array) -> tuple[Array, Array]:
        """Signed distance and gradient."""
        ...


class NodeEnergy(Protocol):
    """A further energy of the nodes: friction's sliders."""

    def energy(self, points: Array) -> float:
        """N mm."""
        ...

    def add(self, points: Array, gradient: Array, bands: Array) -> None:
        """Add gradient (4n,) and lower-band Hessian."""
        ...


@dataclass(frozen=True, eq=False)
class Rod:
    """A wire cut into n edges with n + 1 nodes, node 0 at the entry: everything that stays while it relaxes.

    direction, director (3,) : of the introducer.     lengths (n,) : of the edges, mm.
    bend, rest, twist (n,), axial : as in ``kernels.Elastic``.     loads_N (n + 1, 3) : dead loads on the nodes.
    """

    direction: Array
    director: Array
    lengths: Array
    bend: Array
    rest: Array
    twist: Array
    axial: float
    radius_mm: float
    wall: Wall | None = None
    stiffness_N_mm2: float = 0.0
    loads_N: Array | None = None
    sliders: NodeEnergy | None = None


@dataclass(frozen=True, eq=False)
class Shape:
    """Nodes (n + 1, 3), tangents and directors (n + 1, 3) of the introducer and the n edges."""

    points: Array
    tangents: Array
    directors: Array


def edge_lengths(depth_mm: float, step_mm: float) -> Array:
    """Edges counted from the tip: fine ones, then ``step_mm``; the first takes what is left, half to 1.5 steps.

    A tip pushed by F at an angle a touches over sqrt(2 F / (k a)), 0.05 to 0.2 mm: nodes must be closer there.
    """
    fine = np.full(TIP_REFINEMENT * TIP_EDGES, step_mm / TIP_REFINEMENT)
    rest = depth_mm - TIP_EDGES * step_mm
    whole = max(int((rest - 0.5 * step_mm) / step_mm), 0)
    return np.concatenate([[rest - whole * step_mm], np.full(whole, step_mm), fine])


def make_rod(wire: TrueWire, direction: Array, director: Array, depth_mm: float, step_mm: float) -> Rod:
    """Cut a wire inserted to ``depth_mm`` into edges of ``step_mm``; the clamp owns half a cell."""
    lengths = edge_lengths(depth_mm, step_mm)
    ends = ends_of(lengths)
    middle = 0.5 * (ends[1:] + ends[:-1])
    low = np.concatenate([[0.0], middle[:-1]])
    cells = middle - low
    from_tip = depth_mm - middle, depth_mm - low
    bend = cell_means(wire.bending_N_mm2, *from_tip) / cells
    rest = cell_means(wire.rest_curvature_per_mm, *from_tip) * cells
    twist = min(wire.torsional_N_mm2, RIGID_TORSION_N_MM2) / cells
    return Rod(direction, director, lengths, bend, rest, twist, wire.axial_N, wire.radius_mm)


def shape_from_points(rod: Rod, points: Array) -> Shape:
    """The twist-free shape through given nodes."""
    points = np.ascontiguousarray(points)
    tangents, directors = np.empty_like(points), np.empty_like(points)
    tangents[0], directors[0] = rod.direction, rod.director
    kernels.twist_free(points, tangents, directors)
    return Shape(points, tangents, directors)
