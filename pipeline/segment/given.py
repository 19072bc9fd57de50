"""The signed distance of a lumen that the user brings: a label map, a closed surface, or a centreline with radius."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.grids import in_memory_order, lattice_mm, reorder
from pipeline.model import Branches, Lumen, Shapes, Volume
from pipeline.segment._kernels.distance import Owned
from pipeline.segment._kernels.solids import cones, enclosed, splat_triangles
from pipeline.segment._kernels.wall import PAD
from pipeline.segment.closest import find_closest
from pipeline.segment.config import SegmentConfig
from pipeline.segment.labelled import distance_to_labels
from pipeline.segment.levels import GreyLevels, box_from, failed
from pipeline.segment.surface import padded_box, prepare, signed, signed_distance
from solver.grid import Grid

SMOOTHING_TAPS = np.array([0.25, 0.5, 0.25], np.float32)
"""Probabilities are smoothed by 0.7 voxel (and the spline's 0.6) before their half level is taken."""

LABELS_VOXELS, THICK_SLICES, SLICE_SHARE = 0.1, 1.5, 0.2
"""How well a right label map tells the wall, rms in voxels; and where slices are thicker than pixels are wide by more
than a factor, in their distances (docs/howto/scans.md): of 2 mm and 0.4 mm tubes across were 0.41 mm off."""


def _lumen(distance: Grid, note: str) -> Lumen:
    return Lumen(distance, warnings=(note,), counters={"voxels_total": float(distance.values.size)})


def _empty(low: NDArray[Any], high: NDArray[Any], margin: float) -> Grid:
    """An isotropic lattice around the box from ``low`` to ``high``, mm, holding nothing yet."""
    low, size = low - margin, high - low + 2 * margin
    voxel = lattice_mm(size)
    shape = tuple(int(n) for n in np.ceil(size / voxel) + 1)
    return Grid(np.broadcast_to(np.float32(0), shape), np.full(3, voxel), low)


def lumen_from_branches(branches: Branches, config: SegmentConfig) -> Lumen:
    """The union of round cones along a centreline with radius."""
    ends = np.concatenate([branches.start_mm, branches.end_mm])
    thickest = float(max(branches.start_radius_mm.max(), branches.end_radius_mm.max()))
    grid = _empty(ends.min(0) - thickest, ends.max(0) + thickest, config.margin_mm)
    distance = np.full(grid.shape, config.outer_mm, np.float32)
    origin = grid.origin_mm
    cones(
        branches.start_mm - origin, branches.end_mm - origin, branches.start_radius_mm, branches.end_radius_mm,
        grid.spacing_mm, config.outer_mm, distance,
    )  # fmt: skip
    return _lumen(grid.with_values(distance), "the lumen is the union of cones along the given centreline")


def lumen_from_surface(shapes: Shapes, config: SegmentConfig) -> Lumen:
    """What a closed triangle surface encloses."""
    points = shapes.points_mm
    grid = _empty(points.min(0), points.max(0), config.margin_mm)
    corners = np.ascontiguousarray((points - grid.origin_mm)[shapes.triangles])
    spacing = grid.spacing_mm
    voxel = float(spacing[0])
    box = Owned(np.zeros(grid.shape, np.int32), np.zeros(grid.shape, np.uint8), spacing)
    enclosed(corners, spacing, box.inside)
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    corners = np.ascontiguousarray(corners[area > 1e-9 * voxel**2])
    foot = np.zeros((int(8 * area.sum() / voxel**2) + 8 * len(corners) + 1000, 3))
    voxels = splat_triangles(corners, spacing, 1.5 * voxel, box.owner, foot)[:, 0]
    foot = foot[: len(voxels)]
    find_closest(box, voxels, foot, config.outer_mm)
    flat = (foot, np.zeros_like(foot), np.zeros(len(foot)))
    distance = signed(box, flat, config.outer_mm, 0)
    return _lumen(grid.with_values(distance), "the lumen is what the given surface encloses (points taken as LPS mm)")


def lumen_from_labels(labels: Volume, config: SegmentConfig) -> Lumen:
    """Where a map of 0 and 1 is 1, its staircase evened out."""
    grid, axes = in_memory_order(labels)
    corner, padded = padded_box(np.flatnonzero(grid.values.reshape(-1) >= 0.5), grid, config.margin_mm)
    box = box_from(corner, np.array(padded) - 2 * PAD)
    distance = distance_to_labels(grid.values[box] >= 0.5, grid.spacing_mm, config.outer_mm)
    own = Grid(distance, grid.spacing_mm, grid.to_mm(corner), grid.direction)
    widest = float(grid.spacing_mm.max())
    thick = widest > THICK_SLICES * grid.voxel_mm
    share, of = (SLICE_SHARE, "of its thick slices' distance") if thick else (LABELS_VOXELS, "voxel")
    note = (
        "the lumen is the given label map, its staircase evened out: of a right one the wall is known to about "
        f"{share * widest:.2f} mm ({share:g} {of}); that of a closed surface is known better"
    )
    return _lumen(reorder(own, axes), note)


def lumen_from_probabilities(share: Volume, config: SegmentConfig) -> Lumen:
    """A map of probabilities 0..1; the wall is the half level after light smoothing."""
    grid, axes = in_memory_order(share)
    order = np.flatnonzero(grid.values.reshape(-1) >= 0.5)
    site = prepare(grid, order, SMOOTHING_TAPS, config.margin_mm)
    values = signed_distance(site, GreyLevels(1.0, 0.0, 0.0, (0.0,)), config.outer_mm).values
    distance = reorder(site.grid.with_values(values), axes)
    return _lumen(distance, "the wall of the lumen is where the given probabilities are a half")


def given_lumen(given: Branches | Shapes | Volume, config: SegmentConfig) -> Lumen:
    """The lumen that is the union of cones, or inside a closed surface, or where a map is above 0.5.

    Raises StageError (SEGMENT_FAILED) where a map has no wall, as it is full or empty.
    """
    if isinstance(given, Branches):
        return lumen_from_branches(given, config)
    if isinstance(given, Shapes):
        return lumen_from_surface(given, config)
    inside = given.values >= 0.5
    if (count := np.count_nonzero(inside)) in (0, inside.size):
        got, allowed = f"a lumen of {count} of the map's {inside.size} voxels", "one with something around it"
        raise failed(got, allowed, "check the label, the level and how the map was made")
    binary = np.array_equal(given.values, inside)
    return lumen_from_labels(given, config) if binary else lumen_from_probabilities(given, config)
