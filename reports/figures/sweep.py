"""How the error answers to a setting: one panel per swept parameter, one line per case."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from reports.figures._axes import legend, plain
from reports.figures._drawing import Drawing, new_figure
from reports.figures._style import GREY, PALETTE, Look
from reports.figures.overview import RunFiles
from reports.tables import has

UNCHANGED = "(plain)"  # the parameter of the rows in which nothing was changed
_MAX_CASES = 6  # beyond, one colour and no names: the spread is what is read
_LOG_FROM_RATIO = 5.0
_STYLES = (("rms_mm", "-o", "traced"), ("truth_rms_mm", ":D", "true"))


def sensitivity(run: RunFiles) -> Drawing | None:
    """Pooled error against each varied setting, to the traced and to the true wire where there is one."""
    varied = run.sweep[run.sweep["parameter"] != UNCHANGED]
    parameters = list(dict.fromkeys(varied["parameter"]))
    if not parameters or not has(varied, *(column for column, *_ in _STYLES)):
        return None
    rows = -(-len(parameters) // 2)
    figure = new_figure(3.2 * rows)
    panels = list(figure.subplots(rows, min(2, len(parameters)), squeeze=False).ravel())
    unchanged = run.sweep[run.sweep["parameter"] == UNCHANGED].set_index("case")
    for axes, parameter in zip(panels, parameters, strict=False):
        _panel(axes, varied[varied["parameter"] == parameter], unchanged)
        axes.set_xlabel(str(parameter))
    for axes in panels[len(parameters) :]:
        axes.remove()
    handles, labels = panels[0].get_legend_handles_labels()
    if handles:
        legend(figure, handles, labels, loc="outside upper left", ncols=3)
    return Drawing(figure, run.sweep)


def _panel(axes: Axes, rows: pd.DataFrame, unchanged: pd.DataFrame) -> None:
    rows = rows.assign(place=_places(rows["value"]))
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
    _value_axis(axes, rows)
    # the whole range from zero: a slope must not be drawn steeper than it is
    shown = [rows["rms_mm"], rows["truth_rms_mm"], unchanged["rms_mm"]]
    axes.set_ylim(bottom=0.0, top=1.1 * max(float(np.nan_to_num(values.max())) for values in shown))
    axes.set_ylabel("pooled rms distance, mm")
    plain(axes)


def _places(values: pd.Series[Any]) -> pd.Series[float]:
    """Numbers as they are; words in their order."""
    numbers = pd.to_numeric(values, errors="coerce")
    order = {value: i for i, value in enumerate(dict.fromkeys(values))}
    return (numbers if numbers.notna().all() else values.map(order)).astype(float)


def _value_axis(axes: Axes, rows: pd.DataFrame) -> None:
    places = rows["place"]
    numeric = bool(pd.to_numeric(rows["value"], errors="coerce").notna().all())
    if numeric and places.min() > 0 and places.max() > _LOG_FROM_RATIO * places.min():
        axes.set_xscale("log")
        axes.minorticks_off()
    known = dict(sorted(zip(places, rows["value"], strict=True)))
    axes.set_xticks(list(known), [str(value) for value in known.values()])
    axes.margins(x=0.15)
