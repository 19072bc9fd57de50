"""Small motions by least squares: what the grey values at the walls say, without filtering or resampling a scan.

A wall that moves by d changes grey by -gradient . d there. Values and gradients are those of the Gaussian-blurred scan,
taken at a few thousand points alone, so that noise falls to 0.15 and nothing is interpolated.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.arrays.grids import MAD, in_memory_order, unflattened
from pipeline.arrays.jets import Blurred, jets_at, values_at
from pipeline.model import Array, Volume
from pipeline.register.rigid import Motion

BLUR_VOXELS = 1.0
"""Gaussian in which grey is read: wide enough to see a wall 2 voxels away, and it takes noise to 0.15."""
BORDER_VOXELS = 3.0
"""Points nearer to the edge of a scan have no full Gaussian."""
TUKEY = 4.685
"""Tukey's constant: 95 % as good as least squares where there is no metal, blind to residuals beyond 4.7 sd."""
ABOVE_NOISE = 1.5
"""Squared steepness along a direction, over what noise alone gives, from which it shows motion: a tube cut off by the
scan's ends has none along its axis, and fits to noise were 0.4 voxel off. Gently curved ones have 2 to 3."""
FLAT, FLAT_POINTS = 0.25, 4000
"""Share of a scan's voxels that lie in nothing but noise at the least, and how many are looked at."""
OF_FLAT = 1.2125
"""That quantile of the squared length of three normal numbers."""
METAL_SCALES = 5.0
"""Brighter than expected by this many scales is metal."""
METAL_VOXELS = 4.0
"""Its blurred skirts (sd 1.4 voxels with the blur in which grey is read) reach this far."""
MOST_METAL = 0.4
"""Share of the points that must stay: if fewer do, it is not metal but a wall in another place."""
LEAST_GAIN = 0.4
"""Contrast relative to the reference's below which (or above whose inverse) the wall is not the reference's: a frame
that shows nothing but tissue at the points is explained to perfection by a gain of 0."""
MOST_SEEN = 0.8
"""Share of the points that a motion must leave inside the scan."""
UNSEEN_VOXELS = 0.03
"""A motion known no better than this (sd) counts as none: a straight tube does not show that it slid along itself."""
REWEIGHTS = 5
"""Times that the weights against metal are worked out anew; from the third on nothing changes by a tenth."""
ROUNDS = 12
"""Gauss-Newton steps at most; a motion of half a voxel takes 3."""
STILL_VOXELS = 0.002
"""A step smaller than this is the last."""


@dataclass(frozen=True, eq=False)
class StaticPoints:
    """Points (n, 3) LPS mm on structures that do not move against each other, with the reference's blurred grey (n,)
    and its gradient (n, 3) per mm; blur_mm : of both; voxel_mm : the unit in which motion is judged; noise : standard
    deviation of each of the gradient's components by noise alone.
    """

    points_mm: Array
    grey: Array
    gradient: Array
    blur_mm: float
    voxel_mm: float
    noise: float

    @property
    def centre_mm(self) -> Array:
        """Centroid (3,)."""
        return np.asarray(self.points_mm.mean(axis=0))

    @property
    def radius_mm(self) -> float:
        """Root mean square distance from the centroid: what turns an angle into a displacement."""
        return float(np.sqrt(np.mean(np.sum((self.points_mm - self.centre_mm) ** 2, axis=1))))

    @property
    def lever_mm(self) -> float:
        """The radius, by which turns are made shifts; that of one point is a voxel."""
        return max(self.radius_mm, self.voxel_mm)

    @property
    def steepness(self) -> float:
        """Root mean square gradient, per mm."""
        return float(np.sqrt(np.mean(np.sum(self.gradient**2, axis=1))))


@dataclass(frozen=True, eq=False)
class Fit:
    """A motion and how well it explains the frame: misfit_voxels is the residual as an uncertainty of one point."""

    motion: Motion
    misfit_voxels: float


def inside(scan: Volume, points_mm: Array) -> NDArray[np.bool_]:
    """Which points (n, 3) lie well inside a scan."""
    index = scan.to_index(points_mm)
    return np.asarray(np.all((index > BORDER_VOXELS) & (index < np.array(scan.shape) - 1 - BORDER_VOXELS), axis=1))


def static_points(reference: Volume, points_mm: Array) -> StaticPoints:
    """Read the reference at the points (n, 3) that lie well inside it."""
    points = np.ascontiguousarray(points_mm[inside(reference, points_mm)])
    grid, _ = in_memory_order(reference)
    voxel = float(np.min(grid.spacing_mm))
    field = Blurred(grid.values, grid.spacing_mm, BLUR_VOXELS * voxel)
    jets = jets_at(field, grid.to_index(points) * grid.spacing_mm)
    anywhere = unflattened(np.arange(0, grid.values.size, 1 + grid.values.size // FLAT_POINTS), grid.shape)
    steep = np.sum(jets_at(field, anywhere * grid.spacing_mm)[:, 1:4] ** 2, axis=1)
    steep = steep[steep > 1e-12 * max(float(steep.max()), 1e-12)]  # not the padding around what was reconstructed
    noise = float(np.sqrt(np.quantile(steep, FLAT) / OF_FLAT)) if len(steep) else 0.0
    return StaticPoints(points, jets[:, 0], jets[:, 1:4] @ grid.direction.T, BLUR_VOXELS * voxel, voxel, noise)


def _seen(normal: Array, right: Array, scale: float, noise: float) -> Array:
    """Solve the 8 normal equations; of the six motions, those that the structures do not show stay zero.

    noise : of a gradient's component, per voxel.
    """
    a, b, c = normal[:6, :6], normal[:6, 6:], normal[6:, 6:]
    to_grey = np.linalg.solve(c, np.column_stack([b.T, right[6:]]))
    power, axes = np.linalg.eigh(a - b @ to_grey[:, :6])
    shown = power > max((scale / UNSEEN_VOXELS) ** 2, ABOVE_NOISE * normal[7, 7] * noise**2, 1e-9 * power[-1])
    amounts = np.where(shown, axes.T @ (right[:6] - b @ to_grey[:, 6]) / np.where(shown, power, 1.0), 0.0)
    motion = axes @ amounts
    return np.concatenate([motion, to_grey[:, 6] - to_grey[:, :6] @ motion])


def _reweighted(design: Array, grey: Array, used: NDArray[np.bool_], noise: float) -> tuple[Array, float, Array]:
    """Robust solution of design @ x = grey, its scale (sd) and all residuals; points not ``used`` have no say.

    noise : see ``_seen``.
    """
    weights, solution, scale, residual = used.astype(float), np.zeros(8), 0.0, grey
    for _ in range(REWEIGHTS):
        weighted = design * weights[:, None]
        solution = _seen(weighted.T @ design, weighted.T @ grey, scale, noise)
        residual = grey - design @ solution
        scale = MAD * float(np.median(np.abs(residual[used]))) + 1e-9
        weights = used * np.clip(1.0 - (residual / (TUKEY * scale)) ** 2, 0.0, None) ** 2
    return solution, scale, residual


def near_metal(points_mm: Array, metal: NDArray[np.bool_], reach_mm: float) -> NDArray[np.bool_]:
    """Which points (n, 3) lie within reach of a metal one: the skirts of its blur bias a fit, but do not stand out."""
    if not metal.any():
        return metal
    gap, _ = cKDTree(points_mm[metal]).query(points_mm, distance_upper_bound=reach_mm)
    return np.asarray(np.isfinite(gap))


def changes(s: StaticPoints, at_mm: Array, motion: Motion) -> Array:
    """Change of the frame's grey (n, 6) at moved points (n, 3), by shifts and turns (about the centroid) of a voxel."""
    gradient = s.gradient @ motion.rotation.T
    arm = (at_mm - motion.moved(s.centre_mm)) / s.lever_mm
    return -s.voxel_mm * np.column_stack([gradient, np.cross(arm, gradient)])


def moved_by(motion: Motion, s: StaticPoints, voxels: Array) -> Motion:
    """The motion, and then shifts and turns (6,) as ``changes`` counts them."""
    by = s.voxel_mm * voxels
    return motion.then(Motion.about(motion.moved(s.centre_mm), by[3:] / s.lever_mm, by[:3]))


def grey_at(frame: Volume, s: StaticPoints, at_mm: Array) -> Array:
    """The frame's grey (n,) at points (n, 3), in the blur of the static points'."""
    grid, _ = in_memory_order(frame)
    return values_at(Blurred(grid.values, grid.spacing_mm, s.blur_mm), grid.to_index(at_mm) * grid.spacing_mm)


def _step(s: StaticPoints, at_mm: Array, grey: Array, motion: Motion) -> tuple[Array, float]:
    """The six amounts (voxels, see ``changes``) of motion that the residuals ask for, and the misfit.

    Unknowns also hold a gain and an offset of grey, since contrast drifts between scans. The misfit is infinite where
    the gain says that there is no such wall here.
    """
    h = s.voxel_mm
    design = np.column_stack([changes(s, at_mm, motion), s.grey - s.grey.mean(), np.ones(len(grey))])
    slope = h * s.steepness
    solution, scale, residual = _reweighted(design, grey, np.ones(len(grey), bool), h * s.noise)
    clear = ~near_metal(s.points_mm, residual > METAL_SCALES * scale, METAL_VOXELS * h)
    if MOST_METAL * len(grey) < np.count_nonzero(clear) < len(grey):
        solution, scale, _ = _reweighted(design, grey, clear, h * s.noise)
    shown = LEAST_GAIN < solution[6] < 1.0 / LEAST_GAIN
    return solution[:6], scale / max(slope, 1e-9) if shown else float("inf")


def fit_motion(frame: Volume, s: StaticPoints, start: Motion | None = None, rounds: int = ROUNDS) -> Fit:
    """Gauss-Newton from ``start`` (at rest): the motion under which the frame shows the static points' grey.

    Good for motions below the width of a blurred wall, about 1.5 voxels; metal is outvoted.
    """
    motion, misfit = start or Motion(), float("inf")
    for _ in range(rounds):
        at = motion.moved(s.points_mm)
        if np.mean(inside(frame, at)) < MOST_SEEN:
            return Fit(motion, float("inf"))
        step, misfit = _step(s, at, grey_at(frame, s, at), motion)
        motion = moved_by(motion, s, step)
        if np.linalg.norm(step[:3]) + np.linalg.norm(step[3:]) < STILL_VOXELS:
            break
    return Fit(motion, misfit)
