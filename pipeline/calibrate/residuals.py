"""How far the solver's wires lie from the traces of an insertion, weighted by the errors of traces and forces.

A point of a trace is compared with the wire's point at the same distance from the tip, across the wire: a length that
is a little off is taken up by the frame's own depth.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular

from pipeline.arrays.polyline import at_arc, tangents
from pipeline.calibrate.trials import Point, Trial, depths_at
from pipeline.model import Array
from pipeline.simulate.clamp import FIRST_MM, LAST_MM, TANGENT_MM
from pipeline.simulate.evidence import TraceSamples, covariance_of_traces
from solver import Solution

EVERY_MM = 1.5
"""Between the points of a trace that are fitted; its own ends are left out."""
WALL_BELL_MM = 3.0
"""Length (mm) over which the local error of a segmented wall is correlated."""
MODEL_VOXELS, MODEL_BELL_MM = 0.15, 6.0
"""Error of the model in each single frame though all parameters are right (where the wire sticks by friction, what a
contact that opens or closes decides): standard deviation in voxels, and the length (mm) over which it is correlated.
The true rod and the solver differ by 0.003 to 0.04 mm in this way."""
LOST_MM = 1.0
"""Distance that is taken for a wire that did not come to rest: its frame tells nothing, but looks no better for it."""
FORCE_SHARE = 0.03
"""Relative error of the model in a push force, one standard deviation."""
FARTHEST_MM, OUTLYING = 0.6, 4.0
"""A wire that moves farther (mm) in a difference quotient's step snaps: its derivative is taken as 0. A frame whose
mean square is more than so many times that of the median frame is weighted down to that: a release must not decide."""

Simulated = tuple[Sequence[Solution], Point]
"""The wires of an insertion, and the parameters that they have."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Residuals: across (points, 3) mm, force (frames,) N, NaN where unknown, and which frames are at rest."""

    across_mm: Array
    force_N: Array
    rests: Array


@dataclass(frozen=True, eq=False)
class Evidence:
    """An insertion's traces as the data of a fit."""

    trial: Trial
    _roots: dict[str, Any] = field(default_factory=dict, init=False)

    @cached_property
    def traces(self) -> list[TraceSamples]:
        """The points of every frame's trace that are fitted."""
        seen = self.trial.seen
        stops = [max(frame.curve.length_mm - LAST_MM, FIRST_MM + 1e-6) for frame in seen]
        arcs = [np.arange(FIRST_MM, stop, EVERY_MM) for stop in stops]
        return [TraceSamples.of(frame.index, frame.curve, arc) for frame, arc in zip(seen, arcs, strict=True)]

    @cached_property
    def counts(self) -> NDArray[np.int64]:
        """Number of points of every frame (frames,)."""
        return np.array([len(trace.arc_mm) for trace in self.traces], dtype=np.int64)

    @cached_property
    def runs(self) -> list[slice]:
        """Where the points of every frame stand among those of all."""
        ends = np.cumsum(self.counts).tolist()
        return [slice(first, end) for first, end in zip([0, *ends], ends, strict=False)]

    @cached_property
    def stated(self) -> bool:
        """Whether there is a trace that states its standard deviation at all points."""
        return any(bool(np.isfinite(trace.sigma_mm).all()) for trace in self.traces)

    @cached_property
    def traced(self) -> Array:
        """Covariance (points, points), mm^2, of one component: the errors of the traces."""
        return covariance_of_traces(self.traces, self.trial.voxel_mm)

    @cached_property
    def modelled(self) -> Array:
        """Covariance (points, points), mm^2, of one component: the errors of wall and model, without the traces'."""
        arc = np.concatenate([trace.arc_mm for trace in self.traces])
        bell = np.exp(-0.5 * ((arc[:, None] - arc[None, :]) / WALL_BELL_MM) ** 2)
        wall = self.trial.wall_sigmas_mm[1] ** 2 * bell
        frame = np.repeat(np.arange(len(self.counts)), self.counts)
        bell = np.exp(-0.5 * ((arc[:, None] - arc[None, :]) / MODEL_BELL_MM) ** 2)
        # a clamped wire is where it is held
        free = 1.0 - np.exp(-arc / MODEL_BELL_MM)
        own = (MODEL_VOXELS * self.trial.voxel_mm) ** 2 * bell * np.outer(free, free)
        return np.asarray(wall + np.where(frame[:, None] == frame[None, :], own, 0.0))

    def root(self, scale: float) -> Array:
        """Lower Cholesky factor (points, points) of the covariance of one component, that of the traces times scale."""
        if self._roots.get("scale") != scale:
            self._roots.update(scale=scale, root=cholesky(scale * self.traced + self.modelled, lower=True))
        return np.asarray(self._roots["root"])

    def rows(self, wires: Sequence[Solution], point: Point) -> Rows:
        """Residuals: traces minus wires, across the wires, and measured minus simulated push forces."""
        across, push, rests = [], [], np.zeros(len(wires), bool)
        depths = depths_at(self.trial, point)
        for i, (trace, wire, depth) in enumerate(zip(self.traces, wires, depths, strict=True)):
            rests[i] = wire.converged and len(wire.joints_mm) > 2
            if not rests[i]:
                across.append(np.full((len(trace.arc_mm), 3), LOST_MM / np.sqrt(3.0)))
                push.append(np.nan)
                continue
            here, tangent = along(wire, self._arc(i, depth))
            away = trace.points_mm - here
            across.append(away - np.sum(away * tangent, axis=1)[:, None] * tangent)
            push.append(wire.push_force_N)
        measured = np.nan if self.trial.force_N is None else self.trial.force_N
        return Rows(np.concatenate(across), measured - np.array(push), rests)

    def slopes(self, still: Simulated, moved: Simulated, step: float) -> tuple[Array, Array]:
        """Derivatives of wires (points, 3) and forces (frames,): 0 for a frame that snaps or is not at rest."""
        here_mm, there_mm = (depths_at(self.trial, point) for _, point in (still, moved))
        change, push = [], np.zeros(len(here_mm))
        for i, (a, b, here, there) in enumerate(zip(still[0], moved[0], here_mm, there_mm, strict=True)):
            n = len(self.traces[i].arc_mm)
            if not (a.converged and b.converged and min(len(a.joints_mm), len(b.joints_mm)) > 2):
                change.append(np.zeros((n, 3)))
                continue
            old, tangent = along(a, self._arc(i, here))
            way = along(b, self._arc(i, there))[0] - old
            snaps = float(np.abs(way).max()) > FARTHEST_MM
            way = way - np.sum(way * tangent, axis=1)[:, None] * tangent
            change.append(np.zeros((n, 3)) if snaps else way / step)
            push[i] = 0.0 if snaps else (b.push_force_N - a.push_force_N) / step
        return np.concatenate(change), push

    def _arc(self, frame: int, depth_mm: float) -> Array:
        """Where the points of a frame are on a wire of some depth: as far from the tip as on the trace."""
        return np.asarray(self.traces[frame].arc_mm + depth_mm - self.trial.seen[frame].curve.length_mm)

    def surprise(self, rows: Rows) -> Array:
        """Mean squares (frames,) of each frame's residuals by its own covariance, about 1 where all is as expected."""
        each = [(self.traced[run, run], rows.across_mm[run]) for run in self.runs]
        return np.array([np.sum(mine * np.linalg.solve(own, mine)) / (2 * len(mine)) for own, mine in each])

    def whitened(self, values: Array, force: Array, weights: Array, scale: float) -> Array:
        """Numbers of variance 1 (3 points + frames, ...) from values (points, 3, ...) and forces (frames, ...)."""
        heavy = np.repeat(np.sqrt(weights), self.counts)
        flat = heavy[:, None] * values.reshape(len(values), -1)
        across = solve_triangular(self.root(scale), flat, lower=True)
        return np.concatenate(
            [across.reshape(3 * len(values), *values.shape[2:]), force * self._force_weight(weights, force)]
        )

    def _force_weight(self, weights: Array, like: Array) -> Array:
        """Roots of the weights of the measured forces, 0 where there is none."""
        given = self.trial.force_N
        if given is None:
            return np.zeros((len(weights),) + (1,) * (like.ndim - 1))
        sigma = np.hypot(self.trial.force_sigma_N, FORCE_SHARE * np.abs(np.nan_to_num(given)))
        each = np.where(np.isfinite(given), np.sqrt(weights) / sigma, 0.0)
        return each.reshape(-1, *(1,) * (like.ndim - 1))


def along(wire: Solution, arc_mm: Array) -> tuple[Array, Array]:
    """Points and tangents (n, 3) of a wire at arc lengths from its clamp, straight on beyond its ends."""
    curve = wire.joints_mm
    arc = np.maximum(arc_mm, 0.0)
    tangent = tangents(curve, arc, TANGENT_MM)
    return at_arc(curve, arc) + np.minimum(arc_mm, 0.0)[:, None] * tangent, tangent


def weights_of(surprises: Sequence[Array], *, stated: bool) -> tuple[list[Array], float]:
    """Weights of the frames of each insertion, and the factor on the traces' covariance: at least 1 where stated."""
    middle = float(np.median(np.concatenate(surprises)))
    scale = max(middle, 1.0 if stated else 0.01)
    return [np.minimum(1.0, OUTLYING * scale / np.maximum(own, 1e-12)) for own in surprises], scale
