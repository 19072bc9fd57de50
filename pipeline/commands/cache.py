"""``wireval cache --info | --prune``: the stage store."""

from __future__ import annotations

from argparse import Namespace

from pipeline.commands.common import say
from pipeline.run.cache import Store, default_root


def main(args: Namespace) -> int:
    """Exit 0."""
    store = Store(default_root())
    if args.prune:
        count, size = store.prune()
        say(f"removed {count} stage results, {size / 2**20:.1f} MiB, from {store.root}")
    else:
        entries = store.entries()
        size = sum(p.stat().st_size for p in entries)
        say(f"{store.root}: {len(entries)} stage results, {size / 2**20:.1f} MiB")
    return 0
