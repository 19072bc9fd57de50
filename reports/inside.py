"""Outputs stay where the user put them: no link in an output folder may lead out of it."""

import os
from pathlib import Path

MOST_NAMED = 5


def links_out(out: Path) -> list[str]:
    """A sentence where links below ``out`` lead out of it: what is written through them would land elsewhere."""
    root = out.resolve()
    found = []
    for folder, folders, files in os.walk(out, followlinks=False):
        for name in (*folders, *files):
            path = Path(folder, name)
            if path.is_symlink() and not _target(path).is_relative_to(root):
                found.append(f"{path} -> {path.readlink()}")
    if not found:
        return []
    named = ", ".join(sorted(found)[:MOST_NAMED])
    return [f"{out}: {len(found)} links lead out of it ({named}); outputs follow none: remove them, or name another -o"]


def _target(path: Path) -> Path:
    """Where a link leads in the end; a loop leads nowhere, which is not within."""
    try:
        return path.resolve()
    except (OSError, RuntimeError):
        return Path(path.anchor)
