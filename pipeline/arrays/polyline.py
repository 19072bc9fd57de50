"""Polylines: resampling, truncation and extension by arc length, tangents, units of their lengths."""

import math
import warnings

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import make_splprep

from pipeline.model import Array, arc_length

SAME_MM = 1e-6
"""Arc lengths closer than this are one."""
_SPELLED = {
    1.0: "mm millimeter millimetre millimeters millimetres",
    1e-3: "um µm μm micron microns micrometer micrometre micrometers micrometres",
    10.0: "cm centimeter centimetre centimeters centimetres",
    25.4: "inch inches in",
    1e3: "m meter metre meters metres",
    1e-6: "nm nanometer nanometre nanometers nanometres",
}
UNITS_MM = {name: factor for factor, names in _SPELLED.items() for name in names.split()}
"""Units of length as files name them."""
MISTAKEN = ("mm", "cm", "inch", "m", "µm")
"""Units in which a length may have been given by mistake."""


def other_units(stated: str) -> dict[str, float]:
    """Factors by which lengths that were taken for ``stated`` grow where they are in another unit."""
    return {name: UNITS_MM[name] / UNITS_MM[stated] for name in MISTAKEN if UNITS_MM[name] != UNITS_MM[stated]}


def unit_of(ratio: float, room: float, stated: str = "mm") -> str:
    """The unit in which a length is right that is ``ratio`` times too small in the stated one; empty for none.

    room : how near log(ratio) must be to the logarithm of the unit's factor.
    """
    return next((name for name, factor in other_units(stated).items() if abs(np.log(ratio / factor)) < room), "")


def at_arc(curve_mm: ArrayLike, arc_mm: ArrayLike) -> Array:
    """Points (n, 3) of a polyline (m, 3) at arc lengths (n,) in mm from its start; beyond its end, straight on."""
    curve = np.asarray(curve_mm, dtype=np.float64)
    wanted = np.asarray(arc_mm, dtype=np.float64)
    arc = arc_length(curve)
    inside: Array = np.stack([np.interp(wanted, arc, curve[:, a]) for a in range(3)], axis=-1)
    beyond: Array = np.multiply.outer(np.maximum(wanted - arc[-1], 0.0), tip_tangent(curve))
    return inside + beyond


def samples(length_mm: float, step_mm: float) -> Array:
    """Arc lengths 0, step, 2 step, ... and the end itself, mm."""
    count = max(int(np.floor(length_mm / step_mm + 1e-9)), 0)
    arc = np.asarray(np.arange(count + 1) * step_mm, dtype=np.float64)
    return arc if length_mm - arc[-1] < SAME_MM else np.concatenate([arc, [length_mm]])


def resample(curve_mm: ArrayLike, step_mm: float) -> Array:
    """The polyline sampled every ``step_mm`` of arc length, both ends included."""
    curve = np.asarray(curve_mm, dtype=np.float64)
    return at_arc(curve, samples(float(arc_length(curve)[-1]), step_mm))


def to_length(curve_mm: ArrayLike, length_mm: float, step_mm: float = 0.5) -> Array:
    """The polyline cut at, or continued straight to, ``length_mm``."""
    return at_arc(curve_mm, samples(length_mm, step_mm))


def tip_tangent(curve_mm: ArrayLike, over_mm: float = 1.0) -> Array:
    """Unit vector (3,) along which the curve ends, taken over its last ``over_mm``; zero for a single point."""
    curve = np.asarray(curve_mm, dtype=np.float64)
    arc = arc_length(curve)
    # of points at equal steps one may lie just there: rounding chose between it and the one before, 0.8 degrees apart
    start = int(np.searchsorted(arc, arc[-1] - over_mm + SAME_MM, side="right")) - 1
    chord = curve[-1] - curve[max(start, 0)]
    norm = np.linalg.norm(chord)
    return np.asarray(chord / norm) if norm > 0 else np.zeros(3)


def tangents(curve_mm: ArrayLike, arc_mm: Array, reach_mm: float) -> Array:
    """Unit vectors (n, 3) along a polyline at arc lengths (n,), from ``reach_mm`` behind to as far ahead of each."""
    chords = at_arc(curve_mm, arc_mm + reach_mm) - at_arc(curve_mm, np.maximum(arc_mm - reach_mm, 0.0))
    return np.asarray(chords / np.maximum(np.linalg.norm(chords, axis=1), 1e-12)[:, None])


def crossed(a: Array, b: Array) -> Array:
    """Cross products of two arrays (..., 3) of one shape, in a quarter of ``np.cross``'s time where they are few."""
    (a0, a1, a2), (b0, b1, b2) = a.T, b.T
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0]).T


def across(directions: Array) -> Array:
    """Two vectors (..., 2, 3) across directions (..., 3) and each other, the first of length 1, the second as long."""
    first = crossed(directions, np.eye(3)[np.argmin(np.abs(directions), axis=-1)])
    first /= np.maximum(np.linalg.norm(first, axis=-1, keepdims=True), 1e-12)
    return np.stack([first, crossed(directions, first)], axis=-2)


def carried(tangents: Array, first: Array) -> Array:
    """Unit vectors (n, 3) across unit tangents (n, 3), carried along from ``first`` (3,) without twist.

    Parallel transport: from one to the next a vector loses what it has along the tangent, and nothing else.
    """
    x, y, z = first.tolist()
    normals = []
    for a, b, c in tangents.tolist():  # arrays of three numbers take five times as long
        along = x * a + y * b + z * c
        x, y, z = x - along * a, y - along * b, z - along * c
        size = max(math.sqrt(x * x + y * y + z * z), 1e-9)
        x, y, z = x / size, y / size, z / size
        normals.append((x, y, z))
    return np.array(normals)


def turns_deg(curve_mm: Array, apart: int) -> Array:
    """Angles (m,), degrees, between the segments of a polyline (n, 3) that are ``apart`` segments from each other."""
    along = np.diff(curve_mm, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1), 1e-12)[:, None]
    cosine = np.sum(along[apart:] * along[:-apart], axis=1)
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def angle_deg(a: Array, b: Array) -> float:
    """Angle between two vectors (3,) by atan2: arccos loses half the digits near 0."""
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))


def smooth(path_mm: ArrayLike, sigma_mm: float) -> Array:
    """Smoothing cubic spline through a voxel path whose points scatter by ``sigma_mm`` per axis. Steps of 0.5 mm."""
    path = np.asarray(path_mm, dtype=np.float64)
    if len(path) < 5:
        return path
    with warnings.catch_warnings():
        # its search for the asked smoothness may stop short on a nearly straight path; what it has is smooth enough
        warnings.filterwarnings("ignore", message=r"(?s).*smoothing spline", category=RuntimeWarning)
        spline, _ = make_splprep(path.T, s=3.0 * len(path) * sigma_mm**2)
    return resample(np.asarray(spline(np.linspace(0.0, 1.0, 4 * len(path)))).T, 0.5)
