"""Every frame on one sheet, small, from the side where the wire is seen longest."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from reports.case_files import GOOD, CaseFiles
from reports.figures._planes import PLANES, Plane, View, around, show
from reports.figures._style import ORANGE, SKY, VERMILION, Drawing, new_figure
from reports.frames_file import Frame, Scan

_COLUMNS = 6
_MAX_FRAMES = 36
_WIDTH_INCH = 10.0
_TITLE_INCH = 0.24
_PANEL_INCH = (0.9, 3.0)


def every_frame(case: CaseFiles) -> Drawing | None:
    """Up to 36 frames, evenly thinned, each with its status or error; the traced and the simulated wire."""
    table = case.errors[case.errors["frame"].isin(case.frames)]
    if case.scan is None or len(table) < 2:
        return None
    chosen = np.unique(np.linspace(0, len(table) - 1, min(len(table), _MAX_FRAMES)).round().astype(int))
    table = table.iloc[chosen]
    frames = [case.read_frame(number) for number in table["frame"].tolist()]
    if not any(frame.mips for frame in frames):
        return None
    view, axis, plane = _side(case.scan, frames)
    rows = -(-len(frames) // _COLUMNS)
    width = _WIDTH_INCH / _COLUMNS
    height = float(np.clip(width * view.size[plane[1]] / view.size[plane[0]], *_PANEL_INCH))
    # thirty small panels without labels: a fixed lattice needs no fitting, which is most of the drawing time
    figure = new_figure(rows * (height + _TITLE_INCH), _WIDTH_INCH, fitted=False)
    panels = figure.subplots(rows, _COLUMNS, squeeze=False).ravel()
    step = _TITLE_INCH / (height + _TITLE_INCH) / rows
    figure.subplots_adjust(0.005, 0.005, 0.995, 1.0 - step, 0.04, _TITLE_INCH / height)
    for axes in panels:
        axes.set_axis_off()
    shown = zip(panels, frames, table["status"].tolist(), table["rms_mm"].tolist(), strict=False)
    for axes, frame, status, rms in shown:
        _panel(axes, frame, view, axis, plane)
        good = status in GOOD
        text = f"{frame.frame}: {rms:.2f} mm" if good and np.isfinite(rms) else f"{frame.frame}: {status}"
        axes.set_title(text, fontsize=8, loc="left", pad=2, color="black" if good else VERMILION)
    return Drawing(figure, table[["frame", "status", "insertion_mm", "rms_mm"]], compact=True)


def _side(scan: Scan, frames: list[Frame]) -> tuple[View, int, Plane]:
    """The view of all curves, and the projection in which they spread most."""
    curves = [c for frame in frames for c in (frame.traced_mm, frame.simulated_mm) if c is not None]
    view = around(scan, curves)
    spread = {axis: view.size[plane[0]] * view.size[plane[1]] for axis, plane in PLANES}
    axis, plane = max(PLANES, key=lambda item: float(spread[item[0]]))
    return view, axis, plane


def _panel(axes: Axes, frame: Frame, view: View, axis: int, plane: Plane) -> None:
    if axis in frame.mips:
        show(axes, frame.mips[axis], view, plane)
    for points, colour, style, wide in (
        (frame.traced_mm, ORANGE, "-", 1.6),
        (frame.simulated_mm, SKY, "--", 1.0),
    ):
        if points is not None and len(points):
            across, up = view.coordinates(points)[:, plane].T
            axes.plot(across, up, style, color=colour, linewidth=wide)
    axes.set_xlim(view.low[plane[0]], view.high[plane[0]])
    axes.set_ylim(view.low[plane[1]], view.high[plane[1]])
    axes.set_aspect("equal")
