"""Compiled signed distance of a smooth union of swept tubes: arrays and numbers in, arrays out."""

from typing import NamedTuple

import numpy as np

from data_synthetic._compile import on_disk, part_of_callers
from data_synthetic.geometry import Array, Index

Vector = tuple[float, float, float]

BLOCK = 16
"""Samples under one bounding ball: 16 cost half as much as 8 at a thousand samples, and more gain nothing."""
FAR = 1e30
"""Stands for no tube yet; finite, so that differences stay finite."""
BLENDS = 2.0
"""Widths of blending beyond which a tube changes no bit; with 1 it changes 4e-6 of a voxel."""
TINY_LENGTH_MM = 1e-12
"""Lengths below this are treated as zero where a direction has to be formed (coordinates are below 1e3 mm)."""
FOOT_TOLERANCE_MM = 1e-10
"""Step at which the foot on a centreline counts as found: far below the 1e-7 mm that a force of 1e-7 N needs."""


class TubeTables(NamedTuple):
    """All samples of all tubes, one after the other: tube t holds samples starts[t] up to starts[t + 1].

    points, tangents (n, 3), radii, slopes (n,) : as in Tube.     steps, blends (t,) : mm, one per tube.
    balls (b, 4) : x, y, z, R of a ball around every BLOCK samples; those of tube t start at block_starts[t].
    around (t, 4) : the same of a ball around each whole tube.
    """

    points: Array
    tangents: Array
    radii: Array
    slopes: Array
    starts: Index
    steps: Array
    blends: Array
    balls: Array
    block_starts: Index
    around: Array


@part_of_callers()
def ball_distance(
    p: Vector, s: float, first: int, step: float, tubes: TubeTables
) -> tuple[float, float, float, float, float, float]:
    """f(s) = |p - c(s)| - r(s), its derivative, the vector from c(s) to p and its length; s in samples from ``first``.

    Centre c and radius r are cubic Hermite polynomials between samples.
    """
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
    c, t = tubes.points, tubes.tangents
    vx = p[0] - (h0 * c[a, 0] + h1 * t[a, 0] + h2 * c[b, 0] + h3 * t[b, 0])
    vy = p[1] - (h0 * c[a, 1] + h1 * t[a, 1] + h2 * c[b, 1] + h3 * t[b, 1])
    vz = p[2] - (h0 * c[a, 2] + h1 * t[a, 2] + h2 * c[b, 2] + h3 * t[b, 2])
    cx = g0 * (c[a, 0] - c[b, 0]) + g1 * t[a, 0] + g3 * t[b, 0]
    cy = g0 * (c[a, 1] - c[b, 1]) + g1 * t[a, 1] + g3 * t[b, 1]
    cz = g0 * (c[a, 2] - c[b, 2]) + g1 * t[a, 2] + g3 * t[b, 2]
    radii, slopes = tubes.radii, tubes.slopes
    r = h0 * radii[a] + h1 * slopes[a] + h2 * radii[b] + h3 * slopes[b]
    dr = g0 * (radii[a] - radii[b]) + g1 * slopes[a] + g3 * slopes[b]
    length = np.sqrt(vx * vx + vy * vy + vz * vz)
    slope = -dr
    if length > TINY_LENGTH_MM:
        slope -= (vx * cx + vy * cy + vz * cz) / length
    return length - r, slope, vx, vy, vz, length


@part_of_callers()
def foot(p: Vector, sample: int, t: int, tubes: TubeTables) -> float:
    """Where f of tube t is least near ``sample``: the one zero of f' there (f is convex), by the Illinois method.

    The value at an end is halved when it stays for the second time: 5 steps. Halved every time, it takes 27.
    """
    first, last, step = tubes.starts[t], tubes.starts[t + 1], tubes.steps[t]
    lo: float = max(sample - first - 1, 0) * 1.0
    hi: float = min(sample - first + 1, last - 1 - first) - 1e-12
    flo = ball_distance(p, lo, first, step, tubes)[1]
    fhi = ball_distance(p, hi, first, step, tubes)[1]
    if flo >= 0.0:
        return lo
    if fhi <= 0.0:
        return hi
    s: float = lo
    side = 0
    for _ in range(60):
        s = lo + (hi - lo) * flo / (flo - fhi)
        width = hi - lo
        f = ball_distance(p, s, first, step, tubes)[1]
        if f == 0.0:
            break
        if f < 0.0:
            shift = s - lo
            lo, flo = s, f
            fhi *= 0.5 if side < 0 else 1.0
            side = -1
        else:
            shift = hi - s
            hi, fhi = s, f
            flo *= 0.5 if side > 0 else 1.0
            side = 1
        if shift * step < FOOT_TOLERANCE_MM or width * step < FOOT_TOLERANCE_MM:
            break
    return s


@part_of_callers()
def beyond(p: Vector, balls: Array, k: int, limit: float) -> bool:
    """Whether all of what lies in ball k is at least ``limit`` away from p."""
    dx, dy, dz = p[0] - balls[k, 0], p[1] - balls[k, 1], p[2] - balls[k, 2]
    far = limit + balls[k, 3]
    return bool(far < 0.0 or dx * dx + dy * dy + dz * dz >= far * far)


@part_of_callers()
def nearest_sample(p: Vector, t: int, limit: float, tubes: TubeTables) -> int:
    """The sample of tube t whose ball is nearest; -1 when the tube is certainly further away than ``limit``."""
    first, last, step = tubes.starts[t], tubes.starts[t + 1], tubes.steps[t]
    best, sample = limit, -1
    for k in range(tubes.block_starts[t], tubes.block_starts[t + 1]):
        if beyond(p, tubes.balls, k, best):
            continue
        a = first + (k - tubes.block_starts[t]) * BLOCK
        for i in range(a, min(a + BLOCK + 1, last)):
            dx, dy, dz = p[0] - tubes.points[i, 0], p[1] - tubes.points[i, 1], p[2] - tubes.points[i, 2]
            f = np.sqrt(dx * dx + dy * dy + dz * dz) - tubes.radii[i]
            # the least of f between samples lies within a step of the least sample
            if f - step < best and (sample < 0 or f < best):
                best, sample = f, i
    return sample


@part_of_callers()
def tube_distance(p: Vector, t: int, limit: float, tubes: TubeTables) -> tuple[float, float, float, float]:
    """Signed distance to tube t and its gradient; FAR when it is certainly above ``limit``."""
    first, step = tubes.starts[t], tubes.steps[t]
    sample = nearest_sample(p, t, limit, tubes)
    if sample < 0:
        return FAR, 0.0, 0.0, 0.0
    if tubes.starts[t + 1] - first == 1:
        vx, vy, vz = (p[0] - tubes.points[first, 0], p[1] - tubes.points[first, 1], p[2] - tubes.points[first, 2])
        length = max(np.sqrt(vx * vx + vy * vy + vz * vz), TINY_LENGTH_MM)
        return length - tubes.radii[first], vx / length, vy / length, vz / length
    s = foot(p, sample, t, tubes)
    f, _, vx, vy, vz, length = ball_distance(p, s, first, step, tubes)
    length = max(length, TINY_LENGTH_MM)
    return f, vx / length, vy / length, vz / length


@part_of_callers()
def union_distance(p: Vector, limit: float, tubes: TubeTables) -> tuple[float, float, float, float]:
    """Signed distance of the smooth union and its gradient; tubes certainly above ``limit`` are not looked at."""
    value, gx, gy, gz = FAR, 0.0, 0.0, 0.0
    for t in range(len(tubes.steps)):
        k = tubes.blends[t]
        most = min(limit, value + k)
        if beyond(p, tubes.around, t, most):
            continue
        f, nx, ny, nz = tube_distance(p, t, most, tubes)
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
def distances(points: Array, tubes: TubeTables, out: Array, gradients: Array) -> None:
    """Fill signed distances (n,) and their gradients (n, 3) at points (n, 3); faster where neighbours are near."""
    # the distance changes by no more than the way between two places: tubes further off are not looked at
    limit, margin = FAR, BLENDS * tubes.blends.max()
    for i in range(len(points)):
        p = (points[i, 0], points[i, 1], points[i, 2])
        if i > 0:
            before = (points[i - 1, 0], points[i - 1, 1], points[i - 1, 2])
            limit = out[i - 1] + np.sqrt((p[0] - before[0]) ** 2 + (p[1] - before[1]) ** 2 + (p[2] - before[2]) ** 2)
        # what is no number tells nothing of the next place
        f, gx, gy, gz = union_distance(p, limit + margin if limit < FAR else FAR, tubes)
        out[i] = f
        gradients[i, 0], gradients[i, 1], gradients[i, 2] = gx, gy, gz


@part_of_callers()
def room_for(tubes: TubeTables) -> TubeTables:
    """Tables that ``tubes_around`` writes into; where its runs of samples fill no block, each has one of its own."""
    return TubeTables(
        np.empty_like(tubes.points),
        np.empty_like(tubes.tangents),
        np.empty_like(tubes.radii),
        np.empty_like(tubes.slopes),
        np.zeros_like(tubes.starts),
        np.empty_like(tubes.steps),
        np.empty_like(tubes.blends),
        np.empty((len(tubes.balls) + len(tubes.steps), 4)),
        np.zeros_like(tubes.block_starts),
        np.empty_like(tubes.around),
    )


@part_of_callers()
def samples_around(p: Vector, reach: float, t: int, limit: float, tubes: TubeTables) -> tuple[int, int]:
    """The first sample of tube t, and the one after the last, that may count within ``reach`` of p; none: (0, 0)."""
    first, last = tubes.starts[t], tubes.starts[t + 1]
    nearest = nearest_sample(p, t, limit, tubes)
    if nearest < 0:
        return 0, 0
    c, r = tubes.points, tubes.radii
    # the distance to a sample changes by no more than ``reach``, and so does that to the nearest one
    dx, dy, dz = p[0] - c[nearest, 0], p[1] - c[nearest, 1], p[2] - c[nearest, 2]
    most = np.sqrt(dx * dx + dy * dy + dz * dz) - r[nearest] + 2.0 * reach + FOOT_TOLERANCE_MM
    low = high = nearest
    for k in range(tubes.block_starts[t], tubes.block_starts[t + 1]):
        if beyond(p, tubes.balls, k, most):
            continue
        a = first + (k - tubes.block_starts[t]) * BLOCK
        for i in range(a, min(a + BLOCK + 1, last)):
            dx, dy, dz = p[0] - c[i, 0], p[1] - c[i, 1], p[2] - c[i, 2]
            if np.sqrt(dx * dx + dy * dy + dz * dz) - r[i] <= most:
                low, high = min(low, i), max(high, i)
    # the foot is looked for between a sample's neighbours
    return max(low - 1, first), min(high + 2, last)


@part_of_callers()
def tubes_around(p: Vector, reach: float, limit: float, tubes: TubeTables, room: TubeTables) -> TubeTables:
    """The part of the tables that gives the distance within ``reach`` of p, where it is below ``limit``."""
    count = samples = blocks = 0
    for t in range(len(tubes.steps)):
        low, high = samples_around(p, reach, t, limit + reach, tubes)
        if low == high:
            continue
        for i in range(low, high):
            room.points[samples], room.tangents[samples] = tubes.points[i], tubes.tangents[i]
            room.radii[samples], room.slopes[samples] = tubes.radii[i], tubes.slopes[i]
            samples += 1
        room.steps[count], room.blends[count] = tubes.steps[t], tubes.blends[t]
        room.around[count] = (p[0], p[1], p[2], FAR)
        for _ in range(max((high - low + BLOCK - 2) // BLOCK, 1)):
            room.balls[blocks] = (p[0], p[1], p[2], FAR)  # all of them are near
            blocks += 1
        count += 1
        room.starts[count], room.block_starts[count] = samples, blocks
    return TubeTables(
        room.points[:samples],
        room.tangents[:samples],
        room.radii[:samples],
        room.slopes[:samples],
        room.starts[: count + 1],
        room.steps[:count],
        room.blends[:count],
        room.balls[:blocks],
        room.block_starts[: count + 1],
        room.around[:count],
    )
