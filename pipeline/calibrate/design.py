"""A planned study: how well its insertions would tell each parameter (the Cramér-Rao bound, with the priors).

The solver's own wires at the stated parameters stand for the traces; only derivatives matter.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pipeline.calibrate.fit import Problem
from pipeline.calibrate.residuals import Evidence
from pipeline.calibrate.search import FIRST_FRICTION, Fit
from pipeline.calibrate.segments import resolved
from pipeline.calibrate.trials import OWN, Point, Trial, replayed
from pipeline.calibrate.unknowns import FRICTION, Unknown
from pipeline.model import Curve
from pipeline.simulate.clamp import TracedFrame
from pipeline.simulate.config import SolverConfig

TRACE_VOXELS, TIP_VOXELS = 0.07, 0.2
"""Standard deviation of a plain study's traces in voxels, across the wire per axis and at the tip (README)."""


@dataclass(frozen=True)
class Predicted:
    """A parameter's standard deviation as the planned study would find it, and whether that counts as seen."""

    unknown: Unknown
    sd: float

    @property
    def seen(self) -> bool:
        """Whether it is small enough."""
        return self.sd <= self.unknown.enough


def straight_to(trial: Trial, depths_mm: Sequence[float], rolls_deg: Sequence[float]) -> Trial:
    """The trial with straight lines as traces: so far only their lengths, the planned depths, and the rolls matter."""
    seen = []
    for n, (depth, roll) in enumerate(zip(depths_mm, rolls_deg, strict=True)):
        points = trial.given.entry_mm + np.linspace(0.0, depth, 2)[:, None] * trial.given.direction
        seen.append(TracedFrame(n, Curve(points, np.zeros(2)), roll))
    return replace(trial, seen=tuple(seen))


def predicted(free: Sequence[Unknown], planned: Sequence[Trial], solver: SolverConfig) -> list[Predicted]:
    """Standard deviations of all parameters; ValueError where a planned depth is not reached."""
    fit, _ = resolved(partial(_as_stated, free, planned), planned[0].wire, solver)
    return [Predicted(u, fit.sd[u.name]) for u in free]


def _as_stated(free: Sequence[Unknown], planned: Sequence[Trial], solver: SolverConfig) -> Fit:
    """The planned study linearised at the stated parameters, of which there is nothing to fit."""
    shared = {u.name: max(u.prior, FIRST_FRICTION) if u.name == FRICTION else u.prior for u in free}
    points = [Point(shared, np.zeros(OWN + len(trial.seen))) for trial in planned]
    found = []
    for trial, wires in zip(planned, replayed(list(zip(planned, points, strict=True)), solver), strict=True):
        seen, voxel = [], trial.voxel_mm
        for frame, wire in zip(trial.seen, wires, strict=True):
            if not wire.converged:
                depth = frame.curve.length_mm
                raise ValueError(f"case {trial.name!r}: {depth:g} mm is not reached: {wire.sentence}")
            sigma = np.full(len(wire.joints_mm), TRACE_VOXELS * voxel)
            seen.append(replace(frame, curve=Curve(wire.joints_mm, sigma, TIP_VOXELS * voxel)))
        force = None if trial.force_N is None else np.array([wire.push_force_N for wire in wires])
        found.append(Evidence(replace(trial, seen=tuple(seen), force_N=force)))
    problem = Problem(tuple(free), {}, tuple(found), solver)
    x = np.concatenate([[shared[u.name] for u in free], np.zeros(len(problem.prior[0]) - len(free))])
    return Fit(problem, problem.linear(x), ())
