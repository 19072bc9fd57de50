"""A case without frames: the lumen's outline with the simulated wires, coloured by depth."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from reports.case_files import CaseFiles, thinned
from reports.figures._drawing import Drawing
from reports.figures._planes import PLANES, Array, Plane, View, draw_curve, dress, points_table, sheet, whole

_MAX_WIRES = 12
_COLOURS = "viridis"


def simulated_wires(case: CaseFiles) -> Drawing | None:
    """Up to a dozen depths, the deepest last, in the three projections of the lumen."""
    compared = bool(case.errors["rms_mm"].notna().any())
    if case.scan is None or compared or not case.frames:
        return None
    wires = _wires(case)
    if not wires:
        return None
    view = whole(case.scan)
    figure, (row,) = sheet(view, 1)
    depths = [depth for _, depth, _ in wires]
    scale = ScalarMappable(Normalize(min(depths), max(max(depths), min(depths) + 1e-9)), colormaps[_COLOURS])
    # deep wires first and wide, shallow ones over them and thin: each is seen where it differs
    widths = np.linspace(3.2, 1.0, len(wires))
    for axes, plane in zip(row, PLANES, strict=True):
        _outline(axes, view, plane)
        for (_, depth, points), width in zip(reversed(wires), widths, strict=True):
            colour = scale.to_rgba(np.array(depth))
            draw_curve(axes, points, view, plane, tip=4, color=colour, linewidth=width)
        dress(axes, view, plane)
    figure.colorbar(scale, ax=row, label="insertion depth, mm", pad=0.01, aspect=30, shrink=0.8)
    parts = [points_table(points, frame=frame, insertion_mm=depth) for frame, depth, points in wires]
    return Drawing(figure, pd.concat(parts))


def _wires(case: CaseFiles) -> list[tuple[int, float, Array]]:
    """Frame, depth and simulated wire, LPS mm, of up to a dozen frames."""
    good = case.good[case.good["insertion_mm"].notna()]
    picked = good.iloc[thinned(len(good), _MAX_WIRES)]
    wires = []
    for frame, depth in zip(picked["frame"].tolist(), picked["insertion_mm"].tolist(), strict=True):
        points = case.read_frame(frame).simulated_mm if frame in case.frames else None
        if points is not None and len(points):
            wires.append((frame, depth, points))
    return wires


def _outline(axes: Axes, view: View, plane: Plane) -> None:
    """The lumen's silhouette, where the file has one with an inside and an outside."""
    mask = (view.scan.lumen_mips.get(plane.along, np.zeros((1, 1))) > 0).astype(float)
    if min(mask.shape) < 2 or mask.min() == mask.max():
        return
    left, right, bottom, top = view.extent(plane)
    half = 0.5 * view.scan.spacing_mm
    across = np.linspace(left + half[plane.across], right - half[plane.across], mask.shape[0])
    up = np.linspace(bottom + half[plane.up], top - half[plane.up], mask.shape[1])
    axes.contourf(across, up, mask.T, levels=[0.5, 1.5], colors=["0.90"])
    axes.contour(across, up, mask.T, levels=[0.5], colors=["0.45"], linewidths=0.7)
