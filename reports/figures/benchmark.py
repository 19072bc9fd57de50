"""Run time against error, convergence with the segment length, and the outcomes of a stress study."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.colours import SIMULATED
from reports.figures._drawing import Drawing, lattice, legend, new_figure, plain, plain_decades
from reports.figures._style import GREY, PALETTE, Look
from reports.tables import has

_STYLES = tuple(zip((*PALETTE, "black", GREY), "osD^vPX*", strict=True))


@dataclass(frozen=True, eq=False)
class BenchFiles:
    """rows: one row per scene, method and setting, with ``on_front``; stress: one row per axis and outcome.

    claims: one row per promise, measured; orders: one row per point that an order of convergence was fitted to.
    """

    rows: pd.DataFrame
    stress: pd.DataFrame
    claims: pd.DataFrame
    orders: pd.DataFrame

    def outcomes(self) -> pd.DataFrame:
        """Numbers of stress scenes: one row per axis, one column per outcome."""
        return self.stress.pivot_table(
            index="axis", columns="outcome", values="count", aggfunc="sum", fill_value=0, sort=False
        )


def pareto(bench: BenchFiles) -> Drawing | None:
    """Shape error against milliseconds per mm inserted; the line is what nothing beats in both."""
    rows = _plottable(bench.rows, "shape_error_mm", "ms_per_mm")
    if rows.empty:
        return None

    def draw(axes: Axes, mine: pd.DataFrame) -> None:
        _methods(axes, mine, bench, "shape_error_mm", "ms_per_mm", linestyle="")
        front = mine[mine["on_front"]].sort_values("shape_error_mm")
        steps: Look = {"color": "black", "linewidth": 1.0, "drawstyle": "steps-post"}
        axes.plot(front["shape_error_mm"], front["ms_per_mm"], **steps)
        _name_segments(axes, front)

    figure = _panels(rows, draw, "shape error, mm", "ms per mm inserted")
    shown = ["scene", "method", "segment_mm", "hull", "tolerance", "shape_error_mm", "ms_per_mm", "on_front"]
    return Drawing(figure, rows[[c for c in shown if c in rows]])


def convergence(bench: BenchFiles) -> Drawing | None:
    """Shape error against segment length, the best over the other settings, with a second-order slope."""
    rows = _plottable(bench.rows, "segment_mm", "shape_error_mm")
    if rows.empty or rows["segment_mm"].nunique() < 2:
        return None
    best = rows.groupby(["scene", "method", "segment_mm"], sort=False)["shape_error_mm"].min().reset_index()

    def draw(axes: Axes, mine: pd.DataFrame) -> None:
        _methods(axes, mine.sort_values("segment_mm"), bench, "segment_mm", "shape_error_mm", linestyle="-")
        ends = np.array([mine["segment_mm"].min(), mine["segment_mm"].max()])
        anchor = float(mine.loc[mine["segment_mm"] == ends[1], "shape_error_mm"].min())
        axes.plot(ends, anchor * (ends / ends[1]) ** 2, ":", color="0.5", linewidth=1.0, label="second order")

    return Drawing(_panels(best, draw, "segment length, mm", "shape error, mm"), best)


def orders(bench: BenchFiles) -> Drawing | None:
    """Errors against what was made smaller, and the line whose slope is the order of convergence."""
    if bench.orders.empty:
        return None

    def draw(axes: Axes, mine: pd.DataFrame) -> None:
        title, _, size = str(mine["scene"].iloc[0]).partition(": ")
        order, aim, unit = mine["order"].iloc[0], mine["aim"].iloc[0], mine["unit"].iloc[0]
        sizes, errors = mine["size"].to_numpy(float), mine["error"].to_numpy(float)
        level = np.exp(np.mean(np.log(errors) - order * np.log(sizes)))
        axes.plot(sizes, errors, "o", color=SIMULATED, markersize=5, label="measured")
        axes.plot(sizes, level * sizes**order, ":", color="0.4", linewidth=1.0, label="fitted order")
        axes.set_title(f"{title}\norder {order:.3f} (aim: {aim})", loc="left", fontsize=9)
        axes.set_xlabel(size)
        axes.set_ylabel("error, mm" if unit == "mm" else "relative error")

    return Drawing(_panels(bench.orders.rename(columns={"against": "scene"}), draw), bench.orders)


def stress_outcomes(bench: BenchFiles) -> Drawing | None:
    """Fraction of scenes by outcome, for each kind of stress."""
    if bench.stress.empty:
        return None
    counts = bench.outcomes()
    fractions = counts.div(counts.sum(axis=1), axis=0)
    figure = new_figure(1.5 + 0.34 * len(counts))
    axes = figure.subplots()
    left = np.zeros(len(counts))
    for i, outcome in enumerate(counts.columns):
        width = fractions[outcome].to_numpy()
        look: Look = {"color": _STYLES[i % len(_STYLES)][0], "hatch": "//" if i >= len(_STYLES) else ""}
        axes.barh(list(counts.index), width, left=left, label=str(outcome), **look)
        left = left + width
    axes.invert_yaxis()
    axes.set_xlim(0.0, 1.0)
    axes.set_xlabel("fraction of scenes")
    legend(figure, loc="outside upper left", ncols=3)
    plain(axes)
    return Drawing(figure, counts.reset_index())


def _plottable(rows: pd.DataFrame, *columns: str) -> pd.DataFrame:
    """Rows in which all of the columns are above zero, as logarithmic axes want them."""
    return rows[np.logical_and.reduce([rows[c].notna() & (rows[c] > 0) for c in columns])]


def _panels(
    rows: pd.DataFrame, draw: Callable[[Axes, pd.DataFrame], None], xlabel: str = "", ylabel: str = ""
) -> Figure:
    """One panel per scene, which ``draw`` fills with the scene's rows: logarithmic axes, one legend above."""
    count = rows["scene"].nunique()
    figure, panels = lattice(count, 3, row_inch=3.4, more_inch=0.6, width_inch=9.0 if count > 1 else 6.5)
    entries: dict[Any, Any] = {}
    for axes, (scene, mine) in zip(panels, rows.groupby("scene", sort=False), strict=True):
        axes.set_title(str(scene), loc="left", fontsize=9)
        axes.set_xlabel(xlabel)
        axes.set_ylabel(ylabel)
        draw(axes, mine)
        _log_axes(axes)
        entries |= dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))
    legend(figure, list(entries.values()), list(entries), loc="outside upper left", ncols=5)
    return figure


def _methods(axes: Axes, rows: pd.DataFrame, bench: BenchFiles, x: str, y: str, linestyle: str) -> None:
    """One column against another; a method has the same colour and marker in every panel and figure."""
    places = {method: i for i, method in enumerate(dict.fromkeys(bench.rows["method"]))}
    for method, group in rows.groupby("method", sort=False):
        colour, marker = _STYLES[places[str(method)] % len(_STYLES)]
        look: Look = {"color": colour, "marker": marker, "markersize": 4, "linestyle": linestyle}
        axes.plot(group[x], group[y], label=str(method), **look)


def _name_segments(axes: Axes, front: pd.DataFrame) -> None:
    """Segment lengths in mm along the front, each once and none upon another."""
    if not has(front, "segment_mm"):
        return
    last, at = None, (0.0, 0.0)
    for x, y, segment in zip(front["shape_error_mm"], front["ms_per_mm"], front["segment_mm"], strict=True):
        apart = max(np.log10(x / at[0]), abs(np.log10(y / at[1]))) if last is not None else 1.0
        if segment != last and apart > 0.1:
            axes.annotate(f"{segment:g}", (x, y), xytext=(3, 4), textcoords="offset points", fontsize=8)
            last, at = segment, (x, y)


def _log_axes(axes: Axes) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        # beyond two and a half decades three labels a decade run into each other
        plain_decades(axis, (1.0, 2.0, 5.0) if high < 300 * low else (1.0,))
        axis.set_tick_params(labelsize=8)
    plain(axes)
