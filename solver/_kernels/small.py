"""3x3 algebra on scalars: no arrays, so that the compiler keeps everything in registers.

Symmetric matrices are six numbers (xx, yy, zz, xy, xz, yz), general ones nine, row by row.
"""

from __future__ import annotations

from typing import Any

from solver._kernels.flags import inlined

Six = tuple[float, float, float, float, float, float]
Nine = tuple[float, float, float, float, float, float, float, float, float]
Three = tuple[float, float, float]

ZERO3 = (0.0, 0.0, 0.0)
ZERO6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
ZERO9 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inlined
def times(a: Nine, b: Nine) -> Nine:
    """A B."""
    return (
        a[0] * b[0] + a[1] * b[3] + a[2] * b[6],
        a[0] * b[1] + a[1] * b[4] + a[2] * b[7],
        a[0] * b[2] + a[1] * b[5] + a[2] * b[8],
        a[3] * b[0] + a[4] * b[3] + a[5] * b[6],
        a[3] * b[1] + a[4] * b[4] + a[5] * b[7],
        a[3] * b[2] + a[4] * b[5] + a[5] * b[8],
        a[6] * b[0] + a[7] * b[3] + a[8] * b[6],
        a[6] * b[1] + a[7] * b[4] + a[8] * b[7],
        a[6] * b[2] + a[7] * b[5] + a[8] * b[8],
    )


@inlined
def times_transposed(a: Nine, b: Nine) -> Nine:
    """A Bᵀ."""
    return (
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2],
        a[0] * b[3] + a[1] * b[4] + a[2] * b[5],
        a[0] * b[6] + a[1] * b[7] + a[2] * b[8],
        a[3] * b[0] + a[4] * b[1] + a[5] * b[2],
        a[3] * b[3] + a[4] * b[4] + a[5] * b[5],
        a[3] * b[6] + a[4] * b[7] + a[5] * b[8],
        a[6] * b[0] + a[7] * b[1] + a[8] * b[2],
        a[6] * b[3] + a[7] * b[4] + a[8] * b[5],
        a[6] * b[6] + a[7] * b[7] + a[8] * b[8],
    )


@inlined
def transpose(a: Nine) -> Nine:
    """Aᵀ."""
    return a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8]


@inlined
def apply(a: Nine, v: Three) -> Three:
    """A v."""
    return (
        a[0] * v[0] + a[1] * v[1] + a[2] * v[2],
        a[3] * v[0] + a[4] * v[1] + a[5] * v[2],
        a[6] * v[0] + a[7] * v[1] + a[8] * v[2],
    )


@inlined
def apply_transposed(a: Nine, v: Three) -> Three:
    """Aᵀ v."""
    return (
        a[0] * v[0] + a[3] * v[1] + a[6] * v[2],
        a[1] * v[0] + a[4] * v[1] + a[7] * v[2],
        a[2] * v[0] + a[5] * v[1] + a[8] * v[2],
    )


@inlined
def full(m: Six) -> Nine:
    """The nine entries of a symmetric matrix."""
    return m[0], m[3], m[4], m[3], m[1], m[5], m[4], m[5], m[2]


@inlined
def conjugate(e: Nine, m: Six) -> Six:
    """E M Eᵀ of a symmetric M."""
    t = times(e, full(m))
    return (
        t[0] * e[0] + t[1] * e[1] + t[2] * e[2],
        t[3] * e[3] + t[4] * e[4] + t[5] * e[5],
        t[6] * e[6] + t[7] * e[7] + t[8] * e[8],
        t[0] * e[3] + t[1] * e[4] + t[2] * e[5],
        t[0] * e[6] + t[1] * e[7] + t[2] * e[8],
        t[3] * e[6] + t[4] * e[7] + t[5] * e[8],
    )


@inlined
def add6(a: Six, b: Six) -> Six:
    """A + B."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]


@inlined
def add9(a: Nine, b: Nine) -> Nine:
    """A + B."""
    return (
        a[0] + b[0],
        a[1] + b[1],
        a[2] + b[2],
        a[3] + b[3],
        a[4] + b[4],
        a[5] + b[5],
        a[6] + b[6],
        a[7] + b[7],
        a[8] + b[8],
    )


@inlined
def add3(a: Three, b: Three) -> Three:
    """A + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def cross(a: Three, b: Three) -> Three:
    """A x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def cross_matrix(a: Three) -> Nine:
    """[a]x, the matrix whose product with v is a x v."""
    return 0.0, -a[2], a[1], a[2], 0.0, -a[0], -a[1], a[0], 0.0


@inlined
def load9(r: Any) -> Nine:
    """The nine entries of a (3, 3) array."""
    return r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2], r[2, 0], r[2, 1], r[2, 2]


@inlined
def store9(r: Any, a: Nine) -> None:
    """Write nine entries into a (3, 3) array."""
    r[0, 0], r[0, 1], r[0, 2] = a[0], a[1], a[2]
    r[1, 0], r[1, 1], r[1, 2] = a[3], a[4], a[5]
    r[2, 0], r[2, 1], r[2, 2] = a[6], a[7], a[8]


@inlined
def load3(x: Any) -> Three:
    """Three entries of an array."""
    return x[0], x[1], x[2]


@inlined
def gram(q: Nine, k: Nine) -> Six:
    """The symmetric part of Qᵀ K, which is symmetric where K = -S Q with symmetric S."""
    return (
        q[0] * k[0] + q[3] * k[3] + q[6] * k[6],
        q[1] * k[1] + q[4] * k[4] + q[7] * k[7],
        q[2] * k[2] + q[5] * k[5] + q[8] * k[8],
        q[0] * k[1] + q[3] * k[4] + q[6] * k[7],
        q[0] * k[2] + q[3] * k[5] + q[6] * k[8],
        q[1] * k[2] + q[4] * k[5] + q[7] * k[8],
    )
