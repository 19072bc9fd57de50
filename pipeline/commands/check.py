"""``wireval check MANIFEST``: every problem at once, before anything is computed."""

import argparse

from pipeline.commands import add_settings, resolved_settings, say
from pipeline.commands.given import add_manifest, assumed_in, given

HELP = "list every problem of a manifest at once; reads only the headers of scans, and a given lumen whole"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What may follow the verb."""
    add_manifest(parser)
    add_settings(parser)


def main(args: argparse.Namespace) -> int:
    """Exit 0 when nothing is wrong, with what is assumed; raises InputError with every problem."""
    from pipeline.status import InputError
    from pipeline.study.check import check, frames_of
    from pipeline.study.manifest import ManifestError
    from pipeline.study.plausible import doubts
    from reports.case_files import counted

    config = resolved_settings(args).config
    try:
        manifest = given(args)
    except ManifestError as error:  # the scans of its sound cases are looked at all the same
        raise InputError([*error.problems, *check(error.sound, config)]) from None
    problems = check(manifest.cases, config)
    if problems:
        raise InputError(problems)
    for note in assumed_in(manifest.cases):
        say(f"assumed, not confirmed: {note}")
    for note in doubts(manifest.cases, config):
        say(f"warning: {note}")
    frames = sum(frames_of(case, config) for case in manifest.cases)
    say(f"{args.manifest}: {counted(len(manifest.cases), 'case')}, {counted(frames, 'frame')}: no problem found")
    return 0
