"""The scan seen along its three axes with the traced and the simulated wire over it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from reports.case_files import CaseFiles
from reports.figures._planes import PLANES, Plane, View, around, dress, sheet, show
from reports.figures._style import GREEN, ORANGE, SKY, Drawing
from reports.frames_file import Frame, Scan

# drawn in this order: the later lie over the earlier
_CURVES = (
    ("traced_mm", "traced", ORANGE, "-", 1.8),
    ("truth_mm", "true", GREEN, ":", 1.2),
    ("simulated_mm", "simulated", SKY, (0, (4, 2)), 1.2),
)
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


def _draw(case: CaseFiles, scan: Scan, chosen: Sequence[tuple[int, str]]) -> Drawing | None:
    if not chosen:
        return None
    frames = [case.read_frame(number) for number, _ in chosen]
    curves = [points for frame in frames for _, points in _curves(frame)]
    view = around(scan, curves)
    figure, rows = sheet(view, len(chosen), square=bool(curves))
    for frame, (number, title), row in zip(frames, chosen, rows, strict=True):
        for axes, (axis, plane) in zip(row[:3], PLANES, strict=True):
            _panel(axes, frame, view, axis, plane)
        for axes in row[3:]:
            _tip_panel(axes, frame, view)
        row[0].set_title(f"frame {number} ({title})", loc="left", fontsize=9)
    for row in rows[:-1]:
        for axes in row[:3]:
            axes.set_xlabel("")
    _legend(figure, rows[0][0])
    return Drawing(figure, pd.concat([_tidy(frame) for frame in frames]), compact=True)


def _curves(frame: Frame) -> list[tuple[str, NDArray[np.float64]]]:
    arrays = ((label, getattr(frame, field)) for field, label, *_ in _CURVES)
    return [(label, points) for label, points in arrays if points is not None and len(points)]


def _panel(axes: Axes, frame: Frame, view: View, axis: int, plane: Plane) -> None:
    if axis in frame.mips:
        show(axes, frame.mips[axis], view, plane)
    else:
        axes.set_facecolor("0.25")
    known = dict(_curves(frame))
    for _, label, colour, style, width in _CURVES:
        if label in known:
            across, up = view.coordinates(known[label])[:, plane].T
            axes.plot(across, up, color=colour, linestyle=style, linewidth=width, label=label)
            axes.plot(across[-1:], up[-1:], "o", color=colour, markersize=3)
    dress(axes, view, plane)


def _tip_panel(axes: Axes, frame: Frame, view: View) -> None:
    """Close to the tip, along the axis in which the wire's end is seen longest."""
    known = _curves(frame)
    if not known:
        axes.remove()
        return
    end = view.coordinates(known[0][1])
    tip = end[-1]
    near = end[np.linalg.norm(end - tip, axis=1) < 0.5 * _TIP_WINDOW_MM]
    axis, plane = max(PLANES, key=lambda item: float(np.ptp(near, axis=0)[list(item[1])].sum()))
    _panel(axes, frame, view, axis, plane)
    half = 0.5 * _TIP_WINDOW_MM
    dress(axes, view, plane, (tip - half, tip + half))
    axes.set_title(f"tip, {_TIP_WINDOW_MM:g} mm wide", loc="left", fontsize=9)


def _legend(figure: Figure, axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        legend = figure.legend(handles, labels, loc="outside upper right", ncols=3, fontsize=8)
        legend.get_frame().set_facecolor("0.3")  # the line colours are chosen for the dark of the scan
        for text in legend.get_texts():
            text.set_color("white")


def _tidy(frame: Frame) -> pd.DataFrame:
    columns = ["frame", "curve", "x_mm", "y_mm", "z_mm"]
    parts = [
        pd.DataFrame(points, columns=columns[2:]).assign(frame=frame.frame, curve=label)[columns]
        for label, points in _curves(frame)
    ]
    nothing = pd.DataFrame([[frame.frame, "none"]], columns=columns[:2])
    return pd.concat(parts or [nothing])
