"""``wireval settings [NAME]``: what every setting means, may be and is by default, as a file for ``-c``."""

import argparse

from pipeline.commands import say

HELP = "every setting with its meaning, range and default, as a file for -c"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What may follow the verb."""
    parser.add_argument("name", nargs="?", default="", metavar="TABLE[.KEY]", help="only this table or setting")


def main(args: argparse.Namespace) -> int:
    """Exit 0; raises UsageError for a name that there is none of."""
    from pipeline.status import UsageError, did_you_mean
    from pipeline.study.explain import described

    known = list(described())
    names = {one.table for one in known} | {one.name for one in known}
    if args.name and args.name not in names:
        raise UsageError([f"{args.name!r}: no such table or setting; {did_you_mean(args.name, names)}"])
    table = ""
    for one in known:
        if args.name in ("", one.table, one.name):
            if table != one.table:
                say(f"{chr(10) * bool(table)}[{one.table}]")
            table = one.table
            say(one.toml)
    return 0
