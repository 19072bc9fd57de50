"""Pooled statistics of a case and their block-bootstrap intervals.

Points are pooled, RMSEs never averaged. Neighbouring frames of one insertion are not independent, so the bootstrap
resamples blocks: cases (groups) where there are several, runs of consecutive frames within a single case.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.run.frame import Frame

NULLS = ("centreline", "shortest", "min_bending", "previous")
SEED = 20021  # of the bootstrap: the same result files give the same intervals
Array = NDArray[np.float64]


def skill_of(rms_mm: float, null_mm: float) -> float:
    """Mean-square skill score 1 - (rms / null)^2 (Murphy 1988); NaN without a null."""
    return 1.0 - (rms_mm / null_mm) ** 2 if null_mm > 0 else float("nan")


def _squares(frames: Sequence[Frame]) -> Array:
    """Per frame: number of points, sum of squares of errors, the same of the centreline null; (n, 3)."""
    rows = []
    for frame in frames:
        assert frame.comparison is not None
        count = len(frame.comparison.error_mm)
        null = frame.nulls_rms_mm.get("centreline", float("nan"))
        rows.append((count, float(np.sum(frame.comparison.error_mm**2)), count * null**2))
    return np.array(rows).reshape(-1, 3)


def blocks(count: int, length: int) -> list[NDArray[np.intp]]:
    """Indices 0..count-1 in runs of ``length``; a short rest joins the last run."""
    starts = range(0, max(count - length + 1, 1), length)
    cuts = [*starts, count]
    return [np.arange(a, b) for a, b in itertools.pairwise(cuts)]


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


def pooled_rms(rows: Array) -> float:
    """Root mean square over rows of (number of points, sum of squares, ...)."""
    return float(np.sqrt(rows[:, 1].sum() / rows[:, 0].sum()))


def _pooled_skill(rows: Array) -> float:
    return 1.0 - float(rows[:, 1].sum() / rows[:, 2].sum()) if rows[:, 2].sum() > 0 else float("nan")


def _median_tip(rows: Array) -> float:
    return float(np.median(rows[:, 3]))


def pooled(frames: Sequence[Frame], draws: int) -> dict[str, float]:
    """Statistics over all points of the frames that are ok and compared; empty where there are none."""
    used = [f for f in frames if f.ok and f.comparison is not None]
    if not used:
        return {}
    errors = np.concatenate([f.comparison.error_mm for f in used if f.comparison])
    tips = np.array([f.comparison.tip_mm for f in used if f.comparison])
    rows = np.column_stack([_squares(used), tips])
    units = blocks(len(used), max(round(np.sqrt(len(used))), 1))
    rms_ci, tip_ci, skill_ci = intervals(rows, units, (pooled_rms, _median_tip, _pooled_skill), draws)
    return {
        "rms_mm": pooled_rms(rows),
        "rms_low_mm": rms_ci[0],
        "rms_high_mm": rms_ci[1],
        "mean_mm": float(errors.mean()),
        "p95_mm": float(np.percentile(errors, 95)),
        "max_mm": float(errors.max()),
        "tip_median_mm": float(np.median(tips)),
        "tip_low_mm": tip_ci[0],
        "tip_high_mm": tip_ci[1],
        "skill": _pooled_skill(rows),
        "skill_low": skill_ci[0],
        "skill_high": skill_ci[1],
        **_frame_statistics(used, rows[:, 0]),
    }


def _weighted_rms(values: Sequence[float], weights: Array) -> float:
    array = np.array(values)
    known = np.isfinite(array)
    if not known.any():
        return float("nan")
    return float(np.sqrt(np.sum(weights[known] * array[known] ** 2) / weights[known].sum()))


def _median(values: Sequence[float]) -> float:
    known = np.array(values)[np.isfinite(values)]
    return float(np.median(known)) if known.size else float("nan")


def _frame_statistics(used: Sequence[Frame], points: Array) -> dict[str, float]:
    """What is pooled from per-frame numbers: a per-frame mean square times its number of points is a sum of squares."""
    compared = [f.comparison for f in used if f.comparison]
    result = {
        f"null_{name}_rms_mm": _weighted_rms([f.nulls_rms_mm.get(name, float("nan")) for f in used], points)
        for name in NULLS
    }
    return result | {
        "arc_rms_mm": _weighted_rms([c.arc_rms_mm for c in compared], points),
        "branch_ok_fraction": float(np.mean([c.branch_ok for c in compared])),
        "coverage": float(np.mean([c.coverage for c in compared])),
        "trace_mean_median_mm": _median([f.truth.trace_mean_mm for f in used]),
        "trace_tip_median_mm": _median([f.truth.trace_tip_mm for f in used]),
        "truth_rms_mm": _weighted_rms([f.truth.truth_rms_mm for f in used], points),
    }


def forces(frames: Sequence[Frame]) -> dict[str, float]:
    """Largest penetration and push force over all simulated frames."""
    done = [f.simulated for f in frames if f.simulated is not None]
    if not done:
        return {}
    return {
        "max_penetration_mm": max(s.max_penetration_mm for s in done),
        "push_force_max_N": max(s.push_force_N for s in done),
    }


def case_row(run: Any, total_s: float, peak_mib: float) -> dict[str, Any]:
    """One row of summary.csv for a finished CaseRun."""
    frames: list[Frame] = run.frames
    good = sum(f.ok for f in frames)
    failed = next((f for f in frames if not f.ok), None)
    status = run.failure.status.identifier if run.failure else "ok" if failed is None else failed.status
    return {
        "case": run.case.id,
        "group": run.case.group,
        "role": run.case.role,
        "status": status,
        "frames": len(frames),
        "frames_ok": good,
        "frames_failed": len(frames) - good,
        **pooled(frames, run.config.compare.bootstrap),
        **forces(frames),
        **{f"{stage}_s": run.seconds[stage] for stage in ("load", "segment", "trace", "simulate", "compare")},
        "total_s": total_s,
        "peak_memory_MiB": peak_mib,
    }
