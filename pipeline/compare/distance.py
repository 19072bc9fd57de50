"""Distance from points to a polyline, exactly."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pipeline.model import Array, arc_length

PAIRS_AT_ONCE = 2_000_000  # point-segment pairs held in memory together: about 100 MB


def _feet(points: Array, start: Array, chord: Array) -> tuple[Array, Array]:
    """Squared distances (n, m) of points to segments and where the feet lie on them (0 to 1)."""
    squared = np.einsum("ij,ij->i", chord, chord)
    offset = points[:, None, :] - start[None, :, :]
    along = np.einsum("nmj,mj->nm", offset, chord) / np.where(squared > 0, squared, 1.0)
    along = np.clip(along, 0.0, 1.0)
    gap = offset - along[..., None] * chord
    return np.einsum("nmj,nmj->nm", gap, gap), along


def point_to_curve(points: ArrayLike, curve: ArrayLike) -> tuple[Array, Array]:
    """Distance from each point to the nearest place *on the segments* of a polyline.

    points : (n, 3) LPS mm.     curve : (m, 3) LPS mm, m >= 1, ordered from entry to tip.
    Returns distances (n,) in mm and the arc length (n,) in mm of the nearest place (the foot).
    One-sided: swap the arguments for the other direction; `compare` reports both. Cost O(n m), exact.
    """
    p = np.atleast_2d(np.asarray(points, dtype=np.float64))
    c = np.atleast_2d(np.asarray(curve, dtype=np.float64))
    if p.shape[1:] != (3,) or c.shape[1:] != (3,) or len(c) == 0:
        msg = f"point_to_curve: got points {p.shape} and curve {c.shape}; expected (n, 3) and (m, 3) with m >= 1"
        raise ValueError(msg)
    if len(c) == 1:
        return np.linalg.norm(p - c[0], axis=1), np.zeros(len(p))
    start, chord, arc = c[:-1], np.diff(c, axis=0), arc_length(c)
    lengths = np.diff(arc)
    distance, foot = np.empty(len(p)), np.empty(len(p))
    block = max(PAIRS_AT_ONCE // len(start), 1)
    for first in range(0, len(p), block):
        part = slice(first, first + block)
        squared, along = _feet(p[part], start, chord)
        best = np.argmin(squared, axis=1)
        rows = np.arange(len(best))
        distance[part] = np.sqrt(squared[rows, best])
        foot[part] = arc[best] + along[rows, best] * lengths[best]
    return distance, foot
