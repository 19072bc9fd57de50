"""A phantom in voxels: wires as points, and how much of each voxel is lumen or bone."""

import math

import numpy as np

from data_synthetic._compile import on_disk, part_of_callers
from data_synthetic.anatomy._kernels import BLENDS, FAR, TubeTables, room_for, tubes_around, union_distance
from data_synthetic.anatomy.tubes import Anatomy
from data_synthetic.geometry import Array, Index, ScanGrid, Volume, arc_lengths, at_arc, voxels_near
from data_synthetic.scanner.phantom import Phantom

CUT = 4.0
"""Gaussians are cut at this many sd: the rest of the weight is 6e-5."""
RING_POINTS, RINGS = 16, 4
"""Points over the wire's cross-section, rings of equal area."""


def wire_particles(points_mm: Array, radius_mm: float, step_mm: float) -> tuple[Array, float]:
    """Points (n, 3) that fill the wire evenly, and the volume in mm3 that each stands for."""
    arc = arc_lengths(points_mm)
    count = max(int(np.ceil(arc[-1] / step_mm)), 1)
    places = (np.arange(count) + 0.5) * arc[-1] / count
    centre = at_arc(places, arc, points_mm)
    tangent = np.diff(points_mm, axis=0)[np.clip(np.searchsorted(arc, places) - 1, 0, len(arc) - 2)]
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    seed = np.where(np.abs(tangent[:, :1]) < 0.8, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = np.cross(tangent, seed)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(tangent, first)
    # the cross-section: rings of equal area, every other one turned by half a point
    ring = radius_mm * np.sqrt((np.arange(RINGS)[:, None] + 0.5) / RINGS)
    angle = 2.0 * np.pi * (np.arange(RING_POINTS)[None] + 0.5 * (np.arange(RINGS)[:, None] % 2)) / RING_POINTS
    x, y = (ring * np.cos(angle)).reshape(-1, 1), (ring * np.sin(angle)).reshape(-1, 1)
    filled = centre[:, None] + x * first[:, None] + y * second[:, None]
    volume = np.pi * radius_mm**2 * arc[-1] / (count * len(x))
    return filled.reshape(-1, 3), float(volume)


@on_disk()
def splat(index: Array, weights: Array, sigma: Array, out: Volume) -> None:
    """Add weighted points (n, 3), in voxels, blurred by a Gaussian (sd per axis) and integrated over every voxel."""
    reach = np.ceil(CUT * sigma + 0.5).astype(np.int64)
    profile = np.zeros((3, 2 * reach.max() + 1))
    low, first, last = np.empty(3, np.int64), np.empty(3, np.int64), np.empty(3, np.int64)
    for n in range(len(index)):
        for a in range(3):
            low[a] = int(np.rint(index[n, a])) - reach[a]
            first[a], last[a] = max(0, -low[a]), min(2 * reach[a] + 1, out.shape[a] - low[a])
            scale = 1.0 / (np.sqrt(2.0) * sigma[a])
            below = math.erf((low[a] - 0.5 - index[n, a]) * scale)
            for i in range(2 * reach[a] + 1):
                above = math.erf((low[a] + i + 0.5 - index[n, a]) * scale)
                profile[a, i] = 0.5 * (above - below)
                below = above
        for i in range(first[0], last[0]):
            for j in range(first[1], last[1]):
                part = weights[n] * profile[0, i] * profile[1, j]
                for k in range(first[2], last[2]):
                    out[low[0] + i, low[1] + j, low[2] + k] += part * profile[2, k]


SUBSAMPLES = 4
"""Sub-voxels per axis where the wall crosses a voxel, the wall being a plane in each."""


@on_disk()
def fill_coverage(
    index: Index, origin: Array, axes: Array, offsets: Array, reach: float, tubes: TubeTables, out: Volume
) -> None:
    """Coverage (n,) of listed voxels (n, 3).

    axes (3, 3) : index steps in mm.     offsets (8, m, 3) : of sub-voxels from a voxel's centre by its octants, mm.
    reach : half a voxel's diagonal, mm.
    """
    # the distance changes by no more than the way between two places: tubes further off are not looked at
    f, before, margin, room = FAR, origin, BLENDS * tubes.blends.max(), room_for(tubes)
    for n in range(len(index)):
        p = origin + axes @ index[n].astype(np.float64)
        way = p - before
        f = union_distance((p[0], p[1], p[2]), f + np.sqrt((way * way).sum()) + margin, tubes)[0]
        before = p
        if abs(f) > reach:
            out[n] = 1.0 if f < 0 else 0.0
            continue
        limit = f + reach + margin
        near = tubes_around((p[0], p[1], p[2]), reach, limit, tubes, room)
        out[n] = share_inside(p, offsets, reach, limit, near)


@part_of_callers()
def share_inside(p: Array, offsets: Array, reach: float, limit: float, tubes: TubeTables) -> float:
    """Share inside of a voxel that the wall crosses; arguments as of ``fill_coverage``."""
    # within a sub-voxel the wall is taken as a plane: no grain where it is parallel to a face
    cell = 2.0 * reach / np.sqrt(3.0) / SUBSAMPLES
    inside, m = 0.0, offsets.shape[1]
    for octant in offsets:
        middle = octant.sum(axis=0) / m
        way = octant[0] - middle
        x, y, z = p[0] + middle[0], p[1] + middle[1], p[2] + middle[2]
        g = union_distance((x, y, z), limit, tubes)[0]
        # sub-voxels lie that far from the middle of their octant: each of them is whole or empty
        if abs(g) > np.sqrt((way * way).sum()) + 0.5 * cell:
            inside += m if g < 0.0 else 0.0
            continue
        for q in octant:
            g = union_distance((p[0] + q[0], p[1] + q[1], p[2] + q[2]), limit, tubes)[0]
            inside += min(max(0.5 - g / cell, 0.0), 1.0)
    return inside / offsets[:, :, 0].size


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
    half = SUBSAMPLES // 2
    i, j, k = (  # eight octants, then the sub-voxels in each
        step.reshape(2, half, 2, half, 2, half).transpose(0, 2, 4, 1, 3, 5).reshape(8, -1, 1)
        for step in np.meshgrid(steps, steps, steps, indexing="ij")
    )
    offsets = axes[:, 0] * i + axes[:, 1] * j + axes[:, 2] * k
    fill_coverage(index, grid.origin_mm, axes, offsets, reach, anatomy.tables, share)
    out = np.zeros(grid.shape, dtype=np.float32)
    out[tuple(index.T)] = share
    return out


def bone_coverage(phantom: Phantom, grid: ScanGrid) -> Volume:
    """Share of bone, which keeps its gap from the lumen; linear in the distance, as its edge is not measured."""
    out, bone = np.zeros(grid.shape, dtype=np.float32), phantom.bone
    if bone is not None and len(index := near_tubes(bone, grid, grid.voxel_mm)):
        points = grid.to_mm(index)
        distance = np.maximum(bone.distance(points), phantom.bone_gap_mm - phantom.anatomy.distance(points))
        out[tuple(index.T)] = np.clip(0.5 - distance / grid.voxel_mm, 0.0, 1.0)
    return out
