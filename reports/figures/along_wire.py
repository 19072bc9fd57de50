"""Heat maps: a quantity along the wire (across) for every frame (up)."""

from dataclasses import replace

import numpy as np
import pandas as pd
from matplotlib.colors import ListedColormap, Normalize
from scipy.interpolate import interp1d

from reports.case_files import GOOD, CaseFiles
from reports.colours import BAD
from reports.figures._drawing import Drawing, FrameAxis, error_scale, heat_map, new_figure, whole_numbers
from reports.tables import has

_MOST_OVER_U = 4.0  # twice what counts as beyond
_NOT_SCORED, _NO_FORCE = "0.82", "0.95"
_CLIP_PERCENTILE = 99.5  # of forces, which have no scale of their own: one wild point must not turn the whole map dark


def error_along_wire(case: CaseFiles) -> Drawing | None:
    """Distance to the traced curve along the simulated wire, of frames that are ok."""
    failed = set(case.errors["frame"]) - set(case.good["frame"])
    points = case.points[~case.points["frame"].isin(failed)]
    return _along_wire(case, points, "error_mm", "distance to the traced curve, mm", error_scale())


def error_over_u(case: CaseFiles) -> Drawing | None:
    """The error across the traced wire over its uncertainty, of frames that are ok."""
    points = case.points[case.points["frame"].isin(case.good["frame"])]
    scale = Normalize(0.0, _MOST_OVER_U)
    return _along_wire(case, points, "error_over_u", "error over u (beyond 2: the model's)", scale)


def contact_along_wire(case: CaseFiles) -> Drawing | None:
    """Magnitude of the wall's force along the simulated wire."""
    points = case.points if has(case.points, "contact_force_N") else _joints(case)
    known = points["contact_force_N"].dropna()
    most = float(np.percentile(known, _CLIP_PERCENTILE)) if len(known) else 0.0
    scale = Normalize(0.0, max(most, 1e-9))
    drawing = _along_wire(case, points, "contact_force_N", "contact force, N", scale, zero=_NO_FORCE)
    if drawing is None:
        return None
    # the wires of refused frames are shown, too: with the cross that the map of a run has for such a frame
    rows = case.errors.loc[case.errors["frame"].isin(list(drawing.frames[0].of_frame)), ["frame", "status"]]
    refused = rows["frame"][~rows["status"].isin(GOOD)].to_numpy()
    if len(refused):
        drawing.figure.axes[0].plot(0.0 * refused, refused, "x", color=BAD, markersize=7, clip_on=False, zorder=5)
    return replace(drawing, table=drawing.table.merge(rows, on="frame", how="outer"))


def _joints(case: CaseFiles) -> pd.DataFrame:
    """Contact force at the joints, for a case that was not compared and so has no points.csv.gz."""
    parts = [case.points]
    for number in case.frames:
        frame = case.read_frame(number)
        wire, force = frame.simulated_mm, frame.contact_force_N
        if wire is not None and force is not None and len(wire) == len(force) > 1:
            steps = np.linalg.norm(np.diff(wire, axis=0), axis=1)
            size = np.linalg.norm(force.reshape(len(force), -1), axis=1)
            arc = np.concatenate([[0.0], np.cumsum(steps)])
            parts.append(pd.DataFrame({"frame": number, "arc_mm": arc, "contact_force_N": size}))
    return pd.concat(parts, ignore_index=True) if len(parts) > 1 else case.points


def _along_wire(
    case: CaseFiles, points: pd.DataFrame, column: str, label: str, scale: Normalize, zero: str = ""
) -> Drawing | None:
    """The map of a column. zero : colour of what is exactly 0, where that is another thing than little.

    Each frame of the case has its row: without those at the ends that failed a page seemed to have all.
    """
    kept = points[points[column].notna() & points["arc_mm"].notna()]
    if kept.empty:
        return None
    every = pd.concat([kept["frame"], case.errors["frame"]]).astype(int)
    frames = np.arange(every.min(), every.max() + 1)
    step = _step(kept)
    grid, held = np.full((len(frames), int(kept["arc_mm"].max() / step) + 2), np.nan), np.zeros(len(frames))
    for frame, samples in kept.groupby("frame"):
        first, last = (round(float(samples["arc_mm"].agg(end)) / step) for end in ("min", "max"))
        at = np.arange(first, last + 1) * step
        nearest = interp1d(samples["arc_mm"], samples[column], kind="nearest", fill_value="extrapolate")
        row = int(str(frame)) - frames[0]
        grid[row, first : last + 1], held[row] = nearest(at), max(first - 0.5, 0.0) * step
    figure = new_figure(float(np.clip(1.4 + 0.12 * len(frames), 2.9, 7.0)))
    axes = figure.subplots()
    edges = (np.arange(grid.shape[1] + 1) - 0.5) * step, np.append(frames, frames[-1] + 1) - 0.5
    none = (grid == 0.0) & bool(zero)
    heat_map(axes, np.where(none, np.nan, grid), edges, label, scale, bar={}, rasterized=True)
    if none.any():
        axes.pcolormesh(*edges, np.where(none, 0.0, np.nan), cmap=ListedColormap([zero]), rasterized=True)
    # the clamp's reach in front, which counts in no score: white is beyond the tip
    axes.barh(frames, held, height=1.0, color=_NOT_SCORED, linewidth=0.0)
    axes.set_xlim(left=0.0)
    axes.set_xlabel("arc length from the entry along the simulated wire, mm")
    axes.set_ylabel("frame")
    whole_numbers(axes.yaxis)
    row_of, place = np.nonzero(np.isfinite(grid))
    table = {"frame": frames[row_of], "arc_mm": place * step, column: grid[row_of, place]}
    rows = FrameAxis(axes, {int(n): float(n) for n in frames}, across=False)
    return Drawing(figure, pd.DataFrame(table), frames=[rows])


def _step(points: pd.DataFrame) -> float:
    """Arc-length step between samples, mm."""
    steps = points.groupby("frame")["arc_mm"].diff()
    positive = steps[steps > 0]
    return float(positive.median()) if len(positive) else 1.0
