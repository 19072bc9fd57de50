"""Uniform cubic B-splines on a lattice: node values used as coefficients, so the result is C2 and lightly smoothed.

The smoothing has variance 1/3 voxel^2 per axis (the variance of the cubic B-spline).
"""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from pipeline.arrays.lattice import kernel

Four = tuple[float, float, float, float]


@kernel
def basis(t: float) -> Four:
    """The four cubic B-spline weights at offset ``t`` in [0, 1) from the second node."""
    u = 1.0 - t
    return (
        u * u * u / 6.0,
        (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
        (4.0 - 6.0 * u * u + 3.0 * u * u * u) / 6.0,
        t * t * t / 6.0,
    )


@kernel
def slope(t: float) -> Four:
    """First derivatives of :func:`basis`, per voxel."""
    u = 1.0 - t
    return -0.5 * u * u, 1.5 * t * t - 2.0 * t, 2.0 * u - 1.5 * u * u, 0.5 * t * t


@kernel
def bend(t: float) -> Four:
    """Second derivatives of :func:`basis`, per voxel^2."""
    u = 1.0 - t
    return u, 3.0 * t - 2.0, 3.0 * u - 2.0, t


@kernel
def _row(c: NDArray[Any], i: int, j: int, k: int, w: Four) -> float:
    return float(w[0] * c[i, j, k] + w[1] * c[i, j, k + 1] + w[2] * c[i, j, k + 2] + w[3] * c[i, j, k + 3])


@kernel
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


@kernel
def _contracted(c: NDArray[Any], at: tuple[int, int, int], wx: Four, wy: Four, wz: Four) -> float:
    """The 4^3 nodes around ``at``, weighted along each axis and added up."""
    i, j, k = at
    total = 0.0
    for a in range(4):
        plane = 0.0
        for b in range(4):
            plane += wy[b] * _row(c, i + a - 1, j + b - 1, k - 1, wz)
        total += wx[a] * plane
    return total


@kernel
def hessian(c: NDArray[Any], x: float, y: float, z: float) -> tuple[float, float, float, float, float, float]:
    """Second derivatives xx, yy, zz, xy, xz, yz (per voxel^2) at a point in index coordinates."""
    at = int(x), int(y), int(z)
    x, y, z = x - at[0], y - at[1], z - at[2]
    wx, dx, wy, dy, wz, dz = basis(x), slope(x), basis(y), slope(y), basis(z), slope(z)
    return (
        _contracted(c, at, bend(x), wy, wz), _contracted(c, at, wx, bend(y), wz), _contracted(c, at, wx, wy, bend(z)),
        _contracted(c, at, dx, dy, wz), _contracted(c, at, dx, wy, dz), _contracted(c, at, wx, dy, dz),
    )  # fmt: skip
