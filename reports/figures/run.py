"""A whole run: error of every frame, pooled error of every case."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from reports.case_files import GOOD
from reports.colours import BAD, SIMULATED
from reports.figures._drawing import (
    Drawing,
    drawn_names,
    error_scale,
    heat_map,
    legend,
    new_figure,
    plain,
    whole_numbers,
)
from reports.figures._style import GREY, Look, predictors
from reports.tables import has

_MAX_INCH = 24.0
_BAR_INCH = 4.0
_MOST_NUMBERED = 16  # frames up to which a cell is wide enough for its number
_TOP_TICKS_FROM = 30  # rows from which the lower axis is out of sight
_MAX_NAMES = 90  # more labels than that overlap at the largest height


@dataclass(frozen=True, eq=False)
class RunFiles:
    """Tables of a run. errors maps a case to its errors.csv; summary has one row per case; sweep may be empty.

    planned : frames over all validation cases where some have no result, and so no row; else 0.
    """

    errors: dict[str, pd.DataFrame]
    summary: pd.DataFrame
    sweep: pd.DataFrame
    planned: int = 0


def case_frame_map(run: RunFiles) -> Drawing | None:
    """95th percentile error of every frame of every case; a cross is a frame without result."""
    # a case without scans has nothing to show here, unless it failed
    known = {name: t for name, t in run.errors.items() if (t["status"] != "simulated").any()}
    columns = ["case", "frame", "status", "p95_mm"]
    parts = [t.assign(case=name)[columns] for name, t in known.items()]
    table = pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=columns)
    failed = ~table["status"].isin(GOOD).to_numpy(dtype=bool)
    if not has(table, "p95_mm") and not failed.any():
        return None
    cases, frames = list(known), table["frame"].to_numpy(dtype=int)
    rows = table["case"].map({name: i for i, name in enumerate(cases)}).to_numpy(dtype=int)
    grid = np.full((len(cases), int(frames.max()) + 1), np.nan)
    grid[rows[~failed], frames[~failed]] = table["p95_mm"].to_numpy()[~failed]
    figure, axes = _tall(cases)
    edges = np.arange(grid.shape[1] + 1) - 0.5, np.arange(len(cases) + 1) - 0.5
    # a colour bar of readable size at the top, however tall the figure is
    share = min(1.0, _BAR_INCH / figure.get_figheight())
    bar: Look = {"shrink": share, "anchor": (0.0, 1.0), "aspect": 12, "fraction": 0.04}
    look: Look = {"edgecolors": "white", "linewidth": 0.4 if len(cases) <= _MAX_NAMES else 0.0}
    heat_map(axes, grid, edges, "95th percentile, mm", error_scale(), bar, **look)
    if grid.shape[1] <= _MOST_NUMBERED and len(cases) <= _MAX_NAMES:
        _numbers(axes, grid)
    axes.plot(frames[failed], rows[failed], "x", color=BAD, markersize=5)
    axes.set_xlabel("frame")
    whole_numbers(axes.xaxis)
    return Drawing(figure, table)


def _numbers(axes: Axes, grid: NDArray[np.float64]) -> None:
    """Write into each cell what it holds: of a scale from 0.02 to 2 mm, 0.3 and 1.3 are two shades of one colour."""
    for row, frame in np.argwhere(np.isfinite(grid)):
        value = float(grid[row, frame])
        text = f"{value:.2f}" if value < 9.995 else f"{value:.0f}"
        axes.text(frame, row, text, ha="center", va="center", fontsize=7, color="white")


def cases_by_error(run: RunFiles) -> Drawing | None:
    """Pooled rms of every case with its 95 % interval, beside the centreline's and its strongest predictor's."""
    table = run.summary[run.summary["rms_mm"].notna()]
    if len(table) < 2:
        return None
    column, label, colour, _, marker = next(predictors())
    figure, axes = _tall(list(table["case"]))
    places = np.arange(len(table))
    axes.hlines(places, table["rms_low_mm"], table["rms_high_mm"], color=SIMULATED, linewidth=2)
    calibration = (table["role"] == "calibration").fillna(value=False).to_numpy(dtype=bool)
    looks = (~calibration, "o", "simulated"), (calibration, "D", "simulated (calibration)")
    for chosen, shape, name in looks:
        if chosen.any():
            axes.plot(table["rms_mm"][chosen], places[chosen], shape, color=SIMULATED, label=name)
    axes.plot(table[column], places, marker, color=colour, fillstyle="none", label=label)
    strongest = [float(row.get(f"null_{row['strongest_null']}_rms_mm", np.nan)) for row in table.to_dict("records")]
    if np.isfinite(strongest).any():
        axes.plot(strongest, places, "v", color=GREY, fillstyle="none", label="its strongest predictor")
    axes.set_xlim(left=0.0)
    axes.set_xlabel("pooled rms distance to the traced wire, mm")
    legend(figure, *axes.get_legend_handles_labels(), ncols=3, loc="outside upper left")
    plain(axes)
    shown = table[["case", "role", "rms_mm", "rms_low_mm", "rms_high_mm", column, "strongest_null"]]
    return Drawing(figure, shown.assign(strongest_rms_mm=strongest))


def _tall(names: Sequence[str]) -> tuple[Figure, Axes]:
    """A figure with one named row per case, the first at the top; the table beside it has the names whole."""
    figure = new_figure(float(np.clip(1.3 + 0.24 * len(names), 2.2, _MAX_INCH)))
    axes = figure.subplots()
    every = -(-len(names) // _MAX_NAMES)
    axes.set_yticks(range(0, len(names), every), drawn_names(names)[::every], fontsize=8)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.tick_params(axis="x", labeltop=len(names) >= _TOP_TICKS_FROM)
    return figure, axes
