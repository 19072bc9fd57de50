"""Levenberg-Marquardt over all insertions at once: shared parameters, and each insertion's clamp, wall and depths.

Derivatives are difference quotients of whole insertions, which are simulated side by side.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from pipeline.calibrate.residuals import Evidence, Rows, weights_of
from pipeline.calibrate.trials import OWN, OWN_STEPS, Point, replayed
from pipeline.calibrate.unknowns import ROLL, WALL, Unknown
from pipeline.model import Array
from pipeline.simulate.clamp import STEP_DEPTH_MM
from pipeline.simulate.config import SolverConfig
from solver import Solution

ROUNDS, SETTLED = 12, 0.15
"""Most rounds; it ends where a step is smaller than this part of the standard deviations."""
DAMPINGS = (1.0, 10.0)
"""Tried side by side, in units of the present damping."""
Entries = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Linear:
    """The problem linearised at a vector x (p,): whitened residuals and derivatives of every insertion, weights, scale.

    normal : normal matrix (p, p) with the priors.     right : (p,), minus half the gradient.     value : of the
    objective.
    """

    x: Array
    residual: list[Array]
    jacobian: list[Array]
    normal: Array
    right: Array
    value: float
    weights: list[Array]
    scale: float

    @property
    def covariance(self) -> Array:
        """Covariance (p, p) of the posterior."""
        return np.asarray(np.linalg.inv(self.normal))


@dataclass(frozen=True, eq=False)
class Problem:
    """What is fitted: the free unknowns, the values of the others, the insertions.

    A vector holds the free unknowns, then OWN numbers of every insertion and a depth for each of its frames. Cases of
    one insertion have those OWN numbers in common: taken for three, one had its roll known by the root of 3 too well.
    """

    free: tuple[Unknown, ...]
    held: dict[str, float]
    evidence: tuple[Evidence, ...]
    solver: SolverConfig

    @property
    def stated(self) -> bool:
        """Whether every insertion has traces that state their standard deviations."""
        return all(one.stated for one in self.evidence)

    @property
    def insertions(self) -> list[list[int]]:
        """For each insertion the positions of its cases in ``evidence``."""
        found: dict[object, list[int]] = {}
        for i, one in enumerate(self.evidence):
            found.setdefault(one.trial.insertion, []).append(i)
        return list(found.values())

    @cached_property
    def parts(self) -> list[Entries]:
        """For each case the entries (OWN + frames,) of a vector that are its own: its insertion's, then its depths."""
        first_of = {i: cases[0] for cases in self.insertions for i in cases}
        found, free = list[Entries](), len(self.free)
        for i, one in enumerate(self.evidence):
            count = len(one.trial.seen) + OWN * (first_of[i] == i)
            entries = np.arange(free, free + count)
            found.append(entries if first_of[i] == i else np.concatenate([found[first_of[i]][:OWN], entries]))
            free += count
        return found

    @cached_property
    def prior(self) -> tuple[Array, Array]:
        """Means and standard deviations (p,) of the priors: the least of what cases of one insertion state."""
        free = np.array([(u.prior, u.sd) for u in self.free]).reshape(-1, 2)
        count = 1 + max(int(part.max()) for part in self.parts) - len(free)
        means = np.concatenate([free[:, 0], np.zeros(count)])
        sigmas = np.concatenate([free[:, 1], np.full(count, np.inf)])
        for one, part in zip(self.evidence, self.parts, strict=True):
            sigmas[part] = np.minimum(sigmas[part], one.trial.sigmas)
        return means, sigmas

    @property
    def even(self) -> list[Array]:
        """Weights by which every frame counts as much."""
        return [np.ones(len(one.trial.seen)) for one in self.evidence]

    @property
    def precision(self) -> Array:
        """One over the priors' variances (p,); what is known exactly is held by a great one."""
        sigmas = self.prior[1]
        return 1.0 / np.where(sigmas > 0, sigmas, 1e-6) ** 2

    def points(self, x: Array) -> list[Point]:
        """A vector as one Point per case: the shared parameters and its own numbers."""
        return [Point(self.held | self.named(x), x[part]) for part in self.parts]

    def named(self, x: Array) -> dict[str, float]:
        """What a vector holds of the free unknowns, by name."""
        return {u.name: float(v) for u, v in zip(self.free, x, strict=False)}

    def clipped(self, x: Array) -> Array:
        """A vector with its free unknowns clipped to their bounds."""
        n = len(self.free)
        inside = np.clip(x[:n], [u.low for u in self.free], [u.high for u in self.free])
        return np.concatenate([inside, x[n:]])

    def residuals(self, xs: Sequence[Array], weights: list[Array], scale: float) -> list[list[Array]]:
        """Whitened residuals of each insertion at several vectors."""
        each = [self.points(x) for x in xs]
        pairs = [(one.trial, p) for points in each for one, p in zip(self.evidence, points, strict=True)]
        wires = iter(replayed(pairs, self.solver))
        return [self.left(list(islice(wires, len(points))), points, weights, scale) for points in each]

    def left(
        self, wires: Sequence[Sequence[Solution]], points: Sequence[Point], weights: Sequence[Array], scale: float
    ) -> list[Array]:
        """Whitened residuals of each case that wires, one list a case, leave."""
        each = zip(self.evidence, wires, points, weights, strict=True)
        rows = [(one, one.rows(own, point), weight) for one, own, point, weight in each]
        return [one.whitened(r.across_mm, np.nan_to_num(r.force_N), weight, scale) for one, r, weight in rows]

    def value(self, x: Array, residual: Sequence[Array]) -> float:
        """The objective: minus twice the logarithm of the posterior."""
        means, sigmas = self.prior
        free = sigmas > 0
        return float(sum(r @ r for r in residual) + np.sum(((x - means)[free] / sigmas[free]) ** 2))

    def columns(self, index: int) -> dict[int, float]:
        """Entries of a vector that move an insertion's wires, each with its step; not the depths, moved all at once."""
        part, sigmas = self.parts[index], self.prior[1]
        found = {k: u.step for k, u in enumerate(self.free) if self._concerns(u, index)}
        return found | {int(part[k]): OWN_STEPS[k] for k in range(OWN) if sigmas[part[k]] > 0}

    def _concerns(self, unknown: Unknown, index: int) -> bool:
        trial = self.evidence[index].trial
        if unknown.name == ROLL:
            return not trial.roll_free
        return not unknown.name.startswith(WALL) or unknown.stated_N_mm2 == trial.wall.stiffness_N_mm2

    def linear(self, x: Array) -> Linear:
        """The problem linearised at a vector, all its difference quotients simulated side by side."""
        pairs, steps = [], []
        for i, one in enumerate(self.evidence):
            part, columns = self.parts[i], self.columns(i)
            deeper = x + STEP_DEPTH_MM * np.isin(np.arange(len(x)), part[OWN:])
            changed = [x + step * (np.arange(len(x)) == k) for k, step in columns.items()]
            pairs += [(one.trial, self.points(v)[i]) for v in (x, *changed, deeper)]
            steps.append(columns)
        base, slopes = [], []
        simulated = zip(replayed(pairs, self.solver), (point for _, point in pairs), strict=True)
        for i, (one, columns) in enumerate(zip(self.evidence, steps, strict=True)):
            still = next(simulated)
            base.append(one.rows(*still))
            across, push = np.zeros((*base[-1].across_mm.shape, len(x))), np.zeros((len(base[-1].rests), len(x)))
            for k, step in columns.items():
                across[:, :, k], push[:, k] = one.slopes(still, next(simulated), step)
            change, more = one.slopes(still, next(simulated), STEP_DEPTH_MM)
            for f, run in enumerate(one.runs):
                entry = self.parts[i][OWN + f]
                across[run, :, entry], push[f, entry] = change[run], more[f]
            slopes.append((across, push))
        return self._assembled(x, base, slopes)

    def _assembled(self, x: Array, base: Sequence[Rows], slopes: Sequence[tuple[Array, Array]]) -> Linear:
        """The normal equations from the residuals ``base`` and the derivatives ``slopes`` of each insertion."""
        surprise = [one.surprise(rows) for one, rows in zip(self.evidence, base, strict=True)]
        weights, scale = weights_of(surprise, stated=self.stated)
        normal, right = np.diag(self.precision), self.precision * (self.prior[0] - x)
        jacobians, residuals = list[Array](), list[Array]()
        for one, rows, (across, push), weight in zip(self.evidence, base, slopes, weights, strict=True):
            r = one.whitened(rows.across_mm, np.nan_to_num(rows.force_N), weight, scale)
            j = one.whitened(across, push, weight, scale)
            normal, right = normal + j.T @ j, right + j.T @ r
            jacobians.append(j)
            residuals.append(r)
        return Linear(x, residuals, jacobians, normal, right, self.value(x, residuals), weights, scale)

    def solved(self, x: Array, rounds: int = ROUNDS) -> Linear:
        """The problem linearised at the vector of least objective, found from the vector ``x``."""
        damping = 1e-3
        about = self.linear(self.clipped(x))
        for _ in range(rounds):
            n, deviations = len(self.free), np.sqrt(np.diag(about.covariance))
            damped = [about.normal + damping * d * np.diag(np.diag(about.normal)) for d in DAMPINGS]
            tried = [self.clipped(about.x + np.linalg.solve(m, about.right)) for m in damped]
            values = [
                self.value(v, r) for v, r in zip(tried, self.residuals(tried, about.weights, about.scale), strict=True)
            ]
            best = int(np.argmin(values))
            if not values[best] < about.value:
                damping *= 30.0
                if damping > 1e4:
                    break
                continue
            damping = max(damping * (0.1 if best == 0 else 3.0), 1e-6)
            step, fell = tried[best] - about.x, about.value - values[best]
            about = self.linear(tried[best])
            if np.all(np.abs(step[:n]) < SETTLED * deviations[:n]) and fell < 1.0:
                break
        return about
