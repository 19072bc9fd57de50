"""A wire cut into edges, and the shape that its nodes give it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from data_synthetic.anatomy.iso_wall import IsoWall
from data_synthetic.anatomy.tubes import Anatomy
from data_synthetic.geometry import Array, ends_of
from data_synthetic.rod._kernels import Elastic, Shape, add_blocks, carry

ELASTIC_SLIP_MM = 2e-3
"""A slider gives by this much before it slips: a fifth of the truth's own accuracy of 0.01 mm."""


@dataclass(frozen=True, eq=False)
class Sliders:
    """What friction holds the nodes by: limit (n + 1,), mu N in newton; the wall's normal and an anchor (n + 1, 3)."""

    limit: Array
    normal: Array
    anchor: Array

    @staticmethod
    def under(coefficient: float, contact_N: Array, anchor: Array) -> "Sliders":
        """The sliders under given forces (n + 1, 3) of the wall."""
        load = np.linalg.norm(contact_N, axis=1)
        return Sliders(coefficient * load, contact_N / np.maximum(load, 1e-300)[:, None], anchor)

    def stretch(self, points: Array) -> Array:
        """Tangential vectors (n + 1, 3) from anchors to nodes."""
        away = points - self.anchor
        return np.asarray(away - np.sum(away * self.normal, axis=1)[:, None] * self.normal)

    def energy(self, points: Array) -> float:
        """Quadratic up to the elastic slip, linear beyond; N mm."""
        size = np.linalg.norm(self.stretch(points), axis=1)
        held = np.where(size < ELASTIC_SLIP_MM, 0.5 * size**2 / ELASTIC_SLIP_MM, size - 0.5 * ELASTIC_SLIP_MM)
        return float(self.limit @ held)

    def add(self, points: Array, gradient: Array, bands: Array) -> None:
        """Add gradient and Hessian of ``energy``; node 0 is clamped."""
        stretch = self.stretch(points)
        size = np.linalg.norm(stretch, axis=1)
        slides = size > ELASTIC_SLIP_MM
        stiffness = self.limit / np.maximum(size, ELASTIC_SLIP_MM)
        gradient.reshape(-1, 4)[:, 1:] += (stiffness[:, None] * stretch)[1:]
        along = np.where(slides[:, None], stretch / np.maximum(size, ELASTIC_SLIP_MM)[:, None], 0.0)
        block = np.eye(3) - self.normal[:, :, None] * self.normal[:, None, :] - along[:, :, None] * along[:, None, :]
        nodes = np.arange(len(points))
        add_blocks(bands, nodes, nodes, block * stiffness[:, None, None])


Profile = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class TrueWire:
    """A guide wire. Profiles are (distance from the tip mm, value) knots, linear between, constant beyond.

    bending : EI in N mm2.     rest_curvature : 1/mm towards material axis 1.     torsional : GJ in N mm2; the
    rod needs a finite one, and ``RIGID_TORSION_N_MM2`` stands in for inf.     axial : EA in N.
    """

    radius_mm: float = 0.18
    bending_N_mm2: Profile = ((0.0, 0.5), (10.0, 0.5), (30.0, 1.5), (80.0, 4.0))
    rest_curvature_per_mm: Profile = ((0.0, 0.12), (8.0, 0.12), (8.0, 0.0))
    torsional_N_mm2: float = float("inf")
    axial_N: float = 2.0e4


RIGID_TORSION_N_MM2 = 1.0e4
"""Stands in for infinite GJ: a tip torque of 0.05 N mm turns 100 mm of it by 5e-4 rad, 0.005 mm at a 10 mm hook."""


def cell_means(profile: Sequence[tuple[float, float]], low: Array, high: Array) -> Array:
    """Mean of a piecewise linear profile over cells [low, high] (n,), jumps (repeated knots) integrated exactly."""
    knots = np.array(profile, dtype=np.float64)
    place, value = knots[:, 0], knots[:, 1]
    integral = ends_of(0.5 * (value[1:] + value[:-1]) * np.diff(place))

    def antiderivative(s: Array) -> Array:
        inside = np.clip(s, place[0], place[-1])
        k = np.clip(np.searchsorted(place, inside, side="right") - 1, 0, max(len(place) - 2, 0))
        width = np.diff(place, append=place[-1] + 1.0)[k]
        slope = np.where(width > 0, np.diff(value, append=value[-1])[k] / np.where(width > 0, width, 1.0), 0.0)
        u = inside - place[k]
        middle = integral[k] + value[k] * u + 0.5 * slope * u * u
        return np.asarray(middle + (s - inside) * np.where(s > place[-1], value[-1], value[0]))

    return np.asarray((antiderivative(high) - antiderivative(low)) / (high - low))


TIP_REFINEMENT, TIP_EDGES = 8, 2
"""The last two edges are cut into eight each, to resolve the run over which a pushed tip touches."""


Wall = Anatomy | IsoWall
"""What a wire is pushed against."""


@dataclass(frozen=True, eq=False)
class Rod:
    """A wire cut into n edges with n + 1 nodes, node 0 at the entry: everything that stays while it relaxes.

    director (3,) : of the introducer.     loads_N (n + 1, 3) : dead loads on the nodes.     sliders : friction's.
    """

    elastic: Elastic
    director: Array
    radius_mm: float
    wall: Wall | None = None
    stiffness_N_mm2: float = 0.0
    loads_N: Array | None = None
    sliders: Sliders | None = None

    @property
    def lengths(self) -> Array:
        """Of the edges (n,) at rest, mm."""
        return self.elastic.lengths


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
    return Rod(Elastic(direction, lengths, bend, rest, twist, wire.axial_N), director, wire.radius_mm)


def shape_from_points(rod: Rod, points: Array) -> Shape:
    """The twist-free shape through given nodes."""
    points = np.ascontiguousarray(points)
    tangents, directors = np.empty_like(points), np.empty_like(points)
    tangents[0], directors[0] = rod.elastic.introducer, rod.director
    carry(points, np.zeros(len(points) - 1), tangents, directors, True)
    return Shape(points, tangents, directors)
