"""``wireval check MANIFEST``: every problem at once, headers only."""

from __future__ import annotations

from argparse import Namespace

from pipeline.commands.common import complain, resolved_settings, say
from pipeline.study.check import check
from pipeline.study.manifest import ManifestError, read_manifest
from pipeline.study.settings import SettingsError


def main(args: Namespace) -> int:
    """Exit 0 when nothing is wrong, 2 otherwise."""
    try:
        manifest, settings = read_manifest(args.manifest), resolved_settings(args)
    except (ManifestError, SettingsError) as error:
        return complain(error.problems, str(args.manifest))
    problems = check(manifest, settings.config)
    if problems:
        return complain(problems, str(args.manifest))
    frames = sum(case.frame_count for case in manifest.cases)
    say(f"{args.manifest}: {len(manifest.cases)} case(s), {frames} frames: no problem found")
    return 0
