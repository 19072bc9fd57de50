"""A path through a lumen pulled tight: from voxel to voxel it is longer than need be, and one of many as long."""

import numpy as np
from scipy.ndimage import map_coordinates

from pipeline.arrays.polyline import resample
from pipeline.model import Array
from solver import Grid

PASSES = 4
"""Times that it is pulled, from either end in turn: after the first it still swings out before a bend."""
STEP = 0.5
"""Voxels between the places at which a straight way is held against the wall."""
SLACK = 0.1
"""Voxels by which a straight way may come nearer to the wall: smoothed paths do."""


def pulled_tight(path_mm: Array, distance: Grid, room_mm: float) -> Array:
    """The path (n, 3), LPS mm, shortened by straight ways that keep ``room_mm`` to the wall, its ends kept.

    distance : to the wall, mm, negative inside. Points go straight to others that they see, far ones first.
    """
    voxel = float(distance.spacing_mm.mean())
    most = SLACK * voxel - room_mm
    path = resample(path_mm, voxel)
    for _ in range(PASSES):
        path = resample(_hops(path, distance, most), voxel)[::-1]
    return path


def _hops(path: Array, distance: Grid, most: float) -> Array:
    here, kept, last = 0, [0], len(path) - 1
    while here < last:
        sees, not_sees = here + 1, last + 1
        # twice as far while it is seen, then by halves: what is hidden and seen again farther on, the next pass finds
        while not_sees - sees > 1:
            tried = min(2 * sees - here, last) if not_sees > last else (sees + not_sees) // 2
            if _sees(path, here, tried, distance, most):
                sees = tried
            else:
                not_sees = tried
        here = sees
        kept.append(here)
    return path[kept]


def _sees(path: Array, here: int, there: int, distance: Grid, most: float) -> bool:
    """Whether the distance stays below ``most`` on the straight way from one point of a path to another."""
    way = path[there] - path[here]
    count = int(np.linalg.norm(way) / (STEP * float(distance.spacing_mm.mean()))) + 2
    index = distance.to_index(path[here] + np.linspace(0.0, 1.0, count)[:, None] * way)
    return bool(map_coordinates(distance.values, index.T, order=1, mode="nearest").max() <= most)
