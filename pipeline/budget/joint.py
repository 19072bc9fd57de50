"""Whether a whole insertion is rarer than the inputs' uncertainty explains, by all frames' wire ends together.

An error of a single point is claimed beyond its own 2u; a small error that all frames share shows only in their common
pattern. Each wire's end, across the traced one, becomes a few coefficients per frame; the real one's Mahalanobis
distance is ranked among those of the ensemble's members, each judged by the others, with random errors of a trace
added. With a right model the real wire is like one of them: a rank in the last 5 % is then chance in 5 % of studies.
"""

from collections.abc import Sequence

import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.linalg import cho_factor, cho_solve

from pipeline.arrays.polyline import at_arc
from pipeline.budget.frame import FEWEST, FrameSample
from pipeline.budget.shapes import DISTAL_MM
from pipeline.budget.verdict import axes_across
from pipeline.model import Array
from pipeline.simulate.evidence import TraceSamples, covariance_of_traces

DEGREE = 3
SHRUNK = 0.3
"""Weight of the diagonal in the shrunk covariance: 48 members do not determine 48 variances and their correlations."""
NOTHING_MM2 = 1e-12


def coefficients(
    wires: Array, seen: FrameSample, trace: TraceSamples, voxel_mm: float, rng: np.random.Generator
) -> Array | None:
    """Legendre coefficients (members + 1, 2 (DEGREE + 1)) of a frame's wires (members, n, 3), the real one last.

    trace : the trace's error at all points of the wire.     None where nothing was traced or the wire is too short.
    """
    arc, nominal, curve, foot = seen[:4]
    if curve is None or foot is None:
        return None
    end = arc >= arc[-1] - DISTAL_MM
    if end.sum() <= DEGREE:
        return None
    axes = axes_across(curve, foot)[end]
    drawn = np.einsum("nai,mni->mna", axes, wires[:, end] - nominal[end])
    last = TraceSamples(trace.index, trace.arc_mm[end], trace.points_mm[end], trace.sigma_mm[end], trace.knot_mm)
    noise = covariance_of_traces([last], voxel_mm, drawn=True)
    root = np.linalg.cholesky(noise + NOTHING_MM2 * np.eye(len(noise)))
    drawn += np.einsum("nk,mka->mna", root, rng.standard_normal(drawn.shape))
    real = np.einsum("nai,ni->na", axes, (at_arc(curve, foot) - nominal)[end])
    basis = legvander(np.linspace(-1.0, 1.0, int(end.sum())), DEGREE)
    found = np.linalg.pinv(basis) @ np.concatenate([drawn, real[None]])
    return np.asarray(found.reshape(len(found), -1))


def _squares(tried: Array, others: Array) -> Array:
    """Squared Mahalanobis distances (t,) of coefficients (t, k) from 0, the nominal wire, by those of others (m, k).

    The covariance is the shrunk second moment S D + (1 - S) X'X / m, inverted by Woodbury's identity: with many frames
    there are more coefficients than members.
    """
    diagonal = np.mean(others**2, axis=0) + NOTHING_MM2
    x, y = others / np.sqrt(diagonal), tried / np.sqrt(diagonal)
    inner = SHRUNK / (1.0 - SHRUNK) * len(x) * np.eye(len(x)) + x @ x.T
    across = x @ y.T
    return np.asarray((np.sum(y**2, axis=1) - np.sum(across * cho_solve(cho_factor(inner), across), axis=0)) / SHRUNK)


def rank_of_ends(frames: Sequence[Array], per_lumen: int = 1) -> float:
    """Rank (0, 1] of the real insertion among the members, by ``coefficients`` of each frame.

    1 / (members + 1) where it is rarer than every one of them. NaN without frames, and where fewer than FEWEST members
    that came to rest in all of them are left to judge.
    per_lumen : how many members, one after the other, share a lumen (``inputs.drawn``). None is judged by those of its
    own, as the real one has none: with 200 members and a lumen that is all that is uncertain, right models were called
    rare in 7 of 40 cases, not 2.
    """
    if not frames:
        return float("nan")
    whole = np.concatenate(list(frames), axis=1)
    members, real = whole[:-1], whole[-1]
    at_rest = np.isfinite(members).all(axis=1)
    members, lumen = members[at_rest], np.arange(len(members))[at_rest] // per_lumen
    left = len(members) - int(np.bincount(lumen, minlength=1).max())
    if min(len(members), left + 1) < FEWEST or not np.isfinite(real).all():
        return float("nan")
    # as many others for the real one as for each member
    each, own = np.zeros(len(members)), np.zeros(len(members))
    for one in np.unique(lumen):
        mine = lumen == one
        *each[mine], own[mine] = _squares(np.concatenate([members[mine], real[None]]), members[~mine])
    return float((1 + np.sum(each >= own.mean())) / (len(each) + 1))
