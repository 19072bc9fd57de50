"""``wireval report OUT``: tables, figures and pages again, from result files alone."""

import argparse
import sys
from pathlib import Path

from pipeline.commands import complain, say

HELP = "rebuild tables, figures and pages from result files"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What may follow the verb."""
    parser.add_argument("out", type=Path, metavar="OUT", help="a folder that `wireval run` wrote")
    parser.add_argument("--embed", action="store_true", help="put the pictures into the pages: one file a page")


def main(args: argparse.Namespace) -> int:
    """Exit 0 if all cases are ok, 1 if some failed, 2 if there are none."""
    from pipeline.run.aggregate import aggregate
    from pipeline.run.launch import last_line
    from pipeline.run.results import found_results
    from reports.html import render_case, render_index

    found = found_results(args.out)
    if not found:
        problem = f"{args.out}: no cases/*/result.json below it; this is not an output of wireval run"
        return complain([problem], "OUT")
    totals = aggregate(args.out)
    drawn = True
    for result in found:
        try:
            if result.frames:
                render_case(args.out / "cases" / result.case, embed=args.embed)
            elif result.status == "damaged":
                sys.stderr.write(f"{result.case}: {result.failures[0]['message']}\n")
        except (OSError, EOFError, ValueError, KeyError) as error:
            sys.stderr.write(f"{result.case}: its page cannot be drawn: {error}; run the case again with --fresh\n")
            drawn = False
    say(last_line(totals, render_index(args.out, embed=args.embed)))
    return 0 if totals.all_ok and drawn else 1
