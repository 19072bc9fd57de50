"""Partial volume: which share of every voxel lies inside a shape."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from data_synthetic._compile import on_disk
from data_synthetic.anatomy._kernels import Index, Tables, union_distance
from data_synthetic.anatomy.tubes import Anatomy
from data_synthetic.geometry.scan_grid import ScanGrid

Array = NDArray[np.float64]
Volume = NDArray[np.float32]

SUBSAMPLES = 4
"""Sub-voxels per axis where the wall crosses a voxel, the wall being a plane in each."""

CUT = 4.0
"""Gaussians are cut at this many sd: the rest of the weight is 6e-5."""

RING_POINTS, RINGS = 16, 4
"""Points over the wire's cross-section, rings of equal area."""


@on_disk()
def mark_balls(centres: Array, radii: Array, spacing: Array, mask: NDArray[np.bool_]) -> None:
    """Set mask where a voxel centre lies within radii (n,) mm of centres (n, 3) given in index coordinates."""
    for n in range(len(centres)):
        r = radii[n]
        lo, hi = np.empty(3, np.int64), np.empty(3, np.int64)
        for a in range(3):
            lo[a] = max(0, int(np.ceil(centres[n, a] - r / spacing[a])))
            hi[a] = min(mask.shape[a] - 1, int(np.floor(centres[n, a] + r / spacing[a])))
        for i in range(lo[0], hi[0] + 1):
            x = (i - centres[n, 0]) * spacing[0]
            for j in range(lo[1], hi[1] + 1):
                y = (j - centres[n, 1]) * spacing[1]
                for k in range(lo[2], hi[2] + 1):
                    z = (k - centres[n, 2]) * spacing[2]
                    if x * x + y * y + z * z <= r * r:
                        mask[i, j, k] = True


@on_disk()
def fill_coverage(
    index: Index, origin: Array, axes: Array, reach: float, sub: int, tables: Tables, out: Volume
) -> None:
    """Coverage of listed voxels (n, 3); axes (3, 3) are index steps in mm, reach is half a voxel's diagonal."""
    points, tangents, radii, slopes, starts, steps, blends, balls, block_starts = tables
    # within a sub-cell the wall is taken as a plane: no grain where it is parallel to a face
    cell = 2.0 * reach / np.sqrt(3.0) / sub
    for n in range(len(index)):
        p = origin + axes @ index[n].astype(np.float64)
        f, _, _, _ = union_distance(
            p[0], p[1], p[2], points, tangents, radii, slopes, starts, steps, blends, balls, block_starts
        )
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
                    f, _, _, _ = union_distance(
                        q[0],
                        q[1],
                        q[2],
                        points,
                        tangents,
                        radii,
                        slopes,
                        starts,
                        steps,
                        blends,
                        balls,
                        block_starts,
                    )
                    inside += min(max(0.5 - f / cell, 0.0), 1.0)
        out[n] = inside / sub**3


def near_voxels(anatomy: Anatomy, grid: ScanGrid, margin_mm: float) -> NDArray[np.int64]:
    """Indices (n, 3) of voxels within ``margin_mm`` of the tubes."""
    mask = np.zeros(grid.shape, dtype=bool)
    for tube in anatomy.tubes:
        mark_balls(
            grid.to_index(tube.points_mm),
            tube.radii_mm + margin_mm + 0.5 * tube.step_mm,
            grid.spacing_mm,
            mask,
        )
    return np.argwhere(mask)


def lumen_coverage(anatomy: Anatomy, grid: ScanGrid, sub: int = SUBSAMPLES) -> Volume:
    """Share of every voxel inside the lumen, by ``sub`` cubed sub-cells where the wall crosses it."""
    reach = 0.5 * float(np.linalg.norm(grid.spacing_mm))
    # a smooth union lies outside its tubes by at most a sixth of the blend width
    blend = max(t.blend_mm for t in anatomy.tubes) / 6.0
    index = near_voxels(anatomy, grid, reach + blend)
    share = np.empty(len(index), dtype=np.float32)
    fill_coverage(index, grid.origin_mm, grid.direction * grid.spacing_mm, reach, sub, anatomy.tables, share)
    out = np.zeros(grid.shape, dtype=np.float32)
    out[tuple(index.T)] = share
    return out


def bone_coverage(bone: Anatomy, lumen: Anatomy, gap_mm: float, grid: ScanGrid) -> Volume:
    """Share of bone, which keeps ``gap_mm`` from the lumen; linear in the distance, as its edge is not measured."""
    index = near_voxels(bone, grid, grid.voxel_mm)
    out = np.zeros(grid.shape, dtype=np.float32)
    if len(index):
        points = grid.to_mm(index)
        distance = np.maximum(bone.distance(points), gap_mm - lumen.distance(points))
        out[tuple(index.T)] = np.clip(0.5 - distance / grid.voxel_mm, 0.0, 1.0)
    return out


def wire_particles(points_mm: Array, radius_mm: float, step_mm: float) -> tuple[Array, float]:
    """Points (n, 3) that fill the wire evenly, and the volume in mm3 that each stands for."""
    edges = np.linalg.norm(np.diff(points_mm, axis=0), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(edges)])
    count = max(int(np.ceil(arc[-1] / step_mm)), 1)
    places = (np.arange(count) + 0.5) * arc[-1] / count
    centre = np.column_stack([np.interp(places, arc, points_mm[:, a]) for a in range(3)])
    tangent = np.diff(points_mm, axis=0)[np.clip(np.searchsorted(arc, places) - 1, 0, len(edges) - 1)]
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    seed = np.where(np.abs(tangent[:, :1]) < 0.8, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = np.cross(tangent, seed)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(tangent, first)
    disc = _disc(radius_mm)
    filled = centre[:, None] + disc[None, :, :1] * first[:, None] + disc[None, :, 1:] * second[:, None]
    volume = np.pi * radius_mm**2 * arc[-1] / (count * len(disc))
    return filled.reshape(-1, 3), float(volume)


def _disc(radius_mm: float) -> Array:
    """Points (n, 2) of equal area over a disc."""
    ring = radius_mm * np.sqrt((np.arange(RINGS) + 0.5) / RINGS)
    angle = 2.0 * np.pi * (np.arange(RING_POINTS)[None] + 0.5 * (np.arange(RINGS)[:, None] % 2)) / RING_POINTS
    return np.column_stack([(ring[:, None] * np.cos(angle)).ravel(), (ring[:, None] * np.sin(angle)).ravel()])


@on_disk()
def splat(index: Array, weights: Array, sigma: Array, out: Volume) -> None:
    """Add weighted points (n, 3), in voxels, blurred by a Gaussian (sd per axis) and integrated over every voxel."""
    reach = np.ceil(CUT * sigma + 0.5).astype(np.int64)
    profile = np.zeros((3, 2 * reach.max() + 1))
    low = np.empty(3, np.int64)
    for n in range(len(index)):
        inside = True
        for a in range(3):
            low[a] = int(np.rint(index[n, a])) - reach[a]
            inside = inside and low[a] >= 0 and low[a] + 2 * reach[a] < out.shape[a]
            scale = 1.0 / (np.sqrt(2.0) * sigma[a])
            below = math.erf((low[a] - 0.5 - index[n, a]) * scale)
            for i in range(2 * reach[a] + 1):
                above = math.erf((low[a] + i + 0.5 - index[n, a]) * scale)
                profile[a, i] = 0.5 * (above - below)
                below = above
        for i in range(2 * reach[0] + 1):
            x = low[0] + i
            if not inside and (x < 0 or x >= out.shape[0]):
                continue
            for j in range(2 * reach[1] + 1):
                y = low[1] + j
                if not inside and (y < 0 or y >= out.shape[1]):
                    continue
                part = weights[n] * profile[0, i] * profile[1, j]
                for k in range(2 * reach[2] + 1):
                    z = low[2] + k
                    if inside or (0 <= z < out.shape[2]):
                        out[x, y, z] += part * profile[2, k]
