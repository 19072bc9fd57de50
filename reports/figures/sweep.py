"""How the error answers to a setting: one panel per swept parameter, one line per case."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from reports.figures._style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    Drawing,
    has,
    new_figure,
    plain,
)
from reports.figures.overview import RunFiles

_CYCLE = (BLUE, ORANGE, GREEN, PURPLE, VERMILION, SKY)
_MAX_LINES = 12  # beyond, one colour and no names: the spread is what is read
_LOG_FROM_RATIO = 5.0


def sensitivity(run: RunFiles) -> Drawing | None:
    """Pooled error against each varied setting; to the true wire where only that is known."""
    columns = [c for c in ("rms_mm", "truth_rms_mm") if has(run.sweep, c)]
    parameters = list(dict.fromkeys(run.sweep["parameter"]))
    if not parameters or not columns:
        return None
    rows, wide = (len(parameters) + 1) // 2, min(2, len(parameters))
    figure = new_figure(3.2 * rows)
    panels = figure.subplots(rows, wide, squeeze=False).ravel()
    for axes, parameter in zip(panels, parameters, strict=False):
        _panel(axes, run.sweep[run.sweep["parameter"] == parameter], columns)
        axes.set_xlabel(parameter)
    handles, labels = panels[0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside upper left", ncols=3, frameon=False, fontsize=8)
    for axes in panels[len(parameters) :]:
        axes.remove()
    return Drawing(figure, run.sweep)


def _panel(axes: Axes, rows: pd.DataFrame, columns: list[str]) -> None:
    values = pd.to_numeric(rows["value"], errors="coerce")
    numeric = bool(values.notna().all())
    cases = list(dict.fromkeys(rows["case"]))
    for i, case in enumerate(cases):
        mine = rows["case"] == case
        own = rows[mine].assign(place=values[mine] if numeric else rows.loc[mine, "value"].astype(str))
        own = own.sort_values("place") if numeric else own
        colour = _CYCLE[i % len(_CYCLE)] if len(cases) <= _MAX_LINES else GREY
        for column, style, what in zip(columns, ("-o", ":D"), ("traced", "true"), strict=False):
            label = f"{case}: to the {what} wire" if len(cases) <= _MAX_LINES else None
            axes.plot(own["place"], own[column], style, color=colour, markersize=4, label=label)
    if numeric and values.min() > 0 and values.max() > _LOG_FROM_RATIO * values.min():
        axes.set_xscale("log")
        places = np.unique(values.to_numpy())
        axes.set_xticks(places, [f"{v:g}" for v in places], minor=False)
        axes.minorticks_off()
    axes.set_ylim(bottom=0.0, top=1.1 * float(rows[columns].max().max()))
    axes.set_ylabel("pooled rms distance, mm")
    plain(axes)
