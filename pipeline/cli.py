"""The command line: argparse, never interactive; verbs are the modules of ``pipeline.commands``."""

import argparse
import importlib
import re
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NoReturn

import shtab

from pipeline import one_thread
from pipeline.commands import VERBS, complain, unwritable
from pipeline.commands.ended import Terminated, ended_by_signal
from pipeline.commands.summaries import remove_summaries
from pipeline.status import InputError, StageError, did_you_mean
from pipeline.streams import lasting
from reports.atomic import WriteError
from reports.texts import UnreadableError, status_of

OK, FAILED, BAD_INPUT = 0, 1, 2
COMMAND_LINE = "the command line"


KINDS = {"int": "a whole number", "float": "a number"}
UNITS = {"--case-timeout": " of seconds, as 60", "--case-memory": " of MiB, as 2048"}
"""Units of options, for who wrote one beside the number (1m, 2G)."""
WORDED: tuple[tuple[str, Callable[[re.Match[str]], str]], ...] = (
    (
        r"argument (\S+): invalid (int|float) value: (.*)",
        lambda m: f"{_short(m[1])} {m[3]}: expected {KINDS[m[2]]}{UNITS.get(m[1], '')}",
    ),
    (
        r"argument (\S+): invalid choice: ('.*?') \(choose from (.*)\)",
        lambda m: f"{_short(m[1])} {m[2]}: allowed: {m[3]}",
    ),
    (
        r"argument (\S+): expected one argument",
        lambda m: f"{_short(m[1])}: its value is missing (one that begins with - is written {_short(m[1])}=-VALUE)",
    ),
    (
        r"argument (\S+): not allowed with argument (\S+)",
        lambda m: f"{_short(m[1])} and {_short(m[2])}: give one of them",
    ),
    (r"the following arguments are required: (.*)", lambda m: f"missing: {', '.join(map(_short, m[1].split(', ')))}"),
    (r"one of the arguments (.*) is required", lambda m: f"missing: one of {', '.join(m[1].split())}"),
)
"""Patterns of argparse's error messages, each with the function that rewords the match."""


NOWHERE = {
    "no locator available": "compiled code can be kept nowhere: neither the package's folder nor the user's cache "
    "folder is writable; set NUMBA_CACHE_DIR to a folder that is",
    "determine home directory": "the user has no home folder: set HOME, or XDG_CACHE_HOME to a folder for caches",
}
"""What numba and pathlib say in a container whose user is a mere number."""


def _short(names: str) -> str:
    return names.partition("/")[0]


class Parser(argparse.ArgumentParser):
    """A parser that raises its errors as InputError, worded like all others, instead of printing a page of usage."""

    def error(self, message: str) -> NoReturn:
        """Raise InputError."""
        found = ((re.fullmatch(pattern, message), say) for pattern, say in WORDED)
        text = next((say(match) for match, say in found if match), message)
        raise _usage(f"{text}; {self.prog} --help lists what there is")


def parsers() -> tuple[Parser, dict[str, Parser]]:
    """The parser of the whole command line, and that of each verb by its name."""
    parser = Parser(
        prog="wireval",
        allow_abbrev=False,
        description="Validate simulated guide wires against 3D scans.",
        epilog="Exit codes: 0 all ok; 1 some case failed or regressed, or a gate closed; 2 input wrong, nothing run; "
        "130 interrupted; 143 terminated.",
    )
    parser.add_argument("--version", action="store_true", help="print the version")
    shtab.add_argument_to(
        parser, "--print-completion", help="print what makes this shell complete commands and options"
    )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    verbs: dict[str, Parser] = {}
    for name in VERBS:
        verb = importlib.import_module(f"pipeline.commands.{name}")
        verbs[name] = commands.add_parser(name, help=verb.HELP, description=verb.HELP, allow_abbrev=False)
        verb.add_arguments(verbs[name])
        for action in verbs[name]._actions:
            if action.type is Path:
                action.complete = shtab.FILE  # type: ignore[attr-defined]
    return parser, verbs


def parsed(words: Sequence[str]) -> argparse.Namespace:
    """Parse the command line; InputError for what cannot be carried out, argparse's exit for --help."""
    if "" in words:
        raise _usage("an empty argument; name a file, a folder or a value, or leave it out")
    parser, verbs = parsers()
    if words and not words[0].startswith("-") and words[0] not in verbs:
        raise _usage(f"{words[0]!r} is no command; {did_you_mean(words[0], verbs)}")
    try:
        args, unknown = parser.parse_known_args(words)
    except InputError:  # of --curve=x it was said that --curves is missing
        verb = words[0] if words and words[0] in verbs else ""
        known = verbs[verb]._option_string_actions if verb else {}
        typed = [word for word in words if word.startswith("--") and word.partition("=")[0] not in known]
        if not verb or not typed or "--" in words:
            raise
        raise _unknown(typed[0].partition("=")[0], verb, known) from None
    if unknown:
        allowed = verbs[args.command]._option_string_actions if args.command else parser._option_string_actions
        raise _unknown(unknown[0], args.command, allowed, words)
    if not args.command and not args.version:
        parser.print_help()
    return args


def _unknown(
    word: str, verb: str | None, allowed: Mapping[str, argparse.Action], words: Sequence[str] = ()
) -> InputError:
    """What is said of a word that a verb does not know. words : all that was typed."""
    long = [name for name in allowed if name.startswith("--")]
    hint = did_you_mean(word, long) if word.startswith("-") else "one argument too many"
    before = [one for one in words[: words.index(word)] if one.startswith("-")] if word in words else []
    again = bool(before) and isinstance(allowed.get(before[-1]), argparse._AppendAction) and not word.startswith("-")
    a_file = not word.startswith("-") and (word.endswith(".toml") or bool(status_of(Path(word))))
    if verb in OF_MANIFEST and a_file and not again:
        own = ", each with an OUT of its own" * ("--out" in allowed)
        return _usage(f"{word}: {verb} takes one manifest; {SEVERAL}{own}")
    if again:
        hint = f"{before[-1]} takes one value; repeat it: {before[-1]} {word}"
    return _usage(f"{word}: not an option of wireval {verb or ''}; {hint}".replace(" ;", ";"))


OF_MANIFEST = "check", "run", "score", "calibrate"
SEVERAL = "several are joined into one, as docs/howto/cluster.md says, or run one by one"


def _usage(problem: str) -> InputError:
    error = InputError([problem])
    error.place = COMMAND_LINE
    return error


def carried_out(args: argparse.Namespace) -> int:
    """Carry out a verb and return its exit code; InputError or StageError where what was given cannot be used.

    First the summaries of an earlier command go: one that is refused would leave them, all passed. Then it checks that
    every place to write is writable, so that no result is computed that cannot be saved.
    """
    for value in vars(args).values():
        for path in value if isinstance(value, list) else [value]:
            if isinstance(path, Path):
                status_of(path)  # a name that cannot be one is refused here, whatever it was to be
    problems = remove_summaries(args)
    if (jobs := getattr(args, "jobs", 1)) < 1:
        problems.append(f"-j {jobs}: expected 1 or more")
    out, junit = getattr(args, "out", None), getattr(args, "junit", None)
    if out is not None:
        problems += unwritable(Path(out), "OUT" if args.command == "report" else "-o", folder=True)
    if junit is not None:
        problems += unwritable(Path(junit), "--junit")
        if out is not None and Path(junit).absolute() == Path(out).absolute():
            problems.append(f"--junit {junit}: this is the folder of the results; name a file")
    if problems:
        raise _usage(problems[0])
    return int(importlib.import_module(f"pipeline.commands.{args.command}").main(args))


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code; a reader that closes the output pipe early does not change it."""
    with lasting() as out:
        code = _main(argv)
        out.flush()
        if out.lost:  # a table that is cut short is no success
            print(f"the output cannot be written: {out.lost}; make room, then give the command again", file=sys.stderr)
        return code or (FAILED if out.lost else OK)


def _main(argv: Sequence[str] | None) -> int:
    args = argparse.Namespace()
    if argv is None:  # run as a program: nothing has been computed in this process yet
        one_thread()
    try:
        args = parsed(sys.argv[1:] if argv is None else argv)
        if args.version:
            from pipeline.run.provenance import package_version

            print(f"wireval {package_version()}")
            return OK
        if not args.command:
            return BAD_INPUT
        with ended_by_signal():
            return carried_out(args)
    except (InputError, StageError, UnreadableError) as error:
        told = error if isinstance(error, InputError) else InputError([str(error)])
        then = "" if getattr(args, "command", "") == "check" else f"; {told.then}"  # check never runs anything
        return complain(told.problems, told.place or str(getattr(args, "manifest", COMMAND_LINE)), then)
    except KeyboardInterrupt as why:
        number = signal.SIGTERM if isinstance(why, Terminated) else signal.SIGINT
        print("\ninterrupted" + _kept(args), file=sys.stderr)
        return 128 + number
    except WriteError as error:
        print(error, file=sys.stderr)
        return FAILED
    except RuntimeError as error:
        what = next((said for words, said in NOWHERE.items() if words in str(error)), None)
        if what is None:
            raise
        return complain([what], "the environment")


def _kept(args: argparse.Namespace) -> str:
    """Words for an interrupted run or score: what is kept and how to continue; empty for other commands."""
    if getattr(args, "command", None) not in ("run", "score") or getattr(args, "dry_run", False):
        return ""
    again = "the same command without --fresh" if args.fresh else "the same command"
    return f"; what is finished is kept, {again} goes on from there"


if __name__ == "__main__":
    sys.exit(main())
