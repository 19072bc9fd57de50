"""The user's own lumen instead of segment: a label map, a closed surface, or a centreline with radius."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.axis_order import in_memory_order, reorder
from pipeline.load import LoadError, load, read_header
from pipeline.load.centrelines import Branches, read_markups_branches, read_swc
from pipeline.load.surfaces import RAS_TO_LPS, Shapes, read_stl, read_vtp
from pipeline.model import Lumen
from pipeline.segment._kernels.distance import propagate
from pipeline.segment._kernels.solids import cones, enclosed, splat_triangles
from pipeline.segment.config import SegmentConfig
from pipeline.segment.levels import GreyLevels
from pipeline.segment.surface import prepare, signed, signed_distance
from solver.grid import Grid

VOXEL_MM = 0.3
"""Lattice of a lumen that comes without one; coarser where the box would hold more than MOST_VOXELS."""
MOST_VOXELS = 60e6
LABEL_TAPS = np.array([0.25, 0.5, 0.25], np.float32)
"""A label map's staircase is smoothed by 0.7 voxel (and the spline's 0.6) before its half level is taken."""


def _lumen(distance: Grid, note: str) -> Lumen:
    mask = distance.with_values((distance.values < 0).astype(np.uint8))
    return Lumen(distance, mask, warnings=(note,), counters={"voxels_total": float(distance.values.size)})


def _empty(low: NDArray[Any], high: NDArray[Any], margin: float) -> Grid:
    """An isotropic lattice around the box from ``low`` to ``high``, mm, holding nothing yet."""
    low, size = low - margin, high - low + 2 * margin
    voxel = max(VOXEL_MM, float(np.cbrt(np.prod(size) / MOST_VOXELS)))
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


def lumen_from_surface(shapes: Shapes, path: Path, config: SegmentConfig) -> Lumen:
    """What a closed triangle surface encloses."""
    points = shapes.points_mm * RAS_TO_LPS if shapes.ras else shapes.points_mm
    edges = np.sort(shapes.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    open_edges = int(np.sum(np.unique(edges, axis=0, return_counts=True)[1] % 2)) if len(edges) else -1
    if open_edges:
        got = "no triangles" if open_edges < 0 else f"{open_edges} open edges"
        msg = f"{path}: got {got}; expected a closed surface; cap the vessel's ends (3D Slicer: Surface Toolbox)"
        raise LoadError(msg)
    grid = _empty(points.min(0), points.max(0), config.margin_mm)
    corners = np.ascontiguousarray((points - grid.origin_mm)[shapes.triangles])
    spacing = np.asarray(grid.spacing_mm)
    voxel = float(spacing[0])
    inside, owner = np.zeros(grid.shape, np.uint8), np.zeros(grid.shape, np.int32)
    enclosed(corners, spacing, inside)
    area = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    corners = np.ascontiguousarray(corners[area > 1e-9 * voxel**2])
    foot = np.zeros((int(8 * area.sum() / voxel**2) + 8 * len(corners) + 1000, 3))
    voxels = splat_triangles(corners, spacing, 1.5 * voxel, owner, foot)[:, 0]
    foot = foot[: len(voxels)]
    propagate(owner, inside, spacing, voxels, foot, config.outer_mm)
    flat = (foot, np.zeros_like(foot), np.zeros(len(foot)))
    distance = signed(owner, inside, spacing, flat, config.outer_mm, 0)
    return _lumen(
        grid.with_values(distance), "the lumen is what the given surface encloses (points taken as LPS mm)"
    )


def lumen_from_labels(path: Path, config: SegmentConfig) -> Lumen:
    """Everything but 0 in a label map; the wall is its half level after light smoothing."""
    volume = load(read_header(path))
    grid, axes = in_memory_order(volume)
    order = np.flatnonzero(grid.values.reshape(-1))
    if len(order) < config.least_voxels:
        allowed = f"at least {config.least_voxels} (segment.least_voxels)"
        msg = f"{path}: got {len(order)} labelled voxels; expected {allowed}; check the label map"
        raise LoadError(msg)
    binary = grid.with_values((grid.values != 0).astype(np.uint8))
    site = prepare(binary, order, LABEL_TAPS, config.margin_mm)
    values = signed_distance(site, GreyLevels(1.0, 0.0, 0.0), config.outer_mm).values
    distance = reorder(site.grid.with_values(values), axes)
    return _lumen(distance, "the lumen is the given label map, its staircase smoothed")


def read_lumen(path: Path, config: SegmentConfig) -> Lumen:
    """The lumen in a file: .swc or .mrk.json (centreline with radius), .stl or .vtp (closed surface), else label map.

    Raises LoadError when the file does not hold a lumen.
    """
    name = path.name.lower()
    if not path.exists():
        msg = f"{path}: no such file; check lumen in the manifest (relative to the manifest itself)"
        raise LoadError(msg)
    if name.endswith(".swc"):
        return lumen_from_branches(read_swc(path), config)
    if name.endswith(".mrk.json"):
        return lumen_from_branches(read_markups_branches(path), config)
    if name.endswith(".stl"):
        return lumen_from_surface(read_stl(path), path, config)
    if name.endswith(".vtp"):
        return lumen_from_surface(read_vtp(path), path, config)
    return lumen_from_labels(path, config)
