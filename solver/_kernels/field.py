"""The signed distance between its nodes: a C² natural cubic B-spline that interpolates, linear beyond the grid.

Coefficients carry one ghost layer on each side, c[-1] = 2 c[0] - c[1], which makes the second derivative
vanish on the faces; the linear continuation outside is therefore C² as well, axis by axis.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from solver._kernels.algebra import Three
from solver._kernels.flags import entry_point, inlined, kernel

Four = tuple[float, float, float, float]

# Cells along an edge of the blocks over which bounds are taken: small enough to stay local, large enough to be cheap.
BLOCK = 4


class Field(NamedTuple):
    """An interpolated scalar field.

    coefficients : (nx + 2, ny + 2, nz + 2) float32.     to_index : (3, 3), index per mm.     origin : (3,) mm.
    gap : bound on |trilinear look-up - spline|, mm.     slope : bound on |gradient|, mm per mm.
    """

    coefficients: Any
    to_index: Any
    origin: Any
    gap: float
    slope: float


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
    """Turn node values into spline coefficients, in place, along the three axes."""
    nx, ny, nz = values.shape
    scratch = np.empty(max(nx, ny, nz))
    line = np.empty(max(nx, ny, nz))
    for i in range(nx):
        for j in range(ny):
            solve_natural(values[i, j], scratch)
    for i in range(nx):
        for k in range(nz):
            for j in range(ny):
                line[j] = values[i, j, k]
            solve_natural(line[:ny], scratch)
            for j in range(ny):
                values[i, j, k] = line[j]
    for j in range(ny):
        for k in range(nz):
            for i in range(nx):
                line[i] = values[i, j, k]
            solve_natural(line[:nx], scratch)
            for i in range(nx):
                values[i, j, k] = line[i]


@inlined
def cell_of(f: float, last: int) -> tuple[int, float]:
    """Cell and place in it of a continuous index; places outside 0 to 1 are outside the grid."""
    # the clip also catches what does not fit an integer
    i = int(min(max(f, 0.0), float(last)))
    return i, f - i


@inlined
def indices(m: Any, o: Any, x: float, y: float, z: float) -> Three:
    """Continuous indices of a point in mm; m and o are a field's to_index and origin."""
    d0, d1, d2 = x - o[0], y - o[1], z - o[2]
    return (
        m[0, 0] * d0 + m[0, 1] * d1 + m[0, 2] * d2,
        m[1, 0] * d0 + m[1, 1] * d1 + m[1, 2] * d2,
        m[2, 0] * d0 + m[2, 1] * d1 + m[2, 2] * d2,
    )


@inlined
def locate(c: Any, f: Three) -> tuple[int, int, int, float, float, float]:
    """Cell of continuous indices in a field's coefficients c, and the place in it."""
    shape = c.shape
    i, r = cell_of(f[0], shape[0] - 4)
    j, s = cell_of(f[1], shape[1] - 4)
    k, t = cell_of(f[2], shape[2] - 4)
    return i, j, k, r, s, t


@inlined
def in_grid(c: Any, f: Three) -> bool:
    """Whether continuous indices lie among a field's nodes."""
    shape = c.shape
    return bool(0.0 <= f[0] <= shape[0] - 3 and 0.0 <= f[1] <= shape[1] - 3 and 0.0 <= f[2] <= shape[2] - 3)


@inlined
def trilinear(c: Any, i: int, j: int, k: int, r: float, s: float, t: float) -> float:
    """Trilinear look-up among the coefficients: within ``field.gap`` of the spline, at a tenth of its cost."""
    low = (c[i + 1, j + 1, k + 1] * (1 - t) + c[i + 1, j + 1, k + 2] * t) * (1 - s)
    low += (c[i + 1, j + 2, k + 1] * (1 - t) + c[i + 1, j + 2, k + 2] * t) * s
    high = (c[i + 2, j + 1, k + 1] * (1 - t) + c[i + 2, j + 1, k + 2] * t) * (1 - s)
    high += (c[i + 2, j + 2, k + 1] * (1 - t) + c[i + 2, j + 2, k + 2] * t) * s
    return float(low * (1 - r) + high * r)


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
    weights[2, 0] = r
    weights[2, 1] = 3 * t - 2
    weights[2, 2] = 1 - 3 * t
    weights[2, 3] = t


@kernel
def set_basis(r: float, s: float, t: float, weights: Any) -> None:
    """Fill (3, 3, 4) weights for a place in a cell."""
    basis(r, weights[0])
    basis(s, weights[1])
    basis(t, weights[2])


@kernel
def spline(c: Any, i: int, j: int, k: int, weights: Any, jet: Any) -> None:
    """Fill jet (10,): value, gradient x y z, second derivatives xx yy zz xy xz yz, per index."""
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
def cubic(t: float) -> Four:
    """Weights of the four coefficients around t, the first row of ``basis``: linear beyond the grid."""
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
    return (
        row(c, i, j, k, r) * q[0]
        + row(c, i, j + 1, k, r) * q[1]
        + row(c, i, j + 2, k, r) * q[2]
        + row(c, i, j + 3, k, r) * q[3]
    )


@kernel
def value(c: Any, i: int, j: int, k: int, u: float, v: float, w: float) -> float:
    """The spline alone at a place in a cell, without derivatives: a third of the cost."""
    p, q, r = cubic(u), cubic(v), cubic(w)
    return (
        plane(c, i, j, k, q, r) * p[0]
        + plane(c, i + 1, j, k, q, r) * p[1]
        + plane(c, i + 2, j, k, q, r) * p[2]
        + plane(c, i + 3, j, k, q, r) * p[3]
    )


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


@entry_point
def look_up(field: Field, points: Any, jets: Any) -> None:
    """Value, gradient and second derivatives (n, 10), per mm, at points (n, 3) in mm."""
    weights = np.empty((3, 3, 4))
    c, m, o = field.coefficients, field.to_index, field.origin
    for n in range(points.shape[0]):
        i, j, k, r, s, t = locate(c, indices(m, o, points[n, 0], points[n, 1], points[n, 2]))
        set_basis(r, s, t, weights)
        spline(c, i, j, k, weights, jets[n])
        to_world(m, jets[n])


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
    first, second = np.empty(3), np.empty(3)
    for i in range(0, c.shape[0] - 3, BLOCK):
        for j in range(0, c.shape[1] - 3, BLOCK):
            for k in range(0, c.shape[2] - 3, BLOCK):
                if largest_differences(c, i, j, k, first, second) > 0.0:
                    continue
                square = 0.0
                for a in range(3):
                    scale = to_index[a, 0] ** 2 + to_index[a, 1] ** 2 + to_index[a, 2] ** 2
                    square += first[a] ** 2 * scale
                slope = max(slope, math.sqrt(square))
                gap = max(gap, (second[0] + second[1] + second[2]) / 6)
    return gap, slope


@kernel
def largest_differences(c: Any, i0: int, j0: int, k0: int, first: Any, second: Any) -> float:
    """Largest first and second differences (3,) in the support of a block of cells; return its least value."""
    n = BLOCK + 3
    i1, j1, k1 = min(i0 + n, c.shape[0]), min(j0 + n, c.shape[1]), min(k0 + n, c.shape[2])
    least = math.inf
    for a in range(3):
        first[a] = second[a] = 0.0
    for i in range(i0, i1):
        for j in range(j0, j1):
            for k in range(k0, k1):
                here = float(c[i, j, k])
                least = min(least, here)
                if i > i0:
                    step = here - c[i - 1, j, k]
                    first[0] = max(first[0], abs(step))
                    if i > i0 + 1:
                        second[0] = max(second[0], abs(step - c[i - 1, j, k] + c[i - 2, j, k]))
                if j > j0:
                    step = here - c[i, j - 1, k]
                    first[1] = max(first[1], abs(step))
                    if j > j0 + 1:
                        second[1] = max(second[1], abs(step - c[i, j - 1, k] + c[i, j - 2, k]))
                if k > k0:
                    step = here - c[i, j, k - 1]
                    first[2] = max(first[2], abs(step))
                    if k > k0 + 1:
                        second[2] = max(second[2], abs(step - c[i, j, k - 1] + c[i, j, k - 2]))
    return least
