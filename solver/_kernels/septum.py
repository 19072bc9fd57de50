"""Whether a wire has come through a wall: judged by the wire itself, along its whole length, not by how it moved.

A step may rest on the ridge between two lumens and go down on the far side in the next: each move is innocent. So every
place on the wire is led back, down the distance, to the lumen it belongs to (its foot). From one place to the next the
foot moves a little; where the straight way between two feet rises over a ridge of the distance, the wire has changed
lumens, unless both feet are joined by lumen nearby: then the ridge is the edge of a carina or of an aneurysm's neck.
There a wire may press on the edge, and a soft wall gives way. In a narrow wedge it hardly resists: where the wall is so
thick that the whole cross-section is buried in it, the way around must be about as short as the way through, and where
it is much thicker there is none.
"""

import math
from typing import Any

import numpy as np

from solver import _tolerances as tol
from solver._kernels.algebra import Six, Three, apply, dot, full, load3, minus, mix
from solver._kernels.data import Field
from solver._kernels.field import clipped, indices, jet_at, locate, value
from solver._kernels.flags import cached, inlined, kernel, owner

Foot = tuple[float, float, float, float]
"""A place in a lumen, mm, and the distance there, mm; the distance is inf where none was found."""


@cached
def through_wall(field: Field, x: Any, k: int, margin: float) -> bool:
    """Whether a wire with joints x, of k segments, comes through a wall. margin : its radius, mm."""
    if not passes_crease(field, x, k):
        return False
    level, last, known, inside = -margin, (0.0, 0.0, 0.0, 0.0), False, False
    for n in range(1, k + 1):
        a, b = load3(x, n - 1), load3(x, n)
        way = apart(a, b)
        if not near_crease(field, a, b, way):
            known = False
            continue
        steps = math.ceil(2 * way / field.spacing)
        i = 1 if known else 0
        while i <= steps:
            q = mix(1.0 - i / steps, a, i / steps, b)
            v = distance(field, q)
            room = level - v
            here = (q[0], q[1], q[2], v) if room >= 0.0 else foot(field, q, v, level, n == k and i == steps)
            if here[3] < math.inf:
                # a wire that stays in its lumen is its own foot
                if known and not (inside and room >= 0.0) and parted(field, last, here, level):
                    return True
                last, known, inside = here, True, room >= 0.0
            # skip the places that must be inside as well, since the distance's slope is bounded
            i += 1 + int(max(room, 0.0) * steps / (field.slope * way))
    return False


@kernel
def passes_crease(field: Field, x: Any, k: int) -> bool:
    """Whether a wire comes near a crease anywhere; so few joints are tested that most wires cost next to nothing."""
    # all segments but the first, which has up to half a segment more, are as long as the last one
    stride = int(0.75 * tol.CREASE_BLOCK * field.spacing / apart(load3(x, k - 1), load3(x, k)))
    if stride < 1:
        return True
    found = False
    for n in range(k, -stride, -stride):
        found = found or marked(field, load3(x, max(n, 0)))
    return found


@kernel
def near_crease(field: Field, a: Three, b: Three, way: float) -> bool:
    """Whether a segment from a to b, ``way`` mm long, comes near a crease."""
    steps = 1 + int(way / (0.5 * tol.CREASE_BLOCK * field.spacing))
    found = False
    for i in range(1, steps + 1):
        found = found or marked(field, mix(1.0 - i / steps, a, i / steps, b))
    return found


@inlined
def marked(field: Field, q: Three) -> bool:
    """Whether a point lies in a block of the grid that is marked for a crease."""
    marks, block = field.creases, 1.0 / tol.CREASE_BLOCK
    f = indices(field.to_index, field.origin, q)
    i, j = clipped(block * f[0], marks.shape[0] - 1), clipped(block * f[1], marks.shape[1] - 1)
    return bool(marks[i, j, clipped(block * f[2], marks.shape[2] - 1)])


@inlined
def distance(field: Field, q: Three) -> float:
    """Signed distance, mm, at a point."""
    c = field.coefficients
    return float(value(c, locate(c, indices(field.to_index, field.origin, q))))


@kernel
def foot(field: Field, q: Three, v: float, level: float, any_side: bool) -> Foot:
    """Go down the distance from a place, where it is v, to ``level``, mm, or to where a narrower lumen is deepest.

    any_side : take a place on a ridge to either side, as for the tip, which would creep along it; else it has no foot.
    """
    c = field.coefficients
    for n in range(tol.FOOT_STEPS):
        if v <= level + tol.FOOT_MM:
            # the last of these steps ends a rounding above the level or below it
            v = min(v, level)
            break
        first, second = jet_at(c, field.to_index, locate(c, indices(field.to_index, field.origin, q)))
        g = first[1:]
        square = dot(g, g)
        # hardly any slope is the floor of a lumen where the distance curves upwards, and a ridge where it does not
        even, bends = square < 0.5, second[0] + second[1] + second[2]
        floor = even and bends > 0.0
        if floor and v < 0.5 * field.spacing:
            break
        ridge = n == 0 and even and bends * field.spacing < -tol.RIDGE_BEND
        if ridge and not any_side and on_ridge(g, second, bends):
            v = math.inf
            break
        step = min((v - level) / max(square, 1e-12), 0.5 * field.spacing / math.sqrt(max(square, 1e-12)))
        lower = mix(1.0, q, -step, g)
        w = distance(field, lower)
        if floor or not w < v:
            v = math.inf
            break
        q, v = lower, w
    return q[0], q[1], q[2], v


@inlined
def on_ridge(slope: Three, second: Six, bends: float) -> bool:
    """Whether a place lies on a ridge, and belongs to neither side: down the distance it would slide to the edge.

    second : derivatives of the distance; their trace, ``bends``, is that across the ridge but for little.
    """
    across = apply(full(second), slope)
    return bool(dot(across, across) < (tol.RIDGE_SLOPE * bends) ** 2)


@kernel
def parted(field: Field, a: Foot, b: Foot, level: float) -> bool:
    """Whether a ridge lies between two feet, and no way through lumen around it nearby."""
    # where the lumen is narrower than the wire, all of the lumen counts, not only where the wire has room
    top = level if max(a[3], b[3]) <= level else max(a[3], b[3], 0.0)
    top = tol.RIDGE_VOXELS * field.spacing + max(top, -tol.OPEN_VOXELS * field.spacing)
    p, q = a[:3], b[:3]
    through = apart(p, q)
    steps = math.ceil(4 * through / field.spacing)
    for i in range(1, steps):
        if distance(field, mix(1.0 - i / steps, p, i / steps, q)) > top:
            inner, outer = deeper(field, a), deeper(field, b)
            longest = apart(inner, outer) + 2 * tol.DETOUR_MM
            # in radii: the feet are a radius deep in the lumens
            thick = through / max(-level, 0.5 * field.spacing)
            if thick > tol.BURIED_RADII:
                around = math.hypot(tol.BURIED_DETOUR * through, 2 * max(apart(p, inner), apart(q, outer)))
                longest = min(longest, around + 0.5 * field.spacing)
            return thick > tol.SUNK_RADII or not joined(field, inner, outer, top, longest)
    return False


@owner
def joined(field: Field, p: Three, q: Three, top: float, limit: float) -> bool:
    """Whether a way on which the distance stays below ``top`` leads from p to q: a flood fill from p.

    limit : of the sum of a place's distances from p and q, mm.
    """
    way = apart(p, q)
    cell = max(0.25 * field.spacing, limit / tol.FLOOD_CELLS)
    n = math.ceil(0.5 * (limit + way) / cell) + 1
    seen = np.zeros((2 * n + 1, 2 * n + 1, 2 * n + 1), np.uint8)
    queue = np.empty((seen.size, 3), np.int16)
    queue[0, 0] = queue[0, 1] = queue[0, 2] = n
    seen[n, n, n] = 1
    first, count = 0, 1
    while first < count:
        for side in range(6):
            i, j, k = int(queue[first, 0]), int(queue[first, 1]), int(queue[first, 2])
            move = 1 - 2 * (side % 2)
            i, j, k = i + move * (side < 2), j + move * (2 <= side < 4), k + move * (side >= 4)
            here = (p[0] + (i - n) * cell, p[1] + (j - n) * cell, p[2] + (k - n) * cell)
            left = apart(here, q)
            if seen[i, j, k] or apart(here, p) + left > limit:
                continue
            seen[i, j, k] = 1
            if distance(field, here) <= top:
                if left < cell:
                    return True
                queue[count, 0], queue[count, 1], queue[count, 2] = i, j, k
                count += 1
        first += 1
    return False


@inlined
def apart(a: Three, b: Three) -> float:
    """Distance of two places from each other, mm."""
    d = minus(b, a)
    return math.sqrt(dot(d, d))


@kernel
def deeper(field: Field, a: Foot) -> Three:
    """A place up to a voxel deeper in the lumen than a foot: a flood fill from there cannot slip over a ridge."""
    b = foot(field, a[:3], distance(field, a[:3]), a[3] - field.spacing, True)
    return b[:3] if b[3] < math.inf else a[:3]
