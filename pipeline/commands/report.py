"""``wireval report OUT``: tables, figures and pages again, from result files alone."""

from __future__ import annotations

from argparse import Namespace

from pipeline.commands.common import complain, say
from pipeline.commands.run import last_line
from pipeline.run.aggregate import aggregate, found_results
from reports.html import render_case, render_index


def main(args: Namespace) -> int:
    """Exit 0 if all cases are ok, 1 if some failed, 2 if there are none."""
    if not (args.out / "cases").is_dir() or not found_results(args.out):
        return complain(
            [f"{args.out}: no cases/*/result.json below it; this is not an output of wireval run"], "OUT"
        )
    totals = aggregate(args.out)
    for result in found_results(args.out):
        if result["frames"]:
            render_case(args.out / "cases" / result["case"], embed=args.embed)
    index = render_index(args.out, embed=args.embed)
    say(last_line(totals, index))
    return 0 if totals.all_ok else 1
