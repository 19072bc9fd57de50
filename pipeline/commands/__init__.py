"""One module per verb of the command line: HELP, ``add_arguments(parser)`` and ``main(args) -> exit code``.

Here is what several verbs share: settings from the command line, messages for wrong input. What a verb needs it imports
inside ``main``, so that --help is instant.
"""

import argparse
import sys
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pipeline.study.settings import Resolved, Setting

VERBS = ("check", "init", "run", "score", "calibrate", "report", "diff", "settings", "synth", "bench", "cache")
"""In the order of --help."""


def add_settings(parser: argparse.ArgumentParser) -> None:
    """-c and --set."""
    add = parser.add_argument
    add("-c", "--config", type=Path, action="append", default=[], metavar="CFG", help="settings (TOML)")
    add("--set", action="append", default=[], dest="settings", metavar="TABLE.KEY=VALUE", help="one setting")


def add_gates(parser: argparse.ArgumentParser, of: str = "overall.csv", metavar: str = "COLUMN>VALUE") -> None:
    """--fail-if and --junit. of : which table is asked."""
    says = f"exit 1 where a number of {of} is so, or missing; >, <, >= or <=; may be repeated"
    parser.add_argument("--fail-if", action="append", default=[], metavar=metavar, help=says)
    says = "write a JUnit summary, one test per frame and gate"
    parser.add_argument("--junit", type=Path, metavar="FILE", help=says)


def add_quiet(parser: argparse._ActionsContainer) -> None:
    """-q."""
    says = "print the result alone; warnings and failures to stderr"
    parser.add_argument("-q", "--quiet", action="store_true", help=says)


def add_verbosity(parser: argparse.ArgumentParser) -> None:
    """-q and -v."""
    how = parser.add_mutually_exclusive_group()
    add_quiet(how)
    how.add_argument("-v", "--verbose", action="store_true", help="print every step, those of the simulation too")


def settings_of(args: argparse.Namespace) -> "list[Setting]":
    """Settings files first, then --set; raises SettingsError.

    A verb without --parameters takes none, whatever a file of settings was used with.
    """
    from pipeline.study.settings import parse_assignment, read_settings, without_parameters

    read = [setting for path in args.config for setting in read_settings(path)]
    given = getattr(args, "parameters", ()) is not None
    return without_parameters(read, given=given) + [parse_assignment(text) for text in args.settings]


def resolved_settings(args: argparse.Namespace) -> "Resolved":
    """The settings in force, and which parameters are given beside them; raises SettingsError listing every problem."""
    from dataclasses import replace

    from pipeline.run.hashing import file_hash
    from pipeline.study.settings import resolve

    found, path = resolve(settings_of(args)), getattr(args, "parameters", None)
    if path is None or not path.is_file():  # what else stands there is told where it is read
        return found
    return replace(found, calibrated=(file_hash(path)[:12], str(path)))


def complain(problems: Sequence[str], what: str, then: str = "; nothing was run") -> int:
    """List problems on stderr, with their number and what follows; returns exit code 2."""
    for problem in problems:
        sys.stderr.write(f"{problem}\n")
    sys.stderr.write(f"{len(problems)} problem{'s' * (len(problems) != 1)} in {what}{then}\n")
    return 2


def unwritable(place: Path, option: str, *, folder: bool = False) -> list[str]:
    """Why nothing can be written at a place, a folder or a file to be; empty where something can.

    Tried with a folder that goes again, in the nearest one that exists: permissions alone do not tell.
    """
    try:
        loose = next((one for one in (place, *place.absolute().parents) if one.is_symlink() and not one.exists()), None)
        if folder and loose is not None:
            return [f"{option} {place}: {loose} is a link to nothing ({loose.readlink()}); remove it, or name a folder"]
        if folder and place.exists() and not place.is_dir():
            return [f"{option} {place}: this is a file; name a folder"]
        if not folder and place.is_dir():
            return [f"{option} {place}: this is a folder; name a file"]
        nearest = next(one for one in (place, *place.absolute().parents) if one.exists())
        if not folder and nearest == place:
            nearest = place.parent
        with tempfile.TemporaryDirectory(prefix=".tmp-", dir=nearest):
            return []
    except OSError as error:
        return [f"{option} {place}: cannot be written: {error.strerror or error}; name a place where you may write"]


def aside(lines: Iterable[str], *, quiet: bool) -> None:
    """Lines that are not among the result, as warnings: with -q they go to stderr."""
    to = sys.stderr if quiet else sys.stdout
    to.writelines(f"{line}\n" for line in lines)
    to.flush()


def say(text: str) -> None:
    """One line on stdout."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()
