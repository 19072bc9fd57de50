"""The signed distance between its nodes: a C² natural cubic B-spline that interpolates, linear beyond the grid.

Coefficients carry one ghost layer on each side, c[-1] = 2 c[0] - c[1], which makes the second derivative
vanish on the faces; the linear continuation outside is therefore C² as well, axis by axis.
"""

import math
from typing import Any

import numpy as np

from solver._kernels.algebra import Six, Three, apply, conjugate
from solver._kernels.data import Field
from solver._kernels.flags import entry_point, inlined, kernel
from solver._kernels.lanes.vectors import four, quad, weighted

Four = tuple[float, float, float, float]
Cell = tuple[int, int, int, float, float, float]
"""Indices of a cell, and a place in it: 0 to 1 along each axis, below or above where it is outside the grid."""

SIDE_BY_SIDE = 64
"""Lines that are filtered together: 256 values of each are 128 kB."""

TOGETHER = 32
"""Lines along the last axis that are filtered together."""

# Cells along an edge of the blocks over which bounds are taken: small enough to stay local, large enough to be cheap.
BLOCK = 4


@kernel
def solve_natural(lines: Any, pivots: Any) -> None:
    """Replace the values of lines side by side (n, w) by their natural B-spline coefficients (Thomas on 1 4 1)."""
    n, w = lines.shape
    for i in range(1, n - 1):
        for m in range(w):
            lines[i, m] = (6.0 * lines[i, m] - lines[i - 1, m]) * pivots[i]
    for i in range(n - 2, 0, -1):
        for m in range(w):
            lines[i, m] -= pivots[i] * lines[i + 1, m]


@kernel
def solve_rows(rows: Any, pivots: Any) -> None:
    """The same for lines one after the other in memory (w, n): a step of each in turn, so that none waits on itself."""
    w, n = rows.shape
    for i in range(1, n - 1):
        for m in range(w):
            rows[m, i] = (6.0 * rows[m, i] - rows[m, i - 1]) * pivots[i]
    for i in range(n - 2, 0, -1):
        for m in range(w):
            rows[m, i] -= pivots[i] * rows[m, i + 1]


@entry_point
def prefilter(values: Any) -> None:
    """Turn node values (nx, ny, nz) into spline coefficients, in place, along one axis after the other.

    SIDE_BY_SIDE lines at a time: one alone would fetch a row of the cache for each of its values (3.6 times as long).
    """
    flat, pivots = values.reshape(values.size), np.zeros(max(values.shape))
    for i in range(1, pivots.size - 1):
        pivots[i] = 1.0 / (4.0 - pivots[i - 1])
    n = values.shape[2]
    for first in range(0, flat.size // n, TOGETHER):
        solve_rows(flat.reshape(flat.size // n, n)[first : first + TOGETHER], pivots)
    stride = n
    for n in values.shape[1::-1]:
        for start in range(0, flat.size, n * stride):
            lines = flat[start : start + n * stride].reshape(n, stride)
            for first in range(0, stride, SIDE_BY_SIDE):
                solve_natural(lines[:, first : first + SIDE_BY_SIDE], pivots)
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
def depth_in_grid(c: Any, f: Three) -> float:
    """How far inside a field's nodes continuous indices lie, in indices; negative outside."""
    s = c.shape
    low = min(f[0], f[1], f[2])
    return float(min(low, s[0] - 3 - f[0], s[1] - 3 - f[1], s[2] - 3 - f[2]))


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
    s = min(max(t, 0.0), 1.0)
    r, beyond, (a, b, c, d) = 1 - s, t - s, slopes(t)
    return (
        r * r * r * (1 / 6) + beyond * a,
        2.0 / 3 - s * s * (1 - 0.5 * s) + beyond * b,
        2.0 / 3 - r * r * (1 - 0.5 * r) + beyond * c,
        s * s * s * (1 / 6) + beyond * d,
    )


@inlined
def slopes(t: float) -> Four:
    """Derivatives of ``cubic`` per index."""
    s = min(max(t, 0.0), 1.0)
    r = 1 - s
    return -0.5 * r * r, s * (1.5 * s - 2), r * (2 - 1.5 * r), 0.5 * s * s


@inlined
def bends(t: float) -> Four:
    """Second derivatives of ``cubic`` per index; beyond the grid the ghost layer makes their sum 0."""
    s = min(max(t, 0.0), 1.0)
    return 1 - s, 3 * s - 2, 1 - 3 * s, s


@inlined
def plane(c: Any, i: int, j: int, k: int, q: Four) -> Any:
    """Weighted sum of four rows of four coefficients."""
    return (
        four(c, i, j, k) * q[0]
        + four(c, i, j + 1, k) * q[1]
        + four(c, i, j + 2, k) * q[2]
        + four(c, i, j + 3, k) * q[3]
    )


@kernel
def value(c: Any, cell: Cell) -> float:
    """The spline alone, without derivatives: a third of the cost."""
    i, j, k, u, v, w = cell
    p, q = cubic(u), cubic(v)
    low = plane(c, i, j, k, q) * p[0] + plane(c, i + 1, j, k, q) * p[1]
    return weighted(low + plane(c, i + 2, j, k, q) * p[2] + plane(c, i + 3, j, k, q) * p[3], quad(cubic(w)))


@inlined
def layer(c: Any, cell: Cell, a: int, q: tuple[Four, Four, Four]) -> Any:
    """The coefficients of plane a of a cell, weighted by ``cubic``, ``slopes`` and ``bends`` along the second axis."""
    i, j, k, _, _, _ = cell
    one, two, three, last = (
        four(c, i + a, j, k),
        four(c, i + a, j + 1, k),
        four(c, i + a, j + 2, k),
        four(c, i + a, j + 3, k),
    )
    return (
        one * q[0][0] + two * q[0][1] + three * q[0][2] + last * q[0][3],
        one * q[1][0] + two * q[1][1] + three * q[1][2] + last * q[1][3],
        one * q[2][0] + two * q[2][1] + three * q[2][2] + last * q[2][3],
    )


@inlined
def across(w: Four, a: Any, b: Any, c: Any, d: Any) -> Any:
    """Weighted sum of four layers."""
    return a * w[0] + b * w[1] + c * w[2] + d * w[3]


@kernel
def spline(c: Any, cell: Cell) -> tuple[Four, Six]:
    """Value and gradient x y z, second derivatives xx yy zz xy xz yz, per index."""
    _, _, _, u, v, w = cell
    p, dp, r, dr = cubic(u), slopes(u), quad(cubic(w)), quad(slopes(w))
    q = cubic(v), slopes(v), bends(v)
    a, b, e, f = layer(c, cell, 0, q), layer(c, cell, 1, q), layer(c, cell, 2, q), layer(c, cell, 3, q)
    here, x = across(p, a[0], b[0], e[0], f[0]), across(dp, a[0], b[0], e[0], f[0])
    y, xy = across(p, a[1], b[1], e[1], f[1]), across(dp, a[1], b[1], e[1], f[1])
    xx, yy = across(bends(u), a[0], b[0], e[0], f[0]), across(p, a[2], b[2], e[2], f[2])
    first = weighted(here, r), weighted(x, r), weighted(y, r), weighted(here, dr)
    second = weighted(xx, r), weighted(yy, r), weighted(here, quad(bends(w)))
    return first, (*second, weighted(xy, r), weighted(x, dr), weighted(y, dr))


@inlined
def jet_at(c: Any, m: Any, cell: Cell) -> tuple[Four, Six]:
    """``spline`` with its derivatives per mm; m is a field's to_index."""
    return per_mm(m, spline(c, cell))


@inlined
def per_mm(m: Any, jet: tuple[Four, Six]) -> tuple[Four, Six]:
    """Derivatives per mm from those per index: g <- Mᵀ g, H <- Mᵀ H M; m is a field's to_index."""
    (phi, g0, g1, g2), h = jet
    turn = (m[0, 0], m[1, 0], m[2, 0], m[0, 1], m[1, 1], m[2, 1], m[0, 2], m[1, 2], m[2, 2])
    g0, g1, g2 = apply(turn, (g0, g1, g2))
    return (phi, g0, g1, g2), conjugate(turn, h)


@entry_point
def look_up(field: Field, points: Any, jets: Any) -> None:
    """Value, gradient and second derivatives (n, 10), per mm, at points (n, 3) in mm."""
    c, m, o = field.coefficients, field.to_index, field.origin
    for n in range(points.shape[0]):
        cell = locate(c, indices(m, o, (points[n, 0], points[n, 1], points[n, 2])))
        store_jet(jets, n, jet_at(c, m, cell))


@inlined
def store_jet(jets: Any, n: int, jet: tuple[Four, Six]) -> float:
    """Write row n of an array (m, 10); return its value, mm."""
    first, second = jet
    jets[n, 0], jets[n, 1], jets[n, 2], jets[n, 3] = first
    jets[n, 4], jets[n, 5], jets[n, 6], jets[n, 7], jets[n, 8], jets[n, 9] = second
    return first[0]


@entry_point
def bounds(c: Any, to_index: Any, inside: Any) -> tuple[float, float]:
    """Return (gap, slope) of a Field: proven bounds, from differences of the coefficients c.

    gap: along one axis the spline differs from the linear interpolant of its coefficients by at most
    max|second difference|/6, and both operators average, so the three axes add up.
    slope: each component of the gradient averages first differences along its axis.
    Both are taken over blocks of cells that may hold a negative distance, the only ones where a point can be
    clear of the wall: a point that starts clear meets such a cell's bound before it can touch.
    inside : room for a mark (uint8) of each block of BLOCK coefficients along each axis.
    """
    gap, slope = 0.0, 0.0
    n = BLOCK + 3
    mark_inside(c, inside)
    for i in range(0, c.shape[0] - 3, BLOCK):
        for j in range(0, c.shape[1] - 3, BLOCK):
            for k in range(0, c.shape[2] - 3, BLOCK):
                p, q, r = i // BLOCK, j // BLOCK, k // BLOCK
                if inside[p : p + 2, q : q + 2, r : r + 2].max() == 0:
                    continue
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
def mark_inside(c: Any, inside: Any) -> None:
    """Mark with 1, else 0, the blocks of which a coefficient is not positive; each coefficient is looked at once."""
    inside[:] = 0
    for i in range(c.shape[0]):
        for j in range(c.shape[1]):
            for k in range(c.shape[2]):
                if c[i, j, k] <= 0.0:
                    inside[i // BLOCK, j // BLOCK, k // BLOCK] = 1


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
