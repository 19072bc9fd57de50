"""95 % intervals over insertions: what further insertions of the same kind would give.

Frames of one insertion resemble each other, so the unit is the insertion: frames resampled one by one, or in blocks of
one insertion, cover the true value in 36 to 93 % of repetitions. All is done on logarithms, since mean squares are
skew. Each end of an interval is the wider one of two: the delete-one jackknife with Student's t (Miller, Biometrika 61,
1974), and Cox's for the mean of a log-normal quantity (Land, Technometrics 14, 1972), here of the ratio of two of them;
of a median Student's from the spread of the insertions' own medians. With 3, 6 or 20 insertions that covers in 92 to
98 % where insertions have 25 frames or more, and less often where they are shorter and some frames are far off
(``tests/studies/interval_coverage.py`` has the conditions).
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.special import stdtrit

from pipeline.model import Array
from reports.case_files import counted

FEWEST, WIDE_BELOW = 3, 6
"""Fewest insertions for an interval, and the number below which it is wide, and its note says "only"."""
SMALLEST_MM = 1e-6
SMALLEST_MM2 = SMALLEST_MM**2
"""Used in place of an error and a mean square of 0, which have no logarithm: a nanometre is far below any scan."""
WIDEST = 2.0 * float(np.log(1e6))
"""Largest end of an interval of the logarithm of a mean square, or of a ratio of two; beyond it an end counts as not
bounded. Insertions of which one has no error and another one millimetres would put it anywhere up to 1e300."""


class Interval(NamedTuple):
    """The two ends; NaN where there is none, infinite where it is not bounded."""

    low: float
    high: float


WITHHELD = Interval(float("nan"), float("nan"))


def note(insertions: int) -> str:
    """The note on an interval over so many insertions; whether there is an interval depends on their number alone."""
    what = counted(insertions, "insertion")
    if insertions < FEWEST:
        return f"interval withheld: {what}, at least {FEWEST} needed"
    return f"from {what} only" if insertions < WIDE_BELOW else f"over {what}"


def in_words(low: float, high: float, said: str) -> str:
    """An interval and its note as text; an end that is not bounded is left out."""
    bounded = np.isfinite(low), np.isfinite(high)
    least, most = (f"{end:.3f}" if abs(end) >= 0.0005 or end == 0 else f"{end:.1g}" for end in (low, high))
    middle, below, above = f"{least} to {most}", f"up to {most}", f"{least} and more"
    ends = {(True, True): middle, (False, True): below, (True, False): above}.get(bounded)
    return f"95 %: {ends}, {said}" if ends else said


def fields(values: Mapping[str, Any], said: str = "") -> tuple[dict[str, Any], str]:
    """Values as fields of a row, ends that are not bounded as NaN, and the interval's note, which names these ends."""
    names = [name for name, value in values.items() if isinstance(value, float) and np.isinf(value)]
    told = [said] * bool(said) + [f"not bounded: {', '.join(names)}"] * bool(names)
    return {**values, **dict.fromkeys(names, float("nan"))}, "; ".join(told)


def holding(value: float, low: float, high: float) -> Interval:
    """The interval, widened to hold its value, which may be pooled in another way or differ in the last digit."""
    return Interval(min(low, value), max(high, value))


def of_log_ratio(over: Array, under: Array, points: Array, *, rest: Array | None = None) -> Interval:
    """Interval of log(sum of ``over`` / sum of ``under``).

    over, under, points : (insertions,), of which the last are the numbers of points. With the numbers of points as
    ``under``, it is the interval of the logarithm of a mean square. Cox's interval takes both sums per point, so that
    insertions of different lengths do not widen it.
    rest : (2, insertions) both sums with one insertion left out, each in turn; needed where the sum over the others
    changes when one is left out, since that one has a part in their values.
    """
    count = len(points)
    if count < FEWEST:
        return WITHHELD
    least = points * SMALLEST_MM2
    plain, (over, under) = _log_of_totals(over, under), (np.maximum(sums, least) for sums in (over, under))
    whole = float(np.log(over.sum() / under.sum()))
    # one insertion may be so far off that the others are lost in the rounding of the sum
    sums = np.array([over, under])
    rest = np.maximum(sums.sum(axis=1, keepdims=True) - sums if rest is None else rest, least.sum() - least)
    left_out = np.log(rest[0] / rest[1])
    jackknife = np.sqrt((count - 1) / count * np.sum((left_out - left_out.mean()) ** 2))
    a, b = np.log(over / points), np.log(under / points)
    (aa, ab), (_, bb) = np.cov(a, b)
    centre = float(a.mean() - b.mean() + 0.5 * (aa - bb))
    # of two normal samples: variance of the difference of their means, and of half that of their variances
    cox = np.sqrt(max(aa + bb - 2 * ab, 0.0) / count + max(aa**2 + bb**2 - 2 * ab**2, 0.0) / (2 * (count - 1)))
    t = float(stdtrit(count - 1, 0.975))
    low, high = min(whole - t * jackknife, centre - t * cox), max(whole + t * jackknife, centre + t * cox)
    return _bounded(holding(plain, low, high))


def root_ratio(over: Array, under: Array, points: Array) -> tuple[float, float, float]:
    """Root of the sum of ``over`` / the sum of ``under``, with its interval: arguments as ``of_log_ratio``."""
    total = np.maximum([over.sum(), under.sum()], points.sum() * SMALLEST_MM2)
    value = float(np.sqrt(total[0] / total[1]))
    return value, *holding(value, *np.exp(0.5 * np.array(of_log_ratio(over, under, points))).tolist())


def _log_of_totals(over: Array, under: Array) -> float:
    """log(sum of ``over`` / sum of ``under``) without a lower limit: infinite with one sum of 0, NaN with two."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.log(over.sum()) - np.log(under.sum()))


def _bounded(ends: Interval) -> Interval:
    """The ends of an interval of a logarithm of squares, those beyond WIDEST as infinite."""
    inf = float("inf")
    return Interval(-inf if ends.low < -WIDEST else ends.low, inf if ends.high > WIDEST else ends.high)


def of_medians(values: Sequence[Array]) -> Interval:
    """Interval of the median of all values, (n,) of each insertion: about it, on logarithms, the wider one of two.

    Both have Student's t: one with the delete-one jackknife, which alone covers in 86 to 94 %, one with the spread of
    the insertions' own medians (90 to 96 %); the wider covers in 94 to 98 % with 3 to 20 insertions of 4 to 30 frames.
    """
    count = len(values)
    if count < FEWEST:
        return WITHHELD
    others = [np.concatenate([own for k, own in enumerate(values) if k != n]) for n in range(count)]
    whole, logs, left_out = (_log_medians(of) for of in ([np.concatenate(values)], values, others))
    jackknife = np.sqrt((count - 1) / count * np.sum((left_out - left_out.mean()) ** 2))
    reach = float(stdtrit(count - 1, 0.975) * max(jackknife, logs.std(ddof=1) / np.sqrt(count)))
    ends = _bounded(Interval(2.0 * (float(whole[0]) - reach), 2.0 * (float(whole[0]) + reach)))
    return holding(float(np.median(np.concatenate(values))), *np.exp(0.5 * np.array(ends)).tolist())


def _log_medians(values: Sequence[Array]) -> Array:
    """Logarithms (n,) of medians."""
    return np.log([max(float(np.median(own)), SMALLEST_MM) for own in values])


def effective_frames(values: Sequence[Array]) -> float:
    """The number of independent frames that would tell as much. values : (n,) of each insertion's frames, in order.

    The model: successive frames of an insertion are correlated, by one coefficient that is pooled over insertions and
    corrected for its bias of -(1 + 3 r) / n, and insertions differ from each other by a variance of their own. If all
    are equally long, each counts as one frame at least. NaN where no insertion has four frames.
    """
    own = [np.asarray(v, dtype=float) - np.mean(v) for v in values if len(v) > 3]
    if not own or not sum(float(v @ v) for v in own):
        return float("nan")
    frames, length = np.array([*map(len, values)]), float(np.mean([len(v) for v in own]))
    lag = sum(float(v[1:] @ v[:-1]) for v in own) / sum(float(v @ v) for v in own)
    r = float(np.clip((lag + 1 / length) / max(1 - 3 / length, 0.25), 0.0, 0.95))
    # variance of an insertion's mean, over that of its frames; these vary about it by what is left
    of_mean = np.array([_slower(int(n), r) / n for n in frames])
    within = sum(float(v @ v) for v in own) / sum(len(v) * max(1 - _slower(len(v), r) / len(v), 0.2) for v in own)
    means = np.array([np.mean(v) for v in values])
    between = max(float(means.var(ddof=1)) - within * float(of_mean.mean()), 0.0) if len(means) > 1 else 0.0
    shares = (frames / frames.sum()) ** 2
    told = (within + between) / float(shares @ (between + within * of_mean))
    return float(np.clip(told, 1.0, frames.sum()))


def _slower(count: int, r: float) -> float:
    """Variance of the mean of ``count`` values of an autoregressive series of lag-1 correlation ``r``, over that of as
    many independent ones: (1 + r) / (1 - r) of very many, and at most ``count``."""
    k = np.arange(1, count)
    return float(1.0 + 2.0 * np.sum((1.0 - k / count) * r**k))
