"""Scan, lumen and wires seen along the array axes: a few frames, or the wires of a case without scans."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.patheffects import withStroke

from reports.case_files import WORST, CaseFiles, thinned
from reports.colours import SIMULATED, TRACED, TRUE
from reports.figures._drawing import Drawing, legend
from reports.figures._planes import PLANES, Plane, View, around, points_table, whole
from reports.figures._style import BROWN, Look
from reports.frames_file import FrameArrays, ScanCrop

_BAND: Look = {"facecolor": SIMULATED, "alpha": 0.3, "linewidth": 0, "label": "two standard deviations of its inputs"}
_RIM: Look = {"path_effects": [withStroke(linewidth=3.2, foreground="white", alpha=0.75)]}
"""A curve of any colour stands out from every grey of a scan."""
_LOOKS: dict[str, Look] = {
    "traced": {"color": TRACED, "linestyle": "-", "linewidth": 1.8, **_RIM},
    "true": {"color": TRUE, "linestyle": ":", "linewidth": 1.4},
    "simulated": {"color": SIMULATED, "linestyle": (0, (4, 2)), "linewidth": 1.4},
}
_DEPTHS = LinearSegmentedColormap.from_list("depths", (BROWN, SIMULATED))
_MAX_FAILED = 3
_TIP_WINDOW_MM = 10.0
_MAX_WIRES = 12  # of a case without scans


def projections(case: CaseFiles) -> Drawing | None:
    """First, middle, last and worst frame."""
    good = case.good[case.good[WORST].notna()]
    if case.scan is None or good.empty:
        return None
    numbers = good["frame"].astype(int).tolist()
    worst = int(good[WORST].to_numpy().argmax())
    titles: dict[int, list[str]] = {}
    every = case.errors["frame"]  # of a case whose last frame failed, the last one here is the last that is ok
    first = "first" if numbers[0] == every.min() else "first ok"
    last = "last" if numbers[-1] == every.max() else "last ok"
    for title, place in ((first, 0), ("middle", len(numbers) // 2), (last, -1), ("worst", worst)):
        titles.setdefault(numbers[place], []).append(title)
    chosen = [(n, " and ".join(titles[n])) for n in sorted(titles) if n in case.frames]
    frames = [case.read_frame(n) for n, _ in chosen]
    if not any(frame.mips or "traced" in frame.curves for frame in frames):
        return None
    return _draw(case, case.scan, chosen)


def failed_projections(case: CaseFiles) -> Drawing | None:
    """Frames without a result whose scan could be read, three at most."""
    failed = case.errors.drop(case.good.index)
    if case.scan is None or failed.empty:
        return None
    chosen = zip(failed["frame"].tolist(), failed["status"].tolist(), strict=True)
    with_picture = [(n, title) for n, title in chosen if n in case.frames and case.read_frame(n).mips]
    return _draw(case, case.scan, with_picture[:_MAX_FAILED])


def simulated_wires(case: CaseFiles) -> Drawing | None:
    """Up to a dozen depths, the deepest last, in the three projections of the lumen."""
    compared = bool(case.errors["rms_mm"].notna().any())
    if case.scan is None or compared or not case.frames:
        return None
    deep = case.good[case.good["insertion_mm"].notna()]
    picked = deep.iloc[thinned(len(deep), _MAX_WIRES)]
    chosen = zip(picked["frame"].tolist(), picked["insertion_mm"].tolist(), strict=True)
    read = [(n, depth, case.read_frame(n).curves.get("simulated")) for n, depth in chosen if n in case.frames]
    wires = [(n, depth, points) for n, depth, points in read if points is not None]
    if not wires:
        return None
    view = whole(case.scan)
    figure, (row,) = view.sheet(1)
    depths = [depth for _, depth, _ in wires]
    scale = ScalarMappable(Normalize(min(depths), max(max(depths), min(depths) + 1e-9)), _DEPTHS)
    # deep wires first and wide, shallow ones over them and thin: each is seen where it differs
    widths = np.linspace(3.2, 1.0, len(wires))
    for axes, plane in zip(row, PLANES, strict=True):
        _outline(axes, view, plane)
        for (_, depth, points), width in zip(reversed(wires), widths, strict=True):
            colour = scale.to_rgba(np.array(depth))
            view.draw(axes, points, plane, tip=4, color=colour, linewidth=width)
        view.dress(axes, plane)
    figure.colorbar(scale, ax=row, label="insertion depth, mm", pad=0.01, aspect=30, shrink=0.8)
    parts = [points_table(points, frame=n, insertion_mm=depth) for n, depth, points in wires]
    return Drawing(figure, pd.concat(parts))


def _draw(case: CaseFiles, scan: ScanCrop, chosen: Sequence[tuple[int, str]]) -> Drawing | None:
    """One row per frame: the three projections, and the tip close by where any frame has a curve."""
    if not chosen:
        return None
    frames = [case.read_frame(number) for number, _ in chosen]
    curves = [points for frame in frames for points in frame.curves.values()]
    view = around(scan, curves)
    figure, rows = view.sheet(len(chosen), square=bool(curves))
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
        legend(figure, handles, labels, loc="outside upper left", ncols=4)
    return Drawing(figure, pd.concat([_table(frame) for frame in frames]), scans=True)


def _panel(axes: Axes, frame: FrameArrays, view: View, plane: Plane) -> None:
    if plane.along not in frame.mips:
        axes.set_facecolor("0.25")
    view.show(axes, frame, plane)
    if frame.median_mm is not None and frame.covariance_mm2 is not None:
        view.band(axes, frame.median_mm, frame.covariance_mm2, plane, **_BAND)
    for label, points in frame.curves.items():
        view.draw(axes, points, plane, tip=3, label=label, **_LOOKS[label])
    view.dress(axes, plane)


def _tip_panel(axes: Axes, frame: FrameArrays, view: View) -> None:
    """Close to the tip, along the axis in which the wire's end is seen longest."""
    if not frame.curves:
        axes.remove()
        return
    end = view.coordinates(next(iter(frame.curves.values())))
    tip, half = end[-1], 0.5 * _TIP_WINDOW_MM
    near = end[np.linalg.norm(end - tip, axis=1) < half]
    plane = max(PLANES, key=lambda plane: float(np.ptp(near, axis=0)[list(plane[1:])].sum()))
    _panel(axes, frame, replace(view, low=tip - half, high=tip + half), plane)
    axes.set_title(f"tip, {_TIP_WINDOW_MM:g} mm wide", loc="left", fontsize=9)


def _table(frame: FrameArrays) -> pd.DataFrame:
    parts = [points_table(points, frame=frame.frame, curve=label) for label, points in frame.curves.items()]
    if frame.median_mm is not None:
        parts.append(points_table(frame.median_mm, frame=frame.frame, curve="median of the ensemble"))
    nothing = pd.DataFrame([[frame.frame, "none"]], columns=["frame", "curve"])
    return pd.concat(parts or [nothing])


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
