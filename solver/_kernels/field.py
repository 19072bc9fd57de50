"""The signed distance between its nodes: a C² natural cubic B-spline that interpolates, linear beyond the grid.

Coefficients carry one ghost layer on each side, c[-1] = 2 c[0] - c[1], which makes the second derivative
vanish on the faces; the linear continuation outside is therefore C² as well, axis by axis.
"""

import math
from typing import Any

import numpy as np

from solver._kernels.algebra import Three
from solver._kernels.data import Field
from solver._kernels.flags import entry_point, inlined, kernel

Four = tuple[float, float, float, float]
Cell = tuple[int, int, int, float, float, float]
"""Indices of a cell, and a place in it: 0 to 1 along each axis, below or above where it is outside the grid."""

# Cells along an edge of the blocks over which bounds are taken: small enough to stay local, large enough to be cheap.
BLOCK = 4


@kernel
def solve_natural(line: Any, scratch: Any) -> None:
    """Replace the values of one line by its natural B-spline coefficients (Thomas algorithm on 1 4 1)."""
    n = line.size
    scratch[0] = 0.0
    for i in range(1, n - 1):
        scratch[i] = 1.0 / (4.0 - scratch[i - 1])
        line[i] = (6.0 * line[i] - line[i - 1]) * scratch[i]
    for i in range(n - 2, 0, -1):
        line[i] -= scratch[i] * line[i + 1]


@entry_point
def prefilter(values: Any) -> None:
    """Turn node values (nx, ny, nz) into spline coefficients, in place, along one axis after the other."""
    flat, scratch = values.reshape(values.size), np.empty(max(values.shape))
    stride = 1
    for n in values.shape[::-1]:
        for start in range(0, flat.size, n * stride):
            for first in range(start, start + stride):
                solve_natural(flat[first : first + n * stride : stride], scratch)
        stride *= n


@inlined
def indices(m: Any, o: Any, q: Three) -> Three:
    """Continuous indices of a point in mm; m and o are a field's to_index and origin."""
    d0, d1, d2 = q[0] - o[0], q[1] - o[1], q[2] - o[2]
    return (
        m[0, 0] * d0 + m[0, 1] * d1 + m[0, 2] * d2,
        m[1, 0] * d0 + m[1, 1] * d1 + m[1, 2] * d2,
        m[2, 0] * d0 + m[2, 1] * d1 + m[2, 2] * d2,
    )


@inlined
def clipped(f: float, last: int) -> int:
    """The cell of a continuous index; the clip also catches what does not fit an integer."""
    return int(min(max(f, 0.0), float(last)))


@inlined
def locate(c: Any, f: Three) -> Cell:
    """The cell of continuous indices among a field's coefficients c."""
    i, j, k = clipped(f[0], c.shape[0] - 4), clipped(f[1], c.shape[1] - 4), clipped(f[2], c.shape[2] - 4)
    return i, j, k, f[0] - i, f[1] - j, f[2] - k


@inlined
def in_grid(c: Any, f: Three) -> bool:
    """Whether continuous indices lie among a field's nodes."""
    shape = c.shape
    return bool(0.0 <= f[0] <= shape[0] - 3 and 0.0 <= f[1] <= shape[1] - 3 and 0.0 <= f[2] <= shape[2] - 3)


@inlined
def trilinear(c: Any, cell: Cell) -> float:
    """Trilinear look-up among the coefficients: within ``field.gap`` of the spline, at a tenth of its cost."""
    i, j, k, r, s, t = cell
    low = (c[i + 1, j + 1, k + 1] * (1 - t) + c[i + 1, j + 1, k + 2] * t) * (1 - s)
    low += (c[i + 1, j + 2, k + 1] * (1 - t) + c[i + 1, j + 2, k + 2] * t) * s
    high = (c[i + 2, j + 1, k + 1] * (1 - t) + c[i + 2, j + 1, k + 2] * t) * (1 - s)
    high += (c[i + 2, j + 2, k + 1] * (1 - t) + c[i + 2, j + 2, k + 2] * t) * s
    return float(low * (1 - r) + high * r)


@inlined
def cubic(t: float) -> Four:
    """Weights of the four coefficients around a place in a cell: linear beyond the grid."""
    if t < 0.0 or t > 1.0:
        return 0.0, 1 - t, t, 0.0
    r = 1 - t
    return r * r * r / 6, 2.0 / 3 - t * t * (1 - 0.5 * t), 2.0 / 3 - r * r * (1 - 0.5 * r), t * t * t / 6


@inlined
def row(c: Any, i: int, j: int, k: int, r: Four) -> float:
    """Four coefficients along the last axis, weighted."""
    return float(c[i, j, k] * r[0] + c[i, j, k + 1] * r[1] + c[i, j, k + 2] * r[2] + c[i, j, k + 3] * r[3])


@inlined
def plane(c: Any, i: int, j: int, k: int, q: Four, r: Four) -> float:
    """Four rows, weighted."""
    low = row(c, i, j, k, r) * q[0] + row(c, i, j + 1, k, r) * q[1]
    return low + row(c, i, j + 2, k, r) * q[2] + row(c, i, j + 3, k, r) * q[3]


@kernel
def value(c: Any, cell: Cell) -> float:
    """The spline alone, without derivatives: a third of the cost."""
    i, j, k, u, v, w = cell
    p, q, r = cubic(u), cubic(v), cubic(w)
    low = plane(c, i, j, k, q, r) * p[0] + plane(c, i + 1, j, k, q, r) * p[1]
    return low + plane(c, i + 2, j, k, q, r) * p[2] + plane(c, i + 3, j, k, q, r) * p[3]


@inlined
def basis(t: float, weights: Any) -> None:
    """Fill (3, 4) weights: value, first and second derivative per index of the four coefficients around t."""
    weights[0, 0], weights[0, 1], weights[0, 2], weights[0, 3] = cubic(t)
    if t < 0.0 or t > 1.0:
        weights[1, 0], weights[1, 1], weights[1, 2], weights[1, 3] = 0.0, -1.0, 1.0, 0.0
        weights[2, 0], weights[2, 1], weights[2, 2], weights[2, 3] = 0.0, 0.0, 0.0, 0.0
        return
    r = 1 - t
    weights[1, 0] = -0.5 * r * r
    weights[1, 1] = t * (1.5 * t - 2)
    weights[1, 2] = r * (2 - 1.5 * r)
    weights[1, 3] = 0.5 * t * t
    weights[2, 0], weights[2, 1], weights[2, 2], weights[2, 3] = r, 3 * t - 2, 1 - 3 * t, t


@kernel
def spline(c: Any, cell: Cell, weights: Any, jet: Any) -> None:
    """Fill jet (10,): value, gradient x y z, second derivatives xx yy zz xy xz yz, per index."""
    i, j, k, _, _, _ = cell
    p, q, r = weights[0], weights[1], weights[2]
    v = gx = gy = gz = hxx = hyy = hzz = hxy = hxz = hyz = 0.0
    for a in range(4):
        a0 = a1 = a2 = b0 = b1 = d0 = 0.0
        for b in range(4):
            m0 = c[i + a, j + b, k]
            m1 = c[i + a, j + b, k + 1]
            m2 = c[i + a, j + b, k + 2]
            m3 = c[i + a, j + b, k + 3]
            e0 = m0 * r[0, 0] + m1 * r[0, 1] + m2 * r[0, 2] + m3 * r[0, 3]
            e1 = m0 * r[1, 0] + m1 * r[1, 1] + m2 * r[1, 2] + m3 * r[1, 3]
            e2 = m0 * r[2, 0] + m1 * r[2, 1] + m2 * r[2, 2] + m3 * r[2, 3]
            a0 += q[0, b] * e0
            a1 += q[1, b] * e0
            a2 += q[2, b] * e0
            b0 += q[0, b] * e1
            b1 += q[1, b] * e1
            d0 += q[0, b] * e2
        v += p[0, a] * a0
        gx += p[1, a] * a0
        hxx += p[2, a] * a0
        gy += p[0, a] * a1
        hxy += p[1, a] * a1
        hyy += p[0, a] * a2
        gz += p[0, a] * b0
        hxz += p[1, a] * b0
        hyz += p[0, a] * b1
        hzz += p[0, a] * d0
    jet[0], jet[1], jet[2], jet[3] = v, gx, gy, gz
    jet[4], jet[5], jet[6], jet[7], jet[8], jet[9] = hxx, hyy, hzz, hxy, hxz, hyz


@inlined
def to_world(m: Any, jet: Any) -> None:
    """Turn the derivatives of a jet from per index into per mm, in place: g <- Mᵀ g, H <- Mᵀ H M."""
    g0, g1, g2 = jet[1], jet[2], jet[3]
    xx, yy, zz, xy, xz, yz = jet[4], jet[5], jet[6], jet[7], jet[8], jet[9]
    for a in range(3):
        jet[1 + a] = m[0, a] * g0 + m[1, a] * g1 + m[2, a] * g2
    for n in range(6):
        a = n if n < 3 else (0 if n < 5 else 1)
        b = n if n < 3 else (1 if n == 3 else 2)
        h0 = xx * m[0, b] + xy * m[1, b] + xz * m[2, b]
        h1 = xy * m[0, b] + yy * m[1, b] + yz * m[2, b]
        h2 = xz * m[0, b] + yz * m[1, b] + zz * m[2, b]
        jet[4 + n] = m[0, a] * h0 + m[1, a] * h1 + m[2, a] * h2


@inlined
def fill_jet(c: Any, m: Any, cell: Cell, weights: Any, jet: Any) -> float:
    """Fill jet (10,) as ``spline``, but per mm; return its value, mm.

    m is a field's to_index, weights (3, 3, 4) is work space.
    """
    basis(cell[3], weights[0])
    basis(cell[4], weights[1])
    basis(cell[5], weights[2])
    spline(c, cell, weights, jet)
    to_world(m, jet)
    return float(jet[0])


@entry_point
def look_up(field: Field, points: Any, jets: Any) -> None:
    """Value, gradient and second derivatives (n, 10), per mm, at points (n, 3) in mm."""
    weights = np.empty((3, 3, 4))
    c, m, o = field.coefficients, field.to_index, field.origin
    for n in range(points.shape[0]):
        cell = locate(c, indices(m, o, (points[n, 0], points[n, 1], points[n, 2])))
        fill_jet(c, m, cell, weights, jets[n])


@entry_point
def bounds(c: Any, to_index: Any) -> tuple[float, float]:
    """Return (gap, slope) of a Field: proven bounds, from differences of the coefficients c.

    gap: along one axis the spline differs from the linear interpolant of its coefficients by at most
    max|second difference|/6, and both operators average, so the three axes add up.
    slope: each component of the gradient averages first differences along its axis.
    Both are taken over blocks of cells that may hold a negative distance, the only ones where a point can be
    clear of the wall: a point that starts clear meets such a cell's bound before it can touch.
    """
    gap, slope = 0.0, 0.0
    n = BLOCK + 3
    for i in range(0, c.shape[0] - 3, BLOCK):
        for j in range(0, c.shape[1] - 3, BLOCK):
            for k in range(0, c.shape[2] - 3, BLOCK):
                block = c[i : i + n, j : j + n, k : k + n]
                if block.min() > 0.0:
                    continue
                square, second = 0.0, 0.0
                for a in range(3):
                    first, bent = largest_differences(block, a)
                    second += bent
                    square += first**2 * (to_index[a, 0] ** 2 + to_index[a, 1] ** 2 + to_index[a, 2] ** 2)
                slope, gap = max(slope, math.sqrt(square)), max(gap, second / 6)
    return gap, slope


@kernel
def largest_differences(block: Any, axis: int) -> tuple[float, float]:
    """Largest first and second difference of a block of coefficients along an axis."""
    first, second = 0.0, 0.0
    di, dj, dk = int(axis == 0), int(axis == 1), int(axis == 2)
    for i in range(di, block.shape[0]):
        for j in range(dj, block.shape[1]):
            for k in range(dk, block.shape[2]):
                before = float(block[i - di, j - dj, k - dk])
                step = block[i, j, k] - before
                first = max(first, abs(step))
                if i * di + j * dj + k * dk > 1:
                    second = max(second, abs(step - before + block[i - 2 * di, j - 2 * dj, k - 2 * dk]))
    return first, second
