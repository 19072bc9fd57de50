"""What the panels of all figures share: grid, legend, ticks, heat maps."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from reports.figures._style import SEQUENTIAL, Look

Array = NDArray[np.floating[Any]]
_LOG_FROM_RATIO = 20.0  # below a range of 20 a linear axis reads better


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
    """Make y logarithmic with plain numbers where the values span decades, else linear from zero."""
    numbers = np.concatenate([np.asarray(v, dtype=float).ravel() for v in values] or [np.zeros(0)])
    kept = numbers[np.isfinite(numbers) & (numbers > 0)]
    if len(kept) and kept.max() > _LOG_FROM_RATIO * kept.min():
        axes.set_yscale("log")
        axes.set_ylim(kept.min() / 1.5, kept.max() * 1.5)
        plain_decades(axes.yaxis)
    else:
        axes.set_ylim(bottom=0.0)


def heat_map(
    axes: Axes, grid: Array, edges: tuple[Array, Array], label: str, clip: float, bar: Look, **cells: Any
) -> None:
    """Draw ``grid`` (rows, columns) between ``edges`` (across, up), with a colour bar; NaN is left light grey.

    clip : the percentile at which colours end: one wild value must not turn all others dark.
    bar, cells : what else matplotlib is told of the colour bar and of the cells.
    """
    top = max(float(np.nanpercentile(grid, clip)), 1e-9) if np.isfinite(grid).any() else 1.0
    mesh = axes.pcolormesh(*edges, grid, cmap=SEQUENTIAL, vmin=0.0, vmax=top, **cells)
    extend = "max" if (grid > top).any() else "neither"
    figure: Any = axes.get_figure()
    figure.colorbar(mesh, ax=axes, label=label, extend=extend, pad=0.01, **bar)
    axes.set_facecolor("0.93")
    plain(axes)
    axes.grid(visible=False)
