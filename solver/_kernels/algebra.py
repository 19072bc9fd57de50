"""3x3 algebra on scalars: no arrays, so that the compiler keeps everything in registers.

Symmetric matrices are six numbers (xx, yy, zz, xy, xz, yz), general ones nine, row by row.
"""

import math
from typing import Any

from solver._kernels.flags import inlined, merged

Pair = tuple[float, float]
Three = tuple[float, float, float]
Six = tuple[float, float, float, float, float, float]
Nine = tuple[float, float, float, float, float, float, float, float, float]

ZERO3 = (0.0, 0.0, 0.0)
ZERO6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
ZERO9 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inlined
def add3(a: Three, b: Three) -> Three:
    """A + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def add6(a: Six, b: Six) -> Six:
    """A + B."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]


@inlined
def add9(a: Nine, b: Nine) -> Nine:
    """A + B."""
    return add3(a[:3], b[:3]) + add6(a[3:], b[3:])


@inlined
def minus(a: Any, b: Any) -> Three:
    """A - b of two triples or arrays (3,)."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inlined
def scaled(s: float, a: Three) -> Three:
    """S a."""
    return s * a[0], s * a[1], s * a[2]


@inlined
def mix(s: float, a: Three, t: float, b: Three) -> Three:
    """S a + t b."""
    return s * a[0] + t * b[0], s * a[1] + t * b[1], s * a[2] + t * b[2]


@inlined
def dot(a: Three, b: Three) -> float:
    """A · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def cross(a: Three, b: Three) -> Three:
    """A x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def cross_matrix(a: Three) -> Nine:
    """[a]x, the matrix whose product with v is a x v."""
    return 0.0, -a[2], a[1], a[2], 0.0, -a[0], -a[1], a[0], 0.0


@inlined
def transpose(a: Nine) -> Nine:
    """Aᵀ."""
    return a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8]


@inlined
def apply(a: Nine, v: Three) -> Three:
    """A v."""
    return dot(a[:3], v), dot(a[3:6], v), dot(a[6:], v)


@inlined
def apply_transposed(a: Nine, v: Three) -> Three:
    """Aᵀ v."""
    return apply(transpose(a), v)


@inlined
def times_transposed(a: Nine, b: Nine) -> Nine:
    """A Bᵀ."""
    return apply(b, a[:3]) + apply(b, a[3:6]) + apply(b, a[6:])


@inlined
def times(a: Nine, b: Nine) -> Nine:
    """A B."""
    return times_transposed(a, transpose(b))


@inlined
def full(m: Six) -> Nine:
    """The nine entries of a symmetric matrix."""
    return m[0], m[3], m[4], m[3], m[1], m[5], m[4], m[5], m[2]


@inlined
def upper(a: Nine) -> Six:
    """The symmetric matrix of which nine entries are known to rounding."""
    return a[0], a[4], a[8], a[1], a[2], a[5]


@inlined
def conjugate(e: Nine, m: Six) -> Six:
    """E M Eᵀ of a symmetric M."""
    return upper(times_transposed(times(e, full(m)), e))


@inlined
def gram(q: Nine, k: Nine) -> Six:
    """Qᵀ K where that is symmetric, as for K = -S Q with symmetric S."""
    return upper(times(transpose(q), k))


@inlined
def dyad(a: Three, b: Three) -> Six:
    """A bᵀ where that is symmetric."""
    return a[0] * b[0], a[1] * b[1], a[2] * b[2], a[0] * b[1], a[0] * b[2], a[1] * b[2]


@inlined
def outer(a: Three, b: Three, c: Three, d: Three) -> Six:
    """A bᵀ + c dᵀ where that is symmetric."""
    return (
        a[0] * b[0] + c[0] * d[0],
        a[1] * b[1] + c[1] * d[1],
        a[2] * b[2] + c[2] * d[2],
        a[0] * b[1] + c[0] * d[1],
        a[0] * b[2] + c[0] * d[2],
        a[1] * b[2] + c[1] * d[2],
    )


@inlined
def load3(x: Any, n: int) -> Three:
    """Row n of an array (m, 3). Rows are never taken as views in a loop: each costs a reference count."""
    return x[n, 0], x[n, 1], x[n, 2]


@inlined
def store3(x: Any, n: int, v: Three) -> None:
    """Write row n of an array (m, 3)."""
    x[n, 0], x[n, 1], x[n, 2] = v


@inlined
def load9(r: Any, n: int) -> Nine:
    """Matrix n of an array (m, 3, 3)."""
    return (r[n, 0, 0], r[n, 0, 1], r[n, 0, 2], r[n, 1, 0], r[n, 1, 1], r[n, 1, 2], r[n, 2, 0], r[n, 2, 1], r[n, 2, 2])


@inlined
def store9(r: Any, n: int, a: Nine) -> None:
    """Write matrix n of an array (m, 3, 3)."""
    r[n, 0, 0], r[n, 0, 1], r[n, 0, 2] = a[:3]
    r[n, 1, 0], r[n, 1, 1], r[n, 1, 2] = a[3:6]
    r[n, 2, 0], r[n, 2, 1], r[n, 2, 2] = a[6:]


@merged
def farthest(a: Any, at: int, b: Any, to: int, count: int) -> float:
    """Largest distance of ``count`` joints of two wires, mm, from joint ``at`` of one and ``to`` of the other on."""
    most = 0.0
    for m in range(count):
        way = minus(load3(a, at + m), load3(b, to + m))
        most = max(most, dot(way, way))
    return math.sqrt(most)
