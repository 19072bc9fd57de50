"""The three projection planes: which array axes a picture shows, in mm, and how curves are laid over it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from reports.frames_file import Scan

Array = NDArray[np.float64]
# drawn from left to right: projection axis -> (axis across, axis up)
PLANES = ((1, (0, 2)), (0, (1, 2)), (2, (0, 1)))
_LPS_NAMES = ("x, towards left", "y, towards back", "z, towards head")
_WIDTH_INCH = 9.0
_MAX_ROW_INCH = 4.5
_WINDOW_PERCENTILES = (2.0, 99.7)  # keeps the wire's peak from making the vessels black


@dataclass(frozen=True, eq=False)
class Frame2D:
    """Millimetre axes of the crop: LPS coordinates where the array axes are the patient's, else from its corner."""

    scan: Scan

    @property
    def aligned(self) -> bool:
        """Whether array axes point along L, P, S."""
        return bool(np.allclose(self.scan.direction, np.eye(3), atol=1e-3))

    def coordinates(self, points_mm: Array) -> Array:
        """Coordinates (n, 3) of LPS points along the array axes, mm."""
        start = self.scan.origin_mm if self.aligned else 0.0
        return np.asarray(self.scan.to_index(points_mm) * self.scan.spacing_mm + start)

    def extent(self, across: int, up: int) -> tuple[float, float, float, float]:
        """Left, right, bottom, top of a picture in mm, at the outer faces of its voxels."""
        start = self.scan.origin_mm if self.aligned else np.zeros(3)
        low = start - 0.5 * self.scan.spacing_mm
        high = low + np.array(self.scan.shape) * self.scan.spacing_mm
        return float(low[across]), float(high[across]), float(low[up]), float(high[up])

    def label(self, axis: int) -> str:
        """Name of an axis with its unit."""
        return f"{_LPS_NAMES[axis]}, mm" if self.aligned else f"array axis {axis}, mm from the corner"


def sheet(scan: Scan, rows: int) -> tuple[Figure, list[list[Axes]]]:
    """A figure of ``rows`` by three panels at one scale."""
    from reports.figures._style import new_figure

    size = np.array(scan.shape) * scan.spacing_mm
    widths = [size[across] for _, (across, _) in PLANES]
    height = max(size[up] for _, (_, up) in PLANES)
    row_inch = min(_WIDTH_INCH * height / sum(widths), _MAX_ROW_INCH)
    figure = new_figure(rows * (row_inch + 0.45) + 0.5, _WIDTH_INCH)
    axes = figure.subplots(rows, 3, squeeze=False, width_ratios=widths)
    return figure, [[axes[r, c] for c in range(3)] for r in range(rows)]


def show(axes: Axes, picture: NDArray[np.uint8], frame: Frame2D, plane: tuple[int, int]) -> None:
    """Draw a projection in grey; the picture is indexed (across, up)."""
    low, high = np.percentile(picture, _WINDOW_PERCENTILES)
    axes.imshow(
        picture.T,
        cmap="gray",
        vmin=low,
        vmax=max(high, low + 1),
        origin="lower",
        extent=frame.extent(*plane),
        interpolation="nearest",
    )


def dress(axes: Axes, frame: Frame2D, plane: tuple[int, int]) -> None:
    """Equal scale, limits of the crop, names of the axes; seen from the feet, the patient's back is down."""
    across, up = plane
    left, right, bottom, top = frame.extent(across, up)
    axes.set_aspect("equal")
    axes.set_xlim(left, right)
    axes.set_ylim((top, bottom) if frame.aligned and up == 1 else (bottom, top))
    axes.set_xlabel(frame.label(across), fontsize=8)
    axes.set_ylabel(frame.label(up), fontsize=8)
    axes.tick_params(labelsize=7)
