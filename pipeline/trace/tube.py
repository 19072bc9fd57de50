"""The wire fitted as a whole: a B-spline line source blurred by a Gaussian, against the raw voxels around it."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.grids import unflattened
from pipeline.model import Array, arc_length
from pipeline.trace._kernels import tube as kernels
from pipeline.trace._kernels.skyline import factorise, substitute
from pipeline.trace._kernels.tube import Blob, Claim, Equations, Line, Samples
from pipeline.trace.smoothness import smoothness
from pipeline.trace.steps import EVEN, Steps
from pipeline.trace.subtraction import Subtraction, numbered

WINDOW = 3.0
"""Radius of the fitted voxels about the curve, in blurs."""
TINT_KNOTS = 4
"""Spline intervals per amplitude node."""
GREGORY = np.array([3.0 / 8.0, 7.0 / 6.0, 23.0 / 24.0])
"""End weights of the fourth-order Gregory rule: the tip's position depends on the quadrature of the last samples."""
START_VOXELS = 8.0
"""How far from its point the start plane masks voxels: those that the blurred wire before it lights up."""
DIM_END = 0.5
"""Brightness of the wire's end, over that of its brightest part, below which the fit has no offset."""
BLUR_HELD = 2
"""First iterations in which the blur is held: before the curve lies on the wire it would grow."""
SLIDING, POLISHED = 3e-2, 1e-6
"""Damping of control points along the wire, while they are fitted and for the covariance."""


@dataclass(frozen=True, eq=False)
class Tube:
    """Control points (k, 3) in kernel coordinates, amplitude nodes, blur (mm) and offset; covariance when fitted.

    voxels, rest : those that were fitted (flat), and the grey that the fit leaves of them.
    start_plane : (point, direction) before which voxels are ignored, since wire goes on there that is not modelled.
    steps : of its brightness, by which the amplitude is multiplied.
    """

    controls: Array
    tint: Array
    sigma: float
    offset: float
    covariance: Array | None = None
    residual_rms: float = float("nan")
    iterations: int = 0
    voxels: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    rest: Array = field(default_factory=lambda: np.zeros(0))
    start_plane: tuple[Array, Array] | None = None
    steps: Steps = EVEN

    @cached_property
    def peak(self) -> float:
        """Median grey above the background along the wire."""
        u = np.linspace(0.0, 1.0, 20 * len(self.tint))
        return float(np.median(np.interp(u, np.linspace(0, 1, len(self.tint)), self.tint) * self.steps.at(u)))

    def brightness(self, share: Array) -> Array:
        """Grey above the background summed across the wire, grey mm2 (n,), at shares (n,) of the length.

        A blur leaves it as it is: a Gaussian of that peak has 2 pi sigma^2 times as much.
        """
        tint = np.interp(share, np.linspace(0.0, 1.0, len(self.tint)), self.tint)
        return np.asarray(2.0 * np.pi * self.sigma**2 * tint * self.steps.at(share))

    @property
    def intervals(self) -> int:
        """Number of spline pieces."""
        return len(self.controls) - 3

    @cached_property
    def length_mm(self) -> float:
        """Length of the curve."""
        return float(arc_length(self.at(np.linspace(0, self.intervals, 4 * self.intervals + 1)))[-1])

    @cached_property
    def knot_mm(self) -> float:
        """Mean distance of neighbouring control points."""
        return float(np.mean(np.linalg.norm(np.diff(self.controls, axis=0), axis=1)))

    def at(self, u: Array) -> Array:
        """Points (n, 3) of the curve at parameters from 0 to ``intervals``."""
        first, value, _ = weights_at(u, self.intervals)
        return _combined(self.controls, first, value)

    def blob(self, voxel: float) -> Blob:
        """What one of its points looks like."""
        return Blob(self.sigma, WINDOW * max(self.sigma, 0.5 * voxel), self.offset)


def weights_at(u: Array, intervals: int) -> tuple[NDArray[np.int64], Array, Array]:
    """First control, values (n, 4) and slopes (n, 4) of the uniform cubic B-spline at u in [0, intervals]."""
    i = np.clip(np.floor(u).astype(np.int64), 0, intervals - 1)
    t = u - i
    v = 1 - t
    value = np.stack([v**3, 4 - 6 * t**2 + 3 * t**3, 4 - 6 * v**2 + 3 * v**3, t**3], axis=1) / 6
    slope = np.stack([-(v**2), 3 * t**2 - 4 * t, 4 * v - 3 * v**2, t**2], axis=1) / 2
    return i, value, slope


def _combined(controls: Array, first: NDArray[np.int64], weights: Array) -> Array:
    """Weighted sums (n, 3) of four control points each."""
    return np.asarray(np.einsum("nk,nkd->nd", weights, controls[first[:, None] + np.arange(4)]))


def tint_nodes(intervals: int) -> int:
    """How many amplitude nodes: one every TINT_KNOTS intervals, two at least."""
    return max(2, round(intervals / TINT_KNOTS) + 1)


def sampling(tube: Tube, voxel: float) -> Samples:
    """Samples a voxel or 0.8 blur apart, three in every interval at least, with Gregory's end weights."""
    per = max(3, int(np.ceil(tube.knot_mm / max(voxel, 0.8 * tube.sigma))))
    n = tube.intervals * per
    u = np.linspace(0, tube.intervals, n + 1)
    measure = np.full(n + 1, 1.0 / per)
    m = min(3, (n + 1) // 2)
    measure[:m] *= GREGORY[:m]
    measure[-m:] *= GREGORY[:m][::-1]
    last = len(tube.tint) - 1
    at = u / tube.intervals * last
    node = np.clip(np.floor(at).astype(np.int64), 0, last - 1)
    opacity = spread_over(tube.steps, u / tube.intervals, 1.0 / n)
    return Samples(measure, *weights_at(u, tube.intervals), node, at - node, opacity)


def spread_over(steps: Steps, share: Array, width: float) -> Array:
    """Brightness (n,) averaged over ``width`` about shares (n,) of the length."""
    offset = width * (np.arange(8) / 8.0 - 0.4375)
    return np.asarray(np.mean(steps.at(np.clip(share[:, None] + offset, 0.0, 1.0)), axis=1))


def sampled(tube: Tube, s: Samples) -> Line:
    """The tube at its samples."""
    curve, velocity = (_combined(tube.controls, s.first, w) for w in (s.value, s.slope))
    speed = np.linalg.norm(velocity, axis=1) + 1e-30
    amplitude = tube.tint[s.tint_first] * (1.0 - s.tint_share) + tube.tint[s.tint_first + 1] * s.tint_share
    return Line(curve, velocity, speed, amplitude * s.opacity, s)


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
    factors = _factors(basis.T @ basis + 1e-3 * (len(u) / k) * third.T @ third)
    return np.asarray(substitute(*factors, basis.T @ points))


def weights(image: Subtraction, tube: Tube, voxels: NDArray[np.int64]) -> Array:
    """Weights (n,) of the voxels near the tube: none at its start for those that lie before its start plane."""
    if tube.start_plane is None:
        return np.ones(len(voxels))
    point, direction = tube.start_plane
    index = unflattened(voxels, image.grey.shape) * image.spacing
    # a wire may come back past the plane elsewhere
    at_start = np.sum((index - point) ** 2, axis=1) < (START_VOXELS * image.voxel) ** 2
    return np.where(at_start & ((index - point) @ direction <= 0), 0.0, 1.0)


def _equations(image: Subtraction, tube: Tube, samples: Samples) -> tuple[Equations, Claim, Line]:
    """One set of normal equations, with the prior, the voxels that they are of, and the tube at its samples."""
    line, blob, k = sampled(tube, samples), tube.blob(image.voxel), len(tube.controls)
    prior = smoothness(tube.controls, tube.knot_mm, image.voxel) * image.noise**2
    with numbered(image, line.curve, blob.radius) as (voxels, slot):
        claim = Claim(voxels, slot, weights(image, tube, voxels))
        e = kernels.normal_equations(image.grey, image.spacing, claim, line, blob, k, len(tube.tint))
    e.right[: 3 * k] -= prior @ tube.controls.ravel()
    e.normal[: 3 * k, : 3 * k] += prior
    return e, claim, line


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


def _hold(normal: Array, right: Array, columns: list[int]) -> None:
    """Hold some unknowns: change the equations, in place, so that their step is 0."""
    for column in columns:
        normal[column], normal[:, column], right[column] = 0.0, 0.0, 0.0
        normal[column, column] = 1.0


def _factors(normal: Array) -> tuple[Array, NDArray[np.int64]]:
    lower, first, good = factorise(normal)
    if not good:
        raise np.linalg.LinAlgError(
            "the normal equations of the tube are singular: the path leads where there is nothing to fit"
        )
    return lower, first


def _moved(tube: Tube, step: Array, voxel: float, line: Line) -> tuple[Tube, float]:
    """The tube after a step that moves its curve by at most a voxel; and the largest move that counts.

    The first and the last control point lie beyond the curve, and sliding along the wire changes nothing: what
    counts is how far the curve moves sideways, and how far its tip moves in any direction.
    """
    k, a = len(tube.controls), len(tube.tint)
    shift = step[: 3 * k].reshape(k, 3)
    drift = _combined(shift, line.samples.first, line.samples.value)
    size = float(np.max(np.linalg.norm(drift, axis=1)))
    t = line.velocity / line.speed[:, None]
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


def fit_tube(image: Subtraction, tube: Tube, iterations: int = 12, tolerance: float = 0.02) -> Tube:
    """Gauss-Newton on the voxels within WINDOW blurs of the curve.

    Stops when no point of the curve moves by more than ``tolerance`` voxel. The result carries the covariance of its
    columns (controls, amplitudes, blur, offset), for the noise of the image.
    """
    samples = sampling(tube, image.voxel)
    # a bright piece is off a Gaussian by a few hundredths, which the offset takes up; a dim end would drown in that
    stepped = [-1] if tube.steps.levels[-1] < DIM_END * tube.steps.levels.max() else []
    done = 0
    for done in range(1, iterations + 1):
        found, _, line = _equations(image, tube, samples)
        normal, right = _damped(found.normal, tube, SLIDING), found.right
        _hold(normal, right, [-2] * (done <= BLUR_HELD) + stepped)
        tube, size = _moved(tube, substitute(*_factors(normal), right[:, None])[:, 0], image.voxel, line)
        if size < tolerance * image.voxel and done > BLUR_HELD:
            break
    found, claim, _ = _equations(image, tube, samples)
    rms = float(np.sqrt(found.square / max(1.0, claim.weight.sum())))
    normal = _damped(found.normal, tube, POLISHED)
    _hold(normal, found.right, stepped)
    covariance = substitute(*_factors(normal), np.eye(len(normal))).T * image.noise**2
    return replace(
        tube, covariance=covariance, residual_rms=rms, iterations=done, voxels=claim.voxels, rest=found.residual
    )


def point_sigmas(tube: Tube, u: Array) -> tuple[Array, float]:
    """Standard deviation across the wire per axis at parameters u (n,), and along the wire at its end, mm."""
    if tube.covariance is None:
        return np.full(len(u), np.nan), float("nan")
    i, value, slope = weights_at(u, tube.intervals)
    velocity = _combined(tube.controls, i, slope)
    t = velocity / np.linalg.norm(velocity, axis=1)[:, None]
    column = 3 * i[:, None] + np.arange(12)
    blocks = tube.covariance[column[:, :, None], column[:, None, :]].reshape(-1, 4, 3, 4, 3)
    spread = np.einsum("na,naibj,nb->nij", value, blocks, value)
    along = np.einsum("ni,nij,nj->n", t, spread, t)
    across = 0.5 * (np.trace(spread, axis1=1, axis2=2) - along)
    return np.sqrt(np.maximum(across, 0.0)), float(np.sqrt(max(0.0, along[-1])))


def predicted(image: Subtraction, tube: Tube) -> tuple[NDArray[np.int64], Array]:
    """Voxels (flat) that the tube lights up and the grey it gives them."""
    line, blob = sampled(tube, sampling(tube, image.voxel)), tube.blob(image.voxel)
    with numbered(image, line.curve, blob.radius) as (voxels, slot):
        return voxels, kernels.render(slot, image.spacing, len(voxels), line, blob)
