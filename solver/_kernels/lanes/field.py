"""The distance at eight places at once, with its derivatives: ``field`` in lanes.

The coefficients of a place come four in a row. They are loaded for one place after the other and transposed in
registers: a gather of single ones takes three times as long.
"""

import math
from typing import Any

from llvmlite import ir

from solver._kernels.algebra import Six, Three
from solver._kernels.data import Field
from solver._kernels.field import Four, across, bends, cubic, indices, per_mm, slopes
from solver._kernels.flags import inlined, kernel
from solver._kernels.lanes.vectors import LANES, WIDTH, arrays, extend, greater, lesser, select, typing, untyped

Layer = tuple[Four, Four, Four]


@extend.intrinsic
def rows(_: Any, c: Any, at: Any, shift: Any) -> Any:
    """Four consecutive float32 of the flat array c for each lane, from ``at + shift`` on, as four numbers in lanes."""

    def lower(context: Any, builder: Any, kinds: Any, args: Any) -> Any:
        array = arrays.make_array(kinds.args[0])(context, builder, args[0])
        four, word = ir.VectorType(ir.FloatType(), 4), ir.IntType(32)
        places, loaded = builder.fptosi(args[1], ir.VectorType(ir.IntType(64), WIDTH)), []
        for lane in range(WIDTH):
            place = builder.add(builder.extract_element(places, ir.Constant(word, lane)), args[2])
            pointer = builder.bitcast(builder.gep(array.data, [place]), four.as_pointer())
            loaded.append(builder.load(pointer, align=4))

        def mixed(x: Any, y: Any, order: Any) -> Any:
            return builder.shuffle_vector(x, y, ir.Constant(ir.VectorType(word, WIDTH), order))

        # lanes n and n + 4 in one register, then the transposition that such halves have instructions for
        a, b, c, d = (mixed(loaded[n], loaded[n + 4], list(range(WIDTH))) for n in range(4))
        result = []
        for order in ([0, 8, 1, 9, 4, 12, 5, 13], [2, 10, 3, 11, 6, 14, 7, 15]):
            one, two = mixed(a, b, order), mixed(c, d, order)
            result += [mixed(one, two, [0, 1, 8, 9, 4, 5, 12, 13]), mixed(one, two, [2, 3, 10, 11, 6, 7, 14, 15])]
        return context.make_tuple(builder, kinds.return_type, [builder.fpext(r, LANES.value) for r in result])

    return typing.signature(untyped.UniTuple(LANES, 4), c, LANES, untyped.intp), lower


@inlined
def cell_of(f: float, last: float) -> float:
    """``field.clipped``, as a float; 0 for NaN."""
    return math.floor(lesser(greater(f, 0.0), last))  # type: ignore[no-any-return]


@inlined
def depth_in_grid(c: Any, f: Three) -> float:
    """``field.depth_in_grid``."""
    s = c.shape
    low = lesser(lesser(f[0], f[1]), f[2])
    return lesser(low, lesser(lesser(s[0] - 3.0 - f[0], s[1] - 3.0 - f[1]), s[2] - 3.0 - f[2]))  # type: ignore[no-any-return]


@inlined
def fours(w: Four, a: Four, b: Four, c: Four, d: Four) -> Four:
    """``field.across`` of each of four numbers."""
    return (
        across(w, a[0], b[0], c[0], d[0]),
        across(w, a[1], b[1], c[1], d[1]),
        across(w, a[2], b[2], c[2], d[2]),
        across(w, a[3], b[3], c[3], d[3]),
    )


@inlined
def layer(c: Any, at: float, shift: int, q: tuple[Four, Four, Four]) -> Layer:
    """``field.layer`` of the plane that begins ``shift`` coefficients after ``at``."""
    n = c.shape[2]
    a, b, e, f = rows(c, at, shift), rows(c, at, shift + n), rows(c, at, shift + 2 * n), rows(c, at, shift + 3 * n)
    return fours(q[0], a, b, e, f), fours(q[1], a, b, e, f), fours(q[2], a, b, e, f)


@inlined
def weighted(x: Four, w: Four) -> float:
    """``vectors.weighted`` of four numbers in lanes."""
    return (x[0] * w[0] + x[2] * w[2]) + (x[1] * w[1] + x[3] * w[3])


@inlined
def spline(c: Any, at: float, place: Three) -> tuple[Four, Six]:
    """``field.spline`` of a cell in each lane; at : flat index of its first coefficient."""
    u, v, w = place
    p, dp, ddp, q = cubic(u), slopes(u), bends(u), (cubic(v), slopes(v), bends(v))
    r, dr, plane = cubic(w), slopes(w), c.shape[1] * c.shape[2]
    a, b, e, f = layer(c, at, 0, q), layer(c, at, plane, q), layer(c, at, 2 * plane, q), layer(c, at, 3 * plane, q)
    here, x = fours(p, a[0], b[0], e[0], f[0]), fours(dp, a[0], b[0], e[0], f[0])
    y, xy = fours(p, a[1], b[1], e[1], f[1]), fours(dp, a[1], b[1], e[1], f[1])
    xx, yy = fours(ddp, a[0], b[0], e[0], f[0]), fours(p, a[2], b[2], e[2], f[2])
    first = weighted(here, r), weighted(x, r), weighted(y, r), weighted(here, dr)
    second = weighted(xx, r), weighted(yy, r), weighted(here, bends(w))
    return first, (*second, weighted(xy, r), weighted(x, dr), weighted(y, dr))


@inlined
def value(c: Any, at: float, place: Three) -> float:
    """``field.value`` of the same cells."""
    u, v, w = place
    q, n, plane = cubic(v), c.shape[2], c.shape[1] * c.shape[2]
    a, b, e, f = row(c, at, 0, n, q), row(c, at, plane, n, q), row(c, at, 2 * plane, n, q), row(c, at, 3 * plane, n, q)
    return weighted(fours(cubic(u), a, b, e, f), cubic(w))


@inlined
def row(c: Any, at: float, shift: int, n: int, q: Four) -> Four:
    """``field.plane``."""
    return fours(q, rows(c, at, shift), rows(c, at, shift + n), rows(c, at, shift + 2 * n), rows(c, at, shift + 3 * n))


@inlined
def locate(field: Field, q: Three) -> tuple[float, Three, float]:
    """Flat index of the first coefficient of the cell around q, mm; place in it; mm outside the grid, < 0 inside."""
    c = field.coefficients
    f = indices(field.to_index, field.origin, q)
    i, j = cell_of(f[0], float(c.shape[0] - 4)), cell_of(f[1], float(c.shape[1] - 4))
    k = cell_of(f[2], float(c.shape[2] - 4))
    at = (i * float(c.shape[1]) + j) * float(c.shape[2]) + k
    return at, (f[0] - i, f[1] - j, f[2] - k), -field.spacing * depth_in_grid(c, f)


@inlined
def known(phi: float, border: float) -> float:
    """What is kept of a place's distance phi, as in ``energy.wall_energy``: ``border`` at least, 1 outside the grid."""
    return select(border <= 0.0, greater(phi, border), 1.0)  # type: ignore[no-any-return]


@kernel
def look_up(field: Field, found: Any) -> None:
    """Look up the places in rows 0 to 2, mm, of found (11,) in lanes: jets go to rows 0 to 9, ``known`` to row 10."""
    at, place, border = locate(field, (found[0], found[1], found[2]))
    first, second = per_mm(field.to_index, spline(field.coefficients, at, place))
    found[0], found[1], found[2], found[3] = first
    found[4], found[5], found[6], found[7], found[8], found[9] = second
    found[10] = known(first[0], border)


@kernel
def look_first(field: Field, found: Any) -> None:
    """Look up the distance alone, which goes to row 0, and ``known`` to row 10: a third of the cost."""
    at, place, border = locate(field, (found[0], found[1], found[2]))
    found[0] = value(field.coefficients, at, place)
    found[10] = known(found[0], border)
