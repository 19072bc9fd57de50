"""The wall of a real scan's vessel at one grey level, and a way through it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import (
    binary_dilation,
    convolve,
    distance_transform_edt,
    gaussian_filter,
    label,
    maximum_filter,
    spline_filter,
    zoom,
)
from scipy.spatial import cKDTree
from skimage.graph import MCP_Geometric
from skimage.measure import marching_cubes
from skimage.morphology import skeletonize

from data_synthetic._compile import on_disk
from data_synthetic.anatomy.from_tree import smooth_tube
from data_synthetic.anatomy.tubes import Tube
from data_synthetic.geometry import Array, Index, ScanGrid, Volume, arc_lengths, voxels_near

BAND_MM = 1.5
"""Distances are exact up to here and cut beyond: a wire touches at less than its radius."""
SMOOTHING_VOXELS = 0.4
"""sd before the threshold: takes the staircase of an 8-bit scan away."""
NEAREST_TRIANGLES = 8
"""Triangles tried per point, by their centroids; they are smaller than half a voxel, so the nearest is among them."""


@dataclass(frozen=True, eq=False)
class IsoWall:
    """Signed distance in mm by a cubic B-spline with prefiltered ``coefficients`` on ``grid``."""

    grid: ScanGrid
    coefficients: Array

    def distance_and_gradient(self, points_mm: Array) -> tuple[Array, Array]:
        """Signed distance (n,) and its gradient (n, 3); beyond the grid the value at its edge."""
        index = self.grid.to_index(points_mm)
        value, slope = np.empty(len(index)), np.empty((len(index), 3))
        spline(self.coefficients, index, value, slope)
        return value, np.asarray((slope / self.grid.spacing_mm) @ self.grid.direction.T)


def iso_wall(values: Volume, grid: ScanGrid, threshold: float) -> IsoWall:
    """The wall where smoothed ``values`` cross ``threshold``; larger values are inside."""
    smooth = gaussian_filter(values, SMOOTHING_VOXELS)
    corners, faces, _, _ = marching_cubes(smooth, threshold)
    triangles = (corners * grid.spacing_mm)[faces]
    # linear interpolation at half voxels
    inside = zoom(smooth, [(2 * n - 1) / n for n in smooth.shape], order=1) > threshold
    fine = ScanGrid(inside.shape, 0.5 * grid.spacing_mm, grid.origin_mm, grid.direction)
    centres = triangles.mean(axis=1)
    # one ball per cell of half the band is enough to cover the band
    _, first = np.unique((centres / (0.5 * BAND_MM)).astype(np.int64), axis=0, return_index=True)
    near = voxels_near(centres[first] / fine.spacing_mm, np.full(len(first), 1.9 * BAND_MM), fine)
    places = near * fine.spacing_mm  # in the grid's own mm: no origin, no turn
    candidates = np.asarray(cKDTree(centres).query(places, k=NEAREST_TRIANGLES)[1], dtype=np.int64)
    apart = np.empty(len(places))
    triangle_distance(places, triangles, candidates, apart)
    distance = np.full(fine.shape, BAND_MM)
    distance[tuple(near.T)] = np.minimum(apart, BAND_MM)
    return IsoWall(fine, spline_filter(np.where(inside, -distance, distance), order=3, mode="mirror"))


@on_disk()
def triangle_distance(points: Array, triangles: Array, candidates: Index, out: Array) -> None:
    """Least distance to the candidate triangles (n, k): to the plane inside, to the edges outside."""
    for n in range(len(points)):
        best = 1e300
        for m in candidates[n]:
            a, b, c = triangles[m, 0], triangles[m, 1], triangles[m, 2]
            u, v, w = b - a, c - a, points[n] - a
            uu, uv, vv, wu, wv = np.dot(u, u), np.dot(u, v), np.dot(v, v), np.dot(w, u), np.dot(w, v)
            det = uu * vv - uv * uv
            if det > 1e-18:
                s, t = (vv * wu - uv * wv) / det, (uu * wv - uv * wu) / det
                if s >= 0 and t >= 0 and s + t <= 1:
                    d = w - s * u - t * v
                    best = min(best, np.dot(d, d))
                    continue
            for p, e in ((a, u), (a, v), (b, c - b)):
                ee = np.dot(e, e)
                f = 0.0 if ee == 0 else min(max(np.dot(points[n] - p, e) / ee, 0.0), 1.0)
                d = points[n] - p - f * e
                best = min(best, np.dot(d, d))
        out[n] = np.sqrt(best)


@on_disk()
def spline(coefficients: Array, index: Array, value: Array, slope: Array) -> None:
    """Cubic B-spline and its derivatives per voxel at continuous indices (n, 3), clamped to the grid."""
    w, d = np.empty((3, 4)), np.empty((3, 4))
    first = np.empty(3, np.int64)
    for n in range(len(index)):
        for a in range(3):
            x = min(max(index[n, a], 1.0), coefficients.shape[a] - 2.001)
            i = int(x)
            u = x - i
            first[a] = i - 1
            w[a, 0], w[a, 3] = (1 - u) ** 3 / 6, u**3 / 6
            w[a, 1], w[a, 2] = (4 - 6 * u**2 + 3 * u**3) / 6, (4 - 6 * (1 - u) ** 2 + 3 * (1 - u) ** 3) / 6
            d[a, 0], d[a, 3] = -0.5 * (1 - u) ** 2, 0.5 * u**2
            d[a, 1], d[a, 2] = -2 * u + 1.5 * u**2, 2 * (1 - u) - 1.5 * (1 - u) ** 2
        value[n], slope[n, 0], slope[n, 1], slope[n, 2] = 0.0, 0.0, 0.0, 0.0
        for i in range(4):
            for j in range(4):
                for k in range(4):
                    c = coefficients[first[0] + i, first[1] + j, first[2] + k]
                    value[n] += c * w[0, i] * w[1, j] * w[2, k]
                    slope[n, 0] += c * d[0, i] * w[1, j] * w[2, k]
                    slope[n, 1] += c * w[0, i] * d[1, j] * w[2, k]
                    slope[n, 2] += c * w[0, i] * w[1, j] * d[2, k]


Mask = NDArray[np.bool_]

BEFORE_MM, AFTER_MM = 75.0, 20.0
"""The way begins this far before the widest place (an aneurysm, where there is one) and ends this far after it."""
WIDE_ENOUGH, NEAR_VOXELS = 0.8, 6
"""Share of the widest end's radius from which an end may be the inlet, and how near to an end its radius is taken."""


def vessel_threshold(values: Volume) -> float:
    """Half the grey value of the vessel: the median of what is brighter than a quarter of the brightest."""
    top = float(np.percentile(values, 99.9))
    return 0.5 * float(np.median(values[values > 0.25 * top]))


def find_way(values: Volume, grid: ScanGrid, threshold: float) -> tuple[Mask, Tube]:
    """The voxels of the vessel, dilated by two, and the way as a tube.

    The vessel is the largest bright component; the way starts at its widest end and stays longest with the path to its
    widest place.
    """
    parts, _ = label(values > threshold)
    sizes = np.bincount(parts.ravel())
    sizes[0] = 0
    vessel = parts == int(np.argmax(sizes))
    inside = distance_transform_edt(vessel, sampling=grid.spacing_mm)
    ends = _ends(vessel)
    widest = np.array(np.unravel_index(int(np.argmax(inside)), inside.shape))
    away = np.linalg.norm((ends - widest) * grid.spacing_mm, axis=1)
    # largest inscribed radius near each end: an end's own voxel is always at the wall
    width = maximum_filter(inside, 2 * NEAR_VOXELS + 1, mode="constant")[tuple(ends.T)]
    width *= away > 2 * inside.max()
    # skeletons have spurs: of the widest ends the furthest is the inlet
    inlet = ends[int(np.argmax(away * (width > WIDE_ENOUGH * width.max())))]
    cost = np.where(vessel, 1.0 / (0.05 + inside / inside.max()) ** 3, -1.0)
    search = MCP_Geometric(cost, sampling=tuple(grid.spacing_mm.tolist()))
    search.find_costs([tuple(inlet.tolist())])
    path, neck = _past(search, ends, widest, inside, grid)
    return binary_dilation(vessel, iterations=2), _cut(path, neck, inside, grid)


def _ends(vessel: Mask) -> Index:
    """End points (n, 3) of the skeleton."""
    skeleton = skeletonize(vessel) > 0
    neighbours = convolve(skeleton.astype(np.uint8), np.ones((3, 3, 3), dtype=np.uint8), mode="constant")
    return np.argwhere(skeleton & (neighbours == 2))


def _past(search: MCP_Geometric, ends: Index, widest: Index, inside: Array, grid: ScanGrid) -> tuple[Index, int]:
    """The path that shares most with the one to the widest place and goes on furthest; where the two part."""
    to_widest = [tuple(p) for p in search.traceback(tuple(widest.tolist()))]
    best: tuple[float, Index, int] = (-np.inf, np.zeros((0, 3), dtype=np.int64), 0)
    for end in ends:
        path = search.traceback(tuple(end.tolist()))
        shared = next(
            (i for i, (a, b) in enumerate(zip(path, to_widest, strict=False)) if tuple(a) != b), len(path) - 1
        )
        beyond = np.array(path[shared:])
        wide = inside[tuple(beyond.T)] > 0.7
        usable = float(np.argmin(wide)) if not wide.all() else float(len(beyond))
        score = shared + min(usable * float(grid.spacing_mm.min()), AFTER_MM) * 4.0
        if score > best[0]:
            best = (score, np.array(path), shared)
    return best[1], best[2]


def _cut(path: Index, neck: int, inside: Array, grid: ScanGrid) -> Tube:
    """The stretch of the path about the neck, smoothed."""
    points = grid.to_mm(path)
    arc = arc_lengths(points)
    first = int(np.searchsorted(arc, max(arc[neck] - BEFORE_MM, 6.0)))
    radius = inside[tuple(path.T)]
    last = int(np.searchsorted(arc, min(arc[neck] + AFTER_MM, arc[-1] - 2.0)))
    narrow = np.flatnonzero(radius[neck:last] < 0.6)
    last = neck + int(narrow[0]) if len(narrow) else last
    # an aneurysm's own radius says nothing about the way past it
    return smooth_tube("way", points[first:last], np.minimum(radius[first:last], 1.2), smoothing_mm=1.0)
