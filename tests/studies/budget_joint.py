"""Whether a whole insertion is more surprising than what the inputs may be explains: all frames' ends at once.

A point's error is claimed where it is beyond its own 2u; an error that all frames share in small may be seen by their
pattern alone. Each wire's end, across the traced one, becomes a few coefficients a frame; the real one's Mahalanobis
distance is ranked among those of the ensemble's members, each judged by the others, with a trace's errors drawn on top.
Were the model right the real one would be one of them: a rank in the last 5 % is claimed by chance in 5 % of studies.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.linalg import cho_factor, cho_solve

from pipeline.arrays.polyline import at_arc
from pipeline.budget import Seen
from pipeline.budget.verdict import axes_across
from pipeline.model import Array
from pipeline.simulate.evidence import Sight, covariance_of_traces

DISTAL_MM, DEGREE = 20.0, 3
SHRUNK = 0.3
"""Part of the covariance that is its diagonal alone: 48 members do not tell 48 variances and their correlations."""


def coefficients(wires: Array, seen: Seen, sigma_mm: Array, voxel_mm: float, rng: np.random.Generator) -> Array:
    """Legendre coefficients (members + 1, 2 (DEGREE + 1)) of a frame's wires (members, n, 3), the real one last."""
    arc, nominal, curve, foot, _ = seen
    assert curve is not None
    assert foot is not None
    end = arc >= arc[-1] - DISTAL_MM
    axes = axes_across(curve, foot)[end]
    drawn = np.einsum("nai,mni->mna", axes, wires[:, end] - nominal[end])
    noise = covariance_of_traces([Sight(0, arc[end], nominal[end], sigma_mm[end], 3.0)], voxel_mm)
    root = np.linalg.cholesky(noise + 1e-12 * np.eye(len(noise)))
    drawn += np.einsum("nk,mka->mna", root, rng.standard_normal(drawn.shape))
    real = np.einsum("nai,ni->na", axes, (at_arc(curve, foot) - nominal)[end])
    basis = legvander(np.linspace(-1.0, 1.0, int(end.sum())), DEGREE)
    found = np.linalg.pinv(basis) @ np.concatenate([drawn, real[None]])
    return np.asarray(found.reshape(len(found), -1))


def _square(one: Array, others: Array) -> float:
    """Squared Mahalanobis distance of coefficients (k,) from 0, the nominal wire, by others (m, k)."""
    moment = others.T @ others / len(others)
    moment = (1.0 - SHRUNK) * moment + SHRUNK * np.diag(np.diag(moment))
    return float(one @ cho_solve(cho_factor(moment + 1e-12 * np.eye(len(one))), one))


def surprise(frames: Sequence[Array]) -> float:
    """The rank of the real insertion among the members, 1 / (members + 1) at most, from ``coefficients``."""
    whole = np.concatenate(list(frames), axis=1)
    whole = whole[np.isfinite(whole).all(axis=1)]
    members, real = whole[:-1], whole[-1]
    each = np.array([_square(one, np.delete(members, i, axis=0)) for i, one in enumerate(members)])
    # as many others for the real one as for each member
    own = np.mean([_square(real, np.delete(members, i, axis=0)) for i in range(len(members))])
    return float((1 + np.sum(each >= own)) / (len(each) + 1))
