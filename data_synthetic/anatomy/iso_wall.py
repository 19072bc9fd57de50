"""The wall of a real scan's vessel at one grey level."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, spline_filter, zoom
from scipy.spatial import cKDTree
from skimage.measure import marching_cubes

from data_synthetic._compile import on_disk
from data_synthetic.geometry import Array, Index, ScanGrid, Volume, voxels_near

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
