"""Whether a wire passes through itself: the energy knows the vessel's wall and no contact between parts of the wire."""

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from solver.grid import Array

FINEST_RADII = 0.05
"""Joints nearer to the one before than this, in radii, are left out: they move the wire by a twentieth of its radius at
most, and 200 000 of them on 37 mm had more pairs within two radii than memory holds."""


def self_overlap_mm(joints_mm: ArrayLike, radius_mm: float) -> float:
    """How deep a wire of this radius overlaps itself, mm; 0 where it does not.

    joints_mm : (k + 1, 3), entry to tip. Two places count where the way between them along the wire is longer than
    pi radii: a smooth wire that bends no tighter than its own radius comes within two radii of itself nowhere else.
    """
    joints = _thinned(np.asarray(joints_mm, dtype=np.float64), FINEST_RADII * radius_mm)
    start, along = joints[:-1], np.diff(joints, axis=0)
    length = np.linalg.norm(along, axis=1)
    arc = np.concatenate([[0.0], np.cumsum(length)])
    reach = 2.0 * radius_mm + float(length.max(initial=0.0))
    pairs = (
        cKDTree(start + 0.5 * along).query_pairs(reach, output_type="ndarray") if len(start) > 1 else np.empty((0, 2))
    )
    i, j = pairs.T.astype(int)
    apart = arc[j] - arc[i + 1] > math.pi * radius_mm
    if not apart.any():
        return 0.0
    distance = _segment_distance(start[i[apart]], along[i[apart]], start[j[apart]], along[j[apart]])
    return max(2.0 * radius_mm - float(distance.min()), 0.0)


def _thinned(joints: Array, step_mm: float) -> Array:
    """The joints (n, 3) without those of a stretch of ``step_mm`` but its first, and with the last."""
    length = np.linalg.norm(np.diff(joints, axis=0), axis=1)
    if not np.any(length < step_mm):
        return joints
    stretch = np.floor(np.concatenate([[0.0], np.cumsum(length)]) / step_mm)
    kept = np.flatnonzero(np.diff(stretch, prepend=-1.0))
    return joints[np.union1d(kept, len(joints) - 1)]


def _segment_distance(p: Array, u: Array, q: Array, v: Array) -> Array:
    """Distances (n,) of segments p + s u and q + t v (Ericson, Real-Time Collision Detection, section 5.1.9)."""
    a, e, b = _dot(u, u), _dot(v, v), _dot(u, v)
    gap = p - q
    c, f = _dot(u, gap), _dot(v, gap)
    crossing = a * e - b * b
    # for parallel segments any s is as good as any other
    s = np.clip((b * f - c * e) / np.where(crossing > 1e-12 * a * e, crossing, np.inf), 0.0, 1.0)
    t = np.clip((b * s + f) / e, 0.0, 1.0)
    s = np.clip((b * t - c) / a, 0.0, 1.0)
    return np.asarray(np.linalg.norm(gap + s[:, None] * u - t[:, None] * v, axis=1))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("ij,ij->i", a, b))
