"""The signed distance between its nodes: a C² natural cubic B-spline that interpolates, linear beyond the grid.

Coefficients carry one ghost layer on each side, c[-1] = 2 c[0] - c[1], which makes the second derivative
vanish on the faces; the linear continuation outside is therefore C² as well, axis by axis.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from solver._kernels.flags import inlined, kernel


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


@kernel
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
            line[:ny] = values[i, :, k]
            solve_natural(line[:ny], scratch)
            values[i, :, k] = line[:ny]
    for j in range(ny):
        for k in range(nz):
            line[:nx] = values[:, j, k]
            solve_natural(line[:nx], scratch)
            values[:, j, k] = line[:nx]


@inlined
def locate(field: Field, x: float, y: float, z: float, fraction: Any) -> tuple[int, int, int, bool]:
    """Cell of a point and its place in it (into ``fraction``); the flag says that it lies in the grid."""
    inside = True
    cell = (0, 0, 0)
    d0 = x - field.origin[0]
    d1 = y - field.origin[1]
    d2 = z - field.origin[2]
    for a in range(3):
        f = field.to_index[a, 0] * d0 + field.to_index[a, 1] * d1 + field.to_index[a, 2] * d2
        last = field.coefficients.shape[a] - 4
        i = min(max(int(np.floor(min(max(f, 0.0), 1e9))), 0), last)
        fraction[a] = f - i
        if not 0.0 <= fraction[a] <= 1.0:
            inside = False
        if a == 0:
            cell = (i, cell[1], cell[2])
        elif a == 1:
            cell = (cell[0], i, cell[2])
        else:
            cell = (cell[0], cell[1], i)
    return cell[0], cell[1], cell[2], inside


@inlined
def trilinear(field: Field, i: int, j: int, k: int, fraction: Any) -> float:
    """Trilinear look-up among the coefficients: within ``field.gap`` of the spline, at a tenth of its cost."""
    c = field.coefficients
    r, s, t = fraction[0], fraction[1], fraction[2]
    low = (c[i + 1, j + 1, k + 1] * (1 - t) + c[i + 1, j + 1, k + 2] * t) * (1 - s)
    low += (c[i + 1, j + 2, k + 1] * (1 - t) + c[i + 1, j + 2, k + 2] * t) * s
    high = (c[i + 2, j + 1, k + 1] * (1 - t) + c[i + 2, j + 1, k + 2] * t) * (1 - s)
    high += (c[i + 2, j + 2, k + 1] * (1 - t) + c[i + 2, j + 2, k + 2] * t) * s
    return float(low * (1 - r) + high * r)


@inlined
def basis(t: float, weights: Any) -> None:
    """Fill (3, 4) weights: value, first and second derivative per index of the four coefficients around t."""
    if t < 0.0 or t > 1.0:
        weights[0, 0], weights[0, 1], weights[0, 2], weights[0, 3] = 0.0, 1 - t, t, 0.0
        weights[1, 0], weights[1, 1], weights[1, 2], weights[1, 3] = 0.0, -1.0, 1.0, 0.0
        weights[2, 0], weights[2, 1], weights[2, 2], weights[2, 3] = 0.0, 0.0, 0.0, 0.0
        return
    r = 1 - t
    weights[0, 0] = r * r * r / 6
    weights[0, 1] = 2.0 / 3 - t * t * (1 - 0.5 * t)
    weights[0, 2] = 2.0 / 3 - r * r * (1 - 0.5 * r)
    weights[0, 3] = t * t * t / 6
    weights[1, 0] = -0.5 * r * r
    weights[1, 1] = t * (1.5 * t - 2)
    weights[1, 2] = r * (2 - 1.5 * r)
    weights[1, 3] = 0.5 * t * t
    weights[2, 0] = r
    weights[2, 1] = 3 * t - 2
    weights[2, 2] = 1 - 3 * t
    weights[2, 3] = t


@kernel
def spline(field: Field, i: int, j: int, k: int, weights: Any, jet: Any) -> None:
    """Fill jet (10,): value, gradient x y z, second derivatives xx yy zz xy xz yz, per index."""
    c = field.coefficients
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


@kernel
def value(field: Field, i: int, j: int, k: int, weights: Any) -> float:
    """The spline alone, without derivatives: a third of the cost."""
    c = field.coefficients
    p, q, r = weights[0, 0], weights[1, 0], weights[2, 0]
    total = 0.0
    for a in range(4):
        plane = 0.0
        for b in range(4):
            row = c[i + a, j + b, k] * r[0] + c[i + a, j + b, k + 1] * r[1]
            row += c[i + a, j + b, k + 2] * r[2] + c[i + a, j + b, k + 3] * r[3]
            plane += q[b] * row
        total += p[a] * plane
    return total


@inlined
def to_world(field: Field, jet: Any) -> None:
    """Turn the derivatives of a jet from per index into per mm, in place: g <- Mᵀ g, H <- Mᵀ H M."""
    m = field.to_index
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


@kernel
def look_up(field: Field, points: Any, jets: Any) -> None:
    """Value, gradient and second derivatives (n, 10), per mm, at points (n, 3) in mm."""
    fraction = np.empty(3)
    weights = np.empty((3, 3, 4))
    for n in range(points.shape[0]):
        i, j, k, _ = locate(field, points[n, 0], points[n, 1], points[n, 2], fraction)
        for a in range(3):
            basis(fraction[a], weights[a])
        spline(field, i, j, k, weights, jets[n])
        to_world(field, jets[n])


@kernel
def bounds(coefficients: Any, to_index: Any) -> tuple[float, float]:
    """Return (gap, slope) of a Field: proven bounds, from differences of the coefficients.

    gap: along one axis the spline differs from the linear interpolant of its coefficients by at most
    max|second difference|/6, and both operators average, so the three axes add up.
    slope: each component of the gradient averages first differences along its axis.
    """
    shape = coefficients.shape
    first = np.zeros(3)
    second = np.zeros(3)
    for i in range(shape[0]):
        for j in range(shape[1]):
            for k in range(shape[2]):
                c = float(coefficients[i, j, k])
                for a in range(3):
                    p = (i + (a == 0), j + (a == 1), k + (a == 2))
                    if p[a] == shape[a]:
                        continue
                    step = coefficients[p] - c
                    first[a] = max(first[a], abs(step))
                    if (i, j, k)[a] > 0:
                        back = c - coefficients[i - (a == 0), j - (a == 1), k - (a == 2)]
                        second[a] = max(second[a], abs(step - back))
    slope = 0.0
    for a in range(3):
        slope += first[a] ** 2 * (to_index[a, 0] ** 2 + to_index[a, 1] ** 2 + to_index[a, 2] ** 2)
    return (second[0] + second[1] + second[2]) / 6, np.sqrt(slope)
