"""The search for the least objective while the roll is unknown: rolls all around without friction, the best refined."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.calibrate.fit import Linear, Problem
from pipeline.calibrate.residuals import Evidence
from pipeline.calibrate.trials import OWN
from pipeline.calibrate.unknowns import BENDING, FRICTION, ROLL, Unknown
from pipeline.model import Array
from pipeline.simulate.config import SolverConfig

ROLLS_DEG = np.arange(-180.0, 180.0, 15.0)
MOST_STARTS, FIRST_ROUNDS = 3, 4
AS_GOOD = 4.0
"""Rise of the objective, minus twice the log-posterior, up to which another roll is as good."""
FIRST_FRICTION = 0.03
"""Friction starts no lower than this: 0 is the end of its range, where its derivative is one-sided."""


@dataclass(frozen=True, eq=False)
class Fit:
    """The problem and its solution.     starts : roll, degrees, and objective of each start that was followed."""

    problem: Problem
    linear: Linear
    starts: tuple[tuple[float, float], ...]

    @property
    def values(self) -> dict[str, float]:
        """Shared parameters by name, held ones included."""
        return self.problem.held | self.problem.named(self.linear.x)

    @property
    def sd(self) -> dict[str, float]:
        """Standard deviations of the free parameters."""
        return self.problem.named(np.sqrt(np.diag(self.linear.covariance)))


def fitted(free: Sequence[Unknown], evidence: Sequence[Evidence], solver: SolverConfig) -> Fit:
    """The parameters at which the solver's wires lie nearest to the traces."""
    slippery = tuple(u for u in free if u.name not in (FRICTION, BENDING))
    first = Problem(slippery, {FRICTION: 0.0}, tuple(evidence), solver)
    followed = [first.solved(x, FIRST_ROUNDS) for x in _starts(first)]
    best, starts = _best(first, followed, [u.name for u in slippery].index(ROLL))
    whole = Problem(tuple(free), {}, tuple(evidence), solver)
    known = first.named(best.x)
    begin = [known.get(u.name, max(u.prior, FIRST_FRICTION) if u.name == FRICTION else u.prior) for u in free]
    return Fit(whole, whole.solved(np.concatenate([begin, best.x[len(slippery) :]])), starts)


def _best(problem: Problem, solved: Sequence[Linear], roll: int) -> tuple[Linear, tuple[tuple[float, float], ...]]:
    """The solution of least objective, and of each its roll, the entry ``roll`` of a vector, and its objective.

    Each has a scale of its own: they are compared at a common one.
    """
    ends = problem.residuals([one.x for one in solved], problem.even, min(one.scale for one in solved))
    values = [problem.value(one.x, r) for one, r in zip(solved, ends, strict=True)]
    starts = tuple((float(one.x[roll]), value) for one, value in zip(solved, values, strict=True))
    return solved[int(np.argmin(values))], starts


def held_at_prior(fit: Fit, names: Sequence[str]) -> Fit:
    """The fit again, with some parameters held at what the manifest states."""
    keep = [k for k, u in enumerate(fit.problem.free) if u.name not in names]
    held = {u.name: u.prior for u in fit.problem.free if u.name in names}
    problem = replace(fit.problem, free=tuple(fit.problem.free[k] for k in keep), held=fit.problem.held | held)
    x = np.concatenate([fit.linear.x[keep], fit.linear.x[len(fit.problem.free) :]])
    return Fit(problem, problem.solved(x), fit.starts)


def roll_fitted(one: Evidence, friction: float, solver: SolverConfig) -> Fit:
    """The roll at which one wire lies as it was traced; all else but the clamp is as stated."""
    problem = Problem((), {FRICTION: friction}, (one,), solver)
    still = replace(problem, held={FRICTION: 0.0})
    means, _ = problem.prior
    xs = [np.where(np.arange(len(means)) == OWN - 1, roll, means) for roll in ROLLS_DEG]
    found = np.array([float(own[0] @ own[0]) for own in still.residuals(xs, still.even, 1.0)])
    return Fit(problem, *_best(problem, [problem.solved(xs[k]) for k in _valleys(found)], OWN - 1))


@dataclass(frozen=True)
class OwnRoll:
    """The roll of one insertion, degrees, its standard deviation, and other rolls that fit as well."""

    roll_deg: float
    sd_deg: float
    rivals_deg: tuple[float, ...]


def own_roll(fit: Fit) -> OwnRoll:
    """What ``roll_fitted`` found."""
    roll, least = min(fit.starts, key=lambda start: start[1])
    sd = float(np.sqrt(fit.linear.covariance[OWN - 1, OWN - 1]))
    as_good = [other for other, value in fit.starts if value - least < AS_GOOD]
    rivals = [other for other in as_good if abs((other - roll + 180.0) % 360.0 - 180.0) > max(3.0 * sd, 1.0)]
    return OwnRoll(roll, sd, tuple(rivals))


def _valleys(values: Array) -> list[int]:
    """Indices of the lowest local minima of values (n,) on a circle, the lowest first, at most MOST_STARTS."""
    low = [k for k in range(len(values)) if values[k] <= min(values[k - 1], values[(k + 1) % len(values)])]
    return sorted(low, key=lambda k: float(values[k]))[:MOST_STARTS]


def _starts(problem: Problem) -> list[Array]:
    """Vectors to begin with: everything as stated, but rolls from where the objective has its lowest local minima."""
    means, _ = problem.prior
    if not any(one.trial.wire.curved for one in problem.evidence):
        return [means]
    at = [u.name for u in problem.free].index(ROLL)
    xs = []
    for roll in ROLLS_DEG:
        x = means.copy()
        x[at] = roll
        for one, part in zip(problem.evidence, problem.parts, strict=True):
            x[part[OWN - 1]] = roll if one.trial.roll_free else 0.0
        xs.append(x)
    found = problem.residuals(xs, problem.even, 1.0)
    each = np.array([[float(r @ r) for r in own] for own in found])
    free = np.array([one.trial.roll_free for one in problem.evidence])
    together = each[:, ~free].sum(axis=1)
    chosen = []
    valleys = _valleys(together)
    for k in valleys[:1] if free.all() else valleys:  # no insertion asks for a common roll: all starts would be one
        x = xs[k].copy()
        for cases in problem.insertions:
            if free[cases[0]]:
                x[problem.parts[cases[0]][OWN - 1]] = ROLLS_DEG[int(np.argmin(each[:, cases].sum(axis=1)))]
        chosen.append(x)
    return chosen
