"""A wire moved along a curve: every joint slides on it with exact segment lengths."""

from __future__ import annotations

import math
from typing import Any

from solver._kernels.algebra import apply_transposed, load9, store9, times
from solver._kernels.chain import Chain
from solver._kernels.flags import entry_point, inlined, kernel
from solver._kernels.rotation import bend_towards, turn, with_twist


@inlined
def within(a: Any, centre: Any, radius: float) -> bool:
    """Whether a point is inside the sphere around ``centre``."""
    d0, d1, d2 = a[0] - centre[0], a[1] - centre[1], a[2] - centre[2]
    return bool(d0 * d0 + d1 * d1 + d2 * d2 < radius * radius)


@inlined
def leaving(a: Any, b: Any, centre: Any, radius: float) -> float:
    """Where, between 0 and 1, the segment a -> b leaves the sphere around ``centre``; above 1 if it does not."""
    p0, p1, p2 = a[0] - centre[0], a[1] - centre[1], a[2] - centre[2]
    d0, d1, d2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    aa, ab, bb = p0 * p0 + p1 * p1 + p2 * p2, p0 * d0 + p1 * d1 + p2 * d2, d0 * d0 + d1 * d1 + d2 * d2
    if bb <= 0.0:
        return 2.0
    root = ab * ab - bb * (aa - radius * radius)
    if root < 0.0:
        return 2.0
    return float((-ab + math.sqrt(root)) / bb)


@entry_point
def follow(curve: Any, m: int, chain: Chain, u: Any, x: Any, r: Any, k: int) -> None:
    """Lay k segments along a polyline (m, 3) from x[0], which lies on its start; fill u, x and frames r.

    Each joint is the first place on the curve at its segment's length from the joint before; past the end the
    last direction continues. r[0] must hold the base frame.
    """
    at = 0
    start = 0.0
    for j in range(k):
        length = chain.length[j]
        found = False
        while at < m - 1:
            # a segment that ends inside the sphere does not leave it: no root to take
            t = (
                2.0
                if within(curve[at + 1], x[j], length)
                else leaving(curve[at], curve[at + 1], x[j], length)
            )
            if start <= t <= 1.0:
                for a in range(3):
                    x[j + 1, a] = curve[at, a] + t * (curve[at + 1, a] - curve[at, a])
                start = t
                found = True
                break
            at += 1
            start = 0.0
        if not found:
            extend(curve, m, x, j, length)
        aim(chain, u, x, r, j)


@kernel
def extend(curve: Any, m: int, x: Any, j: int, length: float) -> None:
    """Place joint j + 1 beyond the end of the curve, along its last direction."""
    d0, d1, d2 = (
        curve[m - 1, 0] - curve[m - 2, 0],
        curve[m - 1, 1] - curve[m - 2, 1],
        curve[m - 1, 2] - curve[m - 2, 2],
    )
    size = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    d0, d1, d2 = d0 / size, d1 / size, d2 / size
    p0, p1, p2 = x[j, 0] - curve[m - 1, 0], x[j, 1] - curve[m - 1, 1], x[j, 2] - curve[m - 1, 2]
    along = p0 * d0 + p1 * d1 + p2 * d2
    across = p0 * p0 + p1 * p1 + p2 * p2 - along * along
    t = along + math.sqrt(max(length * length - max(across, 0.0), 0.0))
    x[j + 1, 0] = curve[m - 1, 0] + t * d0
    x[j + 1, 1] = curve[m - 1, 1] + t * d1
    x[j + 1, 2] = curve[m - 1, 2] + t * d2


@inlined
def aim(chain: Chain, u: Any, x: Any, r: Any, j: int) -> None:
    """Bend joint j towards x[j + 1], keeping the twist it has; then put that joint at its exact distance."""
    d0, d1, d2 = x[j + 1, 0] - x[j, 0], x[j + 1, 1] - x[j, 1], x[j + 1, 2] - x[j, 2]
    size = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    frame = load9(r[j])
    # a joint on top of the one before has no direction: it keeps the one before
    per_size = 1.0 / size if size > 0.0 else 0.0
    t = (
        apply_transposed(frame, (d0 * per_size, d1 * per_size, d2 * per_size))
        if size > 0.0
        else (0.0, 0.0, 1.0)
    )
    u0, u1 = bend_towards(chain.rest[j], t[0], t[1], t[2])
    u0, u1, u2 = with_twist(u0, u1, u[j, 2])
    u[j, 0], u[j, 1], u[j, 2] = u0, u1, u2
    frame = times(frame, turn(chain.rest[j], u0, u1, u2))
    store9(r[j + 1], frame)
    length = chain.length[j]
    x[j + 1, 0] = x[j, 0] + length * frame[2]
    x[j + 1, 1] = x[j, 1] + length * frame[5]
    x[j + 1, 2] = x[j, 2] + length * frame[8]
