"""A blurred lattice at single voxels, and its derivatives at single points: nothing is filtered where nothing is asked.

Coordinates of points are index * spacing (mm along the grid's axes); derivatives are per mm.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.lattice import clamped, entry_point, kernel, nodes_near, unravelled

REACH = 3.0
"""Half width of the Gaussian's window in sigmas."""
WIDEST = 64
"""Nodes along an axis that a window may have."""


class Blurred(NamedTuple):
    """A lattice (values, voxel size (3,) in mm) that is looked at through a Gaussian of ``sigma`` mm."""

    grey: NDArray[Any]
    spacing: NDArray[Any]
    sigma: float


@kernel
def _weights(x: float, h: float, sigma: float, n: int, w: NDArray[Any]) -> tuple[int, int]:
    """Rows of ``w``: Gaussian, its first and its second derivative at the nodes within reach of x; and their range."""
    s = max(sigma, 0.6 * h)
    first, stop = nodes_near(x, x, REACH * s, h, n)
    stop = min(stop, first + w.shape[1])
    total = 0.0
    for i in range(first, stop):
        d = (i * h - x) / s
        g = np.exp(-0.5 * d * d)
        total += g
        w[0, i - first] = g
        w[1, i - first] = g * d / s
        w[2, i - first] = g * (d * d - 1.0) / (s * s)
    if total > 0.0:
        for m in range(3):
            for i in range(stop - first):
                w[m, i] /= total
    return first, stop


@kernel
def jet(field: Blurred, p: NDArray[Any], w: NDArray[Any], out: NDArray[Any]) -> None:
    """Value, gradient (3), and second derivatives xx yy zz xy xz yz of the blurred lattice at ``p``, into out (10).

    ``w`` is scratch (3, 3, WIDEST).
    """
    grey = field.grey
    i0, i1 = _weights(p[0], field.spacing[0], field.sigma, grey.shape[0], w[0])
    j0, j1 = _weights(p[1], field.spacing[1], field.sigma, grey.shape[1], w[1])
    k0, k1 = _weights(p[2], field.spacing[2], field.sigma, grey.shape[2], w[2])
    for m in range(10):
        out[m] = 0.0
    for i in range(i0, i1):
        f = fy = fz = fyy = fzz = fyz = 0.0
        for j in range(j0, j1):
            r = rz = rzz = 0.0
            for k in range(k0, k1):
                v = grey[i, j, k]
                r += w[2, 0, k - k0] * v
                rz += w[2, 1, k - k0] * v
                rzz += w[2, 2, k - k0] * v
            f += w[1, 0, j - j0] * r
            fy += w[1, 1, j - j0] * r
            fyy += w[1, 2, j - j0] * r
            fz += w[1, 0, j - j0] * rz
            fyz += w[1, 1, j - j0] * rz
            fzz += w[1, 0, j - j0] * rzz
        a, b, c = w[0, 0, i - i0], w[0, 1, i - i0], w[0, 2, i - i0]
        out[0] += a * f
        out[1] += b * f
        out[2] += a * fy
        out[3] += a * fz
        out[4] += c * f
        out[5] += a * fyy
        out[6] += a * fzz
        out[7] += b * fy
        out[8] += b * fz
        out[9] += a * fyz


@entry_point
def jets_at(field: Blurred, points: NDArray[Any]) -> NDArray[Any]:
    """Value and gradient (n, 4) of the blurred lattice at points (n, 3)."""
    w, out = np.empty((3, 3, WIDEST)), np.empty(10)
    result = np.empty((points.shape[0], 4))
    for n in range(points.shape[0]):
        jet(field, points[n], w, out)
        result[n] = out[:4]
    return result


def values_at(field: Blurred, points: NDArray[Any]) -> NDArray[Any]:
    """The blurred lattice (n,) at points (n, 3)."""
    return jets_at(field, np.ascontiguousarray(points))[:, 0].copy()


@kernel
def smoothed(volume: NDArray[Any], taps: NDArray[Any], i: int, j: int, k: int) -> float:
    """The separable kernel ``taps`` (2r+1) applied at one voxel; the border voxel is repeated outside."""
    reach = taps.shape[0] // 2
    ni, nj, nk = volume.shape
    total = 0.0
    for a in range(-reach, reach + 1):
        ia = clamped(i + a, ni)
        plane = 0.0
        for b in range(-reach, reach + 1):
            jb = clamped(j + b, nj)
            row = 0.0
            for c in range(-reach, reach + 1):
                row += taps[c + reach] * volume[ia, jb, clamped(k + c, nk)]
            plane += taps[b + reach] * row
        total += taps[a + reach] * plane
    return total


@entry_point
def smooth_voxels(grey: NDArray[Any], taps: NDArray[Any], voxels: NDArray[Any]) -> NDArray[Any]:
    """The separable kernel ``taps`` at flat indices of a box, float32."""
    out = np.empty(voxels.shape[0], np.float32)
    for n in range(voxels.shape[0]):
        i, j, k = unravelled(voxels[n], grey.shape)
        out[n] = smoothed(grey, taps, i, j, k)
    return out
