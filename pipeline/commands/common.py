"""What several commands share: settings from the command line, messages for wrong input."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Sequence

from pipeline.study.settings import Resolved, Setting, parse_assignment, read_settings, resolve


def settings_of(args: Namespace) -> list[Setting]:
    """Settings files first, then --set; raises SettingsError."""
    read = [setting for path in args.config for setting in read_settings(path)]
    return read + [parse_assignment(text) for text in args.settings]


def resolved_settings(args: Namespace) -> Resolved:
    """The settings in force; raises SettingsError listing every problem."""
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
