"""Slow, obvious point-to-polyline distance."""

from __future__ import annotations

from itertools import pairwise

import numpy as np


def point_to_segment(point, start, end):
    """Distance and fraction along the segment, one pair at a time."""
    chord = end - start
    squared = float(chord @ chord)
    fraction = 0.0 if squared == 0.0 else min(1.0, max(0.0, float((point - start) @ chord) / squared))
    return float(np.linalg.norm(point - start - fraction * chord)), fraction


def point_to_curve(points, curve):
    """Smallest distance over all segments, and the arc length of its foot."""
    result = []
    for point in points:
        best, arc = (np.inf, 0.0), 0.0
        for start, end in pairwise(curve):
            distance, fraction = point_to_segment(point, start, end)
            length = float(np.linalg.norm(end - start))
            best = min(best, (distance, arc + fraction * length))
            arc += length
        result.append(best)
    return np.array(result).T
