"""Bright ridges as ordered sub-voxel points: a predictor-corrector walk from every strong voxel not yet passed."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.jets import Blurred, Probe, new_probe, to_ridge
from pipeline.arrays.lattice import entry_point, grown, kernel, unravelled

LAG = 12
"""Steps over which the run of a walk is compared with the local tangent: a swing from one strand to another that it
crosses at 50 degrees takes 4 to 6 voxels, in two bends of half the angle."""
UNTURNED = 0.97
"""Cosine with the direction LAG steps ago from which a point is taken not to have turned yet."""
BESIDE = 0.8
"""Voxels from a track within which a point that heads the same way lies on it."""


class Track(NamedTuple):
    """Points (n, 3) on crests in the order of a walk, unit tangents (n, 3) and crest grey (n,)."""

    points: NDArray[Any]
    tangents: NDArray[Any]
    values: NDArray[Any]


class Ground(NamedTuple):
    """What is walked over: a lattice, where its crests may run (``allowed``, uint8 box), and an int32 box of zeros in
    which a walk leaves its marks.
    """

    field: Blurred
    allowed: NDArray[Any]
    stamp: NDArray[Any]


class Rules(NamedTuple):
    """When a walk begins and ends: crest grey to start at (``high``) and to go on at (``low``), least curvature across
    (``sharp``), least cosine between two steps (``turn``) and against the last LAG steps (``bend``), and its step, mm.
    """

    high: float
    low: float
    sharp: float
    turn: float
    bend: float
    stride: float


@kernel
def _room(count: int) -> Track:
    return Track(np.empty((count, 3)), np.empty((count, 3)), np.empty(count))


@kernel
def _voxel(p: NDArray[Any], spacing: NDArray[Any], shape: tuple[int, int, int]) -> tuple[int, int, int, bool]:
    """The voxel nearest to a point, and whether the box has it."""
    i, j, k = round(p[0] / spacing[0]), round(p[1] / spacing[1]), round(p[2] / spacing[2])
    return i, j, k, min(i, j, k) >= 0 and i < shape[0] and j < shape[1] and k < shape[2]


@kernel
def _on_track(probe: Probe, track: Track, n: int, reach: float) -> bool:
    """Whether the probe lies on a track beside its point n, and heads the same way or back."""
    p, t, q, u = probe.place, probe.tangent, track.points[n], track.tangents[n]
    gap = (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2
    return bool(gap < reach * reach and abs(t[0] * u[0] + t[1] * u[1] + t[2] * u[2]) > 0.7)


@kernel
def _swung(probe: Probe, track: Track, count: int, bend: float) -> int:
    """How many of the last points, from where the crest began to turn, are to be given up; 0 where it does not turn.

    Where two crests merge the local tangent swings over to the other one: it is compared with the run so far.
    """
    points, tangents, _ = track
    p, t, back = probe.place, probe.tangent, count - LAG
    hx, hy, hz = p[0] - points[back, 0], p[1] - points[back, 1], p[2] - points[back, 2]
    if hx * t[0] + hy * t[1] + hz * t[2] >= bend * np.sqrt(hx * hx + hy * hy + hz * hz):
        return 0
    hx, hy, hz = tangents[back, 0], tangents[back, 1], tangents[back, 2]
    swung = 1
    while swung < LAG - 1:
        m = count - 1 - swung
        if hx * tangents[m, 0] + hy * tangents[m, 1] + hz * tangents[m, 2] > UNTURNED:
            break
        swung += 1
    return swung


@kernel
def _step(field: Blurred, rules: Rules, probe: Probe) -> bool:
    """Move the probe a step along the crest; whether it is still on one: bright, sharp, and where the tangent led."""
    p, t = probe.place, probe.tangent
    ox, oy, oz = t[0], t[1], t[2]
    qx, qy, qz = p[0] + rules.stride * ox, p[1] + rules.stride * oy, p[2] + rules.stride * oz
    p[0], p[1], p[2] = qx, qy, qz
    middle = to_ridge(field, probe, 2)
    size = min(field.spacing[0], field.spacing[1], field.spacing[2])
    moved = (p[0] - qx) ** 2 + (p[1] - qy) ** 2 + (p[2] - qz) ** 2
    ahead = t[0] * ox + t[1] * oy + t[2] * oz
    weak = probe.jet[0] < rules.low or middle > -rules.sharp
    return not (weak or ahead < rules.turn or moved > (0.8 * size) ** 2)


@kernel
def _unstamp(stamp: NDArray[Any], points: NDArray[Any], spacing: NDArray[Any]) -> None:
    """Clear the marks (negative) that the walk under way has left at points (n, 3)."""
    for point in points:
        i, j, k, there = _voxel(point, spacing, stamp.shape)
        if there:
            stamp[i, j, k] = max(0, stamp[i, j, k])


@kernel
def _walk(ground: Ground, rules: Rules, probe: Probe, track: Track, known: Track) -> int:
    """Follow the crest from the probe; fills the track and returns how many of its points count.

    Stops where the crest ends or turns off, leaves ``allowed``, or runs along one that was walked before (``stamp`` =
    its point in ``known`` + 1; the walk's own points are stamped negative meanwhile).
    """
    field, allowed, stamp = ground
    p, spacing = probe.place, field.spacing
    reach = BESIDE * min(spacing[0], spacing[1], spacing[2])
    count = swung = 0
    while count < track.points.shape[0] and _step(field, rules, probe):
        i, j, k, there = _voxel(p, spacing, stamp.shape)
        if not there or not allowed[i, j, k]:
            break
        own, other = -stamp[i, j, k] - 1, stamp[i, j, k] - 1
        if 0 <= own < count - LAG and _on_track(probe, track, own, reach):
            break  # round a ring and back on its own track
        if other < 0:
            stamp[i, j, k] = -count - 1
        elif _on_track(probe, known, other, reach):
            break
        if count >= LAG:
            swung = _swung(probe, track, count, rules.bend)
            if swung:
                break
        for axis in range(3):
            track.points[count, axis], track.tangents[count, axis] = p[axis], probe.tangent[axis]
        track.values[count] = probe.jet[0]
        count += 1
    _unstamp(stamp, track.points[:count], spacing)
    _unstamp(stamp, p.reshape((1, 3)), spacing)
    return count - swung


@kernel
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


@kernel
def _lay_down(to: Track, at: int, part: Track, count: int, turned: float) -> int:
    """Copy the points of a walk to place ``at``, in reverse if ``turned`` is -1 and not 1; returns the next place."""
    for m in range(count):
        source = m if turned > 0.0 else count - 1 - m
        for axis in range(3):
            to.points[at + m, axis] = part.points[source, axis]
            to.tangents[at + m, axis] = turned * part.tangents[source, axis]
        to.values[at + m] = part.values[source]
    return at + count


@kernel
def _start(field: Blurred, rules: Rules, probe: Probe, i: int, j: int, k: int) -> bool:
    """Move the probe from a voxel to the crest beside it; whether there is one that a walk may start at."""
    p, (hx, hy, hz) = probe.place, field.spacing
    p[0], p[1], p[2] = i * hx, j * hy, k * hz
    probe.tangent[:] = 0.0
    middle = to_ridge(field, probe, 3)
    moved = (p[0] - i * hx) ** 2 + (p[1] - j * hy) ** 2 + (p[2] - k * hz) ** 2
    return not (probe.jet[0] < rules.high or middle > -rules.sharp or moved > (1.8 * min(hx, hy, hz)) ** 2)


@entry_point
def tracklets(ground: Ground, seeds: NDArray[Any], rules: Rules, longest: int) -> tuple[Track, NDArray[Any]]:
    """Crests through the seeds (flat box indices, strongest first), each walked both ways.

    longest : most points of a walk.  Returns the points of all, and the first point of every tracklet (m + 1,).
    """
    field, _, stamp = ground
    found, first, probe = _room(1024), np.zeros(64, np.int64), new_probe()
    seed, ahead, back = _room(1), _room(longest), _room(longest)
    count = tracks = 0
    for flat in seeds:
        i, j, k = unravelled(flat, stamp.shape)
        if _taken(stamp, i, j, k) or not _start(field, rules, probe, i, j, k):
            continue
        seed.points[0], seed.tangents[0], seed.values[0] = probe.place, probe.tangent, probe.jet[0]
        na = _walk(ground, rules, probe, ahead, found)
        probe.place[:], probe.tangent[:] = seed.points[0], -seed.tangents[0]
        nb = _walk(ground, rules, probe, back, found)
        while count + na + nb + 1 > found.values.shape[0]:
            found = Track(grown(found.points), grown(found.tangents), grown(found.values))
        begin = count
        count = _lay_down(found, count, back, nb, -1.0)
        count = _lay_down(found, count, seed, 1, 1.0)
        count = _lay_down(found, count, ahead, na, 1.0)
        for m in range(begin, count):
            i, j, k, there = _voxel(found.points[m], field.spacing, stamp.shape)
            if there:
                stamp[i, j, k] = m + 1
        tracks += 1
        if tracks >= first.shape[0]:
            first = grown(first)
        first[tracks] = count
    points, tangents, values = found
    return Track(points[:count], tangents[:count], values[:count]), first[: tracks + 1]
