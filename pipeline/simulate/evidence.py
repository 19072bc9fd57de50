"""What traces say of the clamp: their covariance, and the posterior of a linear model with a prior."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, cho_factor, cho_solve

from pipeline.arrays.polyline import at_arc
from pipeline.model import Array, Curve, arc_length

CORRELATED_KNOTS = 0.43
"""Correlation length of a trace's errors along it (standard deviation of a Gaussian), in distances of the spline's
knots: measured against the truth at contrasts of 16, 8 and 4 (1.13, 1.4 and 1.5 mm)."""
KNOT_MM = 3.0  # distance of the knots where it is not known
OWN = 0.05
"""Share of a trace's variance that is independent from point to point."""
SHARED, SHARED_MM, SHARED_FARTHER = 0.45, 1.5, 0.15
"""Correlation between frames: at the entry, the length (mm) over which it falls, and farther on. The same reference
scan is subtracted from all frames, so its noise is in all of them where the wires coincide. At the entry they do;
measured 0.4 to 0.5 there, 0.1 to 0.2 from 2 mm on."""
START = 1.0
"""Relative excess of a trace's variance at its start, over half a knot: measured 0.2 to 1.5 at contrasts of 16 to 4."""
UNKNOWN_VOXELS = 0.15
"""Standard deviation of a trace that states none, as a user's own."""
LEAST_VOXELS = 0.01
"""No trace is known better here, as exact ones that are stated to be: without any error nothing could be weighed."""
MODEL_VOXELS, MODEL_MM = 0.1, 8.0
"""How far (voxels) the simulated wire may be off at this distance (mm) from the clamp, through errors farther on, such
as the lumen's wall."""
MODEL_SHARED = 0.5
THIRD, ROUGH = 20.0, 1.4
"""Variance of third differences of independent numbers of variance 1; and how many times as rough as their standard
deviations allow traces may be: at 1.45 chance does not explain 20 points of one; those of scans are splines, 0.1."""
SURPRISING = 5.0
"""A frame disagrees where its sum of squares is this many standard deviations above its expected value."""


@dataclass(frozen=True)
class TraceSamples:
    """The points of a frame's trace that are fitted.

    arc_mm (n,), points_mm (n, 3).     sigma_mm : (n,) across the wire, NaN where unknown.     knot_mm : distance of the
    spline's knots, NaN where unknown.     rough_mm : standard deviation of errors that are independent from point to
    point, beyond those of sigma_mm.
    """

    index: int
    arc_mm: Array
    points_mm: Array
    sigma_mm: Array
    knot_mm: float
    rough_mm: float = 0.0

    @classmethod
    def of(cls, index: int, curve: Curve, arc_mm: Array) -> Self:
        """A trace at arc lengths (n,)."""
        sigma = np.interp(arc_mm, arc_length(curve.points_mm), curve.sigma_mm)
        knot = curve.levels.get("knot_mm", np.nan)
        return cls(index, arc_mm, at_arc(curve.points_mm, arc_mm), sigma, knot)


def _modes(trace: TraceSamples, voxel_mm: float) -> Array:
    """Shapes (n, 2), mm, in which a clamped wire deviates through wrong moments and forces farther on: s^2 and s^3."""
    s = trace.arc_mm[:, None] / MODEL_MM
    return np.asarray(MODEL_VOXELS * voxel_mm * np.concatenate([s**2, s**3], axis=1))


def sigma_across(trace: TraceSamples, voxel_mm: float) -> Array:
    """Standard deviation (n,), mm, of each point across the wire, with the excess at the beginning of the trace."""
    sigma = np.where(np.isfinite(trace.sigma_mm), trace.sigma_mm, UNKNOWN_VOXELS * voxel_mm)
    sigma = np.maximum(sigma, LEAST_VOXELS * voxel_mm)
    return np.asarray(sigma * np.sqrt(1.0 + START * np.exp(-2.0 * (trace.arc_mm / _knot(trace)) ** 2)))


def _knot(trace: TraceSamples) -> float:
    return trace.knot_mm if np.isfinite(trace.knot_mm) else KNOT_MM


def _smooth(sigma: Array, trace: TraceSamples) -> Array:
    """What of standard deviations (n,) changes by no more than a factor of e over the length of the correlation.

    A point that is correlated with its neighbours and four times as uncertain would tell the error that they share:
    where a gap is bridged, the clamp was held to be known twice as well as with no such point.
    """
    apart = np.abs(trace.arc_mm[:, None] - trace.arc_mm[None, :]) / (CORRELATED_KNOTS * _knot(trace))
    return np.asarray(np.min(sigma[None, :] * np.exp(apart), axis=1, initial=np.inf))


def _bell(a: TraceSamples, b: TraceSamples) -> Array:
    """Correlation (n, m) of errors along the traces of two frames."""
    length = CORRELATED_KNOTS * 0.5 * (_knot(a) + _knot(b))
    return np.asarray(np.exp(-0.5 * ((a.arc_mm[:, None] - b.arc_mm[None, :]) / length) ** 2))


def covariance_of(traces: Sequence[TraceSamples], voxel_mm: float) -> Array:
    """Covariance, mm^2, of one component at all points of all frames: the errors of the traces and of the model."""
    noise = covariance_of_traces(traces, voxel_mm)
    modes = [_modes(trace, voxel_mm) for trace in traces]
    all_modes, own_modes = np.concatenate(modes), block_diag(*modes)
    noise += MODEL_SHARED * all_modes @ all_modes.T + (1.0 - MODEL_SHARED) * own_modes @ own_modes.T
    return np.asarray(noise)


def covariance_of_traces(traces: Sequence[TraceSamples], voxel_mm: float, *, drawn: bool = False) -> Array:
    """Covariance, mm^2, of one component at all points of all frames: the errors of the traces alone.

    drawn : to draw errors by, not to weigh them: a bridged gap is off as a whole. Drawn point by point it scattered too
    little, and of three right frames with one a third was called rare.
    """
    arc = np.concatenate([trace.arc_mm for trace in traces])
    whole = [sigma_across(trace, voxel_mm) for trace in traces]
    kept = whole if drawn else [_smooth(sigma, trace) for sigma, trace in zip(whole, traces, strict=True)]
    smooth = np.concatenate(kept)
    all_bells, own_bells = np.block([[_bell(a, b) for b in traces] for a in traces]), [_bell(a, a) for a in traces]
    shared = np.sqrt(SHARED_FARTHER + (SHARED - SHARED_FARTHER) * np.exp(-0.5 * (arc / SHARED_MM) ** 2))
    alone = np.sqrt(1.0 - shared**2)
    bells = all_bells * np.outer(shared, shared) + block_diag(*own_bells) * np.outer(alone, alone)
    rough = np.concatenate([np.full(len(trace.arc_mm), trace.rough_mm) for trace in traces])
    by_itself = np.concatenate(whole) ** 2 - smooth**2 + rough**2
    return np.asarray(((1.0 - OWN) * bells + OWN * np.eye(len(arc))) * np.outer(smooth, smooth) + np.diag(by_itself))


def roughness_mm(left: Sequence[Array], traces: Sequence[TraceSamples], voxel_mm: float) -> float:
    """How rough traces are beyond what their standard deviations allow, mm: the median of theirs; 0 where they are not.

    left : residuals (n, 3) of each, across the wire. Of their third differences hardly anything is smooth: a wire that
    is held elsewhere, or is otherwise bent, makes no trace rough. Less than ROUGH times what is allowed is 0.
    """
    found = []
    for mine, trace in zip(left, traces, strict=True):
        third = np.diff(np.eye(len(mine)), n=3, axis=0)
        if not len(third):
            continue
        seen = 0.5 * float(np.mean(np.sum((third @ mine) ** 2, axis=1)))
        allowed = float(np.mean(np.sum(third @ covariance_of_traces([trace], voxel_mm) * third, axis=1)))
        found.append((seen - allowed) / THIRD if seen > ROUGH**2 * allowed else 0.0)
    return float(np.sqrt(np.median(found))) if found else 0.0


def rougher(rough_mm: float, traces: Sequence[TraceSamples], voxel_mm: float) -> str:
    """A warning of traces that are rougher than they state, mm (``roughness_mm``); empty where they are not."""
    if not rough_mm:
        return ""
    sigma = float(np.median(np.concatenate([sigma_across(trace, voxel_mm) for trace in traces])))
    return (
        f"the traces are rougher than they are known to be: near the entry they scatter by {rough_mm:.2g} mm from "
        f"point to point, where a standard deviation of {sigma:.2g} mm leaves {np.sqrt(OWN) * sigma:.2g} mm; the "
        "clamp was estimated with that, and is the less certain for it: smooth them"
    )


def posterior(
    residual: Array, jacobian: Array, noise: Array, sigmas: Array, held: NDArray[np.bool_], at: Array
) -> tuple[Array, Array, Array]:
    """Mean (p,) and covariance (p, p) of the unknowns, and the residuals (n, 3) that the mean leaves.

    residual : (n, 3) at the unknowns' values ``at`` (p,).     jacobian : (n, 3, p).     noise : (n, n) of a component.
    sigmas : (p,) of the prior about 0; an unknown of 0 stays there.     held : (p,) True for those that stay at 0
    although they are not known: what they may be makes the others less certain (Schmidt's consider parameters).
    """
    free, unknown = (sigmas > 0) & ~held, np.where(held, sigmas, 0.0)
    factor = cho_factor(noise)
    slopes = jacobian[:, :, free]
    target = residual + slopes @ at[free]
    normal, right = np.diag(1.0 / sigmas[free] ** 2), np.zeros(int(free.sum()))
    leak: Array = np.zeros((len(right), len(sigmas)))
    for axis in range(3):
        weighted = cho_solve(factor, slopes[:, axis])
        normal, right = normal + slopes[:, axis].T @ weighted, right + weighted.T @ target[:, axis]
        leak = leak + weighted.T @ (jacobian[:, axis] * unknown)
    mean, spread = np.zeros(len(sigmas)), np.diag(unknown)
    inverse = np.linalg.inv(normal)
    mean[free], spread[free] = inverse @ right, -inverse @ leak
    spread = spread @ spread.T
    spread[np.ix_(free, free)] += inverse
    return mean, spread, target - slopes @ mean[free]


def disagreeing(left: Array, traces: Sequence[TraceSamples], voxel_mm: float) -> int | None:
    """Position in ``traces`` of the frame with the most surprising residuals; None where chance explains them."""
    surprise = []
    for trace, mine in zip(traces, np.split(left, np.cumsum([len(t.arc_mm) for t in traces])[:-1]), strict=True):
        square = float(np.sum(mine * cho_solve(cho_factor(covariance_of([trace], voxel_mm)), mine)))
        surprise.append((square - 2 * len(mine)) / np.sqrt(4 * len(mine)))
    worst = int(np.argmax(surprise))
    return worst if surprise[worst] > SURPRISING else None
