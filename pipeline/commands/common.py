"""What several commands share: settings from the command line, messages for wrong input."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Sequence

from pipeline.settings import Resolved, Setting, parse_assignment, read_settings, resolve


def resolved_settings(args: Namespace, extra: Sequence[Setting] = ()) -> Resolved:
    """Settings files first, then --set, then ``extra``; raises SettingsError."""
    settings = [setting for path in args.config for setting in read_settings(path)]
    settings += [parse_assignment(text) for text in args.settings]
    return resolve([*settings, *extra])


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
