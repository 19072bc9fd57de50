"""Every frame on one sheet, small, from the side where the wire is seen longest."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from reports.case_files import GOOD, CaseFiles, thinned
from reports.figures._drawing import Drawing, new_figure
from reports.figures._planes import PLANES, WIDTH_INCH, Plane, View, around, draw_curve, show
from reports.figures._style import ORANGE, SKY, VERMILION, Look
from reports.frames_file import FrameArrays

_COLUMNS = 6
_MAX_FRAMES = 36
_TITLE_INCH = 0.24
_PANEL_INCH = (0.9, 3.0)
_TRACED: Look = {"color": ORANGE, "linestyle": "-", "linewidth": 1.6}
_SIMULATED: Look = {"color": SKY, "linestyle": "--", "linewidth": 1.0}


def every_frame(case: CaseFiles) -> Drawing | None:
    """Up to 36 frames, evenly thinned, each with its status or error; the traced and the simulated wire."""
    table = case.errors[case.errors["frame"].isin(case.frames)]
    if case.scan is None or len(table) < 2:
        return None
    table = table.iloc[thinned(len(table), _MAX_FRAMES)]
    frames = [case.read_frame(number) for number in table["frame"].tolist()]
    if not any(frame.mips for frame in frames):
        return None
    view = around(case.scan, [c for f in frames for c in (f.traced_mm, f.simulated_mm) if c is not None])
    plane = max(PLANES, key=lambda plane: float(view.size[plane.across] * view.size[plane.up]))
    rows, width = -(-len(frames) // _COLUMNS), WIDTH_INCH / _COLUMNS
    height = float(np.clip(width * view.size[plane.up] / view.size[plane.across], *_PANEL_INCH))
    # thirty small panels without labels: a fixed lattice needs no fitting, which is most of the drawing time
    figure = new_figure(rows * (height + _TITLE_INCH), WIDTH_INCH, fitted=False)
    panels = figure.subplots(rows, _COLUMNS, squeeze=False).ravel()
    step = _TITLE_INCH / (height + _TITLE_INCH) / rows
    figure.subplots_adjust(0.005, 0.005, 0.995, 1.0 - step, 0.04, _TITLE_INCH / height)
    for axes in panels:
        axes.set_axis_off()
    for axes, frame, status, rms in zip(panels, frames, table["status"], table["rms_mm"], strict=False):
        _panel(axes, frame, view, plane)
        good = status in GOOD
        text = f"{frame.frame}: {rms:.2f} mm" if good and np.isfinite(rms) else f"{frame.frame}: {status}"
        axes.set_title(text, fontsize=8, loc="left", pad=2, color="black" if good else VERMILION)
    return Drawing(figure, table[["frame", "status", "insertion_mm", "rms_mm"]], compact=True)


def _panel(axes: Axes, frame: FrameArrays, view: View, plane: Plane) -> None:
    show(axes, frame, view, plane)
    for points, look in ((frame.traced_mm, _TRACED), (frame.simulated_mm, _SIMULATED)):
        if points is not None and len(points):
            draw_curve(axes, points, view, plane, **look)
    axes.set_xlim(view.low[plane.across], view.high[plane.across])
    axes.set_ylim(view.low[plane.up], view.high[plane.up])
    axes.set_aspect("equal")
