"""``wireval report OUT``: tables, figures and pages again, from result files alone."""

import argparse
import sys
from dataclasses import replace
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
    from pipeline.run.case import draw
    from pipeline.run.launch import last_line
    from pipeline.run.log import CaseProgress
    from pipeline.run.occupied import held
    from pipeline.run.results import found_results
    from pipeline.run.sweep import found_heads, lost_points, write_sweep
    from reports.atomic import WriteError
    from reports.html import render_index

    found = found_results(args.out)
    if not found:
        problem = f"{args.out}: no cases/*/result.json below it; this is not an output of wireval run"
        return complain([problem], "OUT")
    heads = found_heads(args.out)
    write_sweep(args.out, heads)
    totals = replace(aggregate(args.out), sweep_lost=len(lost_points(args.out, heads)))
    drawn = True
    for result in found:
        try:
            if result.frames:
                folder = args.out / "cases" / result.case
                with held(folder, CaseProgress(result.case, folder / "log.txt").warn):
                    draw(folder, "embedded" if args.embed else "linked")
            elif result.status == "damaged":
                sys.stderr.write(f"{result.case}: {result.failures[0]['message']}\n")
        except WriteError:
            raise
        except (OSError, EOFError, ValueError, KeyError) as error:
            sys.stderr.write(f"{result.case}: its page cannot be drawn: {error}; run the case again with --fresh\n")
            drawn = False
    say(last_line(totals, render_index(args.out, embed=args.embed)))
    return 0 if totals.all_ok and drawn else 1
