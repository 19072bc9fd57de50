"""The declared sections of a page: each figure that has data is drawn, saved and described."""

from __future__ import annotations

import base64
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from reports.figures import Drawing
from reports.figures._style import DOTS_PER_INCH, save


@dataclass(frozen=True)
class Section:
    """One figure on a page. source and numbers are links, or the files themselves as data URIs."""

    figure: str
    title: str
    read: str
    bad: str
    source: str
    numbers: str
    width: int
    height: int


@cache
def declared(page: str) -> tuple[Mapping[str, str], ...]:
    """The entries of sections.toml for ``case`` or ``run``, in order."""
    text = (Path(__file__).parent / "sections.toml").read_text(encoding="utf-8")
    return tuple(tomllib.loads(text)[page])


def draw_sections(
    page: str,
    figures: Mapping[str, Callable[[Any], Drawing | None]],
    data: Any,
    folder: Path,
    embed: bool,
) -> list[Section]:
    """Draw every declared figure of a page into ``folder``/figures; a figure without data is left out.

    A picture left from an earlier run whose data is gone is removed, so that nobody finds it in the folder.
    """
    sections = []
    for entry in declared(page):
        path = folder / "figures" / f"{entry['figure']}.png"
        drawing = figures[entry["figure"]](data)
        if drawing is None:
            path.unlink(missing_ok=True)
            path.with_suffix(".csv").unlink(missing_ok=True)
            continue
        save(drawing, path)
        sections.append(_section(entry, drawing, path, folder, embed))
    return sections


def _section(entry: Mapping[str, str], drawing: Drawing, path: Path, folder: Path, embed: bool) -> Section:
    width, height = (round(DOTS_PER_INCH * inch) for inch in drawing.figure.get_size_inches())
    return Section(
        **entry,
        source=_link(path, folder, "image/png", embed),
        numbers=_link(path.with_suffix(".csv"), folder, "text/csv", embed),
        width=width,
        height=height,
    )


def _link(path: Path, folder: Path, kind: str, embed: bool) -> str:
    if not embed:
        return path.relative_to(folder).as_posix()
    return f"data:{kind};base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"
