"""How figures are drawn, and what pages say, in numbers: sizes, places, widths, limits; the text's own numbers."""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from matplotlib.artist import Artist
from matplotlib.collections import Collection
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text

from reports import page
from reports.figures import Drawing
from tests.numbers.kept import digest

NUMBER = re.compile(r"(?<![\w.#-])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
MARKUP = re.compile(r"<(style|script)\b.*?</\1>|<[^>]*>", re.DOTALL)
TIMED = ("run_time",)
"""Figures that the machine's speed is in."""
SPEED = re.compile(r"[\d.]+ m?s\b")
ROUNDED = {"convergence": ("texts", "paths")}
"""What of a figure has points that are rounding alone."""
WORDINGS = 100_000
"""How many checksums of a text there are: with a tolerance of 1e-3 one of five hundred others passes for it."""

WEIGHTS = {"normal": 400, "bold": 700}
LOOKS: tuple[tuple[str, type[Artist], Callable[[Any], Iterable[Any]]], ...] = (
    ("shown", Artist, lambda a: [a.get_visible(), a.get_rasterized()]),
    ("weights", Text, lambda a: [WEIGHTS.get(a.get_weight(), a.get_weight())]),
    ("texts", Text, lambda a: [*a.get_position(), a.get_size(), a.get_rotation(), len(a.get_text())]),
    ("lines", Line2D, lambda a: [a.get_linewidth(), a.get_markersize(), a.get_alpha() or 1.0, a.get_zorder()]),
    ("paths", Line2D, lambda a: [*_numbers(a.get_xdata()), *_numbers(a.get_ydata())]),
    ("patches", Patch, lambda a: [*a.get_extents().bounds, a.get_linewidth(), a.get_alpha() or 1.0, a.get_zorder()]),
    ("collections", Collection, lambda a: [*_numbers(a.get_offsets()), *_numbers(a.get_linewidths()), a.get_zorder()]),
    ("images", AxesImage, lambda a: [*a.get_extent(), *digest(np.ma.filled(a.get_array(), 0))]),
)


def _numbers(values: Any) -> list[float]:
    try:
        return [float(value) for value in np.ravel(np.ma.filled(values, np.nan)).astype(float)]
    except (TypeError, ValueError):  # names along an axis
        return [float(len(values))]


def looks(figure: Figure) -> dict[str, list[float]]:
    """The layout of a figure that is not drawn yet: of each kind of its artists a digest of what they are set to."""
    found = {"size": [*figure.get_size_inches(), len(figure.axes)]}
    found["panels"] = digest([v for a in figure.axes for v in (*a.get_position().bounds, *a.get_xlim(), *a.get_ylim())])
    found["grids"] = digest(
        [v for a in figure.axes for v in (a.get_axisbelow() is True, len(a.get_xscale() + a.get_yscale()))]
    )
    artists = figure.findobj()
    for name, kind, of in LOOKS:
        found[name] = digest([float(value) for one in artists if isinstance(one, kind) for value in of(one)])
    return found


@contextmanager
def drawn(without: tuple[str, ...] = ()) -> Iterator[dict[str, list[float]]]:
    """Collects in a ``with`` block the looks of every figure that a page has drawn, but for those of these names."""
    found: dict[str, list[float]] = {}
    save = page.save

    def saved(drawing: Drawing, path: Path) -> Any:
        if path.stem not in without:
            place = "_".join(path.relative_to(path.parents[2]).with_suffix("").parts).replace(" ", "-")
            own = looks(drawing.figure).items()
            found.update({f"{place}.{name}": values for name, values in own if name not in ROUNDED.get(path.stem, ())})
        return save(drawing, path)

    with patch.object(page, "save", saved):
        yield found


def said(name: str, text: str) -> dict[str, list[float]]:
    """A digest of the numbers in a text, and a checksum of its words; paths are left out."""
    words = [word for word in MARKUP.sub(" ", text).split() if "/" not in word]
    # so that each may tell, the small ones too
    numbers = [np.arcsinh(float(number)) for word in words for number in NUMBER.findall(word)]
    checksum = zlib.crc32(" ".join(NUMBER.sub("", word) for word in words).encode())
    return {f"{name}.said": digest(numbers), f"{name}.words": [len(words), checksum % WORDINGS]}


@contextmanager
def printed() -> Iterator[dict[str, list[float]]]:
    """Collects in a ``with`` block what a verb prints."""
    found: dict[str, list[float]] = {}
    with redirect_stdout(StringIO()) as text:
        yield found
    found |= said("printed", SPEED.sub("", text.getvalue()))
