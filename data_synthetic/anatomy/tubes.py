"""Swept tubes: a centreline with a radius along it, many of them smoothly united, and their signed distance.

The signed distance of one tube is that of the envelope of its balls, ``min_s |x - c(s)| - r(s)``: exact outside,
and inside as long as the radius stays below the centreline's radius of curvature. Tubes are united by the cubic
smooth minimum (C2, of compact support: nothing changes where two values differ by more than the blend width).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline, PchipInterpolator

from data_synthetic.anatomy import _kernels as kernels
from data_synthetic.geometry import Array, arc_lengths

STEP_MM = 0.25
"""Approximate arc length between samples of a tube, which they divide evenly."""


@dataclass(frozen=True, eq=False)
class Tube:
    """One vessel as samples at equal arc steps.

    points_mm : (n, 3) LPS mm.     tangents : (n, 3), d(point)/d(arc).     radii_mm : (n,), slopes : (n,), d(r)/d(arc).
    step_mm : arc length between samples.     blend_mm : width of its smooth union with the tubes before it.
    """

    name: str
    points_mm: Array
    tangents: Array
    radii_mm: Array
    slopes: Array
    step_mm: float
    blend_mm: float = 0.6

    def __post_init__(self) -> None:
        """Nobody writes into a tube."""
        for array in (self.points_mm, self.tangents, self.radii_mm, self.slopes):
            array.flags.writeable = False

    @property
    def length_mm(self) -> float:
        """Arc length of the centreline."""
        return self.step_mm * (len(self.points_mm) - 1)


def sweep(name: str, points_mm: ArrayLike, radii_mm: ArrayLike, *, blend_mm: float = 0.6) -> Tube:
    """A tube through control points (n, 3) with radii (n,) or a number; a C2 spline, resampled by arc length.

    Raises ValueError for fewer than two points or a radius that is not positive.
    """
    control = np.atleast_2d(np.asarray(points_mm, dtype=np.float64))
    radius = np.broadcast_to(np.asarray(radii_mm, dtype=np.float64), len(control))
    if len(control) < 2 or control.shape[1] != 3 or np.any(radius <= 0):
        raise ValueError(
            f"tube {name}: got points {control.shape} and radii from {radius.min():g} mm; give (n >= 2, 3) and > 0"
        )
    chord = arc_lengths(control)
    curve = CubicSpline(chord, control, bc_type="natural" if len(control) > 2 else "not-a-knot")
    fine = np.linspace(0.0, chord[-1], max(200, int(chord[-1] / 0.01)))
    arc = arc_lengths(curve(fine))
    count = max(2, round(arc[-1] / STEP_MM) + 1)
    grid = np.linspace(0.0, arc[-1], count)
    parameter = np.interp(grid, arc, fine)
    derivative = curve(parameter, 1)
    tangents = derivative / np.linalg.norm(derivative, axis=1, keepdims=True)
    profile = PchipInterpolator(np.interp(chord, fine, arc), radius)
    step = float(arc[-1] / (count - 1))
    return Tube(name, curve(parameter), tangents, profile(grid), profile(grid, 1), step, blend_mm)


def ball(name: str, centre_mm: ArrayLike, radius_mm: float, *, blend_mm: float = 0.6) -> Tube:
    """A sac: a tube of one sample."""
    centre = np.array(centre_mm, dtype=np.float64).reshape(1, 3)
    return Tube(name, centre, np.zeros((1, 3)), np.array([radius_mm]), np.zeros(1), 1.0, blend_mm)


@dataclass(frozen=True, eq=False)
class Anatomy:
    """A smooth union of tubes. ``distance`` is negative inside, mm."""

    tubes: tuple[Tube, ...]

    @cached_property
    def tables(self) -> kernels.TubeTables:
        """The tubes as the kernels take them."""
        tubes = self.tubes
        balls, around = zip(*((_bounding_balls(t, kernels.BLOCK), _bounding_balls(t)) for t in tubes), strict=True)
        return kernels.TubeTables(
            points=np.concatenate([t.points_mm for t in tubes]),
            tangents=np.concatenate([t.tangents for t in tubes]),
            radii=np.concatenate([t.radii_mm for t in tubes]),
            slopes=np.concatenate([t.slopes for t in tubes]),
            starts=np.cumsum([0, *(len(t.points_mm) for t in tubes)]),
            steps=np.array([t.step_mm for t in tubes]),
            blends=np.array([t.blend_mm for t in tubes]),
            balls=np.concatenate(balls),
            block_starts=np.cumsum([0, *(len(b) for b in balls)]),
            around=np.concatenate(around),
        )

    def distance(self, points_mm: ArrayLike) -> Array:
        """Signed distance (n,) in mm of points (n, 3)."""
        return self.distance_and_gradient(points_mm)[0]

    def distance_and_gradient(self, points_mm: ArrayLike) -> tuple[Array, Array]:
        """Signed distance (n,) and its gradient (n, 3)."""
        # for points that cannot be written to the kernel would be compiled once more
        points = np.require(np.atleast_2d(points_mm), np.float64, ["C", "W"])
        values, gradients = np.empty(len(points)), np.empty((len(points), 3))
        kernels.distances(points, self.tables, values, gradients)
        return values, gradients

    def tube(self, name: str) -> Tube:
        """The tube of that name."""
        return next(t for t in self.tubes if t.name == name)


def _bounding_balls(tube: Tube, block: int | None = None) -> Array:
    """One (x, y, z, R) per run of samples, such that every ball of the tube there lies within R of its centre.

    block : samples of a run; None is one run of all.
    """
    balls, most = [], max(1, len(tube.points_mm) - 1)
    for first in range(0, most, block or most):
        run = slice(first, first + (block or most) + 1)
        centre = 0.5 * (tube.points_mm[run].min(axis=0) + tube.points_mm[run].max(axis=0))
        reach = np.max(np.linalg.norm(tube.points_mm[run] - centre, axis=1) + tube.radii_mm[run])
        balls.append([*centre, reach + 0.5 * tube.step_mm])
    return np.array(balls)
