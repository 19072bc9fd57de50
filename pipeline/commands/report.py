"""``wireval report OUT``: tables, figures and pages again, from result files alone."""

import argparse
import sys
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.commands import add_quiet, complain, say

if TYPE_CHECKING:
    from pipeline.run.results import Result

HELP = "rebuild tables, figures and pages from result files"
MANY = 10
"""Cases from which on each page that was drawn is a line: one takes seconds."""
FEW = 5
"""Cases up to which what is wrong is a line each."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What may follow the verb."""
    add = parser.add_argument
    add("out", type=Path, metavar="OUT", help="a folder that `wireval run` wrote")
    add("-j", "--jobs", type=int, default=1, metavar="N", help="pages of cases drawn at once (default 1)")
    add("--overview", action="store_true", help="the tables and the page over all cases alone, in seconds")
    add("--embed", action="store_true", help="put the pictures into the pages: one file a page")
    add("--pdf", action="store_true", help="also write summary.pdf, four pages on paper")
    add_quiet(parser)


def main(args: argparse.Namespace) -> int:
    """Exit 0 if all cases are ok, 1 if some failed or are missing (but what --only left out) or a gate of the last run
    closed, 2 if there are none.
    """
    from pipeline.run.aggregate import aggregate
    from pipeline.run.last_words import last_line, lost_lines
    from pipeline.run.results import found_results
    from pipeline.run.sweep import found_heads, lost_points, write_sweep
    from reports.run_page import render_index
    from reports.simulators import folders_in
    from reports.sweep import not_run, not_run_sentence

    found = found_results(args.out)
    if not found:
        return complain([_without_cases(args.out)], str(args.out), "; nothing was drawn")
    if problems := _unusable(args.out):
        return complain(problems, str(args.out), "; nothing was drawn")
    heads = found_heads(args.out)
    if removed := write_sweep(args.out, heads):
        sys.stderr.write(f"{removed}\n")
    lost = lost_points(args.out, heads)
    sys.stderr.writelines(f"{line}\n" for line in filter(None, [*lost_lines(lost), not_run_sentence(args.out)]))
    totals = replace(aggregate(args.out), sweep_lost=len(lost), sweep_missing=len(not_run(args.out)[0]))
    drawn = args.overview or _all_drawn(args, found)
    page = render_index(args.out, embed=args.embed)
    others_ok = _others(args.out, embed=args.embed)
    if args.pdf:
        from reports.pdf import write_pdf

        summary = write_pdf(args.out)
        if not args.quiet:
            say(f"summary: {summary}")
    whole = _all_there(args.out, found if args.overview else ())
    first = next((f"{name}: " for name in folders_in(args.out)), "")
    sys.stderr.writelines(f"FAIL: {first}{line}\n" for line in totals.closed)
    say(last_line(totals, page))
    return 0 if totals.all_ok and not (totals.closed or totals.missing) and others_ok and drawn and whole else 1


def _unusable(out: Path) -> list[str]:
    """Why nothing can be drawn of a folder with results: tables and pages would be of other files, or lack columns."""
    from pipeline.run.own import not_loaded
    from reports.inside import misleading_links
    from reports.records import damaged_records

    again = f"pipeline.cli.main(['report', {str(out)!r}])"
    return misleading_links(out) or damaged_records(out) or not_loaded(out, again)


def _without_cases(out: Path) -> str:
    """What is wrong with a folder without results."""
    from pipeline.run.results import found_results
    from reports.records import run_records

    above = [f"give {one}" for one in out.absolute().parents[:2] if found_results(one)]
    begun = bool(run_records(out))
    why = "the run into it has finished no case: run it again" if begun else "this is not an output of wireval run"
    return f"{out}: no cases/*/result.json below it; {next(iter(above), why)}"


def _all_there(out: Path, found: Sequence["Result"], name: str = "") -> bool:
    """Whether every case that the runs into a folder name has a result; cases that have none, or nobody names, said.

    found : results of which those that are damaged are still to be said, too.
    """
    from reports.case_files import find_cases, left_out_sentence, left_over_sentence, not_run_sentence

    missing = not_run_sentence(out) or f"no case below {out}" * (not find_cases(out))
    for aside in filter(None, (left_over_sentence(out), left_out_sentence(out), missing)):
        sys.stderr.write(f"{name}{aside}\n")
    _tell([(r.case, str(r.failures[0]["message"])) for r in found if r.status == "damaged"], name)
    return not missing


def _all_drawn(args: argparse.Namespace, found: Sequence["Result"]) -> bool:
    """Draw the pages of all cases, a line for each where there are many; whether that could be."""
    from pipeline.run.batch import run_all
    from reports.atomic import WriteError

    wrong, work = [], partial(_drawn, args.out, args.embed)
    with closing(run_all(found, work, args.jobs)) as outcomes:
        for count, outcome in enumerate(outcomes, 1):
            problem = outcome.error or outcome.result
            if outcome.status == "unwritable":
                raise WriteError(outcome.error)
            wrong += [(outcome.job.case, problem)] if problem else []
            if len(found) >= MANY and not problem and not args.quiet:
                sys.stderr.write(f"{count}/{len(found)} {outcome.job.case}: drawn\n")
    _tell(wrong)
    return not wrong


def _tell(wrong: Sequence[tuple[str, str]], name: str = "") -> None:
    """What is wrong with which cases: a line each, or one line for many."""
    from reports.case_files import listed

    lines = [f"{case}: {problem}" for case, problem in wrong]
    if len(wrong) > FEW:
        lines = [f"{len(wrong)} cases have no new page: {listed([case for case, _ in wrong])}; the first: {lines[0]}"]
    for line in lines:
        sys.stderr.write(f"{name}{line}\n")


def _drawn(out: Path, embed: bool, result: "Result") -> str:
    """Draw the page of a case that has frames; why that cannot be, or nothing. What it is drawn from must be whole."""
    from pipeline.run import ledger
    from pipeline.run.case import draw
    from pipeline.run.log import CaseProgress
    from pipeline.run.occupied import held
    from reports.atomic import WriteError

    folder = out / "cases" / result.case
    try:
        written = ledger.read(folder)
        wrong = written.amiss(folder, ledger.DATA) if written and result.frames else ""
        if wrong:
            return f"its page stays as it was: {wrong}; run the case again"
        if result.frames:
            with held(folder, CaseProgress(result.case, folder / "log.txt").warn):
                draw(folder, "embedded" if embed else "linked")
    except WriteError:
        raise
    except (OSError, EOFError, ValueError, KeyError) as error:
        return f"its page cannot be drawn: {error}; run the case again"
    return str(result.failures[0]["message"]) if result.status == "damaged" else ""


def _others(out: Path, *, embed: bool) -> bool:
    """In a score the tables and pages of the other simulators and of all side by side; whether all of them are ok."""
    from pipeline.run.aggregate import aggregate
    from pipeline.run.results import found_results
    from pipeline.run.simulators import side_by_side
    from reports.run_page import render_index
    from reports.simulators import folders_in

    folders = folders_in(out)
    good = []
    for name, folder in [*folders.items()][1:]:
        totals = aggregate(folder)
        sys.stderr.writelines(f"FAIL: {name}: {line}\n" for line in totals.closed)
        good += [
            totals.all_ok,
            not totals.closed,
            not totals.missing,
            _all_there(folder, found_results(folder), f"{name}: "),
        ]
        say(f"{name}: report: {render_index(folder, embed)}")
    for line in side_by_side(out, folders, embed) if folders else ():
        say(line)
    return all(good)
