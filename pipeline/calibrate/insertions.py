"""What a fit gave each insertion of its own: where its wire is held, how far its walls lie, how it was turned.

Of a lumen 10 % too narrow all walls are moved away by as much: the wires meet the traces, and no run has these walls.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pipeline.calibrate.search import Fit
from pipeline.calibrate.trials import OWN

BEYOND = 3.0
"""Prior standard deviations beyond which a number is told: a right statement is so in one of 370 cases."""
ENTRY, DIRECTION, WALL, ROLL = "entry_mm", "entry_direction", "wall_mm", "roll_deg"
NUMBERS = (
    (ENTRY, "along the wire"),
    (ENTRY, "across, first axis"),
    (ENTRY, "across, second axis"),
    (DIRECTION, "to the first axis"),
    (DIRECTION, "to the second axis"),
    (WALL, "wire's surface to the wall"),
    (ROLL, "turned"),
)
"""The OWN numbers of an insertion: each by what is moved, and how."""
TOO_NARROW = "the lumen may be so much too narrow, or radius_mm too large"
TOO_WIDE = "the lumen may be so much too wide, or radius_mm too small"


@dataclass(frozen=True)
class Moved:
    """A number of one insertion, moved from what is stated, in mm or degrees.

    insertion : its cases.     prior_sd : 0 where it is stated as exact.
    """

    insertion: str
    of: str
    how: str
    value: float
    sd: float
    prior_sd: float


def moved_of(fit: Fit) -> list[Moved]:
    """All numbers of every insertion; without the roll where none is stated."""
    problem, found = fit.problem, list[Moved]()
    sigmas, deviations = problem.prior[1], np.sqrt(np.diag(fit.linear.covariance))
    for cases in problem.insertions:
        trials, part = [problem.evidence[i].trial for i in cases], problem.parts[cases[0]][:OWN]
        insertion = ", ".join(trial.name for trial in trials)
        for (of, how), k in zip(NUMBERS, part, strict=True):
            if of == ROLL and (trials[0].roll_free or not trials[0].wire.curved):
                continue
            unit = float(np.degrees(1.0)) if of == DIRECTION else 1.0
            value, sd, prior = (unit * float(numbers[k]) for numbers in (fit.linear.x, deviations, sigmas))
            found.append(Moved(insertion, of, how, value, sd * (prior > 0.0), prior))
    return found


def beyond_their_priors(fit: Fit) -> list[str]:
    """A warning of each number that insertions have far from what is stated."""
    every, said = moved_of(fit), []
    for of, how in NUMBERS:
        alike = [one for one in every if (one.of, one.how) == (of, how)]
        far = [one for one in alike if abs(one.value) > BEYOND * one.prior_sd > 0.0]
        for these in ([one for one in far if one.value < 0.0], [one for one in far if one.value > 0.0]):
            if these:
                agree = "all insertions agree: " if len(these) == len(alike) > 1 else ""
                said.append(_told(these) + agree + _advice(these[0]))
    return said


def _told(these: list[Moved]) -> str:
    """What was moved, and by how much."""
    first, each = these[0], ", ".join(f"{one.value:.2g}" for one in these)
    cases = ", ".join(one.insertion for one in these)
    if first.of == WALL:
        return f"the walls of {cases} were moved by {each} mm (prior 0 +- {first.prior_sd:.2g}): "
    unit = "mm" if first.of == ENTRY else "degrees"
    return f"{first.of} of {cases} was moved by {each} {unit}, {first.how} (prior 0 +- {first.prior_sd:.2g} {unit}): "


def _advice(one: Moved) -> str:
    if one.of == WALL:
        why = TOO_NARROW if one.value < 0.0 else TOO_WIDE
        return f"{why}; a run with these parameters has the walls as they are given"
    return f"check {one.of}"


def stated_as_exact(fit: Fit) -> Mapping[str, list[str]]:
    """Names of cases by what of them is stated as exact, and so is not fitted."""
    found: dict[str, list[str]] = {ENTRY: [], DIRECTION: [], ROLL: []}
    for trial in (one.trial for one in fit.problem.evidence):
        exact = {ENTRY: trial.prior.sigma_mm == 0.0, DIRECTION: trial.prior.direction_sigma_deg == 0.0}
        exact[ROLL] = trial.wire.curved and not trial.turned
        for name, held in exact.items():
            found[name] += [trial.name] * held
    return {name: cases for name, cases in found.items() if cases}
