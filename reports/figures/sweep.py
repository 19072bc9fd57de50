"""How the error answers to a setting: the value in use is a point of the curve."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from reports.colours import SIMULATED, TRUE
from reports.figures._drawing import Drawing, lattice, legend, plain
from reports.figures._style import GREY, Look
from reports.figures.run import RunFiles
from reports.schema import ALL
from reports.sweep import UNCHANGED
from reports.tables import has

_LOG_FROM_RATIO = 5.0
_STYLES: tuple[tuple[str, str, Look], ...] = (
    ("rms_mm", "to the traced wire", {"color": SIMULATED, "marker": "o"}),
    ("truth_rms_mm", "to the true wire", {"color": TRUE, "marker": "D", "linestyle": ":"}),
)


def sensitivity(run: RunFiles) -> Drawing | None:
    """Pooled error against each varied setting, to the traced and to the true wire where there is one."""
    table = with_unchanged(run.sweep)
    parameters = list(dict.fromkeys(table["parameter"]))
    if not parameters or not has(table, *(column for column, *_ in _STYLES)):
        return None
    figure, panels = lattice(len(parameters), 2, row_inch=3.2)
    for axes, parameter in zip(panels, parameters, strict=True):
        _panel(axes, table[table["parameter"] == parameter])
        axes.set_xlabel(str(parameter))
    handles, labels = panels[0].get_legend_handles_labels()
    if handles:
        legend(figure, handles, labels, loc="outside upper left", ncols=4)
    return Drawing(figure, table)


def with_unchanged(sweep: pd.DataFrame) -> pd.DataFrame:
    """The points of every parameter, the unchanged result among them where its value is known."""
    varied = sweep[sweep["parameter"] != UNCHANGED]
    varied = varied.assign(in_use=varied["value"] == varied["unchanged"])
    plain_rows = sweep[sweep["parameter"] == UNCHANGED]
    parts = [varied]
    for parameter, rows in varied.groupby("parameter", sort=False):
        value = rows["unchanged"].iloc[0]
        if pd.notna(value) and not rows["in_use"].any():
            parts.append(plain_rows.assign(parameter=parameter, value=value, unchanged=value, in_use=True))
    return pd.concat(parts, ignore_index=True)


def _panel(axes: Axes, rows: pd.DataFrame) -> None:
    rows = rows.assign(place=_value_axis(axes, rows["value"])).sort_values("place")
    pooled = rows["case"] == (ALL if len(set(rows["case"])) > 1 else rows["case"].iloc[0])
    for _, one in rows[~pooled].groupby("case"):
        axes.plot(one["place"], one["rms_mm"], color=GREY, linewidth=0.6, alpha=0.7)
    whole = rows[pooled]
    for column, label, look in _STYLES:
        if has(whole, column):
            axes.plot(whole["place"], whole[column], markersize=4, label=label, **look)
    unchanged = whole[whole["in_use"]]
    ring: Look = {"color": SIMULATED, "fillstyle": "none", "markersize": 10, "label": "unchanged"}
    axes.plot(unchanged["place"], unchanged["rms_mm"], "o", **ring)
    # the whole range from zero: a slope must not be drawn steeper than it is; and every case: none may be cut off
    top = 1.1 * float(np.nan_to_num(rows[["rms_mm", "truth_rms_mm"]].max()).max())
    axes.set_ylim(bottom=0.0, top=top)
    if len(unchanged):
        _intervals(axes, whole, float(unchanged["rms_mm"].iloc[0]), top)
    axes.set_ylabel("pooled rms distance, mm")
    plain(axes)


def _intervals(axes: Axes, whole: pd.DataFrame, base: float, top: float) -> None:
    """The intervals of the ratios to ``base``, mm; one without an upper end, or that ends above ``top``, as an arrow.

    Of few insertions they reach so far (700 times the error of four) that an axis with all of them shows nothing.
    """
    known = whole[whole["rms_ratio_low"].notna()]
    low = (base * known["rms_ratio_low"]).clip(upper=top)
    high = (base * known["rms_ratio_high"]).fillna(np.inf)
    axes.vlines(known["place"], low, high.clip(upper=top), color=SIMULATED, linewidth=1.5)
    beyond = known["place"][high > top]
    if len(beyond):  # without points and unclipped it would have no place, and the layout fails
        axes.plot(beyond, [top] * len(beyond), "^", color=SIMULATED, markersize=8, clip_on=False)


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
