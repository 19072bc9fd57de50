"""The three projection planes: which array axes a picture shows, in mm, and what is drawn in a panel of one."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.figures._drawing import new_figure
from reports.figures._style import Look
from reports.frames_file import Array, FrameArrays, ScanCrop


class Plane(NamedTuple):
    """Array axes: the one projected along, the one drawn across and the one drawn up."""

    along: int
    across: int
    up: int


PLANES = (Plane(1, 0, 2), Plane(0, 1, 2), Plane(2, 0, 1))  # from left to right
WIDTH_INCH = 10.0
_LPS_NAMES = ("x, towards left", "y, towards back", "z, towards head")
_WAYS = (("left", "right"), ("back", "front"), ("head", "feet"))  # positive and negative along L, P, S
_LABELS_INCH = 0.62  # what an axis title and its ticks take beside a panel
_ROW_INCH = (1.5, 4.6)
_MARGIN_MM = 5.0
_EXACT = 0.9995  # cosine of 1.8 degrees


@dataclass(frozen=True, eq=False)
class View:
    """What of the crop is shown, mm along the array axes from ``low`` to ``high``, and what is drawn of it.

    The coordinates are LPS where the array axes are the patient's, else they start at the crop's corner.
    """

    scan: ScanCrop
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

    def faces(self) -> tuple[Array, Array]:
        """The outer faces of the whole crop's voxels, mm along the array axes."""
        low = self._start() - 0.5 * self.scan.spacing_mm
        return low, low + np.array(self.scan.shape) * self.scan.spacing_mm

    def extent(self, plane: Plane) -> tuple[float, float, float, float]:
        """Left, right, bottom, top of a whole picture in mm, at the outer faces of its voxels."""
        low, high = self.faces()
        return low[plane.across], high[plane.across], low[plane.up], high[plane.up]

    def label(self, axis: int) -> str:
        """Name of an axis with its unit; of an array that is not aligned also the nearest anatomical way."""
        if self.aligned:
            return f"{_LPS_NAMES[axis]}, mm"
        along = self.scan.direction[:, axis]
        nearest = int(np.abs(along).argmax())
        exact = abs(along[nearest]) > _EXACT * float(np.linalg.norm(along))
        return f"axis {axis}, {'towards' if exact else 'about'} {_WAYS[nearest][int(along[nearest] < 0)]}, mm"

    def sheet(self, rows: int, square: bool = False) -> tuple[Figure, list[list[Axes]]]:
        """A figure of ``rows`` by three panels at one scale, and a square one at the right if asked."""
        widths = [float(self.size[plane.across]) for plane in PLANES]
        height = max(float(self.size[plane.up]) for plane in PLANES)
        widths += [0.75 * height] if square else []
        room = WIDTH_INCH - _LABELS_INCH * len(widths)
        row_inch = float(np.clip(room * height / sum(widths), *_ROW_INCH))
        figure = new_figure(rows * (row_inch + 0.42) + 0.55, WIDTH_INCH)
        axes = figure.subplots(rows, len(widths), squeeze=False, width_ratios=widths)
        return figure, [list(row) for row in axes]

    def show(self, axes: Axes, frame: FrameArrays, plane: Plane) -> None:
        """Draw a frame's projection in grey, where it has one; pictures are indexed (across, up)."""
        if plane.along in frame.mips:
            picture = frame.mips[plane.along]
            # as stored: a window of each picture's own ends below the few pixels of a short wire
            window: Look = {"cmap": "gray", "vmin": 0, "vmax": 255}
            extent = self.extent(plane)
            axes.imshow(picture.T, origin="lower", interpolation="nearest", extent=extent, **window)

    def draw(self, axes: Axes, points_mm: Array, plane: Plane, tip: float = 0, **look: Any) -> None:
        """Draw a curve (n, 3), LPS mm, with a dot of size ``tip`` at its end."""
        across, up = self.coordinates(points_mm)[:, plane[1:]].T
        axes.plot(across, up, **look)
        if tip:
            axes.plot(across[-1:], up[-1:], "o", color=look["color"], markersize=tip)

    def band(self, axes: Axes, points_mm: Array, covariance_mm2: Array, plane: Plane, **look: Any) -> None:
        """Fill two standard deviations to both sides of a curve (n, 3), whose points have covariances (n, 3, 3).

        A single point has no sides.
        """
        if len(points_mm) < 2:
            return
        seen, turn = list(plane[1:]), self.scan.direction[:, plane[1:]]
        centre = self.coordinates(points_mm)[:, seen]
        along = np.gradient(centre, axis=0)
        across = np.stack([-along[:, 1], along[:, 0]], axis=1)
        across /= np.maximum(np.linalg.norm(across, axis=1), 1e-9)[:, None]
        variance = np.einsum("na,ia,nij,jb,nb->n", across, turn, covariance_mm2, turn, across)
        half = 2.0 * np.sqrt(np.maximum(variance, 0.0))[:, None] * across
        axes.fill(*np.concatenate([centre + half, (centre - half)[::-1]]).T, **look)

    def dress(self, axes: Axes, plane: Plane) -> None:
        """Equal scale, limits, names of the axes; where the vertical axis runs front to back, back is down."""
        axes.set_aspect("equal")
        axes.set_xlim(self.low[plane.across], self.high[plane.across])
        limits = self.low[plane.up], self.high[plane.up]
        axes.set_ylim(limits[::-1] if self.aligned and plane.up == 1 else limits)
        axes.set_xlabel(self.label(plane.across), fontsize=8)
        axes.set_ylabel(self.label(plane.up), fontsize=8)
        axes.tick_params(labelsize=8)

    def _start(self) -> Array:
        return self.scan.origin_mm if self.aligned else np.zeros(3)


def whole(scan: ScanCrop) -> View:
    """The whole crop."""
    return View(scan, *View(scan, np.zeros(3), np.zeros(3)).faces())


def around(scan: ScanCrop, curves: Iterable[Array]) -> View:
    """The box of the curves and a margin, cut at the crop; the whole crop where there is no curve."""
    everything = whole(scan)
    points = [everything.coordinates(c) for c in curves if len(c)]
    if not points:
        return everything
    stacked = np.concatenate(points)
    low = np.maximum(stacked.min(axis=0) - _MARGIN_MM, everything.low)
    high = np.minimum(stacked.max(axis=0) + _MARGIN_MM, everything.high)
    # a curve outside the crop would give a box inside out
    return View(scan, low, high) if np.all(high > low) else everything


def points_table(points_mm: Array, **labels: Any) -> pd.DataFrame:
    """Points (n, 3) as rows of labels and coordinates."""
    xyz = ["x_mm", "y_mm", "z_mm"]
    return pd.DataFrame(points_mm, columns=xyz).assign(**labels)[[*labels, *xyz]]
