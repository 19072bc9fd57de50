"""``wireval diff OUT_A OUT_B``: what differs, the verdict with paired intervals, frame by frame: the gate for CI."""

import argparse
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.commands import add_quiet, say, unwritable

if TYPE_CHECKING:
    from pipeline.run.overall import Found

HELP = "paired differences of two outputs; exit 1 on a regression"
FILES = {
    "json": "the verdict for programs",
    "markdown": "tables for a pull request",
    "junit": "a JUnit summary, one test per frame",
    "html": "a page",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What may follow the verb."""
    add = parser.add_argument
    add("first", type=Path, metavar="OUT_A", help="the baseline")
    add("second", type=Path, metavar="OUT_B", help="the candidate")
    add("--tolerance", type=Path, metavar="T", help="TOML, column = allowed increase; a default ships")
    for name, what in FILES.items():
        add(f"--{name}", type=Path, metavar="FILE", help=f"write {what}")
    add_quiet(parser)


def main(args: argparse.Namespace) -> int:
    """Exit 0 when nothing got worse than the tolerance allows, 1 on a regression, or where nothing could be judged.

    InputError on wrong input.
    """
    from pipeline.status import UsageError
    from reports.case_files import find_cases
    from reports.two_runs_files import write

    places = {name: getattr(args, name) for name in FILES}
    problems = [text for name, path in places.items() if path for text in unwritable(path, f"--{name}")]
    if problems:
        raise UsageError(problems)
    try:
        verdict = _verdict(args)
    except (ValueError, OSError) as error:
        raise UsageError([str(error)]) from None
    write(verdict, **places)
    if not find_cases(args.second):
        sys.stderr.write(f"{args.second}: no case below it: is this what `wireval run` wrote?\n")
    for line in [verdict.sentence] if args.quiet else verdict.lines():
        say(line)
    return 1 if verdict.closed else 0


def _verdict(args: argparse.Namespace) -> Any:
    """Both folders read and compared, two scores simulator by simulator; ValueError where they cannot be."""
    import pipeline.compare.nulls  # noqa: F401 - registers metrics and predictors, whose columns may have tolerances
    from pipeline.load.guard import is_folder
    from reports.simulators import folders_in
    from reports.tolerance import DEFAULT_TOLERANCE, load_tolerance
    from reports.two_scores import together

    runs = args.first, args.second
    for out in runs:
        if not is_folder(out):
            raise ValueError(f"{out}: no such folder; give one that `wireval run` wrote")
    tolerance = load_tolerance(args.tolerance or DEFAULT_TOLERANCE)
    old, new = map(folders_in, runs)
    if not (old and new):
        return _compared(*runs, tolerance)
    parts = {name: _compared(old[name], new[name], tolerance) for name in old if name in new}
    if not parts:
        raise ValueError(f"no simulator in common: {', '.join(old)} in {runs[0]}, {', '.join(new)} in {runs[1]}")
    return together(runs, parts, [n for n in old if n not in new], [n for n in new if n not in old])


def _compared(first: Path, second: Path, tolerance: Mapping[str, float]) -> Any:
    """The verdict on two runs."""
    from pipeline.run.another import with_another
    from pipeline.run.ledger import RESULT
    from pipeline.run.overall import damaged, found_cases, golden_cases, ratio
    from reports.case_files import find_cases
    from reports.diff import diff_folders, not_judged
    from reports.origin import of_two_simulators, told_alike, what_differs
    from reports.tolerance import RATIO
    from reports.two_runs import Judged, Verdict, newly_void, newly_warned, warned_of

    allowed = 1.0 + tolerance[RATIO]
    before, after = found_cases(first), found_cases(second)
    if bad := damaged(before):
        case, why = next(iter(bad.items()))
        raise ValueError(f"case {case!r} of the first run cannot be held against: {why}")
    there = {case.result.case for case in before}
    unread = {folder.name for folder in find_cases(second)} & there - {case.result.case for case in after}
    lost = dict.fromkeys(sorted(unread), f"{RESULT} is missing") | damaged(after)
    frames = diff_folders(first, second, tolerance, lost)
    paired = ratio([*before, *golden_cases(first)], after)
    judged: Judged = "holds"
    if paired is None or math.isnan(paired.low):
        judged = "withheld"
    elif paired.low > allowed:
        judged = "worse"
    differs = what_differs(first, second)
    ruler = ", ".join(row["what"] for row in differs if row["what"].startswith("compare."))
    otherwise = f"errors are measured otherwise in the second run ({ruler})" * bool(ruler)
    unpaired = "over all frames nothing is judged: no frame has points in both runs" * (paired is None)
    said = paired.verdict(allowed, otherwise) if paired else ""
    pooled = _pooled(with_another(first, before), with_another(second, after))
    nearer = ""
    if paired and paired.value < 1.0 / allowed and len(frames.regressions) and not otherwise:
        nearer = f"but over all frames the errors are {paired.value:.3g} times those of the first run"
    caveat = "; ".join(filter(None, (otherwise, of_two_simulators(differs), unpaired, not_judged(tolerance), nearer)))
    warned = warned_of(first), warned_of(second)
    told = told_alike(first, second), newly_warned(*warned), newly_void(*warned)
    return Verdict((first, second), differs, pooled, said, judged, frames, caveat, *told)


OF_ALL = "frames", "frames_ok", "within_1mm"
"""What a run's failures change: over all of its frames."""


def _pooled(before: "Sequence[Found]", after: "Sequence[Found]") -> list[dict[str, Any]]:
    """What differs of overall.csv: columns that have a better side, and the predictor behind skill_strongest.

    Errors are over the frames that count in both: a run of one easy case of four seemed the better one.
    """
    import pandas as pd

    from pipeline.run.overall import frames_in, on_frames, overall
    from reports.schema import SUMMARY

    runs = before, after
    both = frames_in(before) & frames_in(after)
    shares = [{name: run[name] for name in OF_ALL if name in run} for run in map(overall, runs)]
    old, new = (overall(on_frames(run, both)) | own for run, own in zip(runs, shares, strict=True))
    told = [column.name for column in SUMMARY if column.better or column.name == "strongest_null"]
    names = [name for name in told if name in old and name in new]
    rows = [{"column": name, "before": old[name], "after": new[name]} for name in names]
    return [row for row in rows if row["before"] != row["after"] and pd.notna(row["before"])]
