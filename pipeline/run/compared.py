"""Two output folders compared: what differs, paired intervals over all frames, and frame by frame."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

import pipeline.compare.nulls  # noqa: F401 - registers metrics and predictors, whose columns may have tolerances
from pipeline.load.guard import is_folder
from pipeline.run.another import with_another
from pipeline.run.ledger import RESULT
from pipeline.run.overall import Found, damaged, found_cases, frames_in, golden_cases, on_frames, overall, ratio
from reports.case_files import find_cases
from reports.diff import diff_folders, not_judged
from reports.origin import of_two_simulators, told_alike, what_differs
from reports.records import run_records
from reports.schema import SUMMARY
from reports.simulators import folders_in
from reports.tolerance import DEFAULT_TOLERANCE, RATIO, load_tolerance
from reports.two_runs import Judged, Verdict, newly_void, newly_warned, warned_of
from reports.two_scores import together

OF_ALL = "frames", "frames_ok", "within_1mm"
"""What a run's failures change: over all frames of these cases."""
NO_RULER = ("compare.simulated_nulls",)
"""Settings of ``compare`` that choose predictors and change no error: skill alone is against others then."""


def compared(first: Path, second: Path, tolerance: Path | None = None) -> Verdict:
    """Two runs, or two scores simulator by simulator; ValueError where they cannot be compared.

    tolerance : TOML, column = allowed increase; the default that ships where none is given.
    """
    runs = first, second
    for out in runs:
        if not is_folder(out):
            raise ValueError(f"{out}: no such folder; give one that `wireval run` wrote")
    if not find_cases(second) and not run_records(second):
        raise ValueError(f"{second}: no case below it: is this what `wireval run` wrote?")
    allowed = load_tolerance(tolerance or DEFAULT_TOLERANCE)
    old, new = map(folders_in, runs)
    if not (old and new):
        return _of_one(*runs, allowed)
    parts = {name: _of_one(old[name], new[name], allowed) for name in old if name in new}
    if not parts:
        raise ValueError(f"no simulator in common: {', '.join(old)} in {runs[0]}, {', '.join(new)} in {runs[1]}")
    return together(runs, parts, [n for n in old if n not in new], [n for n in new if n not in old])


def _of_one(first: Path, second: Path, tolerance: Mapping[str, float]) -> Verdict:
    """The verdict on two runs."""
    allowed = 1.0 + tolerance[RATIO]
    before, after = found_cases(first), found_cases(second)
    held = [*before, *golden_cases(first)]
    if bad := damaged(held):
        case, why = next(iter(bad.items()))
        raise ValueError(f"case {case!r} of the first run cannot be held against: {why}")
    there = {case.result.case for case in before}
    unread = {folder.name for folder in find_cases(second)} & there - {case.result.case for case in after}
    lost = dict.fromkeys(sorted(unread), f"{RESULT} is missing") | damaged(after)
    frames = diff_folders(first, second, tolerance, lost)
    paired = ratio(held, after)
    judged: Judged = "holds"
    if paired is None or math.isnan(paired.low):
        judged = "withheld"
    elif paired.low > allowed:
        judged = "worse"
    differs = what_differs(first, second)
    ruler = ", ".join(what for row in differs if (what := row["what"]).startswith("compare.") and what not in NO_RULER)
    otherwise = f"errors are measured otherwise in the second run ({ruler})" * bool(ruler)
    unpaired = "over all frames nothing is judged: no frame has points in both runs" * (paired is None)
    said = paired.verdict(allowed, otherwise) if paired else ""
    both = there & {case.result.case for case in after}
    # the predictor 'another' too is of these cases: without the others it is another guess, or none
    pooled = _pooled(
        *(
            with_another(out, [case for case in run if case.result.case in both])
            for out, run in ((first, before), (second, after))
        )
    )
    nearer = ""
    if paired and paired.value < 1.0 / allowed and len(frames.regressions) and not otherwise:
        nearer = f"but over all frames the errors are {paired.value:.3g} times those of the first run"
    others = of_two_simulators(first, second)
    caveat = "; ".join(filter(None, (otherwise, others, unpaired, not_judged(tolerance), nearer)))
    warned = warned_of(first), warned_of(second)
    void = newly_void(*warned) or not_judged(tolerance) * (paired is not None and judged == "withheld")
    told = told_alike(first, second), newly_warned(*warned), void
    return Verdict((first, second), differs, pooled, said, judged, frames, caveat, *told)


def _pooled(before: Sequence[Found], after: Sequence[Found]) -> list[dict[str, Any]]:
    """What differs of overall.csv: columns that have a better side, and the predictor behind skill_strongest.

    before, after : the cases of both runs: a run of one easy case of three seemed the better one. Errors are over the
    frames that count in both.
    """
    runs = before, after
    if not before:
        return []
    both = frames_in(before) & frames_in(after)
    shares = [{name: run[name] for name in OF_ALL if name in run} for run in map(overall, runs)]
    old, new = (overall(on_frames(run, both)) | own for run, own in zip(runs, shares, strict=True))
    told = [column.name for column in SUMMARY if column.better or column.name == "strongest_null"]
    names = [name for name in told if name in old and name in new]
    rows = [{"column": name, "before": old[name], "after": new[name]} for name in names]
    return [row for row in rows if row["before"] != row["after"] and pd.notna(row["before"])]
