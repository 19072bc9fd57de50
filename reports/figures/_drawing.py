"""A figure from nothing to its files: one size and resolution, no display, no pyplot; the PNG and its numbers."""

from __future__ import annotations

import io
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial import cKDTree

from reports.atomic import write_bytes
from reports.figures._style import BLUE, GREEN, ORANGE, SKY, VERMILION
from reports.tables import write_csv

DOTS_PER_INCH = 110
WIDTH_INCH = 8.0
_GREYS = 52  # finer than the noise of any scan worth a picture


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
    write_csv(path.with_suffix(".csv"), drawing.table)


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
