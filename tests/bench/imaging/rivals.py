"""Two chains from scikit-image that trace the same frames: skeleton of a threshold, ridge filter and cheapest path."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree
from skimage.filters import sato
from skimage.graph import route_through_array
from skimage.morphology import skeletonize

from tests.bench.imaging.scenes import PEAK, VOXEL
from tests.pipeline import phantoms


def _crop(s, frame, lumen):
    """The frame's part on the lumen's box, the voxels inside the lumen, and the box's origin."""
    corner = np.rint(frame.to_index(lumen.distance.origin_mm)).astype(int)
    window = tuple(slice(c, c + n) for c, n in zip(corner, lumen.distance.shape, strict=True))
    grey = frame.values[window].astype(np.float32)
    return grey, lumen.distance.values < 0, lumen.distance.origin_mm


def _walk(links, start):
    """Breadth-first search from a cell: the cell reached last, and for every cell the one before it."""
    before, front, last = {start: -1}, [start], start
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


def _geodesic(cells):
    """The longest of the shortest paths along 26-connected voxels (n, 3), by two breadth-first searches."""
    links = cKDTree(cells).query_ball_point(cells, 1.8)
    end, _ = _walk(links, 0)
    start, before = _walk(links, end)
    path = []
    while start >= 0:
        path.append(start)
        start = before[start]
    return cells[path]


def _largest(cells):
    """The largest 26-connected group of voxels (n, 3)."""
    links = cKDTree(cells).query_ball_point(cells, 1.8)
    best, left = [], set(range(len(cells)))
    while left:
        group = list(_walk(links, min(left))[1])
        left -= set(group)
        best = max(best, group, key=len)
    return cells[best]


def skeleton_chain(s, frame, lumen):
    """Threshold half way up to the wire's peak inside the lumen, skeletonize, longest path."""
    grey, inside, origin = _crop(s, frame, lumen)
    cells = np.argwhere(skeletonize((grey > phantoms.CONTRAST + 0.5 * PEAK) & inside))
    if len(cells) < 5:
        return None
    points = _geodesic(_largest(cells)) * VOXEL + origin
    near = [np.linalg.norm(p - s.entry) for p in (points[0], points[-1])]
    return points if near[0] < near[1] else points[::-1]


def path_chain(s, frame, lumen):
    """Sato ridge filter and the cheapest path from entry to the TRUE tip, which it is given.

    On the lumen's box alone: on the whole frame the filter takes minutes.
    """
    grey, inside, origin = _crop(s, frame, lumen)
    ridge = sato(grey, sigmas=[1.0], black_ridges=False)
    ridge[~inside] = 0
    cost = 1.0 / (ridge / ridge.max() + 1e-3)
    limit = np.array(grey.shape) - 1
    ends = [np.clip(np.rint((p - origin) / VOXEL), 0, limit).astype(int) for p in (s.entry, s.wire[-1])]
    path, _ = route_through_array(cost, ends[0], ends[1], fully_connected=True, geometric=True)
    return np.array(path) * VOXEL + origin


RIVALS = {"threshold + skeleton": skeleton_chain, "ridge + path": path_chain}
