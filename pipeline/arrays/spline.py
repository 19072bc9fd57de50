"""Uniform cubic B-splines on a lattice: node values used as coefficients, so the result is C2 and lightly smoothed.

The smoothing has variance 1/3 voxel^2 per axis (the variance of the cubic B-spline).
"""

from __future__ import annotations

from typing import Any

from numba import njit
from numpy.typing import NDArray


@njit(cache=True, inline="always")
def basis(t: float) -> tuple[float, float, float, float]:
    """The four cubic B-spline weights at offset ``t`` in [0, 1) from the second node."""
    u = 1.0 - t
    return (
        u * u * u / 6.0,
        (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
        (4.0 - 6.0 * u * u + 3.0 * u * u * u) / 6.0,
        t * t * t / 6.0,
    )


@njit(cache=True, inline="always")
def slope(t: float) -> tuple[float, float, float, float]:
    """First derivatives of :func:`basis`, per voxel."""
    u = 1.0 - t
    return -0.5 * u * u, 1.5 * t * t - 2.0 * t, 2.0 * u - 1.5 * u * u, 0.5 * t * t


@njit(cache=True, inline="always")
def bend(t: float) -> tuple[float, float, float, float]:
    """Second derivatives of :func:`basis`, per voxel^2."""
    u = 1.0 - t
    return u, 3.0 * t - 2.0, 3.0 * u - 2.0, t


@njit(cache=True, inline="always")
def _row(c: NDArray[Any], i: int, j: int, k: int, w: tuple[float, float, float, float]) -> float:
    return float(w[0] * c[i, j, k] + w[1] * c[i, j, k + 1] + w[2] * c[i, j, k + 2] + w[3] * c[i, j, k + 3])


@njit(cache=True)
def value_gradient(c: NDArray[Any], x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """Value and gradient (per voxel) at a point in index coordinates; the four nodes per axis must lie in ``c``."""
    i, j, k = int(x), int(y), int(z)
    wx, dx = basis(x - i), slope(x - i)
    wy, dy = basis(y - j), slope(y - j)
    wz, dz = basis(z - k), slope(z - k)
    f = gx = gy = gz = 0.0
    for a in range(4):
        fa = ya = za = 0.0
        for b in range(4):
            row = _row(c, i + a - 1, j + b - 1, k - 1, wz)
            fa += wy[b] * row
            ya += dy[b] * row
            za += wy[b] * _row(c, i + a - 1, j + b - 1, k - 1, dz)
        f += wx[a] * fa
        gx += dx[a] * fa
        gy += wx[a] * ya
        gz += wx[a] * za
    return f, gx, gy, gz


@njit(cache=True)
def hessian(c: NDArray[Any], x: float, y: float, z: float) -> tuple[float, float, float, float, float, float]:
    """Second derivatives xx, yy, zz, xy, xz, yz (per voxel^2) at a point in index coordinates."""
    i, j, k = int(x), int(y), int(z)
    wx, dx, bx = basis(x - i), slope(x - i), bend(x - i)
    wy, dy, by = basis(y - j), slope(y - j), bend(y - j)
    wz, dz, bz = basis(z - k), slope(z - k), bend(z - k)
    xx = yy = zz = xy = xz = yz = 0.0
    for a in range(4):
        f = fy = fz = fyy = fyz = fzz = 0.0
        for b in range(4):
            row = _row(c, i + a - 1, j + b - 1, k - 1, wz)
            drow = _row(c, i + a - 1, j + b - 1, k - 1, dz)
            f += wy[b] * row
            fy += dy[b] * row
            fyy += by[b] * row
            fz += wy[b] * drow
            fyz += dy[b] * drow
            fzz += wy[b] * _row(c, i + a - 1, j + b - 1, k - 1, bz)
        xx += bx[a] * f
        yy += wx[a] * fyy
        zz += wx[a] * fzz
        xy += dx[a] * fy
        xz += dx[a] * fz
        yz += wx[a] * fyz
    return xx, yy, zz, xy, xz, yz
