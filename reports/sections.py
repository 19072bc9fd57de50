"""The sections of a page: each declared figure that has data is drawn, saved and described."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

from reports.figures import declared, figures_of
from reports.figures._drawing import DOTS_PER_INCH, save

Section = dict[str, Any]
"""figure, title, read and bad as declared; source and numbers: links, or the files themselves as data URIs; width and
height in pixels."""


def draw_sections(page: str, data: Any, folder: Path, embed: bool) -> list[Section]:
    """Draw every declared figure of a page into ``folder``/figures; a figure without data is left out.

    A picture left from an earlier run whose data is gone is removed, so that nobody finds it in the folder.
    """
    sections = []
    for entry in declared(page):
        path = folder / "figures" / f"{entry['figure']}.png"
        drawing = figures_of(page)[entry["figure"]](data)
        if drawing is None:
            path.unlink(missing_ok=True)
            path.with_suffix(".csv").unlink(missing_ok=True)
            continue
        save(drawing, path)
        width, height = (round(DOTS_PER_INCH * inch) for inch in drawing.figure.get_size_inches())
        links = {
            "source": _link(path, folder, "image/png", embed),
            "numbers": _link(path.with_suffix(".csv"), folder, "text/csv", embed),
        }
        sections.append({**entry, **links, "width": width, "height": height})
    return sections


def _link(path: Path, folder: Path, kind: str, embed: bool) -> str:
    if not embed:
        return path.relative_to(folder).as_posix()
    return f"data:{kind};base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"
