"""Compiled signed distance of a smooth union of swept tubes: arrays and scalars in, arrays out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from data_synthetic._compile import on_disk
from data_synthetic._tolerances import FOOT_TOLERANCE_MM, TINY_LENGTH_MM

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Tables = tuple[Array, Array, Array, Array, Index, Array, Array, Array, Index]
"""points, tangents, radii, slopes, starts, steps, blends, bounding balls, block starts."""

BLOCK = 16
"""Samples under one bounding ball: 16 halves the cost of 8 at a thousand samples and gains nothing beyond."""

FAR = 1e30
"""Stands for no tube yet; finite, so that differences stay finite."""


@on_disk()
def ball_distance(
    px: float,
    py: float,
    pz: float,
    s: float,
    first: int,
    step: float,
    points: Array,
    tangents: Array,
    radii: Array,
    slopes: Array,
) -> tuple[float, float, float, float, float, float]:
    """f(s) = |x - c(s)| - r(s), its derivative, and the vector from c(s) to x; s in samples from ``first``."""
    i = int(s)
    u = s - i
    a = first + i
    b = a + 1
    h0 = (1.0 + 2.0 * u) * (1.0 - u) ** 2
    h1 = u * (1.0 - u) ** 2 * step
    h2 = u * u * (3.0 - 2.0 * u)
    h3 = u * u * (u - 1.0) * step
    g0 = 6.0 * u * (u - 1.0)
    g1 = (3.0 * u - 1.0) * (u - 1.0) * step
    g3 = u * (3.0 * u - 2.0) * step
    vx = px - (h0 * points[a, 0] + h1 * tangents[a, 0] + h2 * points[b, 0] + h3 * tangents[b, 0])
    vy = py - (h0 * points[a, 1] + h1 * tangents[a, 1] + h2 * points[b, 1] + h3 * tangents[b, 1])
    vz = pz - (h0 * points[a, 2] + h1 * tangents[a, 2] + h2 * points[b, 2] + h3 * tangents[b, 2])
    cx = g0 * (points[a, 0] - points[b, 0]) + g1 * tangents[a, 0] + g3 * tangents[b, 0]
    cy = g0 * (points[a, 1] - points[b, 1]) + g1 * tangents[a, 1] + g3 * tangents[b, 1]
    cz = g0 * (points[a, 2] - points[b, 2]) + g1 * tangents[a, 2] + g3 * tangents[b, 2]
    r = h0 * radii[a] + h1 * slopes[a] + h2 * radii[b] + h3 * slopes[b]
    dr = g0 * (radii[a] - radii[b]) + g1 * slopes[a] + g3 * slopes[b]
    length = np.sqrt(vx * vx + vy * vy + vz * vz)
    slope = -dr
    if length > TINY_LENGTH_MM:
        slope -= (vx * cx + vy * cy + vz * cz) / length
    return length - r, slope, vx, vy, vz, length


@on_disk()
def foot(
    px: float,
    py: float,
    pz: float,
    sample: int,
    first: int,
    last: int,
    step: float,
    points: Array,
    tangents: Array,
    radii: Array,
    slopes: Array,
) -> float:
    """Where f is least near ``sample``: bisection on f' (f is convex there), polished by the secant rule."""
    lo = max(sample - first - 1, 0) * 1.0
    hi = min(sample - first + 1, last - 1 - first) - 1e-12
    _, flo, _, _, _, _ = ball_distance(px, py, pz, lo, first, step, points, tangents, radii, slopes)
    _, fhi, _, _, _, _ = ball_distance(px, py, pz, hi, first, step, points, tangents, radii, slopes)
    if flo >= 0.0:
        return lo
    if fhi <= 0.0:
        return hi
    s = lo
    for _ in range(60):
        s = lo + (hi - lo) * flo / (flo - fhi)
        width = hi - lo
        _, f, _, _, _, _ = ball_distance(px, py, pz, s, first, step, points, tangents, radii, slopes)
        if f == 0.0:
            break
        if f < 0.0:
            shift = s - lo
            lo, flo = s, f
            fhi *= 0.5
        else:
            shift = hi - s
            hi, fhi = s, f
            flo *= 0.5
        if shift * step < FOOT_TOLERANCE_MM or width * step < FOOT_TOLERANCE_MM:
            break
    return s


@on_disk()
def tube_distance(
    px: float,
    py: float,
    pz: float,
    t: int,
    points: Array,
    tangents: Array,
    radii: Array,
    slopes: Array,
    starts: Index,
    steps: Array,
    balls: Array,
    block_starts: Index,
    limit: float,
) -> tuple[float, float, float, float]:
    """Signed distance to tube t and its gradient; FAR when it is certainly above ``limit``."""
    first, last = starts[t], starts[t + 1]
    best, sample = limit, -1
    for k in range(block_starts[t], block_starts[t + 1]):
        dx, dy, dz = px - balls[k, 0], py - balls[k, 1], pz - balls[k, 2]
        if np.sqrt(dx * dx + dy * dy + dz * dz) - balls[k, 3] >= best:
            continue
        a = first + (k - block_starts[t]) * BLOCK
        for i in range(a, min(a + BLOCK + 1, last)):
            dx, dy, dz = px - points[i, 0], py - points[i, 1], pz - points[i, 2]
            f = np.sqrt(dx * dx + dy * dy + dz * dz) - radii[i]
            # the least of f between samples lies within a step of the least sample
            if f - steps[t] < best and (sample < 0 or f < best):
                best, sample = f, i
    if sample < 0:
        return FAR, 0.0, 0.0, 0.0
    if last - first == 1:
        vx, vy, vz = px - points[first, 0], py - points[first, 1], pz - points[first, 2]
        length = max(np.sqrt(vx * vx + vy * vy + vz * vz), TINY_LENGTH_MM)
        return length - radii[first], vx / length, vy / length, vz / length
    s = foot(px, py, pz, sample, first, last, steps[t], points, tangents, radii, slopes)
    f, _, vx, vy, vz, length = ball_distance(px, py, pz, s, first, steps[t], points, tangents, radii, slopes)
    length = max(length, TINY_LENGTH_MM)
    return f, vx / length, vy / length, vz / length


@on_disk()
def union_distance(
    px: float,
    py: float,
    pz: float,
    points: Array,
    tangents: Array,
    radii: Array,
    slopes: Array,
    starts: Index,
    steps: Array,
    blends: Array,
    balls: Array,
    block_starts: Index,
) -> tuple[float, float, float, float]:
    """Signed distance of the smooth union and its gradient."""
    value, gx, gy, gz = FAR, 0.0, 0.0, 0.0
    for t in range(len(steps)):
        k = blends[t]
        f, nx, ny, nz = tube_distance(
            px, py, pz, t, points, tangents, radii, slopes, starts, steps, balls, block_starts, value + k
        )
        if f >= value + k:
            continue
        if value >= f + k:
            value, gx, gy, gz = f, nx, ny, nz
            continue
        h = (k - abs(value - f)) / k
        w = 0.5 * h * h if f >= value else 1.0 - 0.5 * h * h
        value = min(value, f) - h * h * h * k / 6.0
        gx, gy, gz = gx + w * (nx - gx), gy + w * (ny - gy), gz + w * (nz - gz)
    return value, gx, gy, gz


@on_disk()
def distances(
    xyz: Array,
    points: Array,
    tangents: Array,
    radii: Array,
    slopes: Array,
    starts: Index,
    steps: Array,
    blends: Array,
    balls: Array,
    block_starts: Index,
    out: Array,
    gradients: Array,
) -> None:
    """Signed distances and gradients of many points."""
    for i in range(len(xyz)):
        f, gx, gy, gz = union_distance(
            xyz[i, 0],
            xyz[i, 1],
            xyz[i, 2],
            points,
            tangents,
            radii,
            slopes,
            starts,
            steps,
            blends,
            balls,
            block_starts,
        )
        out[i] = f
        gradients[i, 0], gradients[i, 1], gradients[i, 2] = gx, gy, gz
