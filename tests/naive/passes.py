"""How close a wire comes to itself, slow and obvious: every pair of dense points along it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def closest_mm(joints: Array, arc_apart: float, step: float) -> float:
    """Least distance of two points whose arc lengths differ by more than ``arc_apart``; inf where there are none."""
    points, arcs, arc = [], [], 0.0
    for a, b in pairwise(joints):
        length = float(np.linalg.norm(b - a))
        share = np.linspace(0.0, 1.0, max(int(length / step), 1) + 1)
        points.append(a + share[:, None] * (b - a))
        arcs.append(arc + share * length)
        arc += length
    p, s = np.concatenate(points), np.concatenate(arcs)
    far = np.abs(s[:, None] - s[None, :]) > arc_apart
    distance = np.linalg.norm(p[:, None] - p[None, :], axis=2)
    return float(distance[far].min()) if far.any() else float("inf")
