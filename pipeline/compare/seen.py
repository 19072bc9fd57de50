"""Whether the polyline of a projection can be a wire: its points in order, and not longer than one of its depth."""

import numpy as np

from pipeline.arrays.order import disordered, thinned
from pipeline.arrays.polyline import resample, smooth
from pipeline.compare.views import Screen
from pipeline.model import Array, arc_length

TREMBLE_PX, MOST_TREMBLE_MM = 4.0, 4.0
"""More than two points of a hand's polyline lie apart by being up to a pixel off along both axes (2.8); where "pixels"
are so large that this is a bend, the second holds."""
DRAWN_PX = 0.6
"""Standard deviation of points that lie up to a pixel off."""
STEP_MM, AS_NEAR_MM = 0.25, 0.5
"""Sampling of a polyline, and by how much another pass may be farther from the entry that it comes to first."""


def require_in_order(screen: Screen, points_px: Array, frame: int) -> None:
    """ValueError where the polyline (n, 2), which lies on the plane as ``screen.curve_mm``, is in no order.

    frame : its number, which is that of its entry in the file.
    """
    found = disordered(screen.curve_mm, _tremble_mm(screen, points_px))
    if found is None:
        return
    here, there = found
    mm, px = (float(np.linalg.norm(points[there] - points[here])) for points in (screen.curve_mm, points_px))
    raise ValueError(
        f"frames[{frame}].points_px jumps by {px:.0f} pixels ({mm:.1f} mm) from point {here} to point {there} (counted "
        "from 0), away from the others or back over them: are its points in order, or do they scatter? Allowed: along "
        "the wire, from the base to the tip; it may cross itself, turn back and leave out a stretch. Sort the "
        "points along the wire, or take out what is off it"
    )


def require_not_longer(screen: Screen, points_px: Array, entry_mm: Array, longest_mm: float, told: str) -> None:
    """ValueError where the polyline is longer from the entry on than a wire can be seen, which is never lengthened.

    entry_mm : (3,) where the entry is seen on the plane, shifted as the wire was.     longest_mm : there.
    told : what that allows for.
    """
    drawn = screen.curve_mm[thinned(screen.curve_mm, _tremble_mm(screen, points_px))]
    # a hand's tremble adds a third to the length of points a pixel apart; a spline alone may swing across a gap
    smoothed = smooth(drawn, DRAWN_PX * _pixel_mm(screen, points_px))
    length = min(_beyond(curve, entry_mm) for curve in (resample(drawn, STEP_MM), resample(smoothed, STEP_MM)))
    if length > longest_mm:
        raise ValueError(
            f"points_px is {length:.1f} mm long in the plane through isocentre_mm, from the entry on, {told}: are the "
            "frames, or the depths in insertion_mm, out of order, or is the spacing of the pixels another one?"
        )


def largest_scale(screen: Screen, points_mm: Array) -> float:
    """By how much a wire among the corners (n, 3) of a box is seen longer on the plane than it is, at the most."""
    rays = points_mm - screen.source_mm
    ahead = np.abs(rays @ screen.normal)
    share = abs((screen.isocentre_mm - screen.source_mm) @ screen.normal) / ahead
    # an oblique ray makes a wire longer that leans away from it
    return float(np.max(share * np.linalg.norm(rays, axis=1) / ahead))


def _beyond(curve_mm: Array, entry_mm: Array) -> float:
    """The length of a sampled polyline from where it passes the entry: of passes that are as near, the first."""
    away = np.concatenate([[np.inf], np.linalg.norm(curve_mm - entry_mm, axis=1), [np.inf]])
    nearest = (away[1:-1] <= away[:-2]) & (away[1:-1] <= away[2:]) & (away[1:-1] <= away.min() + AS_NEAR_MM)
    arc = arc_length(curve_mm)
    return float(arc[-1] - arc[np.argmax(nearest)])


def _pixel_mm(screen: Screen, points_px: Array) -> float:
    """The size of a pixel on the plane."""
    sizes = [np.linalg.norm(np.diff(points, axis=0), axis=1).sum() for points in (screen.curve_mm, points_px)]
    return float(sizes[0] / sizes[1])


def _tremble_mm(screen: Screen, points_px: Array) -> float:
    return min(TREMBLE_PX * _pixel_mm(screen, points_px), MOST_TREMBLE_MM)
