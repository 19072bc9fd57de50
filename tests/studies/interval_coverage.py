"""How often intervals over insertions hold the true value: ``python -m tests.studies.interval_coverage [REPETITIONS]``.

A frame's mean square is log-normal (its logarithm has a standard deviation of 0.8, as in the circle of Willis), follows
the frame before with a correlation, and shares a part of its variance with all frames of its insertion; one frame in
twenty is off by four times as much. The predictor's mean square is ten times as large and goes along, correlated 0.6.
"""

from __future__ import annotations

import itertools
import sys
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from pipeline.compare.intervals import of_log_ratio, of_medians
from pipeline.compare.nulls import ANOTHER
from pipeline.compare.pooled import Scored, skill

SEED = 100
SPREAD, OUTLIERS, LARGER, NULL, SHARED = 0.8, 0.05, 16.0, 10.0, 0.6
SIMULATOR = 0.4
WRONG, WRONG_BY = 0.2, 100.0
"""Share of insertions that lie in a wrong branch all along, and their mean square over the others'."""
APART, OWN = 0.5, 0.3
"""Standard deviations of the logarithm of insertions' mean squares: common to two runs, and of each run's own."""
RARELY, TWO_RUNS = (0.0, 0.1), (3, 4, 6, 8, 10, 15, 20, 40)
"""Shares of insertions that a run has in a wrong branch, and numbers of insertions."""
PARTNERS = (3, 4, 6, 20)
FEW = (3, 6, 12)
FRAMES, FEWER, MORE = 30, 10, 50
"""Frames of an insertion; where lengths are unequal, from the fewest to the most."""
SHORT = (3, 4, 5, 6, 8, 10, 15, 25, 30)
"""Frames of insertions that are short."""


@dataclass(frozen=True)
class Condition:
    """Correlation of neighbours, insertions, share of variance between them, unequal lengths, outliers."""

    lag: float
    insertions: int
    between: float
    unequal: bool
    outliers: bool
    frames: int = FRAMES

    @property
    def lengths(self) -> list[int]:
        ends = (FEWER, MORE) if self.unequal else (self.frames, self.frames)
        return [round(n) for n in np.linspace(*ends, self.insertions)]


CONDITIONS = [
    Condition(*c) for c in itertools.product((0.5, 0.8), (3, 6, 20), (0.0, 0.35), (False, True), (False, True))
]


def normal(draw: np.random.Generator, frames: int, c: Condition) -> np.ndarray:
    """Standard normal values (frames,) of one insertion."""
    steps = draw.normal(size=frames)
    steps[1:] *= np.sqrt(1 - c.lag**2)
    own = lfilter([1.0], [1.0, -c.lag], steps)
    return np.sqrt(1 - c.between) * own + np.sqrt(c.between) * draw.normal()


def covered(draw: np.random.Generator, c: Condition) -> tuple[bool, bool, bool]:
    """Whether mean square, its ratio to the predictor's, and median error of one draw hold the true value."""
    squares, nulls, points, errors = [], [], [], []
    for frames in c.lengths:
        first, count = normal(draw, frames, c), np.linspace(20, 130, frames)
        second = SHARED * first + np.sqrt(1 - SHARED**2) * normal(draw, frames, c)
        factor = np.where(draw.random(frames) < OUTLIERS * c.outliers, LARGER, 1.0)
        mean_square = np.exp(SPREAD * first - 0.5 * SPREAD**2) * factor
        errors.append(np.sqrt(np.exp(SPREAD * first)))
        points.append(count.sum())
        squares.append(mean_square @ count)
        nulls.append(NULL * np.exp(SPREAD * second - 0.5 * SPREAD**2) @ count)
    s, n, p = map(np.array, (squares, nulls, points))
    true = np.log(1 + OUTLIERS * c.outliers * (LARGER - 1))
    (a, b), (d, e), (f, g) = of_log_ratio(s, p, p), of_log_ratio(s, n, p), of_medians(errors)
    return bool(a <= true <= b), bool(d <= true - np.log(NULL) <= e), bool(f <= 1.0 <= g)


def coverage(c: Condition, repetitions: int) -> np.ndarray:
    """Shares (3,) of repetitions in which the interval of mean square, ratio and median holds the true value."""
    draw = np.random.default_rng([SEED, CONDITIONS.index(c)])
    return np.mean([covered(draw, c) for _ in range(repetitions)], axis=0)


def coverage_of_short(frames: int, repetitions: int, *, outliers: bool = True) -> np.ndarray:
    """The same (3,) with so few frames in each insertion, the least over 3, 6 and 20 insertions.

    Insertions do not differ otherwise. Short ones often hold no outlier, and nothing tells then how far off one is.
    """
    shares = []
    for insertions in (3, 6, 20):
        c = Condition(0.5, insertions, 0.0, False, outliers, frames)
        draw = np.random.default_rng([SEED, insertions, frames, 2])
        shares.append(np.mean([covered(draw, c) for _ in range(repetitions)], axis=0))
    return np.min(shares, axis=0)


def covered_by_partners(draw: np.random.Generator, insertions: int) -> bool:
    """The same of skill where the predictor is the other insertions, which differ by their rolls: all share each other.

    The roll is within 45 degrees, the predictor's error in proportion to the difference of two rolls, the simulator's
    log-normal.
    """
    roll = draw.uniform(-45.0, 45.0, insertions)
    squares = np.exp(SIMULATOR * draw.normal(size=insertions) - 0.5 * SIMULATOR**2)
    scored = []
    for n, mean_square in enumerate(squares):
        guesses = {str(m): (float((roll[n] - roll[m]) ** 2), 1) for m in range(insertions) if m != n}
        scored.append(Scored({}, np.array([np.sqrt(mean_square)]), np.zeros(1), str(n), guesses))
    nulls = np.array([np.mean([square for square, _ in frame.guesses.values()]) for frame in scored])
    found = skill(scored, squares, nulls, rival=ANOTHER)
    return bool(found["skill_strongest_low"] <= 1.0 - 1.0 / (2.0 * 45.0**2 / 3.0) <= found["skill_strongest_high"])


def coverage_by_partners(insertions: int, repetitions: int) -> float:
    """Share of repetitions in which the interval holds the true value."""
    draw = np.random.default_rng([SEED, insertions])
    return float(np.mean([covered_by_partners(draw, insertions) for _ in range(repetitions)]))


def coverage_with_failures(insertions: int, repetitions: int) -> float:
    """Share of repetitions in which the mean square's interval holds the true value where insertions fail as a whole.

    What such an insertion is like no other tells: where none of a sample has failed, the interval is about the others.
    """
    draw, held = np.random.default_rng([SEED, insertions, 1]), 0
    true = np.log(1.0 + WRONG * (WRONG_BY - 1.0))
    for _ in range(repetitions):
        squares = np.exp(SIMULATOR * draw.normal(size=insertions) - 0.5 * SIMULATOR**2)
        squares *= np.where(draw.random(insertions) < WRONG, WRONG_BY, 1.0)
        low, high = of_log_ratio(squares, np.ones(insertions), np.ones(insertions))
        held += bool(low <= true <= high)
    return held / repetitions


def false_verdicts(insertions: int, share: float, repetitions: int) -> float:
    """Share of repetitions in which the interval of the ratio calls one of two runs better that are equally good.

    Both have the insertions in common, and each errors of its own; it lies in a wrong branch in a ``share`` of them.
    """
    draw, found = np.random.default_rng([SEED, insertions, round(1e3 * share)]), 0
    for _ in range(repetitions):
        common = np.exp(APART * draw.normal(size=insertions))
        wrong = np.where(draw.random((2, insertions)) < share, WRONG_BY, 1.0)
        one, other = common * np.exp(OWN * draw.normal(size=(2, insertions))) * wrong
        low, high = of_log_ratio(one, other, np.ones(insertions))
        found += bool(low > 0.0 or high < 0.0)
    return found / repetitions


def main(repetitions: int = 4000) -> None:
    """Print a line for each condition, and the extremes."""
    print("lag  insertions  between  unequal  outliers   mean square   skill  median tip")
    table = []
    for c in CONDITIONS:
        table.append(coverage(c, repetitions))
        row = f"{c.lag:3.1f}  {c.insertions:10d}  {c.between:7.2f}  {c.unequal!s:7}  {c.outliers!s:8}"
        print(row + "   {:11.3f}  {:6.3f}  {:10.3f}".format(*table[-1]), flush=True)
    low, high = np.min(table, axis=0), np.max(table, axis=0)
    print(
        "from {:.3f} to {:.3f} (mean square), {:.3f} to {:.3f} (skill), {:.3f} to {:.3f} (median)".format(
            *np.column_stack([low, high]).ravel()
        )
    )
    for frames, outliers in itertools.product(SHORT, (True, False)):
        shares = coverage_of_short(frames, repetitions, outliers=outliers)
        of = f"{frames} frames each, with{'out' * (not outliers)} outliers"
        print(f"{of}: " + "{:.3f} (mean square), {:.3f} (skill), {:.3f} (median)".format(*shares), flush=True)
    for insertions in PARTNERS:
        share = coverage_by_partners(insertions, repetitions)
        print(f"skill against the other insertions, {insertions} of them: {share:.3f}", flush=True)
    for insertions in FEW:
        share = coverage_with_failures(insertions, repetitions)
        print(f"mean square, one insertion in five in a wrong branch, {insertions} of them: {share:.3f}", flush=True)
    for wrong, insertions in itertools.product(RARELY, TWO_RUNS):
        share = false_verdicts(insertions, wrong, repetitions)
        of = f"{insertions} insertions, {wrong:g} of them in a wrong branch"
        print(f"ratio of two runs as good, {of}: {share:.3f} are called better", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
