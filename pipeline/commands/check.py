"""``wireval check MANIFEST``: every problem at once, headers only."""

import argparse
from pathlib import Path

from pipeline.commands import add_settings, complain, resolved_settings, say

HELP = "list every problem of a manifest at once; reads headers only"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What may follow the verb."""
    parser.add_argument("manifest", type=Path, metavar="MANIFEST")
    add_settings(parser)


def main(args: argparse.Namespace) -> int:
    """Exit 0 when nothing is wrong, 2 otherwise."""
    from pipeline.status import InputError
    from pipeline.study.check import check
    from pipeline.study.manifest import read_manifest

    try:
        manifest, settings = read_manifest(args.manifest), resolved_settings(args)
    except InputError as error:
        return complain(error.problems, error.place or str(args.manifest))
    problems = check(manifest.cases, settings.config)
    if problems:
        return complain(problems, str(args.manifest))
    frames = sum(case.frame_count for case in manifest.cases)
    say(f"{args.manifest}: {len(manifest.cases)} case(s), {frames} frames: no problem found")
    return 0
