"""What a run says when it is done: what went wrong and what comes next, the numbers, where the report lies."""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.compare.intervals import in_words
from pipeline.run.aggregate import Totals
from pipeline.run.launch import Plan
from pipeline.run.overall import shared_scans
from pipeline.run.provenance import command_line
from pipeline.run.results import Result, found_results
from pipeline.run.sweep import heads_of, lost_points
from reports.alike import alike, line_of
from reports.case_files import counted, left_over_sentence
from reports.doubts import copied_from_traces, warnings_in
from reports.origin import why_not_pooled
from reports.schema import SWEEP
from reports.sweep import silent_points
from reports.tables import read_if_there
from reports.verdict import COPIED, in_short
from reports.what_next import next_command
from reports.worse import worse_sentence


def failure_lines(plan: Plan, then: str = "") -> list[str]:
    """What went wrong, a line each (frames, cases, points of a sweep without a result), and what comes next.

    then : what comes next, where it is not the run's own command for these cases.
    """
    found = found_results(plan.out)
    failed = [row for result in found for row in result.failures]
    lines = [*filter(None, [why_not_pooled(plan.out)]), *shared_scans(found)]
    for result in found:
        lines += map(line_of, alike(result.failures))
    heads = heads_of(plan.template.settings, plan.cases, plan.points)
    lines += lost_lines(lost_points(plan.out, heads))
    lines += silent_points(read_if_there(plan.out / SWEEP.file, SWEEP))
    then = then or _next(plan, failed)
    worse = worse_sentence([{**result.summary, "role": result.role} for result in found])
    aside = [*filter(None, [left_over_sentence(plan.out), worse])]
    return [*aside, *lines, f"next: {then}"] if failed else [*aside, *lines]


def lost_lines(lost: Sequence[tuple[Path, Result]]) -> list[str]:
    """What a sweep has lost, a line each."""
    return [f"{folder}: {result.case}: {result.status}: {result.failures[0]['message']}" for folder, result in lost]


def _next(plan: Plan, failed: Sequence[Mapping[str, Any]]) -> str:
    """What to do about failures; where the manifest was inferred, it must first be written to be corrected."""
    again = next_command((row["case"] for row in failed), command_line(), {row["status"] for row in failed})
    if plan.inferred_from is None:
        return f"see to what the messages name, then {again}"
    folder = shlex.quote(str(plan.inferred_from))
    return f"wireval init {folder}, correct in it what is assumed and what the messages name, then {again}"


def last_line(totals: Totals, index: Path) -> str:
    """Counts, median error, time of the simulate stage, and where the sweep's table and the report lie."""
    fitted = f" (and {totals.frames_fitted} used for the roll)" * bool(totals.frames_fitted)
    parts = [f"{counted(totals.cases, 'case')}, {counted(totals.frames, 'frame')}{fitted}: {totals.frames_ok} ok"]
    if totals.frames_ok < totals.frames:
        parts.append(f"{counted(totals.frames - totals.frames_ok, 'frame')} not ok (failures.csv)")
    elif totals.cases_ok < totals.cases:  # one that is damaged has no frames to be counted
        parts.append(f"{totals.cases - totals.cases_ok} of the cases not ok (failures.csv)")
    if totals.missing:
        parts.append(f"{counted(totals.missing, 'case')} without a result (failures.csv)")
    if totals.sweep_lost:
        parts.append(f"{counted(totals.sweep_lost, 'result')} of the sweep lost")
    if totals.sweep_missing:
        parts.append(f"{counted(totals.sweep_missing, 'result')} of the sweep not run")
    if np.isfinite(totals.median_mm):
        parts.append(f"median point error {totals.median_mm:.3f} mm (p95 {totals.p95_mm:.3f})")
        low, high, said = (totals.pooled[name] for name in ("rms_low_mm", "rms_high_mm", "interval"))
        judged = int(totals.pooled.get("cases") or totals.cases)
        over = f" over the {counted(judged, 'case')} that {'is' if judged == 1 else 'are'} scored" * (
            judged < totals.cases
        )
        parts.append(f"rms {totals.pooled['rms_mm']:.3f} mm{over} ({in_words(low, high, said)})")
        copied = copied_from_traces(warnings_in(index.parent))
        parts += filter(None, [f"no score: the wires were {COPIED}" if copied else in_short(totals.pooled)])
    if totals.unscored:
        parts.append(totals.unscored.rstrip("."))
    if totals.frames and totals.solver_s:
        parts.append(f"simulate {1000.0 * totals.solver_s / totals.frames:.1f} ms/frame")
    sweep = index.parent / SWEEP.file
    parts += [f"sweep: {sweep}"] * sweep.exists()
    return ".  ".join([*parts, f"report: {index}"])
