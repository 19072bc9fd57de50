"""One module per verb of the command line: HELP, ``add_arguments(parser)`` and ``main(args) -> exit code``.

Here is what several verbs share: settings from the command line, messages for wrong input. What a verb needs it imports
inside ``main``, so that --help is instant.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pipeline.study.settings import Resolved, Setting

VERBS = ("check", "run", "calibrate", "report", "diff", "synth", "bench", "cache")
"""In the order of --help."""


def add_settings(parser: argparse.ArgumentParser) -> None:
    """-c and --set."""
    add = parser.add_argument
    add("-c", "--config", type=Path, action="append", default=[], metavar="CFG", help="settings (TOML)")
    add("--set", action="append", default=[], dest="settings", metavar="TABLE.KEY=VALUE", help="one setting")


def settings_of(args: argparse.Namespace) -> "list[Setting]":
    """Settings files first, then --set; raises SettingsError."""
    from pipeline.study.settings import parse_assignment, read_settings

    read = [setting for path in args.config for setting in read_settings(path)]
    return read + [parse_assignment(text) for text in args.settings]


def resolved_settings(args: argparse.Namespace) -> "Resolved":
    """The settings in force; raises SettingsError listing every problem."""
    from pipeline.study.settings import resolve

    return resolve(settings_of(args))


def complain(problems: Sequence[str], what: str) -> int:
    """List problems on stderr; returns exit code 2."""
    for problem in problems:
        sys.stderr.write(f"{problem}\n")
    sys.stderr.write(f"{len(problems)} problem{'s' * (len(problems) != 1)} in {what}; nothing was run\n")
    return 2


def say(text: str) -> None:
    """One line on stdout."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()
