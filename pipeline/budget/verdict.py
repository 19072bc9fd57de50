"""Whether an error is larger than its uncertainty: each point's error over its u.

Only what lies across the traced wire counts, as in the distance to it. There an error has two components, so that u is
half the radius, in the error's own direction, of the ellipse that holds 95 %: with a right model 95 % of points lie
within 2u.
"""

from typing import NamedTuple

import numpy as np
from scipy.special import chdtri, fdtri

from pipeline.arrays.polyline import across, tangents
from pipeline.model import Array
from pipeline.simulate.clamp import TANGENT_MM

COVERED = 0.95
ROUND = 0.5 * float(np.sqrt(chdtri(2, 1.0 - COVERED)))
"""u of an error whose two components have a standard deviation of 1."""


class Judged(NamedTuple):
    """Of each point (n,): u in the direction of its error, mm, and the error over it."""

    u_mm: Array
    ratio: Array


def axes_across(curve_mm: Array, arc_mm: Array) -> Array:
    """Two unit vectors (n, 2, 3) across a curve (m, 3) at arc lengths (n,)."""
    return across(tangents(curve_mm, arc_mm, TANGENT_MM))


def widening(count: int) -> float:
    """Squared radius of the 95 % ellipse in standard deviations, of a second moment from ``count`` members (Hotelling).

    It is about the nominal wire, which is no estimate: no degree of freedom is spent on a mean.
    """
    if count < 4:
        return float("nan")
    return float(2.0 * count / (count - 1) * fdtri(2, count - 1, COVERED))


def reach_mm(covariance_mm2: Array, axes: Array, count: int) -> Array:
    """u (n,), mm, regardless of direction: from the mean variance of covariances (n, 3, 3) along two axes (n, 2, 3)."""
    across = np.einsum("nai,nij,naj->n", axes, covariance_mm2, axes)
    return np.asarray(0.5 * np.sqrt(widening(count) * 0.5 * across))


def judged(error_mm: Array, covariance_mm2: Array, own_mm2: Array, axes: Array, count: int) -> Judged:
    """Errors (n, 3) over their uncertainty.

    covariance_mm2 : (n, 3, 3) of the inputs, from ``count`` members.     own_mm2 : (n,) variance along each axis of the
    trace and of the segments.     axes : (n, 2, 3) across the traced wire.
    """
    error = np.einsum("nai,ni->na", axes, error_mm)
    total = np.einsum("nai,nij,nbj->nab", axes, covariance_mm2, axes) + own_mm2[:, None, None] * np.eye(2)
    size = np.linalg.norm(error, axis=1)
    way = np.where(size[:, None] > 0.0, error / np.maximum(size, 1e-300)[:, None], [1.0, 0.0])
    inverse = np.linalg.inv(total + 1e-12 * np.eye(2))
    u = 0.5 * np.sqrt(widening(count) / np.einsum("na,nab,nb->n", way, inverse, way))
    return Judged(u, size / u)
