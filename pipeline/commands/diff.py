"""``wireval diff OUT_A OUT_B``: paired differences, the gate for CI."""

from __future__ import annotations

import tomllib
from argparse import Namespace

from pipeline.commands.common import complain, say
from reports.diff import DEFAULT_TOLERANCE, diff_folders, load_tolerance


def main(args: Namespace) -> int:
    """Exit 0 when nothing got worse than the tolerance allows, 1 on a regression, 2 on wrong input."""
    try:
        tolerance = load_tolerance(args.tolerance or DEFAULT_TOLERANCE)
        difference = diff_folders(args.first, args.second, tolerance)
    except (ValueError, OSError, tomllib.TOMLDecodeError) as error:
        return complain([str(error)], "the two outputs")
    if len(difference.by_column):
        say(difference.by_column.to_string(index=False, float_format="{:.4g}".format))
    bad = difference.regressions
    if len(bad):
        say(bad.to_string(index=False, float_format="{:.4g}".format, max_rows=30))
    say(difference.sentence)
    return 1 if len(bad) else 0
