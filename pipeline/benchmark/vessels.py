"""Vessels with a closed form: signed distances in mm of points (..., 3), negative inside, the vessel along +z."""

import numpy as np

from pipeline.model import Array

BEND_TURN_MM, BEND_INLET_MM, BEND_LUMEN_MM = 30.0, 30.0, 2.0
SHEATH_MM, MOUTH_MM = 400.0, 4.0
"""Length of the sheath, and over how much of its end it opens into the vessel."""
SPHERE_MM = 9.0


def bend_distance(points: Array) -> Array:
    """Scene B: a straight inlet, a quarter torus towards +x, and straight on."""
    return _axis_distance(points, BEND_INLET_MM, BEND_TURN_MM) - BEND_LUMEN_MM


def sheath_distance(points: Array, bore_mm: float) -> Array:
    """A straight sheath that opens into scene B."""
    z = points[..., 2]
    t = np.clip((z + 0.5 * MOUTH_MM) / MOUTH_MM, 0.0, 1.0)
    bore = bore_mm + (BEND_LUMEN_MM - bore_mm) * t * t * (3.0 - 2.0 * t)
    tube = np.hypot(points[..., 0], points[..., 1]) - bore
    return np.asarray(np.where(z < MOUTH_MM, tube, bend_distance(points)))


TUBE_LUMEN_MM = 0.5


def bent_tube(points: Array) -> Array:
    """The bend without its inlet, and with a narrow lumen."""
    return _axis_distance(points, 0.0, BEND_TURN_MM) - TUBE_LUMEN_MM


def lumen_distance(kind: str, points: Array, radius: float) -> Array:
    """A lumen of the stress study by its kind; every kind without a formula of its own is a straight tube."""
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    if kind == "bend":
        return _axis_distance(points, 10.0, 20.0) - radius
    if kind == "siphon":
        first = _axis_distance(points, 8.0, 8.0)
        # the second bend turns back from where the first one ends
        second = np.where(x > 8.0, np.hypot(np.hypot(x - 8.0, z - 24.0) - 8.0, y), np.inf)
        return np.asarray(np.minimum(np.where(x > 8.0, np.inf, first), second) - radius)
    if kind == "sphere":
        neck = np.hypot(np.hypot(x, y), np.maximum(z - 4.0, 0.0)) - min(radius, 3.0)
        return np.asarray(np.minimum(neck, np.sqrt(x**2 + y**2 + (z - 12.0) ** 2) - SPHERE_MM))
    if kind == "channel":
        return np.asarray(np.abs(y) - radius)
    return np.asarray(np.hypot(x, y) - radius)


def _axis_distance(points: Array, inlet_mm: float, turn_mm: float) -> Array:
    """Distance to a line along +z, a quarter circle towards +x after the inlet, and a line straight on."""
    x, y, z = points[..., 0], points[..., 1], points[..., 2] - inlet_mm
    ring = np.hypot(np.hypot(turn_mm - x, z) - turn_mm, y)
    outlet = np.hypot(z - turn_mm, y)
    return np.asarray(np.where(z < 0, np.hypot(x, y), np.where(x > turn_mm, outlet, ring)))
