"""A case without frames: the lumen's outline with the simulated wires, coloured by depth."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from reports.case_files import CaseFiles
from reports.figures._planes import PLANES, Plane, View, dress, sheet, whole
from reports.figures._style import Drawing

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
    figure, rows = sheet(view, 1)
    depths = [depth for _, depth, _ in wires]
    scale = ScalarMappable(Normalize(min(depths), max(max(depths), min(depths) + 1e-9)), colormaps[_COLOURS])
    for axes, (axis, plane) in zip(rows[0], PLANES, strict=True):
        _panel(axes, view, axis, plane, wires, scale)
    figure.colorbar(scale, ax=rows[0], label="insertion depth, mm", pad=0.01, aspect=30, shrink=0.8)
    return Drawing(figure, _tidy(wires))


def _wires(case: CaseFiles) -> list[tuple[int, float, Any]]:
    good = case.good[case.good["insertion_mm"].notna()]
    chosen = np.unique(np.linspace(0, len(good) - 1, min(len(good), _MAX_WIRES)).round().astype(int))
    wires = []
    picked = good.iloc[chosen]
    for frame, depth in zip(picked["frame"].tolist(), picked["insertion_mm"].tolist(), strict=True):
        points = case.read_frame(frame).simulated_mm if frame in case.frames else None
        if points is not None and len(points):
            wires.append((frame, depth, points))
    return wires


def _panel(axes: Axes, view: View, axis: int, plane: Plane, wires: Any, scale: ScalarMappable) -> None:
    if axis in view.scan.lumen_mips:
        _outline(axes, view, axis, plane)
    # deep wires first and wide, shallow ones over them and thin: each is seen where it differs
    widths = np.linspace(3.2, 1.0, len(wires))
    for (_, depth, points), width in zip(reversed(wires), widths, strict=True):
        across, up = view.coordinates(points)[:, plane].T
        axes.plot(across, up, color=scale.to_rgba(depth), linewidth=width)
        axes.plot(across[-1:], up[-1:], "o", color=scale.to_rgba(depth), markersize=4)
    dress(axes, view, plane)


def _outline(axes: Axes, view: View, axis: int, plane: Plane) -> None:
    mask = (view.scan.lumen_mips[axis] > 0).astype(float)
    left, right, bottom, top = view.extent(*plane)
    half = 0.5 * view.scan.spacing_mm
    across = np.linspace(left + half[plane[0]], right - half[plane[0]], mask.shape[0])
    up = np.linspace(bottom + half[plane[1]], top - half[plane[1]], mask.shape[1])
    if min(mask.shape) >= 2 and mask.min() < mask.max():
        axes.contourf(across, up, mask.T, levels=[0.5, 1.5], colors=["0.90"])
        axes.contour(across, up, mask.T, levels=[0.5], colors=["0.45"], linewidths=0.7)


def _tidy(wires: list[tuple[int, float, Any]]) -> pd.DataFrame:
    parts = []
    for frame, depth, points in wires:
        part = pd.DataFrame(points, columns=["x_mm", "y_mm", "z_mm"])
        parts.append(
            part.assign(frame=frame, insertion_mm=depth)[["frame", "insertion_mm", "x_mm", "y_mm", "z_mm"]]
        )
    return pd.concat(parts)
