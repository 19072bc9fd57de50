"""The simulated wire as an X-ray sees it, over the wire that was seen, frame by frame."""

import numpy as np
import pandas as pd

from reports.case_files import GOOD, CaseFiles, thinned
from reports.colours import SIMULATED, TRACED
from reports.figures._drawing import Drawing, new_figure

_COLUMNS, _MOST = 6, 42
_PANEL_INCH = 1.6
_TITLE_INCH = 0.22
_MARGIN_MM = 6.0
_SHOWN_MM = 130.0  # of either wire, from the tip: what was fitted and what was scored


def views(case: CaseFiles) -> Drawing | None:
    """Every frame (42 at most): the polyline that was seen and the projected simulated wire, around their ends."""
    if "projections" not in case.result.get("chosen", {}):
        return None
    table = case.errors[case.errors["frame"].isin(case.frames)]
    read = {int(n): case.read_frame(int(n)) for n in table["frame"]}
    pairs = {
        n: (f.seen_in_view_mm, f.simulated_in_view_mm)
        for n, f in read.items()
        if f.seen_in_view_mm is not None and f.simulated_in_view_mm is not None
    }
    if not pairs:
        return None
    table = table[table["frame"].isin(pairs)]
    table = table.iloc[thinned(len(table), _MOST)]
    ends = {n: (_end(seen), _end(simulated)) for n, (seen, simulated) in pairs.items()}
    everything = np.concatenate([curve for n in table["frame"] for curve in ends[int(n)]])
    low, high = everything.min(axis=0) - _MARGIN_MM, everything.max(axis=0) + _MARGIN_MM
    rows, height = -(-len(table) // _COLUMNS), _PANEL_INCH * float(np.clip((high - low)[1] / (high - low)[0], 0.4, 2.0))
    figure = new_figure(rows * (height + _TITLE_INCH), _COLUMNS * _PANEL_INCH, fitted=False)
    panels = figure.subplots(rows, _COLUMNS, squeeze=False).ravel()
    figure.subplots_adjust(0.005, 0.005, 0.995, 1.0 - _TITLE_INCH / (height + _TITLE_INCH) / rows, 0.04, 0.16)
    for axes in panels:
        axes.set_axis_off()
    for axes, row in zip(panels, table.to_dict("records"), strict=False):
        seen, simulated = ends[int(row["frame"])]
        axes.plot(*seen.T, color=TRACED, linewidth=2.2)
        axes.plot(*simulated.T, color=SIMULATED, linestyle=(0, (4, 1)), linewidth=1.2)
        for curve, colour in ((seen, TRACED), (simulated, SIMULATED)):
            axes.plot(*curve[-1:].T, "o", color=colour, markersize=4)
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(high[1], low[1])  # v runs downwards, as in the image
        axes.set_aspect("equal")
        good = row["status"] in GOOD
        text = f"{row['frame']}: {row['rms_mm']:.1f} mm" if good else f"{row['frame']}: {row['status']}"
        axes.set_title(text, fontsize=8, loc="left", pad=2, weight="normal" if good else "bold")
    return Drawing(figure, pd.DataFrame(table[["frame", "status", "insertion_mm", "rms_mm", "tip_mm"]]))


def _end(curve: np.ndarray) -> np.ndarray:
    """The last part of a curve (n, 2)."""
    steps = np.linalg.norm(np.diff(curve[::-1], axis=0), axis=1)
    from_tip = np.concatenate([[0.0], np.cumsum(steps)])[::-1]
    return curve[from_tip <= _SHOWN_MM]
