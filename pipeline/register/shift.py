"""Small motions by least squares: what the grey values at the walls say, without filtering or resampling a scan.

A wall that moves by d changes grey by -gradient . d there. Values and gradients are those of the Gaussian-blurred scan,
taken at a few thousand points alone, so that noise falls to 0.15 and nothing is interpolated.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.arrays.grids import MAD, in_memory_order
from pipeline.arrays.jets import Blurred, values_at
from pipeline.model import Array, Volume
from pipeline.register.patches import TINY, products, shaded
from pipeline.register.points import Shading, StaticPoints, inside
from pipeline.register.rigid import Motion

TUKEY = 4.685
"""Tukey's constant: 95 % as good as least squares where there is no metal, blind to residuals beyond 4.7 sd."""
ABOVE_NOISE = 1.5
"""Squared steepness along a direction, over what noise alone gives, from which it shows motion: a tube cut off by the
scan's ends has none along its axis, and fits to noise were 0.4 voxel off. Gently curved ones have 2 to 3."""
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
VARIED = 0.88
"""Misfit with a gain of each patch's own, over that with one that is linear in the place, from which the gain varies
otherwise: where frames were layered, 0.3 to 0.87; where they were not, 0.91 to 1.1 in noise, white or correlated."""
SLOPED = 1.03
"""Misfit with one gain, over that with one that is linear in the place, from which grey slopes: where it did, 1.03 to
1.43; where it did not, 0.99 to 1.02, also of phantoms that moved."""
REWEIGHTS = 5
"""Times that the weights against metal are worked out anew; from the third on nothing changes by a tenth."""
ROUNDS = 12
"""Gauss-Newton steps at most; a motion of half a voxel takes 3."""
STILL_VOXELS = 0.002
"""A step smaller than this is the last."""


class Solved(NamedTuple):
    """Amounts (6,) of motion (see ``changes``) and the change of grey (n,) by them; the gain of grey (n,); what is
    left, ``rest`` (n,), and its scale (sd); clear : points (n,) away from metal.
    """

    amounts: Array
    change: Array
    gain: Array
    rest: Array
    scale: float
    clear: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Fit:
    """A motion and how well it explains the frame: misfit_voxels is the residual as an uncertainty of one point.

    last : the last step, which the motion holds; None where the motion leaves too little inside the scan.
    """

    motion: Motion
    misfit_voxels: float
    last: Solved | None = None


def _seen(normal: Array, right: Array, least: float) -> Array:
    """Solve the normal equations of six motions; those that the structures do not show, below ``least``, stay zero."""
    power, axes = np.linalg.eigh(normal)
    shown = power > max(least, 1e-9 * power[-1])
    return np.asarray(axes @ np.where(shown, axes.T @ right / np.where(shown, power, 1.0), 0.0))


def bisquare(residual: Array, used: NDArray[np.bool_]) -> tuple[Array, float]:
    """Tukey's weights (n,) of residuals (n,) and their scale (sd); points not ``used`` have no say in either."""
    scale = MAD * float(np.median(np.abs(residual[used]))) + TINY
    return used * np.clip(1.0 - (residual / (TUKEY * scale)) ** 2, 0.0, None) ** 2, scale


def _reweighted(s: StaticPoints, design: Array, grey: Array, used: NDArray[np.bool_]) -> Solved:
    """Robust solution of design @ x = grey, but for each patch's gain and offset; points not ``used`` have no say."""
    weights, scale = used.astype(float), 0.0
    rows = np.column_stack([design, s.shades, grey])
    for _ in range(REWEIGHTS):
        normal, right, shade = shaded(products(rows, weights, s.starts), design.shape[1])
        noise = ABOVE_NOISE * float(weights.sum()) * (s.voxel_mm * s.noise) ** 2
        solution = _seen(normal.sum(axis=0), right.sum(axis=0), max((scale / UNSEEN_VOXELS) ** 2, noise))
        shades = shade @ np.append(-solution, 1.0)
        change = design @ solution
        light, gain = s.shade(shades)
        residual = grey - change - light
        weights, scale = bisquare(residual, used)
    return Solved(solution, change, gain, residual, scale, used)


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


def _step(s: StaticPoints, at_mm: Array, grey: Array, motion: Motion) -> Fit:
    """The motion and what the residuals ask for, and the misfit.

    Unknowns also hold each patch's gain and offset of grey, since contrast drifts between scans, and within one. The
    misfit is infinite where the gains say that there is no such wall here.
    """
    h, design = s.voxel_mm, changes(s, at_mm, motion)
    found = _reweighted(s, design, grey, np.ones(len(grey), bool))
    clear = ~near_metal(s.points_mm, found.rest > METAL_SCALES * found.scale, METAL_VOXELS * h)
    if MOST_METAL * len(grey) < np.count_nonzero(clear) < len(grey):
        found = _reweighted(s, design, grey, clear)
    shown = LEAST_GAIN < np.median(found.gain) < 1.0 / LEAST_GAIN
    misfit = found.scale / max(h * s.steepness, TINY) if shown else float("inf")
    return Fit(moved_by(motion, s, found.amounts), misfit, found._replace(clear=clear))


def look(frame: Volume, s: StaticPoints, motion: Motion) -> tuple[Fit, Shading]:
    """One step from ``motion`` on, and with which shading: the simplest that explains the frame.

    What less is left by others is judged, since with slopes a straight tube that moved may as well have stayed.
    """
    one, sloping, own = _steps(frame, s, motion, [s.shaded(shading) for shading in ("one", "sloping", "own")])
    if own.misfit_voxels < VARIED * min(one.misfit_voxels, sloping.misfit_voxels):
        return own, "own"
    return (sloping, "sloping") if sloping.misfit_voxels * SLOPED < one.misfit_voxels else (one, "one")


def _steps(frame: Volume, s: StaticPoints, motion: Motion, shadings: Sequence[StaticPoints]) -> list[Fit]:
    """One step from ``motion`` on with each of the ``shadings`` of the same points."""
    at = motion.moved(s.points_mm)
    if np.mean(inside(frame, at)) < MOST_SEEN:
        return [Fit(motion, float("inf")) for _ in shadings]
    grey = grey_at(frame, s, at)
    return [_step(points, at, grey, motion) for points in shadings]


def farthest(motion: Motion, s: StaticPoints) -> float:
    """Largest displacement of a point, voxels."""
    return float(np.linalg.norm(motion.displacement_mm(s.points_mm), axis=1).max(initial=0.0)) / s.voxel_mm


def fit_motion(frame: Volume, s: StaticPoints, start: Motion | None = None, rounds: int = ROUNDS) -> Fit:
    """Gauss-Newton from ``start`` (at rest): the motion under which the frame shows the static points' grey.

    Good for motions below the width of a blurred wall, about 1.5 voxels; metal is outvoted.
    """
    fit = Fit(start or Motion(), float("inf"))
    for _ in range(rounds):
        fit = _steps(frame, s, fit.motion, [s])[0]
        if fit.last is None:
            break
        if np.linalg.norm(fit.last.amounts[:3]) + np.linalg.norm(fit.last.amounts[3:]) < STILL_VOXELS:
            break
    return fit
