"""A wire cut into edges, and the shape that its nodes give it."""

from dataclasses import dataclass

import numpy as np

from data_synthetic.anatomy.iso_wall import IsoWall
from data_synthetic.anatomy.tubes import Anatomy
from data_synthetic.geometry import Array, ends_of
from data_synthetic.rod._kernels import Elastic, Shape, carry
from data_synthetic.rod.sliders import Sliders
from data_synthetic.rod.wire import RIGID_TORSION_N_MM2, TrueWire, cell_means

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
