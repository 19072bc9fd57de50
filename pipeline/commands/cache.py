"""``wireval cache --info | --check | --limit SIZE | --prune``: the stage store."""

import argparse
import re
import sys

from pipeline.commands import complain, say

HELP = "lumens, traces and the like that are kept, so that no run computes them again"
UNITS = {"K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40}
"""A size has one: `--limit 5`, meant as 5 GB, would remove all but 5 bytes."""
MOST = 2**63
"""Bytes; no disk holds more, and a number of 400 digits is no float."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What may follow the verb."""
    action = parser.add_mutually_exclusive_group(required=True)
    action.add_argument("--info", action="store_true", help="where they lie and how much room they take")
    action.add_argument("--check", action="store_true", help="read every result; remove those that are not whole")
    action.add_argument(
        "--limit", metavar="SIZE", help="how much room they may take (20G, 500M): the oldest used go first"
    )
    action.add_argument("--prune", action="store_true", help="remove all of them")


def main(args: argparse.Namespace) -> int:
    """Exit 0; 1 where the check finds a damaged result, 2 for a size that is none."""
    from pipeline.run.cache import Store, default_root

    store = Store(default_root())
    if args.check:
        whole, damaged = store.check()
        for path in damaged:
            sys.stderr.write(f"{path}: not as it was written; removed, the next run computes it again\n")
        say(f"{store.root}: {whole} kept results are whole, {len(damaged)} were not")
        return 1 if damaged else 0
    if args.limit is not None:
        limit = _bytes(args.limit)
        if limit is None:
            expected = "expected a size with its unit, as in 20G or 500M; nothing was removed"
            return complain([f"--limit {args.limit!r}: {expected}"], "the command line")
        store.set_limit(limit)
    if args.prune or args.limit is not None:
        count, size = store.trim(0 if args.prune else None)
        say(f"removed {count} kept results, {size / 2**20:.1f} MiB, from {store.root}")
    entries = store.entries()
    taken = sum(size for _, size, _ in entries) / 2**20
    say(f"{store.root}: {len(entries)} kept results, {taken:.1f} MiB of at most {store.limit / 2**20:.1f} MiB")
    return 0


def _bytes(text: str) -> int | None:
    """A size in bytes; None for what is no size, has no unit, or is more than any disk holds."""
    found = re.fullmatch(r"(\d+(?:\.\d+)?)\s*([KMGT])(?:i?B)?", text.strip(), re.IGNORECASE)
    size = float(found[1]) * UNITS[found[2].upper()] if found else MOST
    return int(size) if size < MOST else None
