"""A page: its declared figures drawn and saved, its template filled and written."""

import base64
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jinja2

from reports.atomic import write_text
from reports.figures import declared, figures_of
from reports.figures._drawing import DOTS_PER_INCH, save


def draw_sections(page: str, data: Any, folder: Path, embed: bool) -> list[dict[str, Any]]:
    """Draw every declared figure of a page into ``folder``/figures; a figure without data is left out.

    Each is described by its entry in sections.toml, by ``source`` and ``numbers``, which are links or the files
    themselves as data URIs, and by its width and height in pixels. A picture left from an earlier run whose data is
    gone is removed, so that nobody finds it in the folder.
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
        source = _link(path, folder, "image/png", embed)
        numbers = _link(path.with_suffix(".csv"), folder, "text/csv", embed)
        sections.append({**entry, "source": source, "numbers": numbers, "width": width, "height": height})
    return sections


def write_page(template: str, page: Mapping[str, Any], path: Path) -> Path:
    """Render a template of this package with everything escaped; a name it misses is an error, not a gap."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    write_text(path, environment.get_template(template).render(page))
    return path


def _link(path: Path, folder: Path, kind: str, embed: bool) -> str:
    if not embed:
        return path.relative_to(folder).as_posix()
    return f"data:{kind};base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"
