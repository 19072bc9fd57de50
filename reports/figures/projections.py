"""The scan seen along its three axes with the traced and the simulated wire over it."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from matplotlib.axes import Axes

from reports.case_files import CaseFiles
from reports.figures._planes import PLANES, Frame2D, dress, sheet, show
from reports.figures._style import GREEN, ORANGE, SKY, Drawing
from reports.frames_file import Frame, Scan

_CURVES = (
    ("traced_mm", "traced", ORANGE, "-", 1.3),
    ("truth_mm", "true", GREEN, ":", 1.1),
    ("simulated_mm", "simulated", SKY, (0, (4, 2)), 1.3),
)
_MAX_FAILED = 3


def projections(case: CaseFiles) -> Drawing | None:
    """First, middle, last and worst frame."""
    good = case.good[case.good["rms_mm"].notna()]
    if case.scan is None or good.empty:
        return None
    numbers = good["frame"].astype(int).tolist()
    worst = numbers[int(good["rms_mm"].to_numpy().argmax())]
    titles: dict[int, list[str]] = {}
    for number, title in (
        (numbers[0], "first"),
        (numbers[len(numbers) // 2], "middle"),
        (numbers[-1], "last"),
        (worst, "worst"),
    ):
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
    figure, rows = sheet(scan, len(chosen))
    tables = []
    for (number, title), row in zip(chosen, rows, strict=True):
        frame = case.read_frame(number)
        for axes, (axis, plane) in zip(row, PLANES, strict=True):
            _panel(axes, frame, Frame2D(scan), axis, plane)
        row[0].set_title(f"frame {number} ({title})", loc="left", fontsize=9)
        tables.append(_tidy(frame))
    handles, labels = rows[0][0].get_legend_handles_labels()
    if handles:
        legend = figure.legend(handles, labels, loc="outside upper right", ncols=3, fontsize=8)
        legend.get_frame().set_facecolor("0.35")
        for text in legend.get_texts():
            text.set_color("white")
    return Drawing(figure, pd.concat(tables))


def _panel(axes: Axes, frame: Frame, axes_mm: Frame2D, axis: int, plane: tuple[int, int]) -> None:
    if axis in frame.mips:
        show(axes, frame.mips[axis], axes_mm, plane)
    else:
        axes.set_facecolor("0.25")
    for field, label, colour, style, width in _CURVES:
        points = getattr(frame, field)
        if points is not None and len(points):
            across, up = axes_mm.coordinates(points)[:, plane].T
            axes.plot(across, up, color=colour, linestyle=style, linewidth=width, label=label)
            axes.plot(across[-1:], up[-1:], "o", color=colour, markersize=3)
    dress(axes, axes_mm, plane)


def _tidy(frame: Frame) -> pd.DataFrame:
    parts = []
    for field, label, *_ in _CURVES:
        points = getattr(frame, field)
        if points is not None and len(points):
            part = pd.DataFrame(points, columns=["x_mm", "y_mm", "z_mm"])
            part.insert(0, "curve", label)
            part.insert(0, "frame", frame.frame)
            parts.append(part)
    return pd.concat(parts) if parts else pd.DataFrame(columns=["frame", "curve", "x_mm", "y_mm", "z_mm"])
