"""``wireval init FOLDER``: the manifest that run would infer, as a file to correct."""

import argparse
import shlex
from itertools import chain
from pathlib import Path

from pipeline.commands import add_settings, resolved_settings, say, unwritable
from pipeline.commands.given import NAME, add_what_is_seen, inferred

HELP = "write the manifest that is inferred from a folder of scans, to be corrected"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What may follow the verb."""
    parser.add_argument("manifest", type=Path, metavar="FOLDER", help="of scans: one case")
    parser.add_argument("--to", type=Path, metavar="FILE", help=f"where to write it (default FOLDER/{NAME})")
    add_what_is_seen(parser)
    add_settings(parser)


def main(args: argparse.Namespace) -> int:
    """Exit 0; raises InputError or StageError where there is nothing to go by, or a manifest is there already."""
    from pipeline.load import read_headers
    from pipeline.status import InputError, StageError, UsageError
    from pipeline.study.check import entry_problems
    from pipeline.study.manifest import read_manifest
    from reports.atomic import write_text

    if not args.manifest.is_dir():
        what = "this is a file" if args.manifest.exists() else "no such folder"
        raise InputError([f"{args.manifest}: {what}; give a folder that holds scans"])
    path: Path = args.to or args.manifest / NAME
    if problems := unwritable(path, "--to"):
        raise UsageError(problems)
    if path.exists():
        raise UsageError([f"{path}: is there already; correct it, or write another with --to FILE"])
    text, seen, assumed = inferred(args, beside=path.parent.resolve() == args.manifest.resolve())
    head = (
        "# correct what is `assumed` below, and take each line out that you have confirmed: pages repeat what is left"
    )
    write_text(path, f"{head}\n\n{text}")
    try:
        case = read_manifest(path).cases[0]
        problems = entry_problems(case, read_headers(None, case.frames[:1], resolved_settings(args).config.load))
        if problems:
            raise InputError(problems)
    except (InputError, StageError):
        path.unlink()
        raise
    say(f"written: {path}")
    for note in (*seen, *(f"assumed: {text}" for text in assumed)):
        say(note)
    options = [*(("-c", str(file)) for file in args.config), *(("--set", one) for one in args.settings)]
    words = shlex.join([str(path), *chain.from_iterable(options)])
    say(f"correct it, then: wireval check {words} && wireval run {words} -o OUT")
    return 0
