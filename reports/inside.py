"""Outputs stay where the user put them: no link in an output folder leads out of it, nor to a case under two names."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from reports.case_files import listed

FOLDERS = "cases", "figures", "simulators", "sweep", "view"
"""Folders in which runs write, and remove what they wrote."""


def misleading_links(out: Path) -> list[str]:
    """A sentence each on links below ``out`` that lead out of it, and on cases and folders that are links within it.

    What is written through these would land elsewhere; a case behind a link would be counted under two names.
    """
    root, leading_out, twice, within = out.resolve(), [], [], []
    for path in _links(out):
        if not _target(path).is_relative_to(root):
            leading_out.append(path)
        elif path.parent.name == "cases":
            twice.append(path)
        elif path.name in FOLDERS and path.is_dir():
            within.append(path)
    return [
        *_said(leading_out, f"{out}: links lead out of it", "outputs follow none: remove them, or name another -o"),
        *_said(twice, f"{out}: a case is a link to another", "it would be counted twice: remove it"),
        *_said(within, f"{out}: folders that runs write into are links", "outputs follow none: remove them"),
    ]


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
