"""Partial volume: which share of every voxel lies inside a shape."""

from __future__ import annotations

import numpy as np

from data_synthetic._compile import on_disk
from data_synthetic.anatomy._kernels import TubeTables, union_distance
from data_synthetic.anatomy.tubes import Anatomy
from data_synthetic.geometry.scan_grid import ScanGrid, Volume, voxels_near
from data_synthetic.geometry.vectors import Array, Index

SUBSAMPLES = 4
"""Sub-voxels per axis where the wall crosses a voxel, the wall being a plane in each."""


@on_disk()
def fill_coverage(
    index: Index, origin: Array, axes: Array, reach: float, sub: int, tubes: TubeTables, out: Volume
) -> None:
    """Coverage of listed voxels (n, 3); axes (3, 3) are index steps in mm, reach is half a voxel's diagonal."""
    # within a sub-cell the wall is taken as a plane: no grain where it is parallel to a face
    cell = 2.0 * reach / np.sqrt(3.0) / sub
    for n in range(len(index)):
        p = origin + axes @ index[n].astype(np.float64)
        f = union_distance((p[0], p[1], p[2]), tubes)[0]
        if abs(f) > reach:
            out[n] = 1.0 if f < 0 else 0.0
            continue
        inside = 0.0
        for i in range(sub):
            for j in range(sub):
                for k in range(sub):
                    q = p.copy()
                    for a in range(3):
                        q[a] += (
                            axes[a, 0] * ((i + 0.5) / sub - 0.5)
                            + axes[a, 1] * ((j + 0.5) / sub - 0.5)
                            + axes[a, 2] * ((k + 0.5) / sub - 0.5)
                        )
                    f = union_distance((q[0], q[1], q[2]), tubes)[0]
                    inside += min(max(0.5 - f / cell, 0.0), 1.0)
        out[n] = inside / sub**3


def near_tubes(anatomy: Anatomy, grid: ScanGrid, margin_mm: float) -> Index:
    """Indices (n, 3) of voxels within ``margin_mm`` of the tubes."""
    radii = np.concatenate([t.radii_mm + margin_mm + 0.5 * t.step_mm for t in anatomy.tubes])
    return voxels_near(grid.to_index(anatomy.tables.points), radii, grid)


def lumen_coverage(anatomy: Anatomy, grid: ScanGrid, sub: int = SUBSAMPLES) -> Volume:
    """Share of every voxel inside the lumen, by ``sub`` cubed sub-cells where the wall crosses it."""
    reach = 0.5 * float(np.linalg.norm(grid.spacing_mm))
    # a smooth union lies outside its tubes by at most a sixth of the blend width
    blend = max(t.blend_mm for t in anatomy.tubes) / 6.0
    index = near_tubes(anatomy, grid, reach + blend)
    share = np.empty(len(index), dtype=np.float32)
    fill_coverage(index, grid.origin_mm, grid.direction * grid.spacing_mm, reach, sub, anatomy.tables, share)
    out = np.zeros(grid.shape, dtype=np.float32)
    out[tuple(index.T)] = share
    return out


def bone_coverage(bone: Anatomy, lumen: Anatomy, gap_mm: float, grid: ScanGrid) -> Volume:
    """Share of bone, which keeps ``gap_mm`` from the lumen; linear in the distance, as its edge is not measured."""
    index = near_tubes(bone, grid, grid.voxel_mm)
    out = np.zeros(grid.shape, dtype=np.float32)
    if len(index):
        points = grid.to_mm(index)
        distance = np.maximum(bone.distance(points), gap_mm - lumen.distance(points))
        out[tuple(index.T)] = np.clip(0.5 - distance / grid.voxel_mm, 0.0, 1.0)
    return out
