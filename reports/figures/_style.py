"""How every figure looks: colours that colour-blind readers tell apart, one size, no display, no pyplot.

Colours are those of Okabe and Ito (2008). Line styles and markers repeat what colour says, for grey printers.
"""

from __future__ import annotations

import io
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial import cKDTree

from reports.atomic import write_bytes
from reports.tables import write_table

ORANGE, SKY, GREEN, YELLOW = "#E69F00", "#56B4E9", "#009E73", "#F0E442"
BLUE, VERMILION, PURPLE, GREY = "#0072B2", "#D55E00", "#CC79A7", "#7F7F7F"
SIMULATED, TRACED, TRUTH = BLUE, ORANGE, GREEN
SEQUENTIAL = "cividis"
STAGE_COLOURS = {
    "load": "#BFBFBF",
    "segment": GREEN,
    "trace": ORANGE,
    "simulate": BLUE,
    "compare": PURPLE,
    "report": YELLOW,
}
# the trivial predictors: column, what the legend says, colour, line style, marker
NULLS = (
    ("null_centreline_rms_mm", "centreline", PURPLE, "--", "s"),
    ("null_shortest_rms_mm", "shortest path", GREY, ":", "v"),
    ("null_min_bending_rms_mm", "least bending", GREEN, "-.", "D"),
    ("null_previous_rms_mm", "previous frame", "black", (0, (1, 3)), "x"),
)
DOTS_PER_INCH = 110
WIDTH_INCH = 8.0
_GREYS = 52  # finer than the noise of any scan worth a picture
_LOG_FROM_RATIO = 20.0  # below a range of 20 a linear axis reads better


@dataclass(frozen=True, eq=False)
class Drawing:
    """A figure and the numbers that it shows; ``compact`` stores it in a palette, for noisy grey scans."""

    figure: Figure
    table: pd.DataFrame
    compact: bool = False


def new_figure(height_inch: float, width_inch: float = WIDTH_INCH, fitted: bool = True) -> Figure:
    """Make an empty figure that draws into memory; ``fitted`` finds room for all labels by itself."""
    layout: Literal["constrained"] | None = "constrained" if fitted else None
    figure = Figure(figsize=(width_inch, height_inch), dpi=DOTS_PER_INCH, layout=layout)
    FigureCanvasAgg(figure)
    return figure


def save(drawing: Drawing, path: Path) -> None:
    """Write the PNG and, beside it, the CSV of what it shows."""
    canvas: Any = drawing.figure.canvas
    # drawn once: savefig would draw twice, and most of a page's time is drawing
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[..., :3]
    picture = _in_palette(pixels) if drawing.compact else Image.fromarray(np.ascontiguousarray(pixels))
    buffer = io.BytesIO()
    picture.save(buffer, format="png")
    write_bytes(path, buffer.getvalue())
    write_table(path.with_suffix(".csv"), drawing.table)


def _in_palette(pixels: NDArray[np.uint8]) -> Image.Image:
    """The picture (rows, columns, 3) in the palette: half the size where noise does not compress."""
    packed = pixels.astype(np.int64) @ np.array([1 << 16, 1 << 8, 1])
    codes, places = np.unique(packed, return_inverse=True)
    colours = np.stack([codes >> 16, codes >> 8 & 255, codes & 255], axis=1)
    nearest = np.asarray(cKDTree(_palette()).query(colours)[1], dtype=np.uint8)
    height, width = packed.shape
    picture = Image.frombytes("P", (width, height), nearest[places].tobytes())
    picture.putpalette(_palette().ravel().tolist())
    return picture


@cache
def _palette() -> NDArray[np.uint8]:
    """Greys of a scan, and the curves' colours mixed with them: a palette taken from the picture loses these."""
    greys = np.repeat(np.linspace(0.0, 255.0, _GREYS)[:, None], 3, axis=1)
    backgrounds = np.linspace(0.0, 255.0, 5)
    colours = [255.0 * np.array(to_rgb(c)) for c in (ORANGE, SKY, GREEN, VERMILION, BLUE)]
    mixed = [
        share * c + (1 - share) * b for c in colours for b in backgrounds for share in (1.0, 0.75, 0.5, 0.25)
    ]
    return np.concatenate([greys, mixed]).round().astype(np.uint8)


def plain(axes: Axes) -> None:
    """Light grid, no box."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(visible=True, color="0.9", linewidth=0.6)
    axes.set_axisbelow(True)


def positive_axis(axes: Axes, values: Iterable[Any]) -> None:
    """Make y logarithmic with plain numbers where the values span decades, else linear from zero."""
    numbers = np.concatenate([np.asarray(v, dtype=float).ravel() for v in values] or [np.zeros(0)])
    kept = numbers[np.isfinite(numbers) & (numbers > 0)]
    if len(kept) and kept.max() > _LOG_FROM_RATIO * kept.min():
        axes.set_yscale("log")
        axes.set_ylim(kept.min() / 1.5, kept.max() * 1.5)
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
    else:
        axes.set_ylim(bottom=0.0)


def whole_numbers(axis: Any) -> None:
    """Ticks at integers only: there is no frame 2.5."""
    axis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))


def has(table: pd.DataFrame, *columns: str) -> bool:
    """Say whether any of the columns has a number to show."""
    return any(table[column].notna().any() for column in columns if column in table)
