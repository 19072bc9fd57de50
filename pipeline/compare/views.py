"""Wires against X-ray projections: in the plane through the isocentre that is parallel to the detector, in mm there.

What the source sees of a wire falls on that plane along its rays. A patient moves: by default each wire, the
simulated one and every predictor's alike, is shifted in the plane to lie best on the polyline from 40 to 110 mm behind
its tip, and scored on its last 40 mm alone, which took no part in that.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pipeline.arrays.polyline import at_arc, resample, samples, tangents
from pipeline.compare.config import CompareConfig
from pipeline.compare.metrics import METRICS, Pair, VesselAxis, measured, point_to_curve, rms, scored
from pipeline.model import Array, Lumen, arc_length

FIT_FROM_MM, FIT_TO_MM = 40.0, 110.0
"""Distances from the tip, mm, between which a shift is fitted; what lies nearer to the tip is scored."""
LEAST_FIT_MM = 20.0
"""Least length of wire for fitting a shift."""
FREE_MM = 100.0
"""Weak pull of the shift towards 0 (a ridge term): along a straight stretch it would otherwise be undetermined."""
ROUNDS, STILL_MM = 50, 1e-6
MOST_SCALED = 1.3
"""Most that errors may be scaled by an isocentre before or behind the wire: 200 mm off in a C-arm of 750 mm."""
IN_PLANE = (
    *("rms_mm", "mean_mm", "p95_mm", "max_mm", "distal10_rms_mm", "distal20_rms_mm", "back_rms_mm", "hausdorff_mm"),
    *("tip_mm", "tip_angle_deg"),
)
"""The metrics that a projection has; lengths along the wire are foreshortened, and branches lie over each other."""


@dataclass(frozen=True, eq=False)
class Screen:
    """A view's plane. source_mm, isocentre_mm, normal (3,).     curve_mm : (n, 3) the wire that was seen, on it.

    axes : (2, 3) unit vectors along it, as u and v of the pixels run.
    """

    source_mm: Array
    isocentre_mm: Array
    normal: Array
    axes: Array
    curve_mm: Array

    def flat(self, points_mm: Array) -> Array:
        """Where the source sees points (n, 3) on the plane, (n, 3) LPS mm; ValueError for points behind the source."""
        rays = points_mm - self.source_mm
        share = ((self.isocentre_mm - self.source_mm) @ self.normal) / (rays @ self.normal)
        if not np.all(share > 0):
            raise ValueError("the wire lies behind the source: check the matrix and its sign, and isocentre_mm")
        if not MOST_SCALED > np.median(share) > 1.0 / MOST_SCALED:
            got = (
                f"the wire is {np.median(share):.2g} times as large in the plane through isocentre_mm as where it lies"
            )
            raise ValueError(f"{got}; allowed: 1 / {MOST_SCALED} to {MOST_SCALED}: is isocentre_mm near the wire?")
        return np.asarray(self.source_mm + share[:, None] * rays)


def screen_of(matrix: Array, isocentre_mm: Array, points_px: Array) -> Screen:
    """The plane of a projection (3, 4) and the polyline (n, 2) on it."""
    inverse = np.linalg.inv(matrix[:, :3])
    source = -inverse @ matrix[:, 3]
    normal = matrix[2, :3] / np.linalg.norm(matrix[2, :3])
    pixels = np.concatenate([[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], points_px])
    rays = np.column_stack([pixels, np.ones(len(pixels))]) @ inverse.T
    points = source + rays * (((isocentre_mm - source) @ normal) / (rays @ normal))[:, None]
    first = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
    second = np.cross(normal, first)
    second *= np.sign(second @ (points[2] - points[0]))
    return Screen(source, isocentre_mm, normal, np.array([first, second]), points[3:])


def shift_of(screen: Screen, wire_mm: Array, fitted: bool) -> Array:
    """The shift (3,) in the plane by which the fitted part of a wire lies best on the polyline; 0 where none is fitted.

    ValueError where the wire is too short for one.
    """
    if not fitted:
        return np.zeros(3)
    length, need = float(arc_length(wire_mm)[-1]), FIT_FROM_MM + LEAST_FIT_MM
    if length < need - 1e-9:
        takes = f"a shift takes {need:g} mm or more, fitted {FIT_FROM_MM:g} mm behind the tip and further"
        raise ValueError(f'the wire is {length:.1f} mm long: {takes}; leave the frame out, or translation = "none"')
    arc = np.arange(max(length - FIT_TO_MM, 0.0), length - FIT_FROM_MM + 1e-9, 1.0)
    part, axes, shift = screen.flat(at_arc(wire_mm, arc)), screen.axes, np.zeros(2)
    ridge = np.eye(2) * len(arc) / FREE_MM**2
    for _ in range(ROUNDS):
        here = part + shift @ axes
        foot = point_to_curve(here, screen.curve_mm)[1]
        across = np.cross(tangents(screen.curve_mm, foot, 0.5), screen.normal) @ axes.T
        gap = np.sum(((at_arc(screen.curve_mm, foot) - here) @ axes.T) * across, axis=1)
        step = np.linalg.solve(across.T @ across + ridge, across.T @ gap - ridge @ shift)
        shift = shift + step
        if np.linalg.norm(step) < STILL_MM:
            break
    return np.asarray(shift @ axes)


def counted(wire_mm: Array, fitted: bool, config: CompareConfig) -> Array:
    """Arc lengths (n,) that count of a wire: behind the clamp's reach; of a shifted one the last 40 mm alone."""
    arc = scored(samples(float(arc_length(wire_mm)[-1]), config.sample_mm), config.skip_mm)
    return arc[arc >= arc[-1] - FIT_FROM_MM - 1e-9] if fitted else arc


def pair_in(screen: Screen, wire_mm: Array, fitted: bool, lumen: Lumen, way: VesselAxis, config: CompareConfig) -> Pair:
    """The wire and the polyline on the plane; arc lengths are those of the wire in space."""
    shift, arc = shift_of(screen, wire_mm, fitted), counted(wire_mm, fitted, config)
    whole, points = screen.flat(wire_mm) + shift, screen.flat(at_arc(wire_mm, arc)) + shift
    if _apart(whole, screen.curve_mm) > 2.0 * _apart(whole, screen.curve_mm[::-1]) + FIT_FROM_MM / 8:
        raise ValueError("the polyline lies on the wire the other way round: give it from the base to the tip")
    error, foot = point_to_curve(points, screen.curve_mm)
    curve = resample(screen.curve_mm, config.sample_mm)
    length, along = float(arc_length(screen.curve_mm)[-1]), arc_length(curve)
    seen = curve[along >= length - float(arc_length(points)[-1]) - 1e-9]
    if len(points) < 2 or len(seen) < 2:
        raise ValueError("nothing of the wire or of the polyline is left to be compared: check points_px and the depth")
    back = point_to_curve(seen, whole)[0]
    none = np.zeros(0)
    return Pair(whole, screen.curve_mm, points, arc, error, foot, back, none, lumen, way)


def _apart(wire_mm: Array, curve_mm: Array) -> float:
    """Sum of the distances between the first and between the last points of two curves, mm."""
    return float(np.linalg.norm(wire_mm[0] - curve_mm[0]) + np.linalg.norm(wire_mm[-1] - curve_mm[-1]))


def values_in(pair: Pair) -> dict[str, float | bool]:
    """The metrics of a projection by their columns' names."""
    return {name: measured(name, METRICS[name], pair) for name in IN_PLANE}


def nulls_in(screen: Screen, wires: Mapping[str, Array], fitted: bool, config: CompareConfig) -> dict[str, float]:
    """Root mean square distance of every predictor's wire, shifted and scored as the simulated one, by its name."""
    found = {}
    for name, wire in wires.items():
        points = screen.flat(at_arc(wire, counted(wire, fitted, config))) + shift_of(screen, wire, fitted)
        found[name] = rms(point_to_curve(points, screen.curve_mm)[0])
    return found
