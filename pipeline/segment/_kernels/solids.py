"""Solids on a lattice: distance to cones, closest points on triangles, and what a closed surface encloses.

Coordinates are index * spacing (mm along the grid's axes).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.lattice import entry_point, kernel, nodes_near


@entry_point
def cones(
    start: NDArray[Any], end: NDArray[Any], r0: NDArray[Any], r1: NDArray[Any], spacing: NDArray[Any], outer: float,
    distance: NDArray[Any],
) -> None:  # fmt: skip
    """Lower ``distance`` (signed, mm) to that of the union with round cones, within ``outer`` mm of each."""
    ni, nj, nk = distance.shape
    for n in range(start.shape[0]):
        reach = max(r0[n], r1[n]) + outer
        ax, ay, az = start[n, 0], start[n, 1], start[n, 2]
        dx, dy, dz = end[n, 0] - ax, end[n, 1] - ay, end[n, 2] - az
        square = dx * dx + dy * dy + dz * dz + 1e-12
        # the way to a leaning flank is at right angles to it: its foot on the axis lies nearer to the thick end
        length = np.sqrt(square)
        lean = min(0.95, max(-0.95, (r0[n] - r1[n]) / length))
        shift = lean / (np.sqrt(1.0 - lean * lean) * length)
        i0, i1 = nodes_near(min(ax, end[n, 0]), max(ax, end[n, 0]), reach, spacing[0], ni)
        j0, j1 = nodes_near(min(ay, end[n, 1]), max(ay, end[n, 1]), reach, spacing[1], nj)
        k0, k1 = nodes_near(min(az, end[n, 2]), max(az, end[n, 2]), reach, spacing[2], nk)
        for i in range(i0, i1):
            x = i * spacing[0] - ax
            for j in range(j0, j1):
                y = j * spacing[1] - ay
                for k in range(k0, k1):
                    z = k * spacing[2] - az
                    t = (x * dx + y * dy + z * dz) / square
                    across = np.sqrt(max(0.0, x * x + y * y + z * z - t * t * square))
                    t = min(1.0, max(0.0, t - across * shift))
                    px, py, pz = x - t * dx, y - t * dy, z - t * dz
                    d = np.sqrt(px * px + py * py + pz * pz) - (r0[n] + t * (r1[n] - r0[n]))
                    distance[i, j, k] = min(distance[i, j, k], d)


@kernel
def _closest_on_triangle(
    p: NDArray[Any], a: NDArray[Any], b: NDArray[Any], c: NDArray[Any], out: NDArray[Any]
) -> float:
    """Closest point of a triangle to p into ``out``; returns the squared distance (Ericson, Real-Time Collision
    Detection, 5.1.5)."""
    ab, ac, ap = b - a, c - a, p - a
    d1, d2 = _dot(ab, ap), _dot(ac, ap)
    bp = p - b
    d3, d4 = _dot(ab, bp), _dot(ac, bp)
    cp = p - c
    d5, d6 = _dot(ab, cp), _dot(ac, cp)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    v = w = 0.0
    if d1 <= 0 and d2 <= 0:
        v = w = 0.0
    elif d3 >= 0 and d4 <= d3:
        v, w = 1.0, 0.0
    elif d6 >= 0 and d5 <= d6:
        v, w = 0.0, 1.0
    elif vc <= 0 and d1 >= 0 and d3 <= 0:
        v, w = d1 / (d1 - d3), 0.0
    elif vb <= 0 and d2 >= 0 and d6 <= 0:
        v, w = 0.0, d2 / (d2 - d6)
    elif va <= 0 and d4 - d3 >= 0 and d5 - d6 >= 0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v = 1.0 - w
    else:
        total = va + vb + vc
        v, w = vb / total, vc / total
    square = 0.0
    for m in range(3):
        out[m] = a[m] + v * ab[m] + w * ac[m]
        square += (p[m] - out[m]) ** 2
    return square


@kernel
def _dot(a: NDArray[Any], b: NDArray[Any]) -> float:
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@entry_point
def splat_triangles(
    corners: NDArray[Any], spacing: NDArray[Any], reach: float, owner: NDArray[Any], foot: NDArray[Any]
) -> NDArray[Any]:
    """Closest points for the voxels within ``reach`` mm of a triangle mesh (t, 3, 3).

    ``owner`` (int32 zeros) gets position + 1 of each such voxel; ``foot`` (owner.size at most, 3) its closest point.
    Returns (n, 2): flat voxel index and its triangle.
    """
    ni, nj, nk = owner.shape
    found = np.empty((foot.shape[0], 2), np.int64)
    best = np.empty(foot.shape[0])
    count = 0
    p = np.empty(3)
    q = np.empty(3)
    for n in range(corners.shape[0]):
        a, b, c = corners[n, 0], corners[n, 1], corners[n, 2]
        i0, i1 = nodes_near(min(a[0], b[0], c[0]), max(a[0], b[0], c[0]), reach, spacing[0], ni)
        j0, j1 = nodes_near(min(a[1], b[1], c[1]), max(a[1], b[1], c[1]), reach, spacing[1], nj)
        k0, k1 = nodes_near(min(a[2], b[2], c[2]), max(a[2], b[2], c[2]), reach, spacing[2], nk)
        for i in range(i0, i1):
            for j in range(j0, j1):
                for k in range(k0, k1):
                    p[0], p[1], p[2] = i * spacing[0], j * spacing[1], k * spacing[2]
                    square = _closest_on_triangle(p, a, b, c, q)
                    m = owner[i, j, k] - 1
                    if square > reach * reach or (m >= 0 and square >= best[m]):
                        continue
                    if m < 0:
                        if count >= foot.shape[0]:
                            continue
                        m = count
                        count += 1
                        owner[i, j, k] = count
                        found[m, 0] = (i * nj + j) * nk + k
                    best[m] = square
                    found[m, 1] = n
                    foot[m] = q
    return found[:count]


@entry_point
def enclosed(corners: NDArray[Any], spacing: NDArray[Any], inside: NDArray[Any]) -> None:
    """Set ``inside`` (uint8 zeros) where a ray along the last axis has crossed the mesh an odd number of times.

    The ray is shifted by an irrational share of a millionth voxel, so that it meets no edge; the edge functions
    are exact negatives for the two triangles of an edge, so that a ray never slips between them.
    """
    ni, nj, nk = inside.shape
    for n in range(corners.shape[0]):
        a, b, c = corners[n, 0], corners[n, 1], corners[n, 2]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0.0:
            continue
        i0, i1 = nodes_near(min(a[0], b[0], c[0]) - spacing[0], max(a[0], b[0], c[0]), 0.0, spacing[0], ni)
        j0, j1 = nodes_near(min(a[1], b[1], c[1]) - spacing[1], max(a[1], b[1], c[1]), 0.0, spacing[1], nj)
        for i in range(i0, i1):
            x = (i + 1.618034e-6) * spacing[0]
            for j in range(j0, j1):
                y = (j + 2.718282e-6) * spacing[1]
                u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
                v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
                w = ((a[0] - x) * (b[1] - y) - (a[1] - y) * (b[0] - x)) / area
                if u < 0 or v < 0 or w < 0:
                    continue
                z = (u * a[2] + v * b[2] + w * c[2]) / spacing[2]
                for k in range(max(0, int(np.ceil(z))), nk):
                    inside[i, j, k] ^= 1
