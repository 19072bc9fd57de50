"""Tracing error against contrast over noise, its limit, and two chains from scikit-image on the same frames."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from skimage.filters import sato
from skimage.graph import route_through_array
from skimage.morphology import skeletonize

from pipeline.compare import point_to_curve
from pipeline.model import Volume
from pipeline.segment import segment
from pipeline.trace import trace
from tests.pipeline import phantoms

VOXEL, PSF, RADIUS = 0.3, 0.8, 0.2
PEAK = phantoms.wire_peak(RADIUS / VOXEL, PSF)


@dataclass(frozen=True, eq=False)
class Scene:
    """A vessel with a wire in it before blur; ``entry`` is off by half a voxel."""

    origin: np.ndarray
    empty: np.ndarray
    wired: np.ndarray
    wire: np.ndarray
    entry: np.ndarray
    direction: np.ndarray


def scene(seed, side):
    """A 4 mm helical vessel and a wire that wanders in it, in side^3 voxels."""
    vessel = phantoms.helix(
        0.36 * VOXEL * (side - 30), 0.5 * VOXEL * (side - 60), 1.25 if side > 150 else 0.9
    )
    centre = 0.5 * (vessel.min(axis=0) + vessel.max(axis=0))
    origin = centre - 0.5 * VOXEL * side
    shape = (side, side, side)
    wire = phantoms.inside_curve(vessel, 1.2, seed)[60:-140]
    distance = phantoms.distance_to(vessel, shape, VOXEL, origin, 2.6)
    empty = (phantoms.BACKGROUND + 900 * phantoms.partial_volume(distance - 2.0, VOXEL)).astype(np.float32)
    wired = phantoms.add_wire(empty.copy(), wire, RADIUS, phantoms.WIRE, VOXEL, origin)
    direction = wire[45] - wire[35]
    rng = np.random.default_rng(seed + 7)
    shift = rng.normal(size=3)
    shift *= 0.5 * VOXEL / np.linalg.norm(shift)
    return Scene(origin, empty, wired, phantoms.resample(wire, 0.005), wire[40] + shift, direction)


def volumes(s, cnr, seed, correlation=0.0):
    """Frame and reference of the same noise."""
    noise = PEAK / cnr
    return tuple(
        Volume(
            np.asfortranarray(phantoms.scan(v, PSF, noise, 1000 * seed + n, correlation)),
            [VOXEL] * 3,
            s.origin,
        )
        for n, v in enumerate((s.wired, s.empty))
    )


def errors(points, s):
    """Mean, p95, tip (voxel) and coverage of the true curve from the entry plane on."""
    off, _ = point_to_curve(points, s.wire)
    first = int(np.argmin(np.linalg.norm(s.wire - points[0], axis=1)))
    seen = cKDTree(phantoms.resample(points, 0.05)).query(s.wire[first:])[0] < 2 * VOXEL
    tip = np.linalg.norm(points[-1] - s.wire[-1]) / VOXEL
    return off.mean() / VOXEL, np.percentile(off, 95) / VOXEL, tip, seen.mean()


def pulls(curve, s):
    """Errors across the wire over their stated standard deviations, and the tip's along it."""
    _, near = cKDTree(s.wire).query(curve.points_mm)
    t = np.gradient(s.wire, axis=0)[near]
    t /= np.linalg.norm(t, axis=1)[:, None]
    off = curve.points_mm - s.wire[near]
    side = np.cross(t, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=1)[:, None]
    other = np.cross(t, side)
    keep = slice(2, -6)
    across = np.concatenate([np.sum(off * side, axis=1)[keep], np.sum(off * other, axis=1)[keep]])
    sigma = np.concatenate([curve.sigma_mm[keep]] * 2)
    return across / sigma, float((curve.points_mm[-1] - s.wire[-1]) @ t[-1] / curve.tip_sigma_mm)


def _crop(s, frame, lumen):
    """The frame's part on the lumen's box, zero outside the lumen, and the box's origin."""
    corner = np.rint(frame.to_index(lumen.distance.origin_mm)).astype(int)
    window = tuple(slice(c, c + n) for c, n in zip(corner, lumen.distance.shape, strict=True))
    grey = frame.values[window].astype(np.float32)
    return grey, lumen.distance.values < 0, lumen.distance.origin_mm


def _geodesic(cells):
    """The longest of the shortest paths along 26-connected voxels (n, 3), by two breadth-first searches."""
    tree = cKDTree(cells)
    links = tree.query_ball_point(cells, 1.8)

    def walk(start):
        before = {start: -1}
        front = [start]
        last = start
        while front:
            following = []
            for a in front:
                for b in links[a]:
                    if b not in before:
                        before[b] = a
                        following.append(b)
                        last = b
            front = following
        return last, before

    end, _ = walk(0)
    start, before = walk(end)
    path = []
    while start >= 0:
        path.append(start)
        start = before[start]
    return cells[path]


def skeleton_chain(s, frame, lumen):
    """Threshold half way up to the wire's peak inside the lumen, skeletonize, longest path."""
    grey, inside, origin = _crop(s, frame, lumen)
    mask = (grey > phantoms.CONTRAST + 0.5 * PEAK) & inside
    cells = np.argwhere(skeletonize(mask))
    if len(cells) < 5:
        return None
    labels = cKDTree(cells).query_ball_point(cells, 1.8)
    seen, best = np.zeros(len(cells), bool), []
    for first in range(len(cells)):
        if seen[first]:
            continue
        group, todo = [], [first]
        seen[first] = True
        while todo:
            a = todo.pop()
            group.append(a)
            for b in labels[a]:
                if not seen[b]:
                    seen[b] = True
                    todo.append(b)
        best = max(best, group, key=len)
    points = _geodesic(cells[best]) * VOXEL + origin
    return (
        points if np.linalg.norm(points[0] - s.entry) < np.linalg.norm(points[-1] - s.entry) else points[::-1]
    )


def path_chain(s, frame, lumen):
    """Sato ridge filter in the lumen's box, cheapest path from entry to the TRUE tip (which it is given)."""
    grey, inside, origin = _crop(s, frame, lumen)
    ridge = sato(grey, sigmas=[1.0], black_ridges=False)
    ridge[~inside] = 0
    cost = 1.0 / (ridge / ridge.max() + 1e-3)
    ends = [
        np.clip(np.rint((p - origin) / VOXEL), 0, np.array(grey.shape) - 1).astype(int)
        for p in (s.entry, s.wire[-1])
    ]
    path, _ = route_through_array(cost, ends[0], ends[1], fully_connected=True, geometric=True)
    return np.array(path) * VOXEL + origin


def ours(s, frame, reference, lumen):
    """The traced curve."""
    return trace(frame, lumen, s.entry, s.direction, reference=reference)


def row(side, cnr, seeds, correlation=0.0, with_reference=True, chains=False):
    """Errors over seeds at one contrast; with the chains' medians when asked."""
    got, across, tips, seconds, other = [], [], [], [], {"skeleton": [], "ridge + path": []}
    for seed in seeds:
        s = scene(seed, side)
        frame, reference = volumes(s, cnr, seed, correlation)
        lumen = segment(reference, s.entry[None] + 0)
        start = time.process_time()
        curve = ours(s, frame, reference if with_reference else None, lumen)
        seconds.append(time.process_time() - start)
        if len(curve.points_mm) == 0 or curve.status.name != "OK":
            print(f"     seed {seed} CNR {cnr}: {curve.status.name} {curve.note}")
        if len(curve.points_mm) == 0:
            continue
        got.append(errors(curve.points_mm, s))
        a, t = pulls(curve, s)
        across.append(a)
        tips.append(t)
        if chains:
            for name, chain in (("skeleton", skeleton_chain), ("ridge + path", path_chain)):
                start = time.process_time()
                points = chain(s, frame, lumen)
                spent = time.process_time() - start
                if points is not None:
                    other[name].append((*errors(points, s), spent))
    return np.array(got), np.concatenate(across), np.array(tips), float(np.median(seconds)), other


def report(quick):
    """Print the table."""
    side = 128 if quick else 256
    seeds = range(100, 104 if quick else 108)
    print(
        f"\n## Tracing, {side}^3 frames of 0.3 mm, 0.4 mm wire, PSF 0.8 voxel, "
        f"seeds {seeds.start}-{seeds.stop - 1}; errors in voxels"
    )
    print("   bars at CNR 16 / 8 / 4: mean 0.04 / 0.07 / 0.13, median tip 0.2 / 0.35 / 0.55, pull 0.8-1.25")
    print("   limit: mean 2-D error of a line fit with knots every 8 voxels, 1.25 * 0.8 / (CNR sqrt 8)")
    print("   noise, reference    CNR   mean   p95   tip   cover  pull  tip pull  limit  CPU s")
    for label, correlation, given in (
        ("white, one scan", 0, True),
        ("correlated 0.8", 0.8, True),
        ("white, none", 0, False),
    ):
        for cnr in (16, 8, 4):
            got, across, tips, seconds, other = row(
                side, cnr, seeds, correlation, given, chains=label[:11] == "white, one "
            )
            mean, p95, _, cover = got.mean(axis=0)
            limit = 1.25 * 0.8 / (cnr * np.sqrt(8))
            print(f"   {label:18s} {cnr:4d}  {mean:.3f}  {p95:.3f}  {np.median(got[:, 2]):.3f}  {cover:.3f}  "
                  f"{across.std():.2f}   {np.sqrt(np.mean(tips**2)):.2f}     {limit:.3f}  {seconds:.3f}")  # fmt: skip
            for name, rows in other.items():
                if rows:
                    m = np.median(np.array(rows), axis=0)
                    print(f"     {name:16s} {cnr:4d}  {m[0]:.3f}  {m[1]:.3f}  {m[2]:.3f}  {m[3]:.3f}"
                          f"                        {m[4]:.3f}")  # fmt: skip
