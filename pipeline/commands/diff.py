"""``wireval diff OUT_A OUT_B``: what differs, the verdict with paired intervals, frame by frame: the gate for CI."""

import argparse
from pathlib import Path

from pipeline.commands import add_quiet, say, unwritable

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
    add("first", type=Path, metavar="OUT_A", help="the baseline (reference), which comes first")
    add("second", type=Path, metavar="OUT_B", help="the candidate, which is judged against it")
    add(
        "--tolerance",
        type=Path,
        metavar="T",
        help="TOML, column = allowed increase; [share]: as a share; a default ships",
    )
    for name, what in FILES.items():
        add(f"--{name}", type=Path, metavar="FILE", help=f"write {what}")
    add_quiet(parser)


def main(args: argparse.Namespace) -> int:
    """Exit 0 when nothing got worse than the tolerance allows, 1 on a regression, or where nothing could be judged.

    InputError on wrong input.
    """
    from pipeline.run.compared import compared
    from pipeline.status import UsageError
    from reports.two_runs_files import write

    places = {name: getattr(args, name) for name in FILES}
    problems = [text for name, path in places.items() if path for text in unwritable(path, f"--{name}")]
    if problems:
        raise UsageError(problems)
    try:
        verdict = compared(args.first, args.second, args.tolerance)
    except (ValueError, OSError) as error:
        raise UsageError([str(error)]) from None
    write(verdict, **places)
    for line in [verdict.sentence] if args.quiet else verdict.lines():
        say(line)
    return 1 if verdict.closed else 0
