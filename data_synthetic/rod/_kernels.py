"""Compiled bending, twist and stretch of a discrete Kirchhoff rod: arrays and numbers in, arrays out.

Bergou, Wardetzky, Robinson, Audoly, Grinspun, "Discrete elastic rods", ACM Trans. Graph. 27 (2008) 63, with the
time-parallel frames of Bergou et al., ACM Trans. Graph. 29 (2010) 116. Unknowns are node positions and edge
angles, so stretch and twist cost energy instead of being ruled out. Edge 0 is the introducer, which never moves;
edge j >= 1 ends in node j. Unknowns are interleaved: angle of edge j at 4(j-1), node j at 4(j-1)+1..3.
"""

from typing import NamedTuple

import numpy as np

from data_synthetic._compile import on_disk, part_of_callers
from data_synthetic.geometry import Array, Index

Vector = tuple[float, float, float]

BANDS = 11
"""Rows of the lower band matrix: a vertex couples three nodes and two angles, 4 unknowns apart."""
PLUS = np.array([-1, -1, -1, 3, 0, 1, 2, 7, 4, 5, 6])
MINUS = np.array([0, 1, 2, -1, 4, 5, 6, -1, -1, -1, -1])
"""About a vertex each unknown (11,), of node v - 1, angle, node v, angle, node v + 1, is part of one edge or angle
(8,) as it is, and of another with its sign changed; -1 is none."""
HESSIAN_STEP = 1e-6
"""Relative step of the central difference of the exact gradient; its error is about 1e-10 of the stiffness."""


class Elastic(NamedTuple):
    """What stays of a rod of n edges while it relaxes; vertex v lies between edges v and v + 1.

    introducer : direction (3,) of edge 0.     lengths (n,) : of the edges at rest, mm.     axial : EA in N.
    bend, rest, twist (n,) : EI / cell, rest curvature x cell, GJ / cell of every vertex.
    """

    introducer: Array
    lengths: Array
    bend: Array
    rest: Array
    twist: Array
    axial: float


class Shape(NamedTuple):
    """Nodes (n + 1, 3), tangents and directors (n + 1, 3) of the introducer and the n edges."""

    points: Array
    tangents: Array
    directors: Array


Edge = tuple[Vector, Vector]
Vertex = tuple[Edge, Edge, Vector]
"""Tangent and director of the edges before and after a vertex, and its EI / cell, rest curvature x cell, GJ / cell."""


@part_of_callers()
def dot(a: Vector, b: Vector) -> float:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@part_of_callers()
def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@part_of_callers()
def plus(a: Vector, b: Vector) -> Vector:
    """Sum."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@part_of_callers()
def row(values: Array, i: int) -> Vector:
    """Row i of an array (n, 3)."""
    return values[i, 0], values[i, 1], values[i, 2]


@part_of_callers()
def transport(m: Vector, a: Vector, b: Vector) -> Vector:
    """Vector m, normal to unit a, carried by the smallest rotation that takes unit a to unit b."""
    f = dot(m, b) / (1.0 + dot(a, b))
    return m[0] - f * (a[0] + b[0]), m[1] - f * (a[1] + b[1]), m[2] - f * (a[2] + b[2])


@part_of_callers()
def moved_edge(q: Array, k: int, tangent: Vector, director: Vector) -> tuple[float, Vector, Vector]:
    """Length, tangent and director 1 of the edge ``q[k:k+3]``, turned by ``q[k+3]`` from its tangent and director."""
    x, y, z = q[k], q[k + 1], q[k + 2]
    length = np.sqrt(x * x + y * y + z * z)
    t = (x / length, y / length, z / length)
    a = transport(director, tangent, t)
    b = cross(t, a)
    c, s = np.cos(q[k + 3]), np.sin(q[k + 3])
    return length, t, (c * a[0] + s * b[0], c * a[1] + s * b[1], c * a[2] + s * b[2])


@part_of_callers()
def at_vertex(v: int, shape: Shape, rod: Elastic) -> Vertex:
    """What stays of vertex v while its edges move. Arrays handed on call by call would take as long as the rest."""
    before, after = row(shape.tangents, v), row(shape.tangents, v + 1)
    directors = row(shape.directors, v), row(shape.directors, v + 1)
    return (before, directors[0]), (after, directors[1]), (rod.bend[v], rod.rest[v], rod.twist[v])


@part_of_callers()
def vertex(q: Array, at: Vertex, g: Array, want_gradient: bool) -> float:
    """Energy of a vertex and its gradient g (8,) for q = (edge before, its angle, edge after, its angle)."""
    old, new, (bend, rest, twist) = at
    le, e, a = moved_edge(q, 0, old[0], old[1])
    lf, f, b = moved_edge(q, 4, new[0], new[1])
    chi = 1.0 + dot(e, f)
    k = cross(e, f)
    k = (2.0 * k[0] / chi, 2.0 * k[1] / chi, 2.0 * k[2] / chi)
    c, d = cross(e, a), cross(f, b)
    ab, cd = plus(a, b), plus(c, d)
    k1, k2 = 0.5 * dot(k, cd), -0.5 * dot(k, ab)
    u = transport(a, e, f)
    w = cross(u, b)
    tau = np.arctan2(dot(w, f), dot(u, b))
    energy: float = 0.5 * bend * ((k1 - rest) ** 2 + k2 * k2) + 0.5 * twist * tau * tau
    if not want_gradient:
        return energy
    p1, p2, pt = bend * (k1 - rest), bend * k2, twist * tau
    # p1 * director 2 - p2 * director 1 gathers both curvatures into one vector
    both = (
        p1 * (cd[0] / chi) - p2 * (ab[0] / chi),
        p1 * (cd[1] / chi) - p2 * (ab[1] / chi),
        p1 * (cd[2] / chi) - p2 * (ab[2] / chi),
    )
    stretch = p1 * k1 + p2 * k2
    before, after = cross(f, both), cross(e, both)
    for i in range(3):
        mean = (e[i] + f[i]) / chi
        g[i] = (before[i] - stretch * mean + 0.5 * pt * k[i]) / le
        g[4 + i] = (-after[i] - stretch * mean + 0.5 * pt * k[i]) / lf
    g[3] = -0.5 * (p1 * dot(k, a) + p2 * dot(k, c)) - pt
    g[7] = -0.5 * (p1 * dot(k, b) + p2 * dot(k, d)) + pt
    return energy


@part_of_callers()
def load_vertex(points: Array, angles: Array, introducer: Array, v: int, q: Array) -> None:
    """Fill q with the edges and angles around vertex v."""
    for a in range(3):
        q[a] = introducer[a] if v == 0 else points[v, a] - points[v - 1, a]
        q[4 + a] = points[v + 1, a] - points[v, a]
    q[3] = 0.0 if v == 0 else angles[v - 1]
    q[7] = angles[v]


@on_disk()
def elastic_energy(points: Array, angles: Array, shape: Shape, rod: Elastic) -> float:
    """Stored energy, N mm, of nodes (n + 1, 3); angles (n,) are increments from the directors of a shape."""
    q, g = np.zeros(8), np.zeros(8)
    total: float = 0.0
    for v in range(len(rod.bend)):
        load_vertex(points, angles, rod.introducer, v, q)
        total += vertex(q, at_vertex(v, shape, rod), g, False)
        length = np.sqrt(q[4] ** 2 + q[5] ** 2 + q[6] ** 2)
        total += 0.5 * rod.axial / rod.lengths[v] * (length - rod.lengths[v]) ** 2
    return total


@part_of_callers()
def entry(values: Array, a: int) -> float:
    """Value a of (8,); 0 where there is none."""
    return values[a] if a >= 0 else 0.0


@part_of_callers()
def scatter(v: int, g: Array, h: Array, gradient: Array, bands: Array) -> None:
    """Add the local gradient (8,) and Hessian (8, 8) of vertex v to the system."""
    first = 4 * v - 7  # unknown of node v - 1; those of the clamp are negative
    for i in range(max(0, -first), BANDS):
        gradient[first + i] += entry(g, PLUS[i])
        gradient[first + i] -= entry(g, MINUS[i])
        for j in range(max(0, -first), i + 1):
            plus = entry(h[:, PLUS[j]], PLUS[i]) - entry(h[:, PLUS[j]], MINUS[i]) if PLUS[j] >= 0 else 0.0
            minus = entry(h[:, MINUS[j]], PLUS[i]) - entry(h[:, MINUS[j]], MINUS[i]) if MINUS[j] >= 0 else 0.0
            bands[i - j, first + j] += plus - minus


@part_of_callers()
def bend_and_twist(q: Array, at: Vertex, length: float, g: Array, h: Array) -> None:
    """Fill gradient g (8,) and Hessian h (8, 8) of a vertex; h by central differences of the exact gradient.

    length : of the edge after it at rest, mm.
    """
    gp, gm = np.zeros(8), np.zeros(8)
    vertex(q, at, g, True)
    for a in range(8):
        step = HESSIAN_STEP if a % 4 == 3 else HESSIAN_STEP * length
        kept = q[a]
        q[a] = kept + step
        vertex(q, at, gp, True)
        q[a] = kept - step
        vertex(q, at, gm, True)
        q[a] = kept
        for b in range(8):
            h[b, a] = 0.5 * (gp[b] - gm[b]) / step
    for a in range(8):
        for b in range(a):
            h[a, b] = h[b, a] = 0.5 * (h[a, b] + h[b, a])


@on_disk()
def elastic_system(shape: Shape, rod: Elastic, gradient: Array, bands: Array) -> None:
    """Fill gradient (4n,) and lower-band Hessian (11, 4n) of the stored energy."""
    q, g, h, angles = np.zeros(8), np.zeros(8), np.zeros((8, 8)), np.zeros(len(rod.bend))
    gradient[:] = 0.0
    bands[:] = 0.0
    for v in range(len(rod.bend)):
        load_vertex(shape.points, angles, rod.introducer, v, q)
        bend_and_twist(q, at_vertex(v, shape, rod), rod.lengths[v], g, h)
        length = np.sqrt(q[4] ** 2 + q[5] ** 2 + q[6] ** 2)
        strain = 1.0 - rod.lengths[v] / length
        stiffness = rod.axial / rod.lengths[v]
        for a in range(3):
            g[4 + a] += stiffness * strain * q[4 + a]
            h[4 + a, 4 + a] += stiffness * strain
            for b in range(3):
                h[4 + a, 4 + b] += stiffness * (1.0 - strain) * q[4 + a] * q[4 + b] / (length * length)
        scatter(v, g, h, gradient, bands)


@on_disk()
def add_blocks(bands: Array, low: Index, high: Index, block: Array) -> None:
    """Add blocks (n, 3, 3) for pairs of nodes low <= high to the lower bands; node 0 is clamped and has no unknowns."""
    for n in range(len(low)):
        if low[n] <= 0:
            continue
        row, column = 4 * (high[n] - 1) + 1, 4 * (low[n] - 1) + 1
        for a in range(3):
            for b in range(3):
                if row + a >= column + b:
                    bands[row + a - column - b, column + b] += block[n, a, b]


@part_of_callers()
def set_edge(tangents: Array, directors: Array, j: int, t: Vector, a: Vector) -> None:
    """Tangent t and director a of edge j, made orthonormal again, so that rounding cannot pile up."""
    along = dot(a, t)
    a = (a[0] - along * t[0], a[1] - along * t[1], a[2] - along * t[2])
    norm = np.sqrt(dot(a, a))
    for i in range(3):
        tangents[j, i], directors[j, i] = t[i], a[i] / norm


@on_disk()
def carry(points: Array, angles: Array, tangents: Array, directors: Array, along: bool) -> None:
    """Tangents and directors (n + 1, 3) of moved nodes, in place; edge 0, the introducer, stays.

    Each edge carries its own old ones and turns them by ``angles`` (n,); with ``along``, it carries those of the edge
    before it (without twist where the angles are 0).
    """
    q = np.zeros(8)
    for v in range(len(angles)):
        load_vertex(points, angles, tangents[0], v, q)
        old = v if along else v + 1
        _, t, a = moved_edge(q, 4, row(tangents, old), row(directors, old))
        set_edge(tangents, directors, v + 1, t, a)
