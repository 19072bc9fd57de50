"""The command line: argparse, never interactive; verbs are the modules of ``pipeline.commands``."""

import argparse
import importlib
import os
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from pipeline.commands import VERBS

OK, FAILED, BAD_INPUT = 0, 1, 2


class Terminated(KeyboardInterrupt):
    """SIGTERM, as a batch system sends it before it kills: ends like Ctrl-C."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="wireval",
        description="Validate simulated guide wires against 3D scans.",
        epilog="Exit codes: 0 all ok; 1 some case failed or regressed; 2 input wrong, nothing run; 130 interrupted; "
        "143 terminated.",
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
    with _ended_by_signal():
        return _carried_out(args)


@contextmanager
def _ended_by_signal() -> Iterator[None]:
    """SIGTERM ends a command like Ctrl-C: with its workers ended and what is finished kept."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(number: int, frame: object) -> None:
        raise Terminated

    before = signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _carried_out(args: argparse.Namespace) -> int:
    from reports.atomic import WriteError

    try:
        return int(importlib.import_module(f"pipeline.commands.{args.command}").main(args))
    except KeyboardInterrupt as why:
        number = signal.SIGTERM if isinstance(why, Terminated) else signal.SIGINT
        print("\ninterrupted; what is finished is kept, the same command goes on from there", file=sys.stderr)
        return 128 + number
    except WriteError as error:
        print(error, file=sys.stderr)
        return FAILED
    except BrokenPipeError:
        # the reader of a pipe (head, less) has gone: not an error of ours
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return OK


if __name__ == "__main__":
    sys.exit(main())
