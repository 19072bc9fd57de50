"""The scan seen along its three axes with the traced and the simulated wire over it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from reports.case_files import CaseFiles
from reports.figures._drawing import Drawing
from reports.figures._planes import (
    PLANES,
    Array,
    Plane,
    View,
    around,
    draw_curve,
    dress,
    points_table,
    sheet,
    show,
)
from reports.figures._style import GREEN, ORANGE, SKY, Look
from reports.frames_file import FrameArrays, ScanCrop

# drawn in this order: the later lie over the earlier
_CURVES: dict[str, Look] = {
    "traced": {"color": ORANGE, "linestyle": "-", "linewidth": 1.8},
    "true": {"color": GREEN, "linestyle": ":", "linewidth": 1.2},
    "simulated": {"color": SKY, "linestyle": (0, (4, 2)), "linewidth": 1.2},
}
_MAX_FAILED = 3
_TIP_WINDOW_MM = 10.0


def projections(case: CaseFiles) -> Drawing | None:
    """First, middle, last and worst frame."""
    good = case.good[case.good["rms_mm"].notna()]
    if case.scan is None or good.empty:
        return None
    numbers = good["frame"].astype(int).tolist()
    named = (
        (numbers[0], "first"),
        (numbers[len(numbers) // 2], "middle"),
        (numbers[-1], "last"),
        (numbers[int(good["rms_mm"].to_numpy().argmax())], "worst"),
    )
    titles: dict[int, list[str]] = {}
    for number, title in named:
        titles.setdefault(number, []).append(title)
    chosen = [(n, " and ".join(titles[n])) for n in sorted(titles) if n in case.frames]
    return _draw(case, case.scan, chosen)


def failed_projections(case: CaseFiles) -> Drawing | None:
    """Frames without a result whose scan could be read, three at most."""
    failed = case.errors.drop(case.good.index)
    if case.scan is None or failed.empty:
        return None
    chosen = zip(failed["frame"].tolist(), failed["status"].tolist(), strict=True)
    with_picture = [(n, title) for n, title in chosen if n in case.frames and case.read_frame(n).mips]
    return _draw(case, case.scan, with_picture[:_MAX_FAILED])


def _draw(case: CaseFiles, scan: ScanCrop, chosen: Sequence[tuple[int, str]]) -> Drawing | None:
    """One row per frame: the three projections, and the tip close by where any frame has a curve."""
    if not chosen:
        return None
    frames = [case.read_frame(number) for number, _ in chosen]
    curves = [points for frame in frames for points in _curves(frame).values()]
    view = around(scan, curves)
    figure, rows = sheet(view, len(chosen), square=bool(curves))
    for frame, (number, title), row in zip(frames, chosen, rows, strict=True):
        for axes, plane in zip(row, PLANES, strict=False):
            _panel(axes, frame, view, plane)
            if row is not rows[-1]:
                axes.set_xlabel("")
        for axes in row[len(PLANES) :]:
            _tip_panel(axes, frame, view)
        row[0].set_title(f"frame {number} ({title})", loc="left", fontsize=9)
    handles, labels = rows[0][0].get_legend_handles_labels()
    if handles:
        legend = figure.legend(handles, labels, loc="outside upper right", ncols=3, fontsize=8)
        legend.get_frame().set_facecolor("0.3")  # the line colours are chosen for the dark of the scan
        for text in legend.get_texts():
            text.set_color("white")
    return Drawing(figure, pd.concat([_table(frame) for frame in frames]), compact=True)


def _curves(frame: FrameArrays) -> dict[str, Array]:
    """The curves that a frame has, in the order of drawing."""
    arrays = {"traced": frame.traced_mm, "true": frame.truth_mm, "simulated": frame.simulated_mm}
    return {label: points for label, points in arrays.items() if points is not None and len(points)}


def _panel(axes: Axes, frame: FrameArrays, view: View, plane: Plane) -> None:
    if plane.along not in frame.mips:
        axes.set_facecolor("0.25")
    show(axes, frame, view, plane)
    for label, points in _curves(frame).items():
        draw_curve(axes, points, view, plane, tip=3, label=label, **_CURVES[label])
    dress(axes, view, plane)


def _tip_panel(axes: Axes, frame: FrameArrays, view: View) -> None:
    """Close to the tip, along the axis in which the wire's end is seen longest."""
    if not _curves(frame):
        axes.remove()
        return
    end = view.coordinates(next(iter(_curves(frame).values())))
    tip, half = end[-1], 0.5 * _TIP_WINDOW_MM
    near = end[np.linalg.norm(end - tip, axis=1) < half]
    plane = max(PLANES, key=lambda plane: float(np.ptp(near, axis=0)[list(plane[1:])].sum()))
    _panel(axes, frame, replace(view, low=tip - half, high=tip + half), plane)
    axes.set_title(f"tip, {_TIP_WINDOW_MM:g} mm wide", loc="left", fontsize=9)


def _table(frame: FrameArrays) -> pd.DataFrame:
    parts = [points_table(points, frame=frame.frame, curve=label) for label, points in _curves(frame).items()]
    nothing = pd.DataFrame([[frame.frame, "none"]], columns=["frame", "curve"])
    return pd.concat(parts or [nothing])
