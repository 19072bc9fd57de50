"""``wireval report OUT``: tables, figures and pages again, from result files alone."""

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.commands import complain, say

if TYPE_CHECKING:
    from pipeline.run.results import Result

HELP = "rebuild tables, figures and pages from result files"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What may follow the verb."""
    parser.add_argument("out", type=Path, metavar="OUT", help="a folder that `wireval run` wrote")
    parser.add_argument("--embed", action="store_true", help="put the pictures into the pages: one file a page")
    parser.add_argument("--pdf", action="store_true", help="also write summary.pdf, four pages on paper")


def main(args: argparse.Namespace) -> int:
    """Exit 0 if all cases are ok, 1 if some failed, 2 if there are none."""
    from pipeline.run.aggregate import aggregate
    from pipeline.run.launch import last_line
    from pipeline.run.results import found_results
    from pipeline.run.sweep import found_heads, lost_points, write_sweep
    from reports.inside import links_out

    found = found_results(args.out)
    if not found:
        problem = f"{args.out}: no cases/*/result.json below it; this is not an output of wireval run"
        return complain([problem], "OUT")
    if links_out(args.out):
        return complain(links_out(args.out), "OUT")
    heads = found_heads(args.out)
    write_sweep(args.out, heads)
    totals = replace(aggregate(args.out), sweep_lost=len(lost_points(args.out, heads)))
    drawn = [_drawn(args, result) for result in found]
    page = _pages(args.out, embed=args.embed)
    if args.pdf:
        from reports.pdf import write_pdf

        say(f"summary: {write_pdf(args.out)}")
    say(last_line(totals, page))
    return 0 if totals.all_ok and all(drawn) else 1


def _drawn(args: argparse.Namespace, result: "Result") -> bool:
    """Draw the page of a case that has frames; False, and a line, where that cannot be."""
    from pipeline.run.case import draw
    from pipeline.run.log import CaseProgress
    from pipeline.run.occupied import held
    from reports.atomic import WriteError

    folder = args.out / "cases" / result.case
    try:
        if result.frames:
            with held(folder, CaseProgress(result.case, folder / "log.txt").warn):
                draw(folder, "embedded" if args.embed else "linked")
        elif result.status == "damaged":
            sys.stderr.write(f"{result.case}: {result.failures[0]['message']}\n")
    except WriteError:
        raise
    except (OSError, EOFError, ValueError, KeyError) as error:
        sys.stderr.write(f"{result.case}: its page cannot be drawn: {error}; run the case again with --fresh\n")
        return False
    return True


def _pages(out: Path, *, embed: bool) -> Path:
    """The pages over all cases, and of several simulators side by side; the path of the first."""
    from reports.html import render_index
    from reports.schema import SIMULATORS
    from reports.simulators import render_simulators

    if (out / SIMULATORS.file).exists():
        render_simulators(out, embed=embed)
    return render_index(out, embed=embed)
