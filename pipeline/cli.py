"""The command line: argparse, never interactive; verbs are the modules of ``pipeline.commands``."""

import argparse
import importlib
import os
import sys
from collections.abc import Sequence

from pipeline.commands import VERBS

OK, BAD_INPUT, INTERRUPTED = 0, 2, 130


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="wireval",
        description="Validate simulated guide wires against 3D scans.",
        epilog="Exit codes: 0 all ok; 1 some case failed or regressed; 2 input wrong, nothing run; 130 interrupted.",
    )
    parser.add_argument("--version", action="store_true", help="print the version")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    for name in VERBS:
        verb = importlib.import_module(f"pipeline.commands.{name}")
        verb.add_arguments(commands.add_parser(name, help=verb.HELP, description=verb.HELP))
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    parser = _parser()
    args = parser.parse_args(argv)
    if args.version:
        from pipeline.run.provenance import package_version

        print(f"wireval {package_version()}")
        return OK
    if not args.command:
        parser.print_help()
        return BAD_INPUT
    try:
        return int(importlib.import_module(f"pipeline.commands.{args.command}").main(args))
    except KeyboardInterrupt:
        print("\ninterrupted; what is finished is kept, the same command goes on from there", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # the reader of a pipe (head, less) has gone: not an error of ours
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return OK


if __name__ == "__main__":
    sys.exit(main())
