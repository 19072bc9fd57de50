"""Bright ridges as ordered sub-voxel points: a predictor-corrector walk from every strong voxel that is left."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.arrays.jets import jet, ridge_frame, ridge_step
from pipeline.arrays.tiles import grown as _grown
from pipeline.arrays.tiles import smoothed


@njit(cache=True)
def runs_below(distance: NDArray[Any], limit: float) -> NDArray[Any]:
    """Runs (n, 4) along the last axis where ``distance`` < limit: i, j, first k, one past the last k."""
    ni, nj, nk = distance.shape
    runs = np.empty((4096, 4), np.int64)
    count = 0
    for i in range(ni):
        for j in range(nj):
            k = 0
            while k < nk:
                if distance[i, j, k] >= limit:
                    k += 1
                    continue
                start = k
                while k < nk and distance[i, j, k] < limit:
                    k += 1
                if count >= runs.shape[0]:
                    larger = np.empty((2 * count, 4), np.int64)
                    larger[:count] = runs
                    runs = larger
                runs[count, 0], runs[count, 1], runs[count, 2], runs[count, 3] = i, j, start, k
                count += 1
    return runs[:count]


@njit(cache=True)
def subtract(
    frame: NDArray[Any], background: NDArray[Any], corner: NDArray[Any], runs: NDArray[Any], out: NDArray[Any]
) -> int:
    """frame - background on ``runs`` of the box ``out``, whose voxel (0, 0, 0) is ``corner`` of the frame.

    ``background`` is on the box. Returns the number of voxels read.
    """
    read = 0
    for n in range(runs.shape[0]):
        i, j, first, stop = runs[n, 0], runs[n, 1], runs[n, 2], runs[n, 3]
        a, b, c = i + corner[0], j + corner[1], corner[2]
        for k in range(first, stop):
            out[i, j, k] = frame[a, b, k + c] - background[i, j, k]
        read += stop - first
    return read


@njit(cache=True)
def above(grey: NDArray[Any], allowed: NDArray[Any], runs: NDArray[Any], level: float) -> NDArray[Any]:
    """Flat indices of the voxels on ``runs`` that are allowed and brighter than ``level``."""
    _, nj, nk = grey.shape
    found = np.empty(4096, np.int64)
    count = 0
    for n in range(runs.shape[0]):
        i, j = runs[n, 0], runs[n, 1]
        for k in range(runs[n, 2], runs[n, 3]):
            if grey[i, j, k] > level and allowed[i, j, k]:
                if count + 1 >= found.shape[0]:
                    found = _grown(found)
                found[count] = (i * nj + j) * nk + k
                count += 1
    return found[:count]


@njit(cache=True)
def smooth_voxels(grey: NDArray[Any], taps: NDArray[Any], voxels: NDArray[Any]) -> NDArray[Any]:
    """The separable kernel ``taps`` at flat indices of a box."""
    _, nj, nk = grey.shape
    out = np.empty(voxels.shape[0], np.float32)
    for n in range(voxels.shape[0]):
        flat = voxels[n]
        rest = flat // nk
        out[n] = smoothed(grey, taps, rest // nj, rest % nj, flat % nk)
    return out


@njit(cache=True)
def to_ridge(
    grey: NDArray[Any],
    spacing: NDArray[Any],
    sigma: float,
    p: NDArray[Any],
    t: NDArray[Any],
    rounds: int,
    w: NDArray[Any],
    out: NDArray[Any],
    step: NDArray[Any],
) -> float:
    """Move ``p`` onto the crest (in place), set its tangent ``t``; returns the weaker curvature across (negative)."""
    limit = 0.7 * min(spacing[0], spacing[1], spacing[2])
    middle = 0.0
    for m in range(rounds + 1):
        jet(grey, spacing, sigma, p, w, out)
        _, middle = ridge_frame(out, t)
        if m < rounds:
            ridge_step(out, t, limit, step)
            p[0] += step[0]
            p[1] += step[1]
            p[2] += step[2]
    return middle


@njit(cache=True, inline="always")
def _along(p: NDArray[Any], t: NDArray[Any], q: NDArray[Any], u: NDArray[Any], reach: float) -> bool:
    """Whether point p with tangent t lies on the track through q with tangent u."""
    gap = (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2
    return bool(gap < reach * reach and abs(t[0] * u[0] + t[1] * u[1] + t[2] * u[2]) > 0.7)


LAG = 12
"""Steps over which the run of a walk is compared with the local tangent: a swing from one strand to another that it
crosses at 50 degrees takes 4 to 6 voxels, in two bends of half the angle."""
UNTURNED = 0.97
"""Cosine with the direction LAG steps ago from which a point is taken not to have turned yet."""


@njit(cache=True)
def _walk(
    grey: NDArray[Any],
    allowed: NDArray[Any],
    stamp: NDArray[Any],
    spacing: NDArray[Any],
    sigma: float,
    start: NDArray[Any],
    heading: NDArray[Any],
    length: float,
    low: float,
    sharp: float,
    turn: float,
    bend: float,
    points: NDArray[Any],
    tangents: NDArray[Any],
    values: NDArray[Any],
    earlier: NDArray[Any],
    earlier_tangents: NDArray[Any],
) -> int:
    """Follow the crest from ``start``; fills the arrays (m, 3), (m, 3), (m,) and returns how many points were set.

    Stops where the crest is weaker than ``low``, blunter than ``sharp``, turns by more than ``turn`` (cosine) in a
    step or by more than ``bend`` (cosine) against the last LAG steps, leaves ``allowed``, or runs
    along a crest that was walked before (``stamp`` = its point + 1; own points are stamped negative meanwhile).
    """
    w = np.empty((3, 3, 64))
    out = np.empty(10)
    step = np.empty(3)
    p = start.copy()
    t = heading.copy()
    count = 0
    swung = 0
    size = min(spacing[0], spacing[1], spacing[2])
    while count < points.shape[0]:
        qx, qy, qz = p[0] + length * t[0], p[1] + length * t[1], p[2] + length * t[2]
        ox, oy, oz = t[0], t[1], t[2]
        p[0], p[1], p[2] = qx, qy, qz
        middle = to_ridge(grey, spacing, sigma, p, t, 2, w, out, step)
        if out[0] < low or middle > -sharp or t[0] * ox + t[1] * oy + t[2] * oz < turn:
            break
        moved = (p[0] - qx) ** 2 + (p[1] - qy) ** 2 + (p[2] - qz) ** 2
        if moved > (0.8 * size) ** 2:
            break
        i, j, k = round(p[0] / spacing[0]), round(p[1] / spacing[1]), round(p[2] / spacing[2])
        if i < 0 or j < 0 or k < 0 or i >= grey.shape[0] or j >= grey.shape[1] or k >= grey.shape[2]:
            break
        if not allowed[i, j, k]:
            break
        own = -stamp[i, j, k] - 1
        if 0 <= own < count - LAG and _along(p, t, points[own], tangents[own], 0.8 * size):
            break  # round a ring and back on its own track
        known = stamp[i, j, k] - 1
        if known >= 0:
            if _along(p, t, earlier[known], earlier_tangents[known], 0.8 * size):
                break
        else:
            stamp[i, j, k] = -count - 1
        if count >= LAG:
            # where two crests merge the local tangent swings over to the other one: compare it with the run so far
            hx = p[0] - points[count - LAG, 0]
            hy = p[1] - points[count - LAG, 1]
            hz = p[2] - points[count - LAG, 2]
            if hx * t[0] + hy * t[1] + hz * t[2] < bend * np.sqrt(hx * hx + hy * hy + hz * hz):
                # give up the points from where the crest began to turn
                hx, hy, hz = tangents[count - LAG, 0], tangents[count - LAG, 1], tangents[count - LAG, 2]
                swung = 1
                while swung < LAG - 1:
                    m = count - 1 - swung
                    if hx * tangents[m, 0] + hy * tangents[m, 1] + hz * tangents[m, 2] > UNTURNED:
                        break
                    swung += 1
                break
        points[count, 0], points[count, 1], points[count, 2] = p[0], p[1], p[2]
        tangents[count, 0], tangents[count, 1], tangents[count, 2] = t[0], t[1], t[2]
        values[count] = out[0]
        count += 1
    for m in range(count):
        i, j, k = (
            round(points[m, 0] / spacing[0]),
            round(points[m, 1] / spacing[1]),
            round(points[m, 2] / spacing[2]),
        )
        stamp[i, j, k] = max(0, stamp[i, j, k])
    i, j, k = round(p[0] / spacing[0]), round(p[1] / spacing[1]), round(p[2] / spacing[2])
    if 0 <= i < stamp.shape[0] and 0 <= j < stamp.shape[1] and 0 <= k < stamp.shape[2]:
        stamp[i, j, k] = max(0, stamp[i, j, k])
    return count - swung


@njit(cache=True)
def _taken(stamp: NDArray[Any], i: int, j: int, k: int) -> bool:
    """Whether a crest was walked within two voxels or so (square root of 5) of a voxel."""
    ni, nj, nk = stamp.shape
    for a in range(max(0, i - 2), min(ni, i + 3)):
        for b in range(max(0, j - 2), min(nj, j + 3)):
            for c in range(max(0, k - 2), min(nk, k + 3)):
                near = (a - i) * (a - i) + (b - j) * (b - j) + (c - k) * (c - k) <= 5
                if near and stamp[a, b, c] != 0:
                    return True
    return False


@njit(cache=True)
def _rows(array: NDArray[Any], count: int, wanted: int) -> NDArray[Any]:
    """``array`` (n, 3) with room for ``wanted`` rows, its first ``count`` kept."""
    size = array.shape[0]
    if wanted < size:
        return array
    while size <= wanted:
        size *= 2
    larger = np.empty((size, 3))
    larger[:count] = array[:count]
    return larger


@njit(cache=True)
def _lay_down(
    at: int,
    part: NDArray[Any],
    part_t: NDArray[Any],
    part_v: NDArray[Any],
    n: int,
    back: bool,
    points: NDArray[Any],
    tangents: NDArray[Any],
    values: NDArray[Any],
) -> None:
    """Copy n points of a walk to place ``at``; those of a walk ``back`` in reverse, their tangents turned."""
    for m in range(n):
        source = n - 1 - m if back else m
        sign = -1.0 if back else 1.0
        for axis in range(3):
            points[at + m, axis] = part[source, axis]
            tangents[at + m, axis] = sign * part_t[source, axis]
        values[at + m] = part_v[source]


@njit(cache=True)
def _mark(stamp: NDArray[Any], spacing: NDArray[Any], points: NDArray[Any], first: int, stop: int) -> None:
    """Stamp the voxels of points [first, stop) with their number + 1."""
    ni, nj, nk = stamp.shape
    for m in range(first, stop):
        a, b = round(points[m, 0] / spacing[0]), round(points[m, 1] / spacing[1])
        c = round(points[m, 2] / spacing[2])
        if 0 <= a < ni and 0 <= b < nj and 0 <= c < nk:
            stamp[a, b, c] = m + 1


@njit(cache=True)
def tracklets(
    grey: NDArray[Any],
    allowed: NDArray[Any],
    stamp: NDArray[Any],
    spacing: NDArray[Any],
    sigma: float,
    seeds: NDArray[Any],
    high: float,
    low: float,
    sharp: float,
    turn: float,
    bend: float,
    length: float,
    longest: int,
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Crests through the seeds (flat box indices, strongest first), each walked both ways with step ``length`` mm.

    stamp : int32 zeros on the box, working memory.  Returns points (n, 3), tangents (n, 3), crest values (n,), and the
    first point of every tracklet (m + 1,).
    """
    _, nj, nk = grey.shape
    size = min(spacing[0], spacing[1], spacing[2])
    w, out, step = np.empty((3, 3, 64)), np.empty(10), np.empty(3)
    points, tangents, values = np.empty((1024, 3)), np.empty((1024, 3)), np.empty(1024)
    first = np.zeros(64, np.int64)
    count = 0
    tracks = 0
    ahead, ahead_t, ahead_v = np.empty((longest, 3)), np.empty((longest, 3)), np.empty(longest)
    back, back_t, back_v = np.empty((longest, 3)), np.empty((longest, 3)), np.empty(longest)
    p, t = np.empty((1, 3)), np.empty((1, 3))
    value = np.empty(1)
    for n in range(seeds.shape[0]):
        rest, k = seeds[n] // nk, seeds[n] % nk
        i, j = rest // nj, rest % nj
        if _taken(stamp, i, j, k):
            continue
        p[0, 0], p[0, 1], p[0, 2] = i * spacing[0], j * spacing[1], k * spacing[2]
        x, y, z = p[0, 0], p[0, 1], p[0, 2]
        t[:] = 0.0
        middle = to_ridge(grey, spacing, sigma, p[0], t[0], 3, w, out, step)
        moved = (p[0, 0] - x) ** 2 + (p[0, 1] - y) ** 2 + (p[0, 2] - z) ** 2
        if out[0] < high or middle > -sharp or moved > (1.8 * size) ** 2:
            continue
        value[0] = out[0]
        na = _walk(
            grey, allowed, stamp, spacing, sigma, p[0], t[0], length, low, sharp, turn, bend,
            ahead, ahead_t, ahead_v, points, tangents,
        )  # fmt: skip
        nb = _walk(
            grey, allowed, stamp, spacing, sigma, p[0], -t[0], length, low, sharp, turn, bend,
            back, back_t, back_v, points, tangents,
        )  # fmt: skip
        total = na + nb + 1
        points, tangents = _rows(points, count, count + total), _rows(tangents, count, count + total)
        while values.shape[0] < points.shape[0]:
            values = _grown(values)
        _lay_down(count, back, back_t, back_v, nb, True, points, tangents, values)
        _lay_down(count + nb, p, t, value, 1, False, points, tangents, values)
        _lay_down(count + nb + 1, ahead, ahead_t, ahead_v, na, False, points, tangents, values)
        _mark(stamp, spacing, points, count, count + total)
        count += total
        tracks += 1
        if tracks >= first.shape[0]:
            first = _grown(first)
        first[tracks] = count
    return points[:count], tangents[:count], values[:count], first[: tracks + 1]
