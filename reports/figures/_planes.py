"""The three projection planes: which array axes a picture shows, in mm, and the sheet of panels they fill."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from reports.figures._style import new_figure
from reports.frames_file import Scan

Array = NDArray[np.float64]
Plane = tuple[int, int]
# drawn from left to right: projection axis -> (axis across, axis up)
PLANES: tuple[tuple[int, Plane], ...] = ((1, (0, 2)), (0, (1, 2)), (2, (0, 1)))
_LPS_NAMES = ("x, towards left", "y, towards back", "z, towards head")
_WIDTH_INCH = 10.0
_LABELS_INCH = 0.62  # what an axis title and its ticks take beside a panel
_ROW_INCH = (1.5, 4.6)
_MARGIN_MM = 5.0
_WINDOW_PERCENTILES = (2.0, 99.8)  # keeps the wire's peak from making the vessels black


@dataclass(frozen=True, eq=False)
class View:
    """What of the crop is shown: mm along the array axes, from ``low`` to ``high``.

    The coordinates are LPS where the array axes are the patient's, else they start at the crop's corner.
    """

    scan: Scan
    low: Array
    high: Array

    @property
    def aligned(self) -> bool:
        """Whether array axes point along L, P, S."""
        return bool(np.allclose(self.scan.direction, np.eye(3), atol=1e-3))

    @property
    def size(self) -> Array:
        """Lengths (3,) of the view, mm."""
        return self.high - self.low

    def coordinates(self, points_mm: Array) -> Array:
        """Coordinates (n, 3) of LPS points along the array axes, mm."""
        return np.asarray(self.scan.to_index(points_mm) * self.scan.spacing_mm + self._start())

    def extent(self, across: int, up: int) -> tuple[float, float, float, float]:
        """Left, right, bottom, top of a whole picture in mm, at the outer faces of its voxels."""
        low = self._start() - 0.5 * self.scan.spacing_mm
        high = low + np.array(self.scan.shape) * self.scan.spacing_mm
        return float(low[across]), float(high[across]), float(low[up]), float(high[up])

    def label(self, axis: int) -> str:
        """Name of an axis with its unit."""
        return f"{_LPS_NAMES[axis]}, mm" if self.aligned else f"array axis {axis}, mm from the corner"

    def _start(self) -> Array:
        return self.scan.origin_mm if self.aligned else np.zeros(3)


def whole(scan: Scan) -> View:
    """The whole crop."""
    view = View(scan, np.zeros(3), np.zeros(3))
    low = view.coordinates(scan.origin_mm[None])[0] - 0.5 * scan.spacing_mm
    return View(scan, low, low + np.array(scan.shape) * scan.spacing_mm)


def around(scan: Scan, curves: Iterable[Array], margin_mm: float = _MARGIN_MM) -> View:
    """The box of the curves and a margin, cut at the crop; the whole crop where there is no curve."""
    everything = whole(scan)
    points = [everything.coordinates(c) for c in curves if len(c)]
    if not points:
        return everything
    stacked = np.concatenate(points)
    low = np.maximum(stacked.min(axis=0) - margin_mm, everything.low)
    high = np.minimum(stacked.max(axis=0) + margin_mm, everything.high)
    # a curve outside the crop would give a box inside out
    return View(scan, low, high) if np.all(high > low) else everything


def sheet(view: View, rows: int, square: bool = False) -> tuple[Figure, list[list[Axes]]]:
    """A figure of ``rows`` by three panels at one scale, and a square one at the right if asked."""
    widths = [float(view.size[across]) for _, (across, _) in PLANES]
    height = max(float(view.size[up]) for _, (_, up) in PLANES)
    widths += [0.75 * height] if square else []
    room = _WIDTH_INCH - _LABELS_INCH * len(widths)
    row_inch = float(np.clip(room * height / sum(widths), *_ROW_INCH))
    figure = new_figure(rows * (row_inch + 0.42) + 0.55, _WIDTH_INCH)
    axes = figure.subplots(rows, len(widths), squeeze=False, width_ratios=widths)
    return figure, [list(axes[r]) for r in range(rows)]


def show(axes: Axes, picture: NDArray[np.uint8], view: View, plane: Plane) -> None:
    """Draw a projection in grey; the picture is indexed (across, up)."""
    low, high = np.percentile(picture, _WINDOW_PERCENTILES)
    axes.imshow(
        picture.T,
        cmap="gray",
        vmin=low,
        vmax=max(high, low + 1),
        origin="lower",
        extent=view.extent(*plane),
        interpolation="nearest",
    )


def dress(axes: Axes, view: View, plane: Plane, bounds: Sequence[Array] | None = None) -> None:
    """Equal scale, limits, names of the axes; where the vertical axis runs front to back, back is down."""
    across, up = plane
    low, high = bounds if bounds is not None else (view.low, view.high)
    axes.set_aspect("equal")
    axes.set_xlim(low[across], high[across])
    downward = view.aligned and up == 1
    axes.set_ylim((high[up], low[up]) if downward else (low[up], high[up]))
    axes.set_xlabel(view.label(across), fontsize=8)
    axes.set_ylabel(view.label(up), fontsize=8)
    axes.tick_params(labelsize=7)
