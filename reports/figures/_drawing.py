"""A figure from nothing to its files, without display or pyplot: made, its panels furnished, saved as PNG and CSV."""

import io
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial import cKDTree

from reports.atomic import write_bytes
from reports.colours import BAD, ERROR_SCALE_MM, FAR, SIMULATED, TRACED, TRUE
from reports.figures._style import SEQUENTIAL, Look
from reports.tables import write_csv

Array = NDArray[np.floating[Any]]
DOTS_PER_INCH = 110
WIDTH_INCH = 8.0
LOG_FROM_RATIO = 20.0  # below a range of 20 a linear axis reads better
LEAST_MM = 1e-3  # of a logarithmic axis: a trace is known to 0.01 mm at best, and equal curves differ by 1e-16
ROOM_ABOVE = 0.06  # of the largest value: half a marker is 0.03 of a panel 1.5 inches high
_ERROR_COLOURS = LinearSegmentedColormap.from_list("error", (SIMULATED, FAR))  # the viewer's
_COLOURS = LinearSegmentedColormap.from_list("sequential", SEQUENTIAL)
_ERROR_TICKS_MM = (ERROR_SCALE_MM[0], 0.1, 0.5, ERROR_SCALE_MM[1])  # no more: the bar beside two cases is an inch high
LONGEST_NAME = 32  # letters of a name that is drawn: 100, which are allowed, left an inch to the cells beside them
_GREYS = 52  # finer than the noise of any scan worth a picture


class FrameAxis(NamedTuple):
    """Where a panel has its frames: the value of each frame along x (``across``) or y; for marking one in a page."""

    axes: Axes
    of_frame: Mapping[int, float]
    across: bool = True


@dataclass(frozen=True, eq=False)
class Drawing:
    """A figure and the numbers that it shows; ``scans``: its pictures are of scans, stored in a palette of greys."""

    figure: Figure
    table: pd.DataFrame
    scans: bool = False
    frames: Sequence[FrameAxis] = ()

    @property
    def kept(self) -> list[list[float]]:
        """The panels that show scans, once drawn: their boxes, in shares; on a dark page all around them is turned."""
        return [[share / 100.0 for share in _box(a)] for a in self.figure.axes if self.scans and a.images]

    def pixels(self) -> Image.Image:
        """The figure as a picture at its own size and resolution."""
        canvas: Any = self.figure.canvas
        # drawn once: savefig would draw twice, and most of a page's time is drawing
        canvas.draw()
        pixels = np.asarray(canvas.buffer_rgba())[..., :3]
        return _in_palette(pixels) if self.scans else Image.fromarray(np.ascontiguousarray(pixels))

    @property
    def marks(self) -> list[dict[str, Any]]:
        """Each panel with frames, once drawn: its box (left, top, width, height) and their places, in percent."""
        return [_mark(self.figure, panel) for panel in self.frames]


def _box(axes: Axes) -> list[float]:
    """Left, top, width and height of a panel, percent of the figure."""
    box = axes.get_position()
    return [round(100.0 * float(v), 2) for v in (box.x0, 1.0 - box.y1, box.width, box.height)]


def _mark(figure: Figure, panel: FrameAxis) -> dict[str, Any]:
    size = figure.get_size_inches() * figure.dpi
    way = panel.axes.get_xaxis_transform() if panel.across else panel.axes.get_yaxis_transform()
    points = [(v, 0.5) if panel.across else (0.5, v) for v in panel.of_frame.values()]
    places = way.transform(np.array(points).reshape(-1, 2)) / size
    where = places[:, 0] if panel.across else 1.0 - places[:, 1]
    at = {str(n): round(100.0 * float(v), 2) for n, v in zip(panel.of_frame, where, strict=True)}
    return {"box": _box(panel.axes), "across": panel.across, "at": at}


def new_figure(height_inch: float, width_inch: float = WIDTH_INCH, fitted: bool = True) -> Figure:
    """Make an empty figure that draws into memory; ``fitted`` finds room for all labels by itself."""
    layout: Literal["constrained"] | None = "constrained" if fitted else None
    figure = Figure(figsize=(width_inch, height_inch), dpi=DOTS_PER_INCH, layout=layout)
    FigureCanvasAgg(figure)
    return figure


def lattice(
    count: int, most_across: int, row_inch: float, more_inch: float = 0.0, width_inch: float = WIDTH_INCH
) -> tuple[Figure, list[Axes]]:
    """A figure of ``count`` panels, row by row; ``more_inch`` is what legends need beside the rows."""
    across = min(count, most_across)
    rows = -(-count // across)
    figure = new_figure(row_inch * rows + more_inch, width_inch)
    panels = list(figure.subplots(rows, across, squeeze=False).ravel())
    for axes in panels[count:]:
        axes.remove()
    return figure, panels[:count]


def drawn_names(names: Sequence[str]) -> list[str]:
    """The names of a figure's cases as they are drawn: of a long one its beginning and end.

    Those that are the same then, as ids that differ in their middle are, have their place in the figure in front.
    """
    short = [name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 13]}\u2026{name[-12:]}" for name in names]
    count = Counter(short)
    return [f"{place}: {name}" if count[name] > 1 else name for place, name in enumerate(short, 1)]


def plain(axes: Axes) -> None:
    """Light grid, no box."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(visible=True, color="0.9", linewidth=0.6)
    axes.set_axisbelow(True)


def legend(owner: Any, *entries: Any, **place: Any) -> None:
    """Small print without a frame, for a panel or a figure; entries: handles and labels, else all there are."""
    owner.legend(*entries, frameon=False, fontsize=8, **place)


def whole_numbers(axis: Axis) -> None:
    """Ticks at integers only: there is no frame 2.5."""
    axis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))


def plain_decades(axis: Axis, subs: tuple[float, ...] = (1.0, 2.0, 5.0)) -> None:
    """Ticks of a logarithmic axis: these multiples of the powers of ten, as plain numbers."""
    axis.set_major_locator(LogLocator(subs=subs))
    axis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
    axis.set_minor_formatter(NullFormatter())


def positive_axis(axes: Axes, values: Iterable[Any]) -> None:
    """Make y logarithmic with plain numbers where the values, mm, span decades, else linear from zero.

    What is less than LEAST_MM is drawn there, and the axis says so.
    """
    numbers = np.concatenate([np.asarray(v, dtype=float).ravel() for v in values] or [np.zeros(0)])
    known = numbers[np.isfinite(numbers) & (numbers > 0)]
    kept = np.maximum(known, LEAST_MM)
    if len(kept) and kept.max() > LOG_FROM_RATIO * kept.min():
        axes.set_yscale("log")
        axes.set_ylim(kept.min() / 1.5, kept.max() * 1.5)
        plain_decades(axes.yaxis)
        if known.min() < LEAST_MM:
            _end_at_least(axes)
    else:
        from_zero(axes)
        if len(known) and known.max() < LEAST_MM:
            axes.set_ylim(0.0, LEAST_MM)  # an axis of 1e-16 mm would make differences of nothing


def from_zero(axes: Axes) -> None:
    """Let y begin at zero and end beyond the largest marker: matplotlib's margin is a share of the values' span."""
    most = max(panel.dataLim.y1 for panel in _with_this_y(axes))
    axes.set_ylim(bottom=0.0, top=most * (1.0 + ROOM_ABOVE) if 0.0 < most < np.inf else None)


def _with_this_y(axes: Axes) -> list[Axes]:
    """The panels that share its y axis, itself among them."""
    return axes.get_shared_y_axes().get_siblings(axes)


def _end_at_least(axes: Axes) -> None:
    """Draw all lines that fall below LEAST_MM there, with a tick that says what lies on it."""
    for line in (line for panel in _with_this_y(axes) for line in panel.lines):
        line.set_ydata(np.maximum(np.asarray(line.get_ydata(), dtype=float), LEAST_MM))
    tick = FuncFormatter(lambda v, _: f"\u2264 {v:g}" if v < 1.01 * LEAST_MM else f"{v:g}")
    axes.yaxis.set_major_formatter(tick)


def error_scale() -> Normalize:
    """The one scale of distances to the traced wire."""
    return LogNorm(*ERROR_SCALE_MM)


def heat_map(
    axes: Axes, grid: Array, edges: tuple[Array, Array], label: str, scale: Normalize, bar: Look, **cells: Any
) -> None:
    """Draw ``grid`` (rows, columns) between ``edges`` (across, up), with a colour bar; NaN is left blank.

    scale : of the colours; what lies outside has that of the nearer end.
    bar, cells : what else matplotlib is told of the colour bar and of the cells.
    """
    logarithmic, least = isinstance(scale, LogNorm), float(scale.vmin or 0.0)
    colours = _ERROR_COLOURS if logarithmic else _COLOURS
    mesh = axes.pcolormesh(*edges, np.maximum(grid, least), cmap=colours, norm=scale, **cells)
    figure: Any = axes.get_figure()
    extend = "both" if logarithmic else "max"
    shown = figure.colorbar(mesh, ax=axes, label=label, extend=extend, pad=0.01, **bar)
    if logarithmic:
        shown.set_ticks(_ERROR_TICKS_MM, labels=[f"{mm:g}" for mm in _ERROR_TICKS_MM])
        shown.ax.minorticks_off()
    plain(axes)
    axes.grid(visible=False)


def save(drawing: Drawing, path: Path) -> None:
    """Write the PNG and, beside it, the CSV of what it shows."""
    picture = drawing.pixels()
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
    colours = [255.0 * np.array(to_rgb(c)) for c in (TRACED, SIMULATED, TRUE, BAD)]
    mixed = [share * c + (1 - share) * b for c in colours for b in backgrounds for share in (1.0, 0.75, 0.5, 0.25)]
    return np.concatenate([greys, mixed]).round().astype(np.uint8)
