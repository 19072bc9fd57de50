"""Where along its own line the wire ends: a step fitted to the crest's profile."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from pipeline.model import Array, arc_length
from pipeline.trace.subtraction import CREST_VOXELS, Subtraction

BACK_VOXELS = 14.0
"""How much of the wire before its apparent end enters the step fit."""
AHEAD_VOXELS = 8.0
"""How far ahead of the apparent end the wire is looked for along its tangent."""


def extended(points: Array, ahead: float, step: float) -> Array:
    """The path (n, 3), continued straight by ``ahead`` mm in the direction of its last 1.5 mm (or half)."""
    arc = arc_length(points)
    back = int(np.searchsorted(arc, arc[-1] - min(1.5, 0.5 * arc[-1])))
    t = points[-1] - points[min(back, len(points) - 2)]
    t /= np.linalg.norm(t)
    more = np.arange(step, ahead + step, step)[:, None] * t
    return np.concatenate([points, points[-1] + more])


def resampled(points: Array, step: float) -> Array:
    """The polyline at equal steps of arc, both ends kept."""
    arc = arc_length(points)
    keep = np.concatenate([[True], np.diff(arc) > 1e-9])
    s = np.linspace(0, arc[-1], max(2, round(arc[-1] / step) + 1))
    return np.stack([np.interp(s, arc[keep], points[keep, a]) for a in range(3)], axis=1)


def step_position(profile: Array, arc: Array, sigma: float) -> float:
    """Arc length at which a blurred step (height free, foot at 0) fits the profile best, least squares.

    The step may lie beyond neither end of ``arc``; tried every tenth of a blur.
    """
    tries = np.arange(arc[0], arc[-1], 0.1 * sigma)
    shape = ndtr((tries[:, None] - arc[None]) / sigma)
    height = shape @ profile / np.sum(shape**2, axis=1)
    cost = np.sum((profile - height[:, None] * shape) ** 2, axis=1)
    cost[height <= 0] = np.inf
    return float(tries[int(np.argmin(cost))])


def cut_at_tip(image: Subtraction, points: Array, blur_mm: float) -> Array:
    """The path ended (or continued) at the step of its crest profile. points : (n, 3).  blur_mm : of the wire."""
    h = image.voxel
    step = 0.25 * h
    line = resampled(extended(points, AHEAD_VOXELS * h, step), step)
    arc = arc_length(line)
    tail = arc >= arc[-1] - (AHEAD_VOXELS + BACK_VOXELS) * h
    blur = float(np.hypot(CREST_VOXELS * h, blur_mm))
    end = step_position(image.along(line[tail]), arc[tail], blur)
    return np.asarray(line[arc <= max(end, arc[0] + 2 * h)])
