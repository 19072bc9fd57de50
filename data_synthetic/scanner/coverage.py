"""Partial volume: which share of every voxel lies inside a shape."""

import numpy as np

from data_synthetic._compile import on_disk
from data_synthetic.anatomy._kernels import TubeTables, union_distance
from data_synthetic.anatomy.tubes import Anatomy
from data_synthetic.geometry import Array, Index, ScanGrid, Volume, voxels_near

SUBSAMPLES = 4
"""Sub-voxels per axis where the wall crosses a voxel, the wall being a plane in each."""


@on_disk()
def fill_coverage(
    index: Index, origin: Array, axes: Array, offsets: Array, reach: float, tubes: TubeTables, out: Volume
) -> None:
    """Coverage (n,) of listed voxels (n, 3).

    axes (3, 3) : index steps in mm.     offsets (m, 3) : of sub-voxels from a voxel's centre, mm.
    reach : half a voxel's diagonal, mm.
    """
    # within a sub-voxel the wall is taken as a plane: no grain where it is parallel to a face
    cell = 2.0 * reach / np.sqrt(3.0) / SUBSAMPLES
    for n in range(len(index)):
        p = origin + axes @ index[n].astype(np.float64)
        f = union_distance((p[0], p[1], p[2]), tubes)[0]
        if abs(f) > reach:
            out[n] = 1.0 if f < 0 else 0.0
            continue
        inside = 0.0
        for q in offsets:
            f = union_distance((p[0] + q[0], p[1] + q[1], p[2] + q[2]), tubes)[0]
            inside += min(max(0.5 - f / cell, 0.0), 1.0)
        out[n] = inside / len(offsets)


def near_tubes(anatomy: Anatomy, grid: ScanGrid, margin_mm: float) -> Index:
    """Indices (n, 3) of voxels within ``margin_mm`` of the tubes."""
    radii = np.concatenate([t.radii_mm + margin_mm + 0.5 * t.step_mm for t in anatomy.tubes])
    return voxels_near(grid.to_index(anatomy.tables.points), radii, grid)


def lumen_coverage(anatomy: Anatomy, grid: ScanGrid) -> Volume:
    """Share of every voxel inside the lumen, by SUBSAMPLES cubed sub-cells where the wall crosses it."""
    reach = 0.5 * float(np.linalg.norm(grid.spacing_mm))
    # a smooth union lies outside its tubes by at most a sixth of the blend width
    blend = max(t.blend_mm for t in anatomy.tubes) / 6.0
    index = near_tubes(anatomy, grid, reach + blend)
    share, axes = np.empty(len(index), dtype=np.float32), grid.direction * grid.spacing_mm
    steps = (np.arange(SUBSAMPLES) + 0.5) / SUBSAMPLES - 0.5
    i, j, k = (step.reshape(-1, 1) for step in np.meshgrid(steps, steps, steps, indexing="ij"))
    offsets = axes[:, 0] * i + axes[:, 1] * j + axes[:, 2] * k
    fill_coverage(index, grid.origin_mm, axes, offsets, reach, anatomy.tables, share)
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
