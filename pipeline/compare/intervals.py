"""95 % intervals over insertions: what further insertions of the same kind would give.

Frames of one insertion resemble each other, so the unit is the insertion: frames resampled one by one, or in blocks of
one insertion, cover the true value in 36 to 93 % of repetitions. All is done on logarithms, since mean squares are
skew. Each end of an interval is the wider one of two: the delete-one jackknife with Student's t (Miller, Biometrika 61,
1974), and Cox's for the mean of a log-normal quantity (Land, Technometrics 14, 1972), here of the ratio of two of them.
With 3, 6 or 20 insertions that covers in 92 to 98 % (``tests/studies/interval_coverage.py`` has the conditions).
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import t as student

from pipeline.model import Array

FEWEST, WIDE_BELOW = 3, 6
"""Insertions without which there is no interval, and below which it says itself that it is wide."""
SMALLEST_MM = 1e-6
SMALLEST_MM2 = SMALLEST_MM**2
"""Stand for an error and a mean square of 0, whose logarithm there is none of: a nanometre is far below any scan."""
WIDEST = 2.0 * float(np.log(1e6))
"""Of the logarithm of a mean square, or of a ratio of two. An end beyond it is none: insertions of which one has an
error of nothing and another one of millimetres would put it anywhere up to 1e300."""


class Interval(NamedTuple):
    """The two ends; NaN where there is none, infinite where it is not bounded."""

    low: float
    high: float


WITHHELD = Interval(float("nan"), float("nan"))


def note(insertions: int) -> str:
    """What is to be said of an interval over so many insertions: whether there is one hangs on their number alone."""
    what = f"{insertions} insertion{'s' * (insertions != 1)}"
    if insertions < FEWEST:
        return f"interval withheld: {what}, at least {FEWEST} needed"
    return f"wide: {what}" if insertions < WIDE_BELOW else f"over {what}"


def in_words(low: float, high: float, said: str) -> str:
    """Ends and what was said of them, for a line of text; an end that nothing bounds is none."""
    bounded = np.isfinite(low), np.isfinite(high)
    middle, below, above = f"{low:.3f} to {high:.3f}", f"up to {high:.3f}", f"{low:.3f} and more"
    ends = {(True, True): middle, (False, True): below, (True, False): above}.get(bounded)
    return f"95 %: {ends}, {said}" if ends else said


def fields(values: Mapping[str, Any], said: str = "") -> tuple[dict[str, Any], str]:
    """Values as fields of a row, ends that nothing bounds empty, and what was said of the interval with their names."""
    names = [name for name, value in values.items() if isinstance(value, float) and np.isinf(value)]
    told = [said] * bool(said) + [f"not bounded: {', '.join(names)}"] * bool(names)
    return {**values, **dict.fromkeys(names, float("nan"))}, "; ".join(told)


def holding(value: float, low: float, high: float) -> Interval:
    """An interval that also holds its value, which may be pooled otherwise, or differ in the last digit."""
    return Interval(min(low, value), max(high, value))


def of_log_ratio(over: Array, under: Array, points: Array) -> Interval:
    """Of log(sum of ``over`` / sum of ``under``), each (insertions,), as are the numbers of ``points`` in them.

    With the points themselves as ``under`` it is that of the log mean square. Cox's takes both per point, so that an
    insertion's length is no part of how insertions differ.
    """
    count = len(points)
    if count < FEWEST:
        return WITHHELD
    least = points * SMALLEST_MM2
    plain, (over, under) = _log_of_totals(over, under), (np.maximum(sums, least) for sums in (over, under))
    whole = float(np.log(over.sum() / under.sum()))
    # one insertion may be so far off that the others are lost in the rounding of the sum
    rest, under_rest = (np.maximum(sums.sum() - sums, least.sum() - least) for sums in (over, under))
    left_out = np.log(rest / under_rest)
    jackknife = np.sqrt((count - 1) / count * np.sum((left_out - left_out.mean()) ** 2))
    a, b = np.log(over / points), np.log(under / points)
    (aa, ab), (_, bb) = np.cov(a, b)
    centre = float(a.mean() - b.mean() + 0.5 * (aa - bb))
    # of two normal samples: variance of the difference of their means, and of half that of their variances
    cox = np.sqrt(max(aa + bb - 2 * ab, 0.0) / count + max(aa**2 + bb**2 - 2 * ab**2, 0.0) / (2 * (count - 1)))
    t = float(student.ppf(0.975, count - 1))
    low, high = min(whole - t * jackknife, centre - t * cox), max(whole + t * jackknife, centre + t * cox)
    return _bounded(holding(plain, low, high))


def _log_of_totals(over: Array, under: Array) -> float:
    """Of the sums as they are: infinite where one of them alone is 0, NaN where both are."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.log(over.sum()) - np.log(under.sum()))


def _bounded(ends: Interval) -> Interval:
    """Ends of a logarithm (of squares), those beyond WIDEST infinite."""
    inf = float("inf")
    return Interval(-inf if ends.low < -WIDEST else ends.low, inf if ends.high > WIDEST else ends.high)


def of_medians(values: Sequence[Array]) -> Interval:
    """Of a median over insertions, from each one's values (n,): Student's t on the logarithms of their medians."""
    if len(values) < FEWEST:
        return WITHHELD
    logs = np.log([max(float(np.median(own)), SMALLEST_MM) for own in values])
    reach = float(student.ppf(0.975, len(logs) - 1) * logs.std(ddof=1) / np.sqrt(len(logs)))
    low, high = _bounded(Interval(2.0 * (logs.mean() - reach), 2.0 * (logs.mean() + reach)))
    return Interval(float(np.exp(0.5 * low)), float(np.exp(0.5 * high)))


def effective_frames(values: Sequence[Array]) -> float:
    """How many independent frames would tell as much: values (n,) of the frames of each insertion, in their order.

    Frames follow each other with one correlation (pooled, corrected for its bias of -(1 + 3 r) / n), insertions have a
    variance of their own. At least 1. NaN where nothing can be told: no insertion of four frames.
    """
    own = [np.asarray(v, dtype=float) - np.mean(v) for v in values if len(v) > 3]
    if not own or not sum(float(v @ v) for v in own):
        return float("nan")
    frames, length = sum(map(len, values)), float(np.mean([len(v) for v in own]))
    within = sum(float(v @ v) for v in own) / sum(len(v) - 1 for v in own)
    lag = sum(float(v[1:] @ v[:-1]) for v in own) / sum(float(v @ v) for v in own)
    r = float(np.clip((lag + 1 / length) / max(1 - 3 / length, 0.25), 0.0, 0.95))
    slower = (1 + r) / (1 - r)
    means = np.array([np.mean(v) for v in values])
    between = max(float(means.var(ddof=1)) - within * slower * len(means) / frames, 0.0) if len(means) > 1 else 0.0
    told = (within + between) / (between / len(means) + within * slower / frames)
    return float(np.clip(told, 1.0, frames))
