"""``wireval diff OUT_A OUT_B``: paired differences, the gate for CI."""

import argparse
import tomllib
from pathlib import Path

from pipeline.commands import complain, say

HELP = "paired differences of two outputs; exit 1 on a regression"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What may follow the verb."""
    add = parser.add_argument
    add("first", type=Path, metavar="OUT_A", help="the baseline")
    add("second", type=Path, metavar="OUT_B", help="the candidate")
    add("--tolerance", type=Path, metavar="T", help="TOML, column = allowed increase; a default ships")


def main(args: argparse.Namespace) -> int:
    """Exit 0 when nothing got worse than the tolerance allows, 1 on a regression, 2 on wrong input."""
    import pipeline.compare.nulls  # noqa: F401 - registers metrics and predictors, whose columns may have tolerances
    from pipeline.run.overall import found_cases, ratio
    from reports.diff import DEFAULT_TOLERANCE, diff_folders, load_tolerance

    try:
        if not args.second.is_dir():
            raise ValueError(f"{args.second}: no such folder; give one that `wireval run` wrote")
        tolerance = load_tolerance(args.tolerance or DEFAULT_TOLERANCE)
        difference = diff_folders(args.first, args.second, tolerance)
    except (ValueError, OSError, tomllib.TOMLDecodeError) as error:
        return complain([str(error)], "the two outputs")
    if len(difference.by_column):
        say(difference.by_column.to_string(index=False, float_format="{:.4g}".format))
    bad = difference.regressions
    if len(bad):
        say(bad.to_string(index=False, float_format="{:.4g}".format, max_rows=30))
    paired = ratio(found_cases(args.first), found_cases(args.second))
    if paired is not None:
        say(paired.sentence)
    say(difference.sentence)
    return 1 if len(bad) else 0
