"""``wireval diff OUT_A OUT_B``: paired differences, the gate for CI."""

from __future__ import annotations

from argparse import Namespace

from pipeline.commands.common import complain


def main(args: Namespace) -> int:
    """Exit 0 when nothing got worse than the tolerance allows, 1 on a regression, 2 on wrong input."""
    from reports import diff

    missing = [f"{p}: no cases/ below it; not an output of wireval run" for p in (args.first, args.second)]
    missing = [
        text for p, text in zip((args.first, args.second), missing, strict=True) if not (p / "cases").is_dir()
    ]
    if missing:
        return complain(missing, "the two outputs")
    return diff_outputs(diff, args)


def diff_outputs(diff: object, args: Namespace) -> int:
    """Compare and print."""
    raise NotImplementedError
