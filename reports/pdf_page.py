"""A page on paper, filled from the top: paragraphs, lists, tables and figures, all of them whole."""

import textwrap
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from reports.figures._drawing import Drawing

_A4_INCH = (8.27, 11.69)
_LEFT, RIGHT, _TOP, BOTTOM = 0.08, 0.92, 0.95, 0.05
_WIDE_INCH = (RIGHT - _LEFT) * _A4_INCH[0]
_DOTS_PER_INCH = 200  # of a figure as it is printed
_STRETCH = 0.85, 1.6  # of a figure's own height, to fill a page: labels neither touch nor lie far apart
_BESIDE_SCANS = 0.5  # that height and width are kept at least, of a figure and of scans on one page
_LEAST_WIDTH = 0.35  # of the page: what is smaller, as the map of hundreds of cases, cannot be read
WIDE = 104  # characters of 9 points
_LINE = 0.0165  # of the page's height, for type of 9 points
_SMALL = _LINE * 8 / 9


class Figured(NamedTuple):
    """A figure with what stands above and below it."""

    drawing: Drawing
    title: str
    read: str

    @property
    def words(self) -> float:
        """The share of the page that title and caption take."""
        return (_lines(self.read) + 0.4) * _SMALL + 2.5 * _LINE


class Page:
    """A page that is filled from the top."""

    def __init__(self, title: str) -> None:
        self.figure = Figure(figsize=_A4_INCH)
        self.at = _TOP
        self.text(title, size=14, weight="bold")

    def text(self, text: str, size: float = 9, width: int = WIDE, colour: str = "black", **look: Any) -> None:
        """A paragraph, broken at ``width`` characters of 9 points; what does not fit the page is left out."""
        lines = textwrap.wrap(text, round(width * 9 / size)) or [""]
        step = _LINE * size / 9
        for line in lines:
            if self.at < BOTTOM + step:
                return
            self.figure.text(_LEFT, self.at, line, size=size, va="top", color=colour, **look)
            self.at -= step
        self.at -= 0.4 * step

    def some(self, title: str, texts: Sequence[str], rest_stands: str, most: int | None = None) -> None:
        """As many of the texts as ``most`` and the page allow, each whole, and how many more there are."""
        if not texts:
            return
        self.text(f"{title} ({len(texts)})", size=10, weight="bold")
        for number, text in enumerate(texts[:most]):
            high = _lines(text) * _SMALL + 2.4 * _SMALL  # and the line that counts the rest
            if self.at - high < BOTTOM:
                texts, most = texts[number:], 0
                break
            self.text(text, size=8)
        rest = len(texts) - len(texts[:most])
        if rest:
            self.text(f"… and {rest} more {rest_stands}", size=8)

    def height(self, texts: Sequence[str]) -> float:
        """The share of the page that ``some`` takes for all of the texts."""
        return sum((_lines(text) + 0.4) * _SMALL for text in texts) + 5.0 * _LINE if texts else 0.0

    def most(self, figures: Sequence[Figured], below: float = 0.0) -> int:
        """How many of the figures, from the first on, have room where a share ``below`` of the page is left free."""
        return sum(self.left(figures[: n + 1]) >= below for n in range(len(figures)))

    def left(self, figures: Sequence[Figured]) -> float:
        """The share of the page that is left below the figures, as low as they may be drawn."""
        least = [_BESIDE_SCANS if one.drawing.scans else _STRETCH[0] for one in figures]
        taken = [share * _own_height(one.drawing) + one.words for share, one in zip(least, figures, strict=True)]
        return self.at - BOTTOM - sum(taken)

    def pictures(self, figures: Sequence[Figured], below: float = 0.0) -> None:
        """Figures with titles and captions, that fill the rest of the page but for a share ``below``.

        Rows of scans, whose panels have one scale, stand as they are; the others give way or are stretched.
        """
        own = [_own_height(one.drawing) for one in figures]
        stiff = sum(high for one, high in zip(figures, own, strict=True) if one.drawing.scans)
        soft, least = sum(own) - stiff, _BESIDE_SCANS if stiff else _STRETCH[0]
        room = self.at - BOTTOM - below - sum(one.words for one in figures)
        scans = float(np.clip((room - soft) / max(stiff, 1e-9), _BESIDE_SCANS, 1.0))
        rest = room - scans * stiff
        stretch = float(np.clip(rest / max(soft, 1e-9), least, _STRETCH[1]))
        others = min(1.0, rest / max(stretch * soft, 1e-9))
        for one, high in zip(figures, own, strict=True):
            self._picture(one, high, *((1.0, scans) if one.drawing.scans else (stretch, others)))

    def _picture(self, one: Figured, own: float, stretch: float, shrink: float) -> None:
        """A figure of so great a height of its own, drawn for this place; none where it would be too small."""
        wide, high = shrink * (RIGHT - _LEFT), shrink * stretch * own
        if shrink < _LEAST_WIDTH or self.at - high - one.words < BOTTOM - _LINE:
            return
        figure = one.drawing.figure
        figure.set_figheight(stretch * figure.get_figheight())
        figure.set_dpi(_DOTS_PER_INCH * wide * _A4_INCH[0] / figure.get_figwidth())
        self.text(one.title, size=10.5, weight="bold")
        axes = self.figure.add_axes((_LEFT, self.at - high, wide, high))
        axes.imshow(one.drawing.pixels(), interpolation="none")
        axes.set_axis_off()
        self.at -= high + _LINE / 2
        self.text(one.read, size=8)

    def table(self, rows: Sequence[Sequence[str]], widths: Sequence[float]) -> None:
        """Rows of texts, the first as heading; ``widths``: of the columns, in sum the page's."""
        for number, row in enumerate(rows):
            if self.at < BOTTOM + _LINE:
                return
            left = _LEFT
            for text, width in zip(row, widths, strict=True):
                shown = textwrap.shorten(str(text), max(round(width * 135), 4), placeholder="…")
                self.figure.text(left, self.at, shown, size=7.5, va="top", weight="bold" if number == 0 else "normal")
                left += width
            self.at -= 0.85 * _LINE
        self.at -= 0.5 * _LINE


def _lines(text: str) -> int:
    """Lines of a paragraph of 8 points."""
    return max(1, len(textwrap.wrap(text, WIDE * 9 // 8)))


def _own_height(drawing: Drawing) -> float:
    """The share of the page that a figure takes at full width."""
    across, up = drawing.figure.get_size_inches()
    return float(up * _WIDE_INCH / across / _A4_INCH[1])
