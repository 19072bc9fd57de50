"""Outputs stay where the user put them: no link in an output folder leads out of it, nor to a case under two names."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from reports.case_files import listed

WRITTEN = "cases", "figures", "simulators", "sweep"
"""Folders of an output in which runs write, and remove what was there before."""
IN_A_CASE = "figures", "view"
"""Those of a case."""


def misleading_links(out: Path) -> list[str]:
    """A sentence each on links below ``out`` that lead out of it, and on results and folders that are links within it.

    What is written through these would land elsewhere; a case behind a link would be counted under two names. Links
    within it in a folder of the user's own are let be.
    """
    root, leading_out, twice, within = out.resolve(), [], [], []
    for path in _links(out):
        if not _target(path).is_relative_to(root):
            leading_out.append(path)
        elif (parts := _place(path.relative_to(out).parts))[0] in WRITTEN:
            if len(parts) == 2 and parts[0] != "figures":
                twice.append(path)
            elif len(parts) == 1 or (parts[0] == "cases" and len(parts) == 3 and parts[2] in IN_A_CASE):
                within.append(path)
    return [
        *_said(leading_out, f"{out}: links lead out of it", "outputs follow none: remove them, or name another -o"),
        *_said(twice, f"{out}: a result is a link to another", "it would be counted twice: remove it"),
        *_said(within, f"{out}: folders that runs write into are links", "outputs follow none: remove them"),
    ]


def _place(parts: tuple[str, ...]) -> tuple[str, ...]:
    """Where a link lies in an output, or in that of a simulator or of a point of a sweep, which are built alike."""
    return _place(parts[2:]) if len(parts) > 2 and parts[0] in ("simulators", "sweep") else parts


def _links(out: Path) -> Iterator[Path]:
    for folder, folders, files in os.walk(out, followlinks=False):
        yield from (path for name in (*folders, *files) if (path := Path(folder, name)).is_symlink())


def _said(links: Sequence[Path], what: str, do: str) -> list[str]:
    named = listed(sorted(f"{path} -> {path.readlink()}" for path in links))
    return [f"{what}: {named}; {do}"] * bool(links)


def _target(path: Path) -> Path:
    """Where a link leads in the end; a loop leads nowhere, which is not within."""
    try:
        return path.resolve()
    except (OSError, RuntimeError):
        return Path(path.anchor)
