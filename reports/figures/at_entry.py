"""The scan about the entry, of a case whose lumen was not found."""

import numpy as np
import pandas as pd
from matplotlib.patheffects import withStroke

from reports.case_files import CaseFiles
from reports.colours import BAD
from reports.figures._drawing import Drawing
from reports.figures._planes import PLANES, View, points_table, whole
from reports.figures._style import Look
from reports.frames_file import FrameArrays

_ARROW_SHARE = 0.12  # of the scan's longest side
_ROOM_MM = 5.0  # beyond an entry outside the scan
_RIM: Look = {"path_effects": [withStroke(linewidth=4.0, foreground="white")]}


def scan_at_entry(case: CaseFiles) -> Drawing | None:
    """Three slabs through the entry point, which is marked, with the direction in which the wire enters."""
    entry = case.result.get("entry", {})
    if case.scan is None or not case.scan.entry_slabs or "entry_mm" not in entry:
        return None
    start, way = (np.asarray(entry[name], float) for name in ("entry_mm", "entry_direction"))
    everything = whole(case.scan)
    arrow = np.array([start, start + _ARROW_SHARE * everything.size.max() * way / np.linalg.norm(way)])
    at = everything.coordinates(arrow)
    low, high = (pick(at, axis=0) for pick in (np.min, np.max))
    view = View(case.scan, np.minimum(everything.low, low - _ROOM_MM), np.maximum(everything.high, high + _ROOM_MM))
    figure, (row,) = view.sheet(1)
    pictures = FrameArrays(0, mips=case.scan.entry_slabs)
    for axes, plane in zip(row, PLANES, strict=True):
        axes.set_facecolor("0.25")
        view.show(axes, pictures, plane)
        view.draw(axes, arrow, plane, color=BAD, linewidth=2.0, **_RIM)
        view.draw(axes, arrow[:1], plane, tip=8, color=BAD)
        view.dress(axes, plane)
    table = [points_table(arrow[:1], point="entry"), points_table(arrow[1:], point="along entry_direction")]
    return Drawing(figure, pd.concat(table), scans=True)
