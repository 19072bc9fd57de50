"""Files that tell a build server, or a reader, what became of a command: --junit, --json, --markdown, --html.

Those of an earlier command go before anything is begun: where a command is refused they would stay, all passed. What is
no summary stays: a scan or a result may stand under a name that was mistyped.
"""

import argparse
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

OURS = {
    "junit": b'<testsuites name="wireval',
    "json": b'"closed": ',
    "markdown": b"\nfirst: `",
    "html": b"<title>Two runs beside each other - wireval</title>",
}
"""What the beginning of each kind of summary holds."""
BEGINNING = 4096


def remove_summaries(args: argparse.Namespace) -> list[str]:
    """Remove the summaries that the command would write anew; where one is in the way, why, and all stay."""
    asked = {name: Path(path) for name in OURS if (path := getattr(args, name, None)) is not None}
    problems = [problem for name, path in asked.items() for problem in _in_the_way(name, path)]
    if not problems and not getattr(args, "dry_run", False):
        for path in asked.values():
            with suppress(OSError):  # said where it is tried whether the place is writable
                if path.is_file() and not path.is_symlink():
                    path.unlink()
    return problems


def _in_the_way(name: str, path: Path) -> Iterator[str]:
    """Why what stands at a path is not replaced by a summary; nothing where it may be, or is not there."""
    try:
        if not path.exists() or path.is_dir():  # a folder is told of where it is tried whether the place is writable
            return
        if not path.is_file():
            yield f"--{name} {path}: this is a device or a pipe; expected the name of a file"
            return
        with path.open("rb") as file:
            begins = file.read(BEGINNING)
    except OSError as error:
        yield f"--{name} {path}: {error.strerror or error}; name another file"
        return
    if begins and OURS[name] not in begins:
        yield (
            f"--{name} {path}: this file is no earlier summary, it would be lost; name another file, or remove it "
            "if it is not needed"
        )
