"""Where along a wire its wall is looked up."""

from __future__ import annotations

import numpy as np

from solver._kernels.data import Rule
from solver.wall import VesselWall
from solver.wire import GuideWire

QUADRATURES = ("tip", "joints", "segments")
TIP_PANELS = 5
"""Panels of the last segment, each half as long as the one before: the last is 1/16 of it."""
TIP_ZONE = 4
"""Segments before the last with two Gauss points each: they cover the tip's contact run where segments are short."""


def look_up_rule(wire: GuideWire, wall: VesselWall | None, quadrature: str) -> Rule:
    """Where a wire's segments look the wall up.

    The last segment has two Gauss points on each of a few panels that shrink towards the tip, so that a contact
    run much shorter than the segment is still seen.
    """
    hull, reach = wall.hull_points(wire.radius_mm) if wall is not None else (np.zeros((0, 2)), 0.0)
    if quadrature == "joints":
        return Rule(hull, reach, np.zeros(1), np.ones(1), 0)
    edges = np.concatenate([[0.0], 0.5 ** np.arange(TIP_PANELS - 1, -1, -1)])
    width, centre = np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
    offset = width / (2 * np.sqrt(3.0))
    at, weight = np.concatenate([centre - offset, centre + offset]), np.concatenate([width, width]) / 2
    return Rule(hull, reach, at, weight, TIP_ZONE if quadrature == "tip" else 2**62)
