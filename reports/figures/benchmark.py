"""Run time against error, convergence with the segment length, and the outcomes of a stress study."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

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

_STYLES = tuple(
    zip(
        (BLUE, ORANGE, GREEN, PURPLE, VERMILION, SKY, "black", GREY),
        ("o", "s", "D", "^", "v", "P", "X", "*"),
        strict=True,
    )
)
_MAX_COLUMNS = 3


@dataclass(frozen=True, eq=False)
class BenchFiles:
    """rows: one row per scene, method and setting, with ``on_front``; stress: one row per axis and outcome.

    claims: one row per promise, measured; orders: one row per point that an order of convergence was fitted to.
    """

    rows: pd.DataFrame
    stress: pd.DataFrame
    claims: pd.DataFrame
    orders: pd.DataFrame


def pareto(bench: BenchFiles) -> Drawing | None:
    """Shape error against milliseconds per mm inserted; the line is what nothing beats in both."""
    rows = _plottable(bench.rows, "shape_error_mm", "ms_per_mm")
    if rows.empty:
        return None
    figure, panels = _panels(rows)
    styles = _styles(bench.rows)
    for axes, (scene, mine) in zip(panels, rows.groupby("scene", sort=False), strict=False):
        for method, group in mine.groupby("method", sort=False):
            colour, marker = styles[str(method)]
            axes.plot(
                group["shape_error_mm"], group["ms_per_mm"], marker, color=colour, markersize=4, label=method
            )
        front = mine[mine["on_front"]].sort_values("shape_error_mm")
        axes.plot(
            front["shape_error_mm"], front["ms_per_mm"], color="black", linewidth=1.0, drawstyle="steps-post"
        )
        _name_segments(axes, front)
        axes.set_title(str(scene), loc="left", fontsize=9)
        axes.set_xlabel("shape error, mm")
        axes.set_ylabel("ms per mm inserted")
        _log_axes(axes)
    _method_legend(figure, panels)
    shown = ["scene", "method", "segment_mm", "hull", "tolerance", "shape_error_mm", "ms_per_mm", "on_front"]
    return Drawing(figure, rows[[c for c in shown if c in rows]])


def convergence(bench: BenchFiles) -> Drawing | None:
    """Shape error against segment length, the best over the other settings, with a second-order slope."""
    rows = _plottable(bench.rows, "segment_mm", "shape_error_mm")
    if rows.empty or rows["segment_mm"].nunique() < 2:
        return None
    best = rows.groupby(["scene", "method", "segment_mm"], sort=False)["shape_error_mm"].min().reset_index()
    figure, panels = _panels(best)
    styles = _styles(bench.rows)
    for axes, (scene, mine) in zip(panels, best.groupby("scene", sort=False), strict=False):
        for method, group in mine.groupby("method", sort=False):
            colour, marker = styles[str(method)]
            line = group.sort_values("segment_mm")
            axes.plot(
                line["segment_mm"],
                line["shape_error_mm"],
                marker=marker,
                color=colour,
                markersize=4,
                label=method,
            )
        _slope(axes, mine)
        axes.set_title(str(scene), loc="left", fontsize=9)
        axes.set_xlabel("segment length, mm")
        axes.set_ylabel("shape error, mm")
        _log_axes(axes)
    _method_legend(figure, panels)
    return Drawing(figure, best)


def orders(bench: BenchFiles) -> Drawing | None:
    """Errors against what was made smaller, and the line whose slope is the order of convergence."""
    if bench.orders.empty:
        return None
    rows = bench.orders.rename(columns={"against": "scene"})
    figure, panels = _panels(rows)
    for axes, (against, mine) in zip(panels, rows.groupby("scene", sort=False), strict=False):
        title, _, size = str(against).partition(": ")
        order, aim, unit = mine["order"].iloc[0], mine["aim"].iloc[0], mine["unit"].iloc[0]
        sizes, errors = mine["size"].to_numpy(float), mine["error"].to_numpy(float)
        level = np.exp(np.mean(np.log(errors) - order * np.log(sizes)))
        axes.plot(sizes, errors, "o", color=BLUE, markersize=5, label="measured")
        axes.plot(sizes, level * sizes**order, ":", color="0.4", linewidth=1.0, label="fitted order")
        axes.set_title(f"{title}\norder {order:.3f} (aim: {aim})", loc="left", fontsize=9)
        axes.set_xlabel(size)
        axes.set_ylabel("error, mm" if unit == "mm" else "relative error")
        _log_axes(axes)
    _method_legend(figure, panels)
    return Drawing(figure, bench.orders)


def stress_outcomes(bench: BenchFiles) -> Drawing | None:
    """Fraction of scenes by outcome, for each kind of stress."""
    if bench.stress.empty:
        return None
    counts = bench.stress.pivot_table(
        index="axis", columns="outcome", values="count", aggfunc="sum", fill_value=0, sort=False
    )
    fractions = counts.div(counts.sum(axis=1), axis=0)
    figure = new_figure(1.5 + 0.34 * len(counts))
    axes = figure.subplots()
    left = np.zeros(len(counts))
    for i, outcome in enumerate(counts.columns):
        width = fractions[outcome].to_numpy()
        colour = _STYLES[i % len(_STYLES)][0]
        hatch = "//" if i >= len(_STYLES) else ""
        axes.barh(list(counts.index), width, left=left, color=colour, hatch=hatch, label=str(outcome))
        left = left + width
    axes.invert_yaxis()
    axes.set_xlim(0.0, 1.0)
    axes.set_xlabel("fraction of scenes")
    figure.legend(loc="outside upper left", ncols=3, frameon=False, fontsize=8)
    plain(axes)
    return Drawing(figure, counts.reset_index())


def _plottable(rows: pd.DataFrame, *columns: str) -> pd.DataFrame:
    if not all(has(rows, c) for c in columns):
        return rows.iloc[:0]
    keep = np.logical_and.reduce([rows[c].notna() & (rows[c] > 0) for c in columns])
    return rows[keep]


def _panels(rows: pd.DataFrame) -> tuple[Figure, list[Axes]]:
    count = rows["scene"].nunique()
    wide = min(count, _MAX_COLUMNS)
    tall = -(-count // wide)
    figure = new_figure(3.4 * tall + 0.6, 9.0 if wide > 1 else 6.5)
    panels = list(figure.subplots(tall, wide, squeeze=False).ravel())
    for axes in panels[count:]:
        axes.remove()
    return figure, panels[:count]


def _styles(rows: pd.DataFrame) -> dict[str, tuple[str, str]]:
    """One colour and marker per method, the same in every panel and figure."""
    methods = dict.fromkeys(rows["method"])
    return {str(method): _STYLES[i % len(_STYLES)] for i, method in enumerate(methods)}


def _name_segments(axes: Axes, front: pd.DataFrame) -> None:
    """Segment lengths in mm along the front, each once and none upon another."""
    if not has(front, "segment_mm"):
        return
    last, at = None, (0.0, 0.0)
    for x, y, segment in zip(front["shape_error_mm"], front["ms_per_mm"], front["segment_mm"], strict=True):
        apart = max(np.log10(x / at[0]), abs(np.log10(y / at[1]))) if last is not None else 1.0
        if segment != last and apart > 0.1:
            axes.annotate(f"{segment:g}", (x, y), xytext=(3, 4), textcoords="offset points", fontsize=7)
            last, at = segment, (x, y)


def _slope(axes: Axes, rows: pd.DataFrame) -> None:
    ends = np.array([rows["segment_mm"].min(), rows["segment_mm"].max()])
    anchor = float(rows.loc[rows["segment_mm"] == ends[1], "shape_error_mm"].min())
    axes.plot(ends, anchor * (ends / ends[1]) ** 2, ":", color="0.5", linewidth=1.0, label="second order")


def _log_axes(axes: Axes) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        # beyond two and a half decades three labels a decade run into each other
        subs = (1.0, 2.0, 5.0) if high < 300 * low else (1.0,)
        axis.set_major_locator(LogLocator(subs=subs))
        axis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
        axis.set_minor_formatter(NullFormatter())
        axis.set_tick_params(labelsize=8)
    plain(axes)


def _method_legend(figure: Figure, panels: list[Axes]) -> None:
    entries = {
        label: handle
        for axes in panels
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(
        list(entries.values()), list(entries), loc="outside upper left", ncols=5, frameon=False, fontsize=8
    )
