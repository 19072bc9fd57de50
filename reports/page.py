"""A page: its figures drawn into a folder, and a template rendered with them."""

import base64
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Protocol, TypeVar

import jinja2
from markupsafe import Markup

from reports import _content, colours
from reports.alike import of_what
from reports.atomic import remove_files, write_text
from reports.figures import figures_of
from reports.figures._drawing import DOTS_PER_INCH, save
from reports.sections import declared

R = TypeVar("R")
LONGEST = "projections", "contact_along_wire", "run_time"
_NIGHT = "0.52 -0.64 -0.48 0 0.69  -0.48 0.36 -0.48 0 0.69  -0.48 -0.64 0.52 0 0.69  0 0 0 1 0"
"""The matrix by which paper becomes the dark page and ink light, while colours stay theirs."""


class Each(Protocol):
    """Does ``work(i)`` for every i below ``count``, in turn or shared among processes, and returns the results."""

    def __call__(self, work: Callable[[int], R], count: int) -> list[R]:
        """Their results, in order; none of them may be None."""


def one_by_one(work: Callable[[int], R], count: int) -> list[R]:
    """Do the work for each number in turn, in this process."""
    return [work(number) for number in range(count)]


def longest(entries: Sequence[Mapping[str, Any]]) -> list[int]:
    """The numbers, from 1, of the figures of which each takes as long as many others."""
    return [number for number, entry in enumerate(entries, 1) if entry["figure"] in LONGEST]


def begun_first(first: Sequence[int], work: Callable[[int], R], count: int, each: Each) -> list[R]:
    """Results in order, though some works are begun first: begun last, one would keep a core busy alone."""
    order = sorted(range(count), key=lambda number: number not in first)
    done = dict(zip(order, each(lambda turn: work(order[turn]), count), strict=True))
    return [done[number] for number in range(count)]


def draw_sections(page: str, data: Any, folder: Path, embed: bool, each: Each = one_by_one) -> list[dict[str, Any]]:
    """Draw every declared figure of a page into ``folder``/figures; a figure without data is left out.

    Each is described by its entry in sections.toml, by ``source`` and ``numbers``, which are links or (with ``embed``)
    the files themselves as data URIs, and by its width and height in pixels. The picture of a figure that has no data
    any more is removed.
    """
    entries = declared(page)
    return list(filter(None, each(lambda i: section(page, entries[i], data, folder, embed), len(entries))))


def section(page: str, entry: Mapping[str, Any], data: Any, folder: Path, embed: bool) -> dict[str, Any]:
    """One figure, drawn and described; empty without data."""
    path = folder / "figures" / f"{entry['figure']}.png"
    drawing = figures_of(page)[entry["figure"]](data)
    if drawing is None:
        # a folder of that name is no picture
        remove_files(*(file for file in (path, path.with_suffix(".csv")) if not file.is_dir()))
        return {}
    save(drawing, path)
    width, height = (round(DOTS_PER_INCH * inch) for inch in drawing.figure.get_size_inches())
    source = _link(path, folder, "image/png", embed)
    numbers = _link(path.with_suffix(".csv"), folder, "text/csv", embed)
    shown = {"source": source, "numbers": numbers, "width": width, "height": height, "marks": drawing.marks}
    said = {part: _content.caption(entry[part], drawing.table) for part in ("title", "read", "bad")}
    return {**entry, **shown, **said, "kept": drawing.kept}


def write_page(template: str, page: Mapping[str, Any], path: Path) -> Path:
    """Fill in a template of this package, everything escaped, and write it. A name that it misses is an error."""
    write_text(path, _templates().get_template(template).render(page))
    return path


@cache
def compiled() -> None:
    """Compile the templates of a run's pages ahead, beside other work: that takes as long as filling them in."""
    for name in ("case.html.j2", "index.html.j2", "macros.html.j2", "viewer.html.j2", "base.html.j2"):
        _templates().get_template(name)


@cache
def _templates() -> jinja2.Environment:
    """The templates, each compiled once a process."""
    templates = Path(__file__).parent / "templates"
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(templates), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True
    )
    # style and scripts stand in every page: a copied one works from a disk without a network
    fixed = {
        "colours": colours,
        "night": _NIGHT,
        "part": lambda name: Markup((templates / name).read_text(encoding="utf-8")),
    }
    environment.filters["of_what"] = of_what
    environment.globals.update(fixed)  # macros see these, and nothing of the page
    return environment


def _link(path: Path, folder: Path, kind: str, embed: bool) -> str:
    if not embed:
        return path.relative_to(folder).as_posix()
    return f"data:{kind};base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"
