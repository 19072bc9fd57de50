"""What the traces show of every parameter: value, standard deviation, profile, and whether it is seen at all.

A parameter counts as seen where its standard deviation is small enough and the profile of the objective rises to both
sides: a wall that may be as stiff as it likes has a standard deviation only by accident. One that is known no better
stays as stated, unless the traces contradict what is stated: held there, it bends the others.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.calibrate.agreement import no_common_roll, turned_alone
from pipeline.calibrate.fit import Linear, Problem
from pipeline.calibrate.residuals import Evidence
from pipeline.calibrate.search import Fit, fitted, held_at_prior
from pipeline.calibrate.segments import Segments, resolved
from pipeline.calibrate.trials import WALL_OFFSET, replayed
from pipeline.calibrate.unknowns import ROLL, Unknown, spread_in_words, two_digits
from pipeline.model import Array
from pipeline.simulate.config import SolverConfig

OFFSETS = (-3.0, -2.0, -1.0, 1.0, 2.0, 3.0)
"""Offsets, in standard deviations, at which profiles are evaluated, beside +- the unknown's ``enough``."""
RISE = 1.0
"""Rise of the objective (minus twice the log-posterior) at one standard deviation."""
CONTRADICTED = 6.63
"""Rise of the objective from which the traces contradict a stated value: the 99 % point of chi-square of one degree of
freedom. The misfit is in the objective already, by its scale. With 95 %, of four right statements one would be
contradicted in every fifth study; what a wrong one may do to the others is limited by BENT."""
BENT = 2.0
"""Most by which parameters held as stated may move one that is seen, in its standard deviations."""


@dataclass(frozen=True)
class Estimate:
    """A parameter. value : as fitted; used : by runs, the prior where it is not seen.

    sd : of the posterior, of a seen one about ``used``.     profile : (value, rise of the objective with all others
    following), the stated value among them.     why : the reason where it is not seen, or what is not known of one
    that is taken because the traces contradict what is stated.
    """

    unknown: Unknown
    value: float
    sd: float
    used: float
    seen: bool
    why: str
    profile: tuple[tuple[float, float], ...]


@dataclass(frozen=True, eq=False)
class FrameError:
    """Root mean square distance of a frame's wire to its trace, across, mm: as stated and as calibrated.

    as_given_mm : as calibrated, but with the walls where they are given, nothing else following.     turned : whether
    its insertion was turned for itself: "in_both", "as_calibrated" alone, or empty.
    """

    case: str
    frame: int
    depth_mm: float
    before_mm: float
    after_mm: float
    as_given_mm: float
    weight: float
    turned: str


@dataclass(frozen=True, eq=False)
class Calibration:
    """Parameters, their correlations (of those that were free at first), errors of each frame, and the fit.

    scale : factor on the traces' covariance that the residuals ask for; it sets their size where traces state none.
    apart : why the insertions have no common roll, empty where they have.
    """

    estimates: tuple[Estimate, ...]
    correlation: Array
    frames: tuple[FrameError, ...]
    fit: Fit
    scale: float
    segments: Segments
    apart: str = ""

    @property
    def values(self) -> dict[str, float]:
        """Parameters by name as runs take them."""
        return self.fit.values

    @property
    def contradicted(self) -> tuple[Estimate, ...]:
        """Those that are known too little to be seen, and taken because the traces contradict what is stated."""
        return tuple(e for e in self.estimates if e.seen and e.why)


def calibrated(free: Sequence[Unknown], evidence: Sequence[Evidence], solver: SolverConfig) -> Calibration:
    """Fit everything; what is not seen stays at its prior and the rest is fitted again.

    Insertions that want no common roll have each its own in all that is found: under one that is wrong for each of
    them a taper of 1 came out as 0.76 to 1.5, by up to 6.5 of its standard deviations.
    """
    apart: dict[str, str] = {}

    def fit_with(settings: SolverConfig) -> Fit:
        whole = fitted(free, evidence, settings)
        apart[ROLL] = no_common_roll(whole)
        return fitted(free, [turned_alone(one) for one in evidence], settings) if apart[ROLL] else whole

    whole, segments = resolved(fit_with, evidence[0].trial.wire, solver)
    profiles = profiles_of(whole)
    found = [_judged(u, whole, p, apart.get(u.name, "")) for u, p in zip(whole.problem.free, profiles, strict=True)]
    found, last = _with_the_stated(whole, found, no_roll=bool(apart[ROLL]))
    n, about = len(whole.problem.free), _about(whole, last)
    covariance = about.covariance[:n, :n]
    deviations = np.sqrt(np.diag(covariance))
    estimates = tuple(
        replace(e, used=last.values[e.unknown.name], sd=float(sd) if e.seen else e.sd)
        for e, sd in zip(found, deviations, strict=True)
    )
    correlation = covariance / np.outer(deviations, deviations)
    errors = tuple(_errors(last, evidence))
    return Calibration(estimates, correlation, errors, last, last.linear.scale, segments, apart[ROLL])


def _with_the_stated(whole: Fit, found: list[Estimate], *, no_roll: bool) -> tuple[list[Estimate], Fit]:
    """The estimates, and the fit again with what is not seen held as stated.

    Where that moves what is seen by more than BENT, it is contradicted though each alone is not: only a roll that is
    not common is held then.
    """
    unseen = [e.unknown.name for e in found if not e.seen]
    last = held_at_prior(whole, unseen) if unseen else whole
    moved = [e.unknown.name for e in found if e.seen and abs(last.values[e.unknown.name] - e.value) > BENT * e.sd]
    held = [ROLL] if no_roll else []
    if not moved or unseen == held:
        return found, last
    why = f"as stated it moves {', '.join(moved)} by more than {BENT:g} standard deviations"
    taken = [e if e.seen or e.unknown.name in held else _contradicted(e, why) for e in found]
    return taken, held_at_prior(whole, held) if held else whole


def _about(whole: Fit, last: Fit) -> Linear:
    """All parameters linearised at what is used, where the misfit is another than that of the free fit.

    With a taper held far off, the rest curvature beside it had the 3.3 % of the free fit, and was 3 of them off.
    """
    if last is whole:
        return whole.linear
    used = [last.values[u.name] for u in whole.problem.free]
    return whole.problem.linear(np.concatenate([used, last.linear.x[len(last.problem.free) :]]))


def _judged(unknown: Unknown, fit: Fit, profile: tuple[tuple[float, float], ...], apart: str = "") -> Estimate:
    """The estimate of a parameter, which says whether it is seen and, if not, why. apart : that no value is common."""
    value, sd = fit.values[unknown.name], fit.sd[unknown.name]
    why = apart or _unseen(unknown, value, sd, profile)
    found = Estimate(unknown, value, sd, value, not why, why, profile)
    rise = max((rise for v, rise in profile if v == unknown.prior), default=0.0)
    if apart or not why or not rise > CONTRADICTED:
        return found
    return _contradicted(found, f"there the objective is higher by {two_digits(rise)}")


def _contradicted(e: Estimate, why: str) -> Estimate:
    """A parameter that is not seen, taken as fitted: the traces contradict what is stated. why : how that shows."""
    stated = f"the traces contradict the stated {e.unknown.shown(e.unknown.prior):.3g}: {why}"
    return replace(e, seen=True, why=f"{stated}; {e.why}")


def _unseen(unknown: Unknown, value: float, sd: float, profile: tuple[tuple[float, float], ...]) -> str:
    """Why the traces do not show a parameter; empty where they do."""
    near = [(v, rise) for v, rise in profile if abs(abs(v - value) - unknown.enough) < 1e-6 * unknown.enough]
    flat = [v for v, rise in near if not rise >= RISE]
    if sd > unknown.enough:
        known, enough = (spread_in_words(s, logarithmic=unknown.logarithmic) for s in (sd, unknown.enough))
        return f"known to {known} only; {enough} or less counts as seen"
    if flat:
        return f"the objective hardly rises towards {', '.join(f'{unknown.shown(v):.3g}' for v in flat)}"
    if unknown.at_an_end(value):
        return unknown.end_told(value)
    return ""


def profiles_of(fit: Fit) -> list[tuple[tuple[float, float], ...]]:
    """For each free parameter the rise of the objective at values of it, all other numbers following.

    They follow along the covariance, then by one Gauss-Newton step with the residuals there and the minimum's
    derivatives.
    """
    linear, problem, covariance = fit.linear, fit.problem, fit.linear.covariance
    asked: list[tuple[int, Array]] = []
    for k, unknown in enumerate(problem.free):
        spread = float(np.sqrt(covariance[k, k]))
        offsets = (-unknown.enough, *(n * spread for n in OFFSETS), unknown.enough)
        for value in (*(linear.x[k] + offset for offset in offsets), unknown.prior):
            if unknown.low <= value <= unknown.high:
                along = covariance[:, k] / covariance[k, k] * (value - linear.x[k])
                asked.append((k, problem.clipped(linear.x + along)))
    first = problem.residuals([x for _, x in asked], linear.weights, linear.scale)
    second = [_followed(problem, linear, k, x, r) for (k, x), r in zip(asked, first, strict=True)]
    again = problem.residuals(second, linear.weights, linear.scale)
    found: list[list[tuple[float, float]]] = [[] for _ in problem.free]
    for (k, x), r, y, s in zip(asked, first, second, again, strict=True):
        least = min(problem.value(x, r), problem.value(y, s))
        found[k].append((float(x[k]), least - linear.value))
    return [tuple(own) for own in found]


def _followed(problem: Problem, linear: Linear, fixed: int, x: Array, residual: Sequence[Array]) -> Array:
    """The vector after one Gauss-Newton step of all its entries but one.

    What the step takes beyond its bounds stays there, and the others follow that: clipped at the end, they followed a
    friction below 0, and a taper one standard deviation off was told as three.
    """
    right = problem.precision * (problem.prior[0] - x)
    for jacobian, r in zip(linear.jacobian, residual, strict=True):
        right = right + jacobian.T @ r
    held, moved = np.arange(len(x)) == fixed, x
    for _ in x:  # each turn but the last holds one more
        pull = right - linear.normal[:, held] @ (moved - x)[held]
        moved = np.where(held, moved, 0.0)
        moved[~held] = x[~held] + np.linalg.solve(linear.normal[np.ix_(~held, ~held)], pull[~held])
        inside = problem.clipped(moved)
        if np.array_equal(inside, moved):
            return moved
        held, moved = held | (inside != moved), inside
    return x  # nothing follows residuals that are no numbers


def _errors(last: Fit, evidence: Sequence[Evidence]) -> list[FrameError]:
    """Errors of all frames with the clamps fitted to stated and to calibrated parameters. evidence : as stated."""
    free = {u.name: u.prior for u in last.problem.free}
    stated = Problem((), last.problem.held | free, tuple(evidence), last.problem.solver)
    before = stated.solved(np.zeros(len(stated.prior[0])))
    found: list[FrameError] = []
    for n, one in enumerate(last.problem.evidence):
        turned = "in_both" if evidence[n].trial.turned else "as_calibrated" * one.trial.turned
        points = [p.points(x)[n] for p, x in ((stated, before.x), (last.problem, last.linear.x))]
        as_given = replace(points[1], own=np.where(np.arange(len(points[1].own)) == WALL_OFFSET, 0.0, points[1].own))
        pairs = [(one.trial, point) for point in (*points, as_given)]
        wires = replayed(pairs, last.problem.solver)
        rows = [one.rows(own, point) for own, (_, point) in zip(wires, pairs, strict=True)]
        for i, (run, seen) in enumerate(zip(one.runs, one.trial.seen, strict=True)):
            squares = [np.sum(r.across_mm[run] ** 2, axis=1) if r.rests[i] else np.nan for r in rows]
            rms = [float(np.sqrt(np.mean(some))) for some in squares]
            weight = float(last.linear.weights[n][i])
            here = one.trial.name, seen.index, seen.curve.length_mm
            found.append(FrameError(*here, rms[0], rms[1], rms[2], weight, turned))
    return found
