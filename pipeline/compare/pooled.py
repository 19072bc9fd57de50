"""Pooled statistics of a case and their block-bootstrap intervals.

Points are pooled, RMSEs never averaged. Neighbouring frames of one insertion are not independent, so the bootstrap
resamples blocks: cases (groups) where there are several, runs of consecutive frames within a single case.
"""

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.compare.metrics import OF_POINTS
from pipeline.model import Array
from pipeline.status import FrameStatus
from reports.schema import ERRORS

SEED = 20021  # of the bootstrap: the same result files give the same intervals
Row = Mapping[str, Any]
"""A row of errors.csv: values by the names of its columns; what does not apply is NaN, None or absent."""


def is_pooled(row: Row, error_mm: Array | None) -> bool:
    """Whether a frame counts: it is ok and compared.

    This is the one population: summary.csv, the last line, ``overall`` in run.json and every figure of a case pool over
    these frames and no others.
    """
    return row["status"] == FrameStatus.OK.identifier and error_mm is not None and len(error_mm) > 0


def skill_of(rms_mm: float, null_mm: float) -> float:
    """Mean-square skill score 1 - (rms / null)^2 (Murphy 1988); NaN without a null."""
    return 1.0 - (rms_mm / null_mm) ** 2 if null_mm > 0 else float("nan")


def pooled_rms(rows: Array) -> float:
    """Root mean square over rows of (number of points, sum of squares, ...)."""
    return float(np.sqrt(rows[:, 1].sum() / rows[:, 0].sum()))


def pooled(frames: Sequence[tuple[Row, Array]], draws: int) -> dict[str, float]:
    """Values of summary.csv over frames that count, each its row and its point errors (n,); empty where there are none.

    draws : resamples behind the 95 % intervals.
    """
    if not frames:
        return {}
    points = np.array([len(errors) for _, errors in frames], dtype=float)
    everything = np.concatenate([errors for _, errors in frames])
    result = {}
    for column in ERRORS:
        if column.name in OF_POINTS:
            result[column.pooled_name] = OF_POINTS[column.name](everything)
        elif column.pooled in POOLING:
            values = np.array([_number(row.get(column.name)) for row, _ in frames])
            result[column.pooled_name] = _over_frames(POOLING[column.pooled], values, points)
    return result | _with_intervals(frames, points, draws)


def _with_intervals(frames: Sequence[tuple[Row, Array]], points: Array, draws: int) -> dict[str, float]:
    """The statistics that have intervals: rms, median tip and skill."""
    squares = [float(np.sum(errors**2)) for _, errors in frames]
    null = np.array([_number(row.get("null_centreline_rms_mm")) for row, _ in frames])
    tips = [_number(row.get("tip_mm")) for row, _ in frames]
    rows = np.column_stack([points, squares, points * null**2, tips])
    units = blocks(len(frames), max(round(np.sqrt(len(frames))), 1))
    rms_ci, tip_ci, skill_ci = intervals(
        rows, units, (pooled_rms, lambda r: float(np.median(r[:, 3])), _pooled_skill), draws
    )
    return {
        "rms_mm": pooled_rms(rows),
        "rms_low_mm": rms_ci[0],
        "rms_high_mm": rms_ci[1],
        "tip_low_mm": tip_ci[0],
        "tip_high_mm": tip_ci[1],
        "skill": _pooled_skill(rows),
        "skill_low": skill_ci[0],
        "skill_high": skill_ci[1],
    }


def _number(value: Any) -> float:
    return float("nan") if value is None else float(value)


def _over_frames(rule: Callable[[Array, Array], float], values: Array, points: Array) -> float:
    """A rule over the frames that have a value; NaN where none has."""
    known = np.isfinite(values)
    return rule(values[known], points[known]) if known.any() else float("nan")


POOLING: dict[str, Callable[[Array, Array], float]] = {
    # a frame's mean square times its number of points is a sum of squares
    "rms": lambda values, points: float(np.sqrt(np.sum(points * values**2) / points.sum())),
    "mean": lambda values, _: float(np.mean(values)),
    "share": lambda values, _: float(np.mean(values)),
    "median": lambda values, _: float(np.median(values)),
    "max": lambda values, _: float(np.max(values)),
}
"""Rules of ``Column.pooled`` from values of frames (n,) and their numbers of points (n,)."""


def blocks(count: int, length: int) -> list[NDArray[np.intp]]:
    """Indices 0..count-1 in runs of ``length``; a short rest joins the last run."""
    starts = range(0, max(count - length + 1, 1), length)
    return [np.arange(a, b) for a, b in itertools.pairwise([*starts, count])]


def intervals(
    rows: Array, units: Sequence[NDArray[np.intp]], statistics: Sequence[Callable[[Array], float]], draws: int
) -> list[tuple[float, float]]:
    """95 % percentile intervals of statistics of ``rows`` (n, m) when whole units (index arrays) are resampled."""
    if draws < 1 or len(units) < 3:  # two blocks give three distinct resamples: no interval worth the name
        return [(float("nan"), float("nan"))] * len(statistics)
    generator = np.random.default_rng(SEED)
    values = np.empty((draws, len(statistics)))
    for i in range(draws):
        chosen = np.concatenate([units[j] for j in generator.integers(len(units), size=len(units))])
        values[i] = [statistic(rows[chosen]) for statistic in statistics]
    low, high = np.nanpercentile(values, (2.5, 97.5), axis=0)
    return [(float(a), float(b)) for a, b in zip(low, high, strict=True)]


def _pooled_skill(rows: Array) -> float:
    return 1.0 - float(rows[:, 1].sum() / rows[:, 2].sum()) if rows[:, 2].sum() > 0 else float("nan")
