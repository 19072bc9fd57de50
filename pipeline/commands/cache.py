"""``wireval cache --info | --prune``: the stage store."""

import argparse

from pipeline.commands import say

HELP = "the stage store"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What may follow the verb."""
    action = parser.add_mutually_exclusive_group(required=True)
    action.add_argument("--info", action="store_true", help="where the stage store lies and how large it is")
    action.add_argument("--prune", action="store_true", help="empty it")


def main(args: argparse.Namespace) -> int:
    """Exit 0."""
    from pipeline.run.store import Store, default_root

    store = Store(default_root())
    if args.prune:
        count, size = store.prune()
        say(f"removed {count} stage results, {size / 2**20:.1f} MiB, from {store.root}")
    else:
        entries = store.entries()
        size = sum(p.stat().st_size for p in entries)
        say(f"{store.root}: {len(entries)} stage results, {size / 2**20:.1f} MiB")
    return 0
