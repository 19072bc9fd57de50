"""The figures of a calibration, from what calibration.json holds."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from reports.colours import SIMULATED
from reports.figures._drawing import (
    LOG_FROM_RATIO,
    Drawing,
    drawn_names,
    lattice,
    legend,
    new_figure,
    plain,
    plain_decades,
    positive_axis,
    whole_numbers,
)
from reports.figures._style import BROWN, GREY

_LIGHT = 0.99  # weight of a frame below which its mark is hollow
HIGHEST = 12.0
"""Rise up to which profiles are drawn: what lies above is out of the question."""


def profiles(record: Mapping[str, Any]) -> Drawing | None:
    """A panel for each parameter."""
    rows = {row["name"]: row for row in record["estimates"]}
    # a parameter whose profile was not looked at is drawn by its standard deviation: none is missing
    points = {name: record["profiles"].get(name) or [] for name, row in rows.items() if row["sd"] > 0}
    if not any(points.values()):
        return None
    figure, panels = lattice(len(points), 3, row_inch=2.3)
    table = []
    for axes, (name, found) in zip(panels, points.items(), strict=True):
        curve = _curve(rows[name], found)
        axes.plot(*curve.T, color=SIMULATED, **({"marker": ".", "markersize": 4} if found else {"linestyle": "--"}))
        _panel(axes, rows[name])
        table += [{"parameter": name, "value": v, "rise": r} for v, r in curve]
    figure.supylabel("misfit above the least", fontsize=8)
    return Drawing(figure, pd.DataFrame(table))


def _curve(row: Mapping[str, Any], points: Sequence[list[float]]) -> np.ndarray:
    """Values and rises (n, 2) from the least value up; without ``points`` the parabola of the standard deviation."""
    if points:
        curve = np.array(sorted([*points, [row["value"], 0.0]]))
        return np.column_stack([curve[:, 0], np.clip(curve[:, 1], 0.0, 1e9)])
    off = np.linspace(-3.0, 3.0, 25)
    value = row["value"] * np.exp(off * row["sd"]) if row["logarithmic"] else row["value"] + off * row["sd"]
    return np.column_stack([value, off**2])


def _panel(axes: Axes, row: Mapping[str, Any]) -> None:
    axes.plot([row["value"]], [0.0], color=SIMULATED, marker="o")
    axes.axhline(1.0, color=GREY, linestyle="--", linewidth=0.8)
    low, high = _span(row)
    if low < row["prior"] < high:
        axes.axvline(row["prior"], color=BROWN, linestyle=":", linewidth=1.2)
    axes.set_xlim(low, high)
    if low > 0 and high > LOG_FROM_RATIO * low:
        axes.set_xscale("log")
        plain_decades(axes.xaxis, (1.0,))
    else:
        axes.locator_params(axis="x", nbins=4)
    axes.set_ylim(-0.4, HIGHEST)
    verdict = "" if row["seen"] else ": not seen"
    # bold, not red: small print in red cannot be read on a dark page
    axes.set_title(f"{row['name']}{verdict}", fontsize=9, weight="normal" if row["seen"] else "bold")
    plain(axes)


def _span(row: Mapping[str, Any]) -> tuple[float, float]:
    """Values three standard deviations to both sides, as far as the bounds."""
    off = 3.0 * row["sd"]
    ends = row["value"] * np.exp([-off, off]) if row["logarithmic"] else (row["value"] - off, row["value"] + off)
    bounds = row.get("bounds") or (-np.inf, np.inf)
    margin = 0.02 * (ends[1] - ends[0])  # a line at the bound is seen
    low, high = max(ends[0], bounds[0] - margin), min(ends[1], bounds[1] + margin)
    return float(low), float(high)


def correlations(record: Mapping[str, Any]) -> Drawing | None:
    """A square of numbers."""
    names, values = record["correlation"]["names"], np.array(record["correlation"]["values"], dtype=float)
    if len(names) < 2:
        return None
    figure = new_figure(0.5 * len(names) + 1.4, width_inch=0.7 * len(names) + 2.4)
    axes = figure.subplots()
    axes.imshow(values, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    for i, j in np.ndindex(*values.shape):
        shade = "white" if abs(values[i, j]) > 0.6 else "black"
        axes.text(j, i, f"{values[i, j].round(2) + 0.0:.2f}", ha="center", va="center", fontsize=8, color=shade)
    axes.set_xticks(range(len(names)), names, rotation=35, ha="right", fontsize=8)
    axes.set_yticks(range(len(names)), names, fontsize=8)
    return Drawing(figure, pd.DataFrame(values, columns=names).assign(parameter=names))


def residuals(record: Mapping[str, Any]) -> Drawing | None:
    """A panel for each insertion, in the order of its frames."""
    table = pd.DataFrame(record["frames"])
    if not len(table):
        return None
    cases = list(dict.fromkeys(table["case"]))
    figure, panels = lattice(len(cases), 3, row_inch=2.4, more_inch=0.3)
    for axes, case, name in zip(panels, cases, drawn_names(cases), strict=True):
        own = table[table["case"] == case]
        for column, colour, label in (("before_mm", GREY, "as stated"), ("after_mm", SIMULATED, "calibrated")):
            axes.plot(own["frame"], own[column], color=colour, marker="o", markersize=3.5, linewidth=1.0, label=label)
        light = own[own["weight"] < _LIGHT]
        axes.plot(light["frame"], light["after_mm"], "o", markersize=5, markerfacecolor="white", color=SIMULATED)
        axes.set_title(name, fontsize=9)
        axes.set_xlabel("frame")
        whole_numbers(axes.xaxis)
        plain(axes)
        positive_axis(axes, [own["before_mm"].dropna(), own["after_mm"].dropna()])
    panels[0].set_ylabel("mm rms")
    legend(figure, *panels[0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
    light = table["weight"] < _LIGHT
    return Drawing(figure, table.assign(mark=np.where(light, "hollow", "full")))
