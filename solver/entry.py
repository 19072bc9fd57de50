"""Where a wire may begin."""

import numpy as np
from scipy.sparse.csgraph import connected_components

from solver import _tolerances as tol
from solver.doors import Array
from solver.solution import Status
from solver.wall import VesselWall

SEPTUM_SAMPLES = 17
"""Places on a straight way across a septum, which is at most four voxel diagonals long."""


def refused_at(wall: VesselWall, entry: Array) -> Status | None:
    """Why no wire may start at an entry point (3,): too far outside the lumen, or between two lumens."""
    voxel = float(np.linalg.norm(wall.distance.spacing_mm))
    outside = float(wall.look_up(entry)[0][0])
    if outside > tol.ENTRY_MARGIN_VOXELS * voxel:
        return Status.ENTRY_OUTSIDE
    return Status.ENTRY_IN_SEPTUM if outside > 0.0 and _in_septum(wall, entry, outside, outside + voxel) else None


def _in_septum(wall: VesselWall, entry: Array, outside: float, reach: float) -> bool:
    """Whether the lumen around a point that lies ``outside`` mm deep in the wall is in two or more separate parts.

    Of 26 places ``reach`` mm away, those in the lumen; two are joined where the distance on the straight way between
    them stays below half of ``outside``. Around a hole of one voxel, where two vessels part, and beside the inner wall
    of a bend all are joined, directly or through others.
    """
    ways = np.array([way for way in np.ndindex(3, 3, 3) if way != (1, 1, 1)]) - 1.0
    ends = entry + reach * ways / np.linalg.norm(ways, axis=1, keepdims=True)
    ends = ends[wall.look_up(ends)[0] < 0.0]
    share = np.linspace(0.0, 1.0, SEPTUM_SAMPLES)[:, None, None, None]
    between = ends[:, None] + share * (ends - ends[:, None])
    highest = wall.look_up(between.reshape(-1, 3))[0].reshape(SEPTUM_SAMPLES, len(ends), len(ends)).max(axis=0)
    return connected_components(highest <= 0.5 * outside)[0] > 1
