"""Compiled bending, twist and stretch of a discrete Kirchhoff rod: arrays and scalars in, arrays out.

Bergou, Wardetzky, Robinson, Audoly, Grinspun, "Discrete elastic rods", ACM Trans. Graph. 27 (2008) 63, with the
time-parallel frames of Bergou et al., ACM Trans. Graph. 29 (2010) 116. Unknowns are node positions and edge
angles, so stretch and twist cost energy instead of being ruled out. Edge 0 is the introducer, which never moves;
edge j >= 1 ends in node j. Unknowns are interleaved: angle of edge j at 4(j-1), node j at 4(j-1)+1..3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from data_synthetic._compile import on_disk
from data_synthetic._tolerances import HESSIAN_STEP

Array = NDArray[np.float64]
Vector = tuple[float, float, float]

BANDS = 11
"""Rows of the lower band matrix: a vertex couples three nodes and two angles, 4 unknowns apart."""


@on_disk()
def dot(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> float:
    """Scalar product."""
    return ax * bx + ay * by + az * bz


@on_disk()
def cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> Vector:
    """Vector product."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@on_disk()
def transport(
    mx: float, my: float, mz: float, ax: float, ay: float, az: float, bx: float, by: float, bz: float
) -> Vector:
    """Vector m, normal to unit a, carried by the smallest rotation that takes unit a to unit b."""
    f = dot(mx, my, mz, bx, by, bz) / (1.0 + dot(ax, ay, az, bx, by, bz))
    return mx - f * (ax + bx), my - f * (ay + by), mz - f * (az + bz)


@on_disk()
def moved_director(q: Array, k: int, t: Array, m: Array) -> tuple[float, ...]:
    """Length, tangent and director 1 of an edge at ``q[k:k+3]`` turned by ``q[k+3]`` from tangent t, director m."""
    x, y, z = q[k], q[k + 1], q[k + 2]
    length = np.sqrt(x * x + y * y + z * z)
    x, y, z = x / length, y / length, z / length
    ax, ay, az = transport(m[0], m[1], m[2], t[0], t[1], t[2], x, y, z)
    bx, by, bz = cross(x, y, z, ax, ay, az)
    c, s = np.cos(q[k + 3]), np.sin(q[k + 3])
    return length, x, y, z, c * ax + s * bx, c * ay + s * by, c * az + s * bz


@on_disk()
def vertex(
    q: Array,
    te0: Array,
    me0: Array,
    tf0: Array,
    mf0: Array,
    bend: float,
    rest: float,
    twist: float,
    g: Array,
    want_gradient: bool,
) -> float:
    """Energy of one vertex and its gradient g (8,) for q = (edge before, its angle, edge after, its angle).

    bend = EI / cell, rest = rest curvature x cell, twist = GJ / cell.
    """
    le, ex, ey, ez, ax, ay, az = moved_director(q, 0, te0, me0)
    lf, fx, fy, fz, bx, by, bz = moved_director(q, 4, tf0, mf0)
    chi = 1.0 + dot(ex, ey, ez, fx, fy, fz)
    kx, ky, kz = cross(ex, ey, ez, fx, fy, fz)
    kx, ky, kz = 2.0 * kx / chi, 2.0 * ky / chi, 2.0 * kz / chi
    cx, cy, cz = cross(ex, ey, ez, ax, ay, az)
    dx, dy, dz = cross(fx, fy, fz, bx, by, bz)
    k1 = 0.5 * dot(kx, ky, kz, cx + dx, cy + dy, cz + dz)
    k2 = -0.5 * dot(kx, ky, kz, ax + bx, ay + by, az + bz)
    ux, uy, uz = transport(ax, ay, az, ex, ey, ez, fx, fy, fz)
    wx, wy, wz = cross(ux, uy, uz, bx, by, bz)
    tau = np.arctan2(dot(wx, wy, wz, fx, fy, fz), dot(ux, uy, uz, bx, by, bz))
    energy: float = 0.5 * bend * ((k1 - rest) ** 2 + k2 * k2) + 0.5 * twist * tau * tau
    if not want_gradient:
        return energy
    p1, p2, pt = bend * (k1 - rest), bend * k2, twist * tau
    sx, sy, sz = (ex + fx) / chi, (ey + fy) / chi, (ez + fz) / chi
    ax_, ay_, az_ = (ax + bx) / chi, (ay + by) / chi, (az + bz) / chi
    cx_, cy_, cz_ = (cx + dx) / chi, (cy + dy) / chi, (cz + dz) / chi
    # p1 * director 2 - p2 * director 1 gathers both curvatures into one vector
    vx, vy, vz = p1 * cx_ - p2 * ax_, p1 * cy_ - p2 * ay_, p1 * cz_ - p2 * az_
    stretch = p1 * k1 + p2 * k2
    hx, hy, hz = cross(fx, fy, fz, vx, vy, vz)
    g[0] = (hx - stretch * sx + 0.5 * pt * kx) / le
    g[1] = (hy - stretch * sy + 0.5 * pt * ky) / le
    g[2] = (hz - stretch * sz + 0.5 * pt * kz) / le
    hx, hy, hz = cross(ex, ey, ez, vx, vy, vz)
    g[4] = (-hx - stretch * sx + 0.5 * pt * kx) / lf
    g[5] = (-hy - stretch * sy + 0.5 * pt * ky) / lf
    g[6] = (-hz - stretch * sz + 0.5 * pt * kz) / lf
    g[3] = -0.5 * (p1 * dot(kx, ky, kz, ax, ay, az) + p2 * dot(kx, ky, kz, cx, cy, cz)) - pt
    g[7] = -0.5 * (p1 * dot(kx, ky, kz, bx, by, bz) + p2 * dot(kx, ky, kz, dx, dy, dz)) + pt
    return energy


@on_disk()
def load_vertex(points: Array, angles: Array, edge0: Array, v: int, q: Array) -> None:
    """Fill q with the edges and angles around vertex v."""
    for a in range(3):
        q[a] = edge0[a] if v == 0 else points[v, a] - points[v - 1, a]
        q[4 + a] = points[v + 1, a] - points[v, a]
    q[3] = 0.0 if v == 0 else angles[v - 1]
    q[7] = angles[v]


@on_disk()
def elastic_energy(
    points: Array,
    angles: Array,
    edge0: Array,
    tangents: Array,
    directors: Array,
    bend: Array,
    rest: Array,
    twist: Array,
    axial: float,
    lengths: Array,
) -> float:
    """Stored energy, N mm. angles (n,) are increments from the directors (n + 1, 3)."""
    q, g = np.zeros(8), np.zeros(8)
    total: float = 0.0
    for v in range(len(bend)):
        load_vertex(points, angles, edge0, v, q)
        total += vertex(
            q,
            tangents[v],
            directors[v],
            tangents[v + 1],
            directors[v + 1],
            bend[v],
            rest[v],
            twist[v],
            g,
            False,
        )
        length = np.sqrt(q[4] ** 2 + q[5] ** 2 + q[6] ** 2)
        total += 0.5 * axial / lengths[v] * (length - lengths[v]) ** 2
    return total


@on_disk()
def scatter(v: int, g: Array, h: Array, gradient: Array, bands: Array) -> None:
    """Add the local gradient (8,) and Hessian (8, 8) of vertex v to the system."""
    # unknowns of the vertex: node v-1, angle e, node v, angle f, node v+1; local edges are their differences
    column = np.empty(11, np.int64)
    for a in range(3):
        column[a], column[4 + a], column[8 + a] = 4 * (v - 2) + 1 + a, 4 * (v - 1) + 1 + a, 4 * v + 1 + a
    column[3], column[7] = 4 * (v - 1), 4 * v
    jac = np.zeros((8, 11))
    for a in range(3):
        jac[a, a], jac[a, 4 + a] = -1.0, 1.0
        jac[4 + a, 4 + a], jac[4 + a, 8 + a] = -1.0, 1.0
    jac[3, 3], jac[7, 7] = 1.0, 1.0
    full = jac.T @ h @ jac
    for i in range(11):
        if column[i] < 0:
            continue
        for a in range(8):
            gradient[column[i]] += jac[a, i] * g[a]
        for j in range(i + 1):
            if column[j] >= 0:
                bands[abs(column[i] - column[j]), min(column[i], column[j])] += full[i, j]


@on_disk()
def elastic_system(
    points: Array,
    angles: Array,
    edge0: Array,
    tangents: Array,
    directors: Array,
    bend: Array,
    rest: Array,
    twist: Array,
    axial: float,
    lengths: Array,
    gradient: Array,
    bands: Array,
) -> None:
    """Gradient (4n,) and lower-band Hessian (11, 4n); the Hessian by central differences of the exact gradient."""
    q, g, gp, gm, h = np.zeros(8), np.zeros(8), np.zeros(8), np.zeros(8), np.zeros((8, 8))
    gradient[:] = 0.0
    bands[:] = 0.0
    for v in range(len(bend)):
        load_vertex(points, angles, edge0, v, q)
        te, me, tf, mf = tangents[v], directors[v], tangents[v + 1], directors[v + 1]
        vertex(q, te, me, tf, mf, bend[v], rest[v], twist[v], g, True)
        for a in range(8):
            step = HESSIAN_STEP if a % 4 == 3 else HESSIAN_STEP * lengths[v]
            kept = q[a]
            q[a] = kept + step
            vertex(q, te, me, tf, mf, bend[v], rest[v], twist[v], gp, True)
            q[a] = kept - step
            vertex(q, te, me, tf, mf, bend[v], rest[v], twist[v], gm, True)
            q[a] = kept
            for b in range(8):
                h[b, a] = 0.5 * (gp[b] - gm[b]) / step
        for a in range(8):
            for b in range(a):
                h[a, b] = h[b, a] = 0.5 * (h[a, b] + h[b, a])
        length = np.sqrt(q[4] ** 2 + q[5] ** 2 + q[6] ** 2)
        strain = 1.0 - lengths[v] / length
        for a in range(3):
            g[4 + a] += axial / lengths[v] * strain * q[4 + a]
            h[4 + a, 4 + a] += axial / lengths[v] * strain
            for b in range(3):
                h[4 + a, 4 + b] += (
                    axial / lengths[v] * (1.0 - strain) * q[4 + a] * q[4 + b] / (length * length)
                )
        scatter(v, g, h, gradient, bands)


@on_disk()
def update_directors(points: Array, angles: Array, edge0: Array, tangents: Array, directors: Array) -> None:
    """Directors after the move, in place; made orthonormal again, so that rounding cannot pile up."""
    q = np.zeros(8)
    for v in range(len(angles)):
        load_vertex(points, angles, edge0, v, q)
        _, x, y, z, ax, ay, az = moved_director(q, 4, tangents[v + 1], directors[v + 1])
        along = dot(ax, ay, az, x, y, z)
        ax, ay, az = ax - along * x, ay - along * y, az - along * z
        norm = np.sqrt(dot(ax, ay, az, ax, ay, az))
        tangents[v + 1, 0], tangents[v + 1, 1], tangents[v + 1, 2] = x, y, z
        directors[v + 1, 0], directors[v + 1, 1], directors[v + 1, 2] = ax / norm, ay / norm, az / norm


@on_disk()
def twist_free(points: Array, tangents: Array, directors: Array) -> None:
    """Tangents and directors of every edge carried without twist from edge 0, in place."""
    for v in range(len(points) - 1):
        x, y, z = (
            points[v + 1, 0] - points[v, 0],
            points[v + 1, 1] - points[v, 1],
            points[v + 1, 2] - points[v, 2],
        )
        norm = np.sqrt(x * x + y * y + z * z)
        x, y, z = x / norm, y / norm, z / norm
        d, t = directors[v], tangents[v]
        ax, ay, az = transport(d[0], d[1], d[2], t[0], t[1], t[2], x, y, z)
        along = dot(ax, ay, az, x, y, z)
        ax, ay, az = ax - along * x, ay - along * y, az - along * z
        norm = np.sqrt(dot(ax, ay, az, ax, ay, az))
        tangents[v + 1, 0], tangents[v + 1, 1], tangents[v + 1, 2] = x, y, z
        directors[v + 1, 0], directors[v + 1, 1], directors[v + 1, 2] = ax / norm, ay / norm, az / norm
