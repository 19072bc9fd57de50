"""A whole run: error of every frame, pooled error of every case, and how the error answers to a setting."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.case_files import GOOD
from reports.figures._drawing import Drawing, heat_map, lattice, legend, new_figure, plain, whole_numbers
from reports.figures._style import GREY, PALETTE, SIMULATED, VERMILION, Look, predictors
from reports.tables import has

_CLIP_PERCENTILE = 98.0  # one lost frame must not turn the others dark
_MAX_INCH = 24.0
_BAR_INCH = 4.0
_TOP_TICKS_FROM = 30  # rows from which the lower axis is out of sight
_MAX_NAMES = 90  # more labels than that overlap at the largest height
UNCHANGED = "(plain)"  # the parameter of the rows of sweep.csv in which nothing was changed
_MAX_CASES = 6  # of a sweep; beyond, one colour and no names: the spread is what is read
_LOG_FROM_RATIO = 5.0
_STYLES = (("rms_mm", "-o", "traced"), ("truth_rms_mm", ":D", "true"))


@dataclass(frozen=True, eq=False)
class RunFiles:
    """Tables of a run. errors maps a case to its errors.csv; summary has one row per case; sweep may be empty."""

    errors: dict[str, pd.DataFrame]
    summary: pd.DataFrame
    sweep: pd.DataFrame


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
    look: Look = {"edgecolors": "white", "linewidth": 0.4}
    heat_map(axes, grid, edges, "95th percentile, mm", _CLIP_PERCENTILE, bar, **look)
    axes.plot(frames[failed], rows[failed], "x", color=VERMILION, markersize=5)
    axes.set_xlabel("frame")
    whole_numbers(axes.xaxis)
    return Drawing(figure, table)


def cases_by_error(run: RunFiles) -> Drawing | None:
    """Pooled rms of every case with its 95 % interval, beside the centreline's."""
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
    axes.set_xlim(left=0.0)
    axes.set_xlabel("pooled rms distance to the traced wire, mm")
    legend(axes, ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    plain(axes)
    return Drawing(figure, table[["case", "role", "rms_mm", "rms_low_mm", "rms_high_mm", column]])


def sensitivity(run: RunFiles) -> Drawing | None:
    """Pooled error against each varied setting, to the traced and to the true wire where there is one."""
    varied = run.sweep[run.sweep["parameter"] != UNCHANGED]
    parameters = list(dict.fromkeys(varied["parameter"]))
    if not parameters or not has(varied, *(column for column, *_ in _STYLES)):
        return None
    figure, panels = lattice(len(parameters), 2, row_inch=3.2)
    unchanged = run.sweep[run.sweep["parameter"] == UNCHANGED].set_index("case")
    for axes, parameter in zip(panels, parameters, strict=True):
        _panel(axes, varied[varied["parameter"] == parameter], unchanged)
        axes.set_xlabel(str(parameter))
    handles, labels = panels[0].get_legend_handles_labels()
    if handles:
        legend(figure, handles, labels, loc="outside upper left", ncols=3)
    return Drawing(figure, run.sweep)


def _tall(names: Sequence[str]) -> tuple[Figure, Axes]:
    """A figure with one named row per case, the first at the top."""
    figure = new_figure(float(np.clip(1.3 + 0.24 * len(names), 2.2, _MAX_INCH)))
    axes = figure.subplots()
    every = -(-len(names) // _MAX_NAMES)
    axes.set_yticks(range(0, len(names), every), names[::every], fontsize=8)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.tick_params(axis="x", labeltop=len(names) >= _TOP_TICKS_FROM)
    return figure, axes


def _panel(axes: Axes, rows: pd.DataFrame, unchanged: pd.DataFrame) -> None:
    rows = rows.assign(place=_value_axis(axes, rows["value"]))
    cases = list(dict.fromkeys(rows["case"]))
    few = len(cases) <= _MAX_CASES
    for i, case in enumerate(cases):
        colour = PALETTE[i % len(PALETTE)] if few else GREY
        mine = rows[(rows["case"] == case).to_numpy()].sort_values("place")
        name = f"{case}: " if few and len(cases) > 1 else ""
        for column, style, what in _STYLES:
            if has(mine, column):
                label = f"{name}to the {what} wire" if few else None
                axes.plot(mine["place"], mine[column], style, color=colour, markersize=4, label=label)
        if case in unchanged.index and np.isfinite(unchanged.loc[case, "rms_mm"]):
            look: Look = {"color": colour, "linestyle": "--", "linewidth": 0.9}
            label = "nothing changed, to the traced wire" if i == 0 else None
            axes.axhline(unchanged.loc[case, "rms_mm"], label=label, **look)
    # the whole range from zero: a slope must not be drawn steeper than it is
    shown = [rows["rms_mm"], rows["truth_rms_mm"], unchanged["rms_mm"]]
    axes.set_ylim(bottom=0.0, top=1.1 * max(float(np.nan_to_num(values.max())) for values in shown))
    axes.set_ylabel("pooled rms distance, mm")
    plain(axes)


def _value_axis(axes: Axes, values: "pd.Series[Any]") -> "pd.Series[float]":
    """Name the values below the panel; returns their places: numbers as they are, words in their order."""
    numbers = pd.to_numeric(values, errors="coerce")
    numeric = bool(numbers.notna().all())
    places = (numbers if numeric else pd.Series(pd.factorize(values)[0], values.index)).astype(float)
    if numeric and places.min() > 0 and places.max() > _LOG_FROM_RATIO * places.min():
        axes.set_xscale("log")
        axes.minorticks_off()
    known = dict(sorted(zip(places, values, strict=True)))
    axes.set_xticks(list(known), [str(value) for value in known.values()])
    axes.margins(x=0.15)
    return places
