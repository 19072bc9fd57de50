"""What a fit gave each insertion of its own: where its wire is held, how far its walls lie, how it was turned.

Of a lumen 10 % too narrow all walls are moved away by as much: the wires meet the traces, and no run has these walls.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
from scipy.special import ndtri

from pipeline.calibrate.search import Fit
from pipeline.calibrate.trials import OWN

BEYOND = 3.0
"""Least prior standard deviations beyond which a number is told: a right statement is so in one of 370 cases."""
EACH = 2.0
"""The same of each of the numbers on which all insertions agree, which are beyond 3 on average."""
RIGHT_TOLD = 0.01
"""Most of right studies of which some number is told by itself: beyond 3 each it was up to 9 % with 5 insertions."""
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

    insertion : its cases.     prior_sd : 0 where it is stated as exact.     beyond : whether it is too far from what is
    stated.
    """

    insertion: str
    of: str
    how: str
    value: float
    sd: float
    prior_sd: float
    beyond: bool = False

    @property
    def alike(self) -> tuple[str, str, bool]:
        """What insertions agree on: what was moved, how, and to which side."""
        return self.of, self.how, self.value > 0.0

    @property
    def times(self) -> float:
        """How far it is from what is stated, in standard deviations of its prior; 0 where it is stated as exact."""
        return abs(self.value) / self.prior_sd if self.prior_sd > 0.0 else 0.0


def limit_of(numbers: int) -> float:
    """Prior standard deviations beyond which one of so many numbers is told by itself."""
    return max(BEYOND, float(-ndtri(0.5 * RIGHT_TOLD / max(numbers, 1))))


def moved_of(fit: Fit) -> list[Moved]:
    """All numbers of every insertion; without the roll where none is stated.

    What all insertions have to one side, beyond 3 on average, is told however many numbers there are: walls of a lumen
    10 % too narrow are at 3.1. Of what they share, as the lumen, chance puts it there in one study of 370.
    """
    every, insertions = _numbers(fit), len(fit.problem.insertions)
    limit = limit_of(sum(one.prior_sd > 0.0 for one in every))
    times = defaultdict[tuple[str, str, bool], list[float]](list)
    for one in every:
        if one.times > EACH:
            times[one.alike].append(one.times)
    agreed = {alike for alike, far in times.items() if len(far) == insertions > 1 and np.mean(far) > BEYOND}
    return [replace(one, beyond=one.times > limit or one.alike in agreed) for one in every]


def _numbers(fit: Fit) -> list[Moved]:
    """The numbers, before they are judged."""
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
    said, beyond = [], [one for one in moved_of(fit) if one.beyond]
    for of, how in NUMBERS:
        for these in ([one for one in beyond if one.alike == (of, how, up)] for up in (False, True)):
            if these:
                agree = "all insertions agree: " if len(these) == len(fit.problem.insertions) > 1 else ""
                said.append(f"{_told(these)}: {agree}{_advice(these[0])}")
    return said


def _told(these: Sequence[Moved]) -> str:
    """What was moved, and by how much in which insertions, those of one prior together."""
    first = these[0]
    unit = "mm" if first.of in (ENTRY, WALL) else "degrees"
    what = "the walls were moved" if first.of == WALL else f"{first.of} was moved ({first.how})"
    parts = []
    for prior, group in groupby(sorted(these, key=_prior), _prior):
        same = list(group)
        each = ", ".join(f"{one.value:.2g}" for one in same)
        parts.append(f"by {each} {unit} in {', '.join(one.insertion for one in same)} (prior 0 +- {prior})")
    return f"{what} {', '.join(parts)}"


def _prior(one: Moved) -> str:
    """Its prior's standard deviation as it is told."""
    return f"{one.prior_sd:.2g}"


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
