"""Where a wire runs so nearly in the plane in which the scanner turned that its scan is least to be trusted."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.arrays.polyline import at_arc
from pipeline.model import Array, arc_length

TANGENT_MM = 1.5
"""Length over which the wire's direction is taken: a few voxels, so that noise does not turn it."""


def near_rotation_plane(points_mm: Array, axis: ArrayLike, limit_deg: float) -> NDArray[np.bool_]:
    """Points (n,) of a curve (n, 3) whose tangent is within ``limit_deg`` of the plane across ``axis`` (LPS).

    A cone-beam scan on a circle lacks the frequencies within the cone's half angle of its axis (Tuy 1983, doi
    10.1137/0143035), and those are what places such a stretch along the axis; rays that run along the metal there
    leave streaks. Both happen below the cone's half angle: 7 to 9 degrees for a 30 x 40 cm detector at 1.2 m.
    """
    if len(points_mm) < 2:
        return np.zeros(len(points_mm), bool)
    normal = np.asarray(axis, float) / np.linalg.norm(np.asarray(axis, float))
    arc = arc_length(points_mm)
    ends = (np.clip(arc + sign * 0.5 * TANGENT_MM, 0.0, arc[-1]) for sign in (1, -1))
    chord = np.subtract(*(at_arc(points_mm, s) for s in ends))
    climb = np.abs(chord / (np.linalg.norm(chord, axis=1)[:, None] + 1e-12) @ normal)
    return np.asarray(climb < np.sin(np.radians(limit_deg)))
