"""Motions that a vessel hardly shows: along itself, and about itself.

There the gradient at the wall is noise for the most part, and least squares go a hundredth of the way in a step. How
well a frame fits is looked at instead, at places along such a motion: 2 mm along a gently curved vessel changed grey by
a quarter of its noise, and went unseen.
"""

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.grids import spread
from pipeline.model import Array, Volume
from pipeline.register.patches import TINY, products, shaded
from pipeline.register.points import StaticPoints, inside
from pipeline.register.rigid import Motion
from pipeline.register.shift import (
    ABOVE_NOISE,
    METAL_SCALES,
    METAL_VOXELS,
    changes,
    farthest,
    fit_motion,
    grey_at,
    moved_by,
    near_metal,
)

WEAK = 0.05
"""Squared steepness along a motion, over that of the steepest, from which least squares find it."""
OFFSETS_VOXELS = np.array([-6.0, -3.0, -1.5, -0.7, 0.0, 0.7, 1.5, 3.0, 6.0])
ROUNDS, SETTLE = 3, 2
"""Times that all such motions are tried; steps of least squares at each place, which put right what else moved."""
CUT = 3.0
"""Residuals count up to so many standard deviations: a wire in the frame is no misfit of the wall."""
LEAST_SEEN = 0.6
"""Share of the points that all places along a motion must leave inside the scan."""
TOGETHER = 10.0
"""Points whose noise is one: grey is read in a blur of a voxel."""
SURE, LEAST_GAIN = 2.3, 0.04
"""Standard deviations, and share of the misfit, by which a place must fit better than where least squares ended."""


def slid(frame: Volume, s: StaticPoints, motion: Motion) -> tuple[Motion, float]:
    """The motion, moved along what the structures hardly show to where the frame fits best, if that is sure.

    Also how far it may lie off at most where the frame fits as well, within its noise, voxels.
    """
    loose = 0.0
    for _ in range(ROUNDS):
        before, loose = motion, 0.0
        for axis in _weak_axes(s, motion):
            motion, open_to = _best_along(frame, s, motion, axis)
            loose = max(loose, open_to)
        if motion is before:
            break
    return motion, loose


def hidden(s: StaticPoints) -> bool:
    """Whether the structures can move in some way, along or about themselves, that is lost in noise."""
    power, _ = _power(s, Motion())
    return bool(power[0] < ABOVE_NOISE * len(s.points_mm) * (s.voxel_mm * s.noise) ** 2)


def _weak_axes(s: StaticPoints, motion: Motion) -> Array:
    """The motions (n, 6), shift and turn about the centroid over its radius, that change the points' grey least."""
    power, axes = _power(s, motion)
    return np.asarray(axes.T[power < WEAK * power[-1]])


def _power(s: StaticPoints, motion: Motion) -> tuple[Array, Array]:
    """Squared change of the points' grey with six motions (6,), least first, and the motions (6, 6), in columns."""
    design = changes(s, motion.moved(s.points_mm), motion)
    power, axes = np.linalg.eigh(design.T @ design)
    return np.asarray(power), np.asarray(axes)


def _best_along(frame: Volume, s: StaticPoints, motion: Motion, axis: Array) -> tuple[Motion, float]:
    """The motion plus that share of ``axis`` with which the frame fits best; the same where that is not sure.

    Also how far from it (voxels) a point lies at most in places that fit as well. A place is where least squares
    settle: what slides back from its offset is no other.
    """

    def settled(voxels: float) -> Motion:
        return fit_motion(frame, s, moved_by(motion, s, voxels * axis), rounds=SETTLE).motion

    motions = [settled(voxels) for voxels in OFFSETS_VOXELS]
    seen = np.all([inside(frame, one.moved(s.points_mm)) for one in motions], axis=0)
    if np.mean(seen) < LEAST_SEEN:
        return motion, 0.0
    rest = np.stack([_rest(frame, s, one, seen) for one in motions])
    here = len(rest) // 2
    scale = max(spread(rest[here]), TINY)  # a scan without noise
    metal = np.min(rest, axis=0) > METAL_SCALES * scale
    clear = ~near_metal(s.points_mm[seen], metal, METAL_VOXELS * s.voxel_mm)
    square = np.minimum(np.abs(rest[:, clear]) / scale, CUT) ** 2
    best = int(np.argmin(square.mean(axis=1)))
    worse = square - square[best]  # point by point, as all places have the same noise
    sure = worse.mean(axis=1) / np.maximum(worse.std(axis=1) * np.sqrt(TOGETHER / max(1, worse.shape[1])), 1e-12)
    n = int(np.clip(best, 1, len(rest) - 2))
    a, b, _ = np.polyfit(OFFSETS_VOXELS[n - 1 : n + 2], square.mean(axis=1)[n - 1 : n + 2], 2)
    if a > 0.0 and sure[here] >= SURE and worse[here].mean() >= LEAST_GAIN * square[here].mean():
        motion = settled(float(np.clip(-b / (2.0 * a), *OFFSETS_VOXELS[[n - 1, n + 1]])))
    return motion, max(farthest(motions[k].after(motion), s) for k in np.flatnonzero(sure < SURE))


def _rest(frame: Volume, s: StaticPoints, motion: Motion, seen: NDArray[np.bool_]) -> Array:
    """The frame's blurred grey at the moved points that are ``seen``, less the reference's in its patches' gains."""
    grey = grey_at(frame, s, motion.moved(s.points_mm))
    rows = np.column_stack([s.shades, grey])
    _, _, shade = shaded(products(rows, seen.astype(float), s.starts), 0)
    rest = (grey - s.shade(shade[:, :, 0])[0])[seen]
    return np.asarray(rest - np.median(rest))
