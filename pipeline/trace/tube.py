"""The wire fitted as a whole: a B-spline line source blurred by a Gaussian, against the raw voxels around it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.sparse import sparse_zeros
from pipeline.model import Array, arc_length
from pipeline.trace._kernels.skyline import factorise, inverse, substitute
from pipeline.trace._kernels.tube import active_voxels, normal_equations, render

WINDOW = 3.0
"""Radius of the fitted voxels about the curve, in blurs."""
STIFFNESS = 2.0
"""Standard deviation (voxel) that the prior gives third differences of control points: it carries gaps, not bends."""
FULL_KNOT = 8.0
"""Knot distance (voxel) from which that holds. A short wire has two intervals whatever its length, and the third
differences of one and the same bend fall with the cube of their length: without that its ends curl up in the noise."""
TIGHTEST = 10.0
"""Radius (voxel) of the bend that second differences of a short wire get as standard deviation: it cannot turn back."""
TINT_KNOTS = 4
"""Spline intervals per amplitude node."""
GREGORY = np.array([3.0 / 8.0, 7.0 / 6.0, 23.0 / 24.0])
"""End weights of the fourth-order Gregory rule: the tip's position hangs on the quadrature of the last samples."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Fixed sampling of a uniform cubic B-spline: per sample four weights, their slopes, and its quadrature weight."""

    first: NDArray[np.int64]
    value: Array
    slope: Array
    measure: Array
    tint_first: NDArray[np.int64]
    tint_share: Array


@dataclass(frozen=True, eq=False)
class Tube:
    """Control points (k, 3) in kernel coordinates, amplitude nodes, blur (mm) and offset; covariance when fitted.

    voxels, rest : those that were fitted (flat), and the grey that the fit leaves of them.
    """

    controls: Array
    tint: Array
    sigma: float
    offset: float
    covariance: Array | None = None
    residual_rms: float = float("nan")
    iterations: int = 0
    voxels: NDArray[np.int64] | None = None
    rest: Array | None = None

    @property
    def intervals(self) -> int:
        """Number of spline pieces."""
        return len(self.controls) - 3


def weights_at(u: Array, intervals: int) -> tuple[NDArray[np.int64], Array, Array]:
    """First control, values (n, 4) and slopes (n, 4) of the uniform cubic B-spline at u in [0, intervals]."""
    i = np.clip(np.floor(u).astype(np.int64), 0, intervals - 1)
    t = u - i
    v = 1 - t
    value = np.stack([v**3, 4 - 6 * t**2 + 3 * t**3, 4 - 6 * v**2 + 3 * v**3, t**3], axis=1) / 6
    slope = np.stack([-(v**2), 3 * t**2 - 4 * t, 4 * v - 3 * v**2, t**2], axis=1) / 2
    return i, value, slope


def evaluate(controls: Array, u: Array) -> tuple[Array, Array]:
    """Points (n, 3) and derivatives (n, 3) of the spline at parameters u."""
    i, value, slope = weights_at(u, len(controls) - 3)
    window = controls[i[:, None] + np.arange(4)]
    return np.einsum("nk,nkd->nd", value, window), np.einsum("nk,nkd->nd", slope, window)


def sampling(intervals: int, per: int) -> Samples:
    """``per`` samples in every interval, both ends included, with Gregory's end weights."""
    n = intervals * per
    u = np.linspace(0, intervals, n + 1)
    measure = np.full(n + 1, 1.0 / per)
    m = min(3, (n + 1) // 2)
    measure[:m] *= GREGORY[:m]
    measure[-m:] *= GREGORY[:m][::-1]
    first, value, slope = weights_at(u, intervals)
    tints = tint_nodes(intervals)
    at = u / intervals * (tints - 1)
    t_first = np.clip(np.floor(at).astype(np.int64), 0, tints - 2)
    return Samples(first, value, slope, measure, t_first, at - t_first)


def tint_nodes(intervals: int) -> int:
    """How many amplitude nodes: one every TINT_KNOTS intervals, two at least."""
    return max(2, round(intervals / TINT_KNOTS) + 1)


def spline_through(points: Array, knot: float) -> Array:
    """Control points (k, 3) of the least-squares uniform spline along a path (n, 3), knots about ``knot`` mm apart."""
    arc = arc_length(points)
    intervals = max(2, round(arc[-1] / knot))
    u = arc / arc[-1] * intervals
    i, value, _ = weights_at(u, intervals)
    k = intervals + 3
    basis = np.zeros((len(u), k))
    np.put_along_axis(basis, i[:, None] + np.arange(4), value, axis=1)
    third = np.diff(np.eye(k), n=3, axis=0)
    density = len(u) / k
    normal = basis.T @ basis + 1e-3 * density * third.T @ third
    lower, first = _factors(normal)
    right = basis.T @ points
    return np.stack([substitute(lower, first, np.ascontiguousarray(right[:, a])) for a in range(3)], axis=1)


def _prior(controls: int, columns: int, noise: float, voxel: float, knot: float) -> Array:
    """Normal matrix of the smoothness prior on the control points, ``knot`` mm apart."""
    third = np.diff(np.eye(controls), n=3, axis=0)
    loose = STIFFNESS * min(1.0, knot / (FULL_KNOT * voxel)) ** 3
    block = third.T @ third * (noise / (loose * voxel)) ** 2
    if knot < FULL_KNOT * voxel:
        second = np.diff(np.eye(controls), n=2, axis=0)
        block += second.T @ second * (noise * TIGHTEST * voxel / knot**2) ** 2
    out = np.zeros((columns, columns))
    for axis in range(3):
        out[axis : 3 * controls : 3, axis : 3 * controls : 3] = block
    return out


def _frozen(normal: Array, held: list[int]) -> Array:
    """Columns that are not fitted: a one on the diagonal and nothing else."""
    for c in held:
        normal[c, :] = 0.0
        normal[:, c] = 0.0
        normal[c, c] = 1.0
    return normal


@dataclass(frozen=True, eq=False)
class TubeData:
    """What is fitted: grey above background (box), voxel size, noise of one voxel, and where the wire is cut off.

    start_plane : (point, direction) before which voxels are ignored, since wire goes on there that is not modelled.
    """

    grey: NDArray[Any]
    spacing: Array
    noise: float
    start_plane: tuple[Array, Array] | None = None


def _weights(data: TubeData, voxels: NDArray[np.int64]) -> Array:
    """1 for voxels that count, 0 before the start plane."""
    if data.start_plane is None:
        return np.ones(len(voxels))
    point, direction = data.start_plane
    index = np.stack(np.unravel_index(voxels, data.grey.shape), axis=1) * data.spacing
    return np.where((index - point) @ direction > 0, 1.0, 0.0)


def _step(
    data: TubeData, tube: Tube, samples: Samples, prior: Array, slot: NDArray[np.int32]
) -> tuple[Array, Array, float, tuple[NDArray[np.int64], Array]]:
    """One set of normal equations: matrix with prior, right-hand side, residual rms, and voxels with residuals."""
    curve, velocity = _sampled(tube.controls, samples)
    radius = WINDOW * max(tube.sigma, 0.5 * float(data.spacing.min()))
    voxels = active_voxels(data.grey.shape, data.spacing, curve, radius, slot)
    weight = _weights(data, voxels)
    columns = prior.shape[0]
    normal, right = np.zeros((columns, columns)), np.zeros(columns)
    residual = np.zeros(len(voxels))
    k = len(tube.controls)
    square = normal_equations(
        data.grey, data.spacing, slot, weight, voxels, curve, velocity, samples.first, samples.value, samples.slope,
        samples.measure, samples.tint_first, samples.tint_share, tube.tint, tube.sigma, tube.offset, radius, k,
        normal, right, residual,
    )  # fmt: skip
    slot.reshape(-1)[voxels] = 0
    right[: 3 * k] -= prior[: 3 * k, : 3 * k] @ tube.controls.ravel()
    return normal + prior, right, float(np.sqrt(square / max(1.0, weight.sum()))), (voxels, residual)


def _sampled(controls: Array, s: Samples) -> tuple[Array, Array]:
    window = controls[s.first[:, None] + np.arange(4)]
    curve = np.einsum("nk,nkd->nd", s.value, window)
    return np.ascontiguousarray(curve), np.ascontiguousarray(np.einsum("nk,nkd->nd", s.slope, window))


def _damped(normal: Array, tube: Tube, amount: float) -> Array:
    """Levenberg damping along the tangent: control points must not slide along the wire, where data say little."""
    k = len(tube.controls)
    t = np.gradient(tube.controls, axis=0)
    t /= np.linalg.norm(t, axis=1)[:, None] + 1e-12
    level = float(np.median(np.diag(normal)[: 3 * k]))
    out = normal.copy()
    m = np.arange(1, k - 1)
    block = 3 * m[:, None] + np.arange(3)
    out[block[:, :, None], block[:, None, :]] += amount * level * t[m][:, :, None] * t[m][:, None, :]
    diagonal = np.arange(3 * k)
    out[diagonal, diagonal] += 1e-4 * level
    return out


def _factors(normal: Array) -> tuple[Array, NDArray[np.int64]]:
    lower, first, good = factorise(normal)
    if not good:
        msg = "the normal equations of the tube are singular: the path leads where there is nothing to fit"
        raise np.linalg.LinAlgError(msg)
    return lower, first


def _solved(normal: Array, right: Array) -> Array:
    return np.asarray(substitute(*_factors(normal), right))


def _moved(tube: Tube, step: Array, voxel: float, samples: Samples) -> tuple[Tube, float]:
    """The tube after a step that moves its curve by at most a voxel; and the largest move that counts.

    The first and the last control point hang beyond the curve, and sliding along the wire changes nothing: what
    counts is how far the curve moves sideways, and its tip at all.
    """
    k, a = len(tube.controls), len(tube.tint)
    shift = step[: 3 * k].reshape(k, 3)
    drift = _sampled(shift, samples)[0]
    size = float(np.max(np.linalg.norm(drift, axis=1)))
    velocity = _sampled(tube.controls, samples)[1]
    t = velocity / np.linalg.norm(velocity, axis=1)[:, None]
    drift[:-1] -= np.sum(drift * t, axis=1)[:-1, None] * t[:-1]
    moved_by = float(np.max(np.linalg.norm(drift, axis=1)))
    scale = min(1.0, voxel / max(size, 1e-12))
    sigma = tube.sigma + scale * float(np.clip(step[3 * k + a], -0.15 * tube.sigma, 0.15 * tube.sigma))
    moved = replace(
        tube,
        controls=tube.controls + scale * shift,
        tint=tube.tint + scale * step[3 * k : 3 * k + a],
        sigma=float(np.clip(sigma, 0.5 * voxel, 3.0 * voxel)),
        offset=tube.offset + scale * float(step[3 * k + a + 1]),
    )
    return moved, scale * moved_by


def fit_tube(
    data: TubeData, tube: Tube, iterations: int = 12, tolerance: float = 0.02, fit_sigma: bool = True
) -> Tube:
    """Gauss-Newton on the voxels within WINDOW blurs of the curve.

    Stops when no point of the curve moves by more than ``tolerance`` voxel. The result carries the covariance of its
    columns (controls, amplitudes, blur, offset), for the noise of ``data``.
    """
    voxel = float(data.spacing.min())
    step_mm = max(voxel, 0.8 * tube.sigma)
    per = max(3, int(np.ceil(_mean_speed(tube.controls) / step_mm)))
    samples = sampling(tube.intervals, per)
    columns = 3 * len(tube.controls) + len(tube.tint) + 2
    prior = _prior(len(tube.controls), columns, data.noise, voxel, _mean_speed(tube.controls))
    held = [columns - 2] if not fit_sigma else []
    slot = sparse_zeros(data.grey.shape, np.int32)
    done = 0
    for done in range(1, iterations + 1):
        normal, right, _, _ = _step(data, tube, samples, prior, slot)
        held_now = held if done > 2 else [columns - 2]
        normal = _frozen(_damped(normal, tube, 3e-2), held_now)
        right[held_now] = 0.0
        tube, size = _moved(tube, _solved(normal, right), voxel, samples)
        if size < tolerance * voxel and done > 2:
            break
    normal, _, rms, (voxels, rest) = _step(data, tube, samples, prior, slot)
    normal = _frozen(_damped(normal, tube, 1e-6), held)
    covariance = inverse(*_factors(normal)) * data.noise**2
    return replace(tube, covariance=covariance, residual_rms=rms, iterations=done, voxels=voxels, rest=rest)


def _mean_speed(controls: Array) -> float:
    return float(np.mean(np.linalg.norm(np.diff(controls, axis=0), axis=1)))


def point_sigmas(tube: Tube, u: Array) -> tuple[Array, float]:
    """Standard deviation across the wire per axis at parameters u (n,), and along the wire at its end, mm."""
    if tube.covariance is None:
        return np.full(len(u), np.nan), float("nan")
    i, value, _ = weights_at(u, tube.intervals)
    _, velocity = evaluate(tube.controls, u)
    t = velocity / np.linalg.norm(velocity, axis=1)[:, None]
    column = 3 * i[:, None] + np.arange(12)
    blocks = tube.covariance[column[:, :, None], column[:, None, :]].reshape(-1, 4, 3, 4, 3)
    spread = np.einsum("na,naibj,nb->nij", value, blocks, value)
    along = np.einsum("ni,nij,nj->n", t, spread, t)
    across = 0.5 * (np.trace(spread, axis1=1, axis2=2) - along)
    return np.sqrt(np.maximum(across, 0.0)), float(np.sqrt(max(0.0, along[-1])))


def predicted(data: TubeData, tube: Tube) -> tuple[NDArray[np.int64], Array]:
    """Voxels (flat) that the tube lights up and the grey it gives them."""
    voxel = float(data.spacing.min())
    per = max(3, int(np.ceil(_mean_speed(tube.controls) / max(voxel, 0.8 * tube.sigma))))
    samples = sampling(tube.intervals, per)
    curve, velocity = _sampled(tube.controls, samples)
    radius = WINDOW * max(tube.sigma, 0.5 * voxel)
    slot = sparse_zeros(data.grey.shape, np.int32)
    voxels = active_voxels(data.grey.shape, data.spacing, curve, radius, slot)
    amplitude = tube.tint[samples.tint_first] * (1 - samples.tint_share)
    amplitude = amplitude + tube.tint[samples.tint_first + 1] * samples.tint_share
    weight = amplitude * samples.measure * np.linalg.norm(velocity, axis=1)
    return voxels, render(data.grey.shape, data.spacing, slot, len(voxels), curve, weight, tube.sigma, radius)
