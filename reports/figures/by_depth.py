"""What changes while the wire goes in: errors, tip, skill, forces, and with truth the trace, against depth."""

from __future__ import annotations

from typing import Any

import pandas as pd
from matplotlib.axes import Axes

from reports.case_files import CaseFiles
from reports.figures._style import (
    GREY,
    NULLS,
    SIMULATED,
    TRACED,
    TRUTH,
    VERMILION,
    Drawing,
    has,
    new_figure,
    plain,
    positive_axis,
)

_DEPTH = "insertion depth, mm"
_NULL_COLUMNS = [column for column, *_ in NULLS]


def error_by_depth(case: CaseFiles) -> Drawing | None:
    """Pooled and 95th percentile error per frame, the trivial predictors above, the trace's sigma below."""
    good = _by_depth(case.good)
    if not has(good, "rms_mm"):
        return None
    figure = new_figure(4.2)
    axes = figure.subplots()
    for column, label, colour, style, _ in NULLS:
        _line(axes, good, column, f"predictor: {label}", color=colour, linestyle=style, linewidth=1.2)
    _line(axes, good, "p95_mm", "95th percentile", color=SIMULATED, linewidth=0.9, marker="^", markersize=3)
    _line(axes, good, "rms_mm", "simulated to traced, rms", color=SIMULATED, marker="o", markersize=4)
    _line(axes, good, "trace_sigma_mm", "floor: sigma of the trace", color=TRACED, linewidth=1.0)
    shown = ["rms_mm", "p95_mm", "trace_sigma_mm", *_NULL_COLUMNS]
    positive_axis(axes, [good[column] for column in shown])
    _floor(axes, good)
    _mark_failed(axes, case)
    _finish(axes, "distance, mm")
    table = case.errors[["frame", "status", "insertion_mm", *shown]]
    return Drawing(figure, table)


def tip_by_depth(case: CaseFiles) -> Drawing | None:
    """Distance of the tips and angle between their tangents."""
    good = _by_depth(case.good)
    if not has(good, "tip_mm"):
        return None
    figure = new_figure(4.6)
    top, bottom = figure.subplots(2, 1, sharex=True)
    _line(top, good, "tip_mm", "distance of the tips", color=SIMULATED, marker="o", markersize=4)
    wrong = good[good["branch_ok"].eq(other=False).fillna(value=False).astype(bool)]
    if len(wrong):
        top.plot(
            wrong["insertion_mm"], wrong["tip_mm"], "X", color=VERMILION, label="tips in different branches"
        )
    positive_axis(top, [good["tip_mm"]])
    _mark_failed(top, case)
    _finish(top, "tip distance, mm", depth=False)
    _line(bottom, good, "tip_angle_deg", "", color=SIMULATED, marker="o", markersize=4)
    bottom.set_ylim(bottom=0.0)
    _finish(bottom, "tip angle, degrees")
    return Drawing(
        figure, case.errors[["frame", "status", "insertion_mm", "tip_mm", "tip_angle_deg", "branch_ok"]]
    )


def truth_by_depth(case: CaseFiles) -> Drawing | None:
    """With truth: how far the trace is from the true wire, and the simulated wire from both."""
    good = _by_depth(case.good)
    columns = ["trace_mean_mm", "trace_max_mm", "trace_tip_mm", "truth_rms_mm", "truth_tip_mm"]
    if not has(good, *columns):
        return None
    figure = new_figure(5.4)
    top, bottom = figure.subplots(2, 1, sharex=True)
    _line(top, good, "trace_mean_mm", "mean", color=TRACED, marker="o", markersize=4)
    _line(top, good, "trace_max_mm", "largest", color=TRACED, linestyle=":", marker="^", markersize=4)
    _line(top, good, "trace_tip_mm", "tip", color=VERMILION, linestyle="--", marker="s", markersize=4)
    positive_axis(top, [good[c] for c in columns[:3]])
    _finish(top, "traced to true wire, mm", depth=False)
    _line(bottom, good, "truth_rms_mm", "to the true wire, rms", color=TRUTH, linewidth=3.5, alpha=0.6)
    _line(bottom, good, "rms_mm", "to the traced wire, rms", color=SIMULATED, marker="o", markersize=4)
    _line(bottom, good, "truth_tip_mm", "to the true tip", color=TRUTH, linestyle="--", linewidth=1.0)
    positive_axis(bottom, [good[c] for c in ("truth_rms_mm", "rms_mm", "truth_tip_mm")])
    _finish(bottom, "simulated wire, mm")
    return Drawing(figure, case.errors[["frame", "status", "insertion_mm", "rms_mm", *columns]])


def skill_by_depth(case: CaseFiles) -> Drawing | None:
    """Skill per frame, and the pooled error with its interval beside those of the trivial predictors."""
    good = _by_depth(case.good)
    if not has(good, "skill"):
        return None
    figure = new_figure(3.6)
    left, right = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
    left.axhline(0.0, color=VERMILION, linewidth=1.0, linestyle="--", label="no better than the centreline")
    _line(left, good, "skill", "", color=SIMULATED, marker="o", markersize=4)
    left.set_ylim(min(-0.1, float(good["skill"].clip(lower=-1.0).min()) - 0.05), 1.02)
    _finish(left, "skill (1 is perfect)")
    table = _predictors(case.result.get("statistics", {}))
    _dots(right, table)
    return Drawing(figure, pd.concat([good[["frame", "insertion_mm", "skill"]], table]))


def forces_by_depth(case: CaseFiles) -> Drawing | None:
    """Push force at the introducer and the deepest overlap with the soft wall."""
    good = _by_depth(case.good)
    if not has(good, "push_force_N", "max_penetration_mm"):
        return None
    figure = new_figure(4.6)
    top, bottom = figure.subplots(2, 1, sharex=True)
    _line(top, good, "push_force_N", "", color=SIMULATED, marker="o", markersize=4)
    top.axhline(0.0, color="0.6", linewidth=0.8)
    _finish(top, "push force, N", depth=False)
    _line(bottom, good, "max_penetration_mm", "", color=VERMILION, marker="s", markersize=4)
    bottom.set_ylim(bottom=0.0)
    _finish(bottom, "deepest overlap\nwith the wall, mm")
    return Drawing(
        figure, case.errors[["frame", "status", "insertion_mm", "push_force_N", "max_penetration_mm"]]
    )


def _by_depth(table: pd.DataFrame) -> pd.DataFrame:
    # a withdrawn wire visits a depth twice: the order of the frames is kept and the line goes back
    return table[table["insertion_mm"].notna()]


def _line(axes: Axes, table: pd.DataFrame, column: str, label: str, **style: Any) -> None:
    if has(table, column):
        axes.plot(table["insertion_mm"], table[column], label=label or None, **style)


def _floor(axes: Axes, good: pd.DataFrame) -> None:
    if has(good, "trace_sigma_mm"):
        bottom = axes.get_ylim()[0]
        axes.fill_between(
            good["insertion_mm"], bottom, good["trace_sigma_mm"], color=TRACED, alpha=0.15, linewidth=0
        )


def _mark_failed(axes: Axes, case: CaseFiles) -> None:
    failed = _by_depth(case.errors.drop(case.good.index))
    if len(failed):
        height = [0.02] * len(failed)
        axes.plot(
            failed["insertion_mm"],
            height,
            "x",
            color=VERMILION,
            transform=axes.get_xaxis_transform(),
            label="frame without result",
        )


def _finish(axes: Axes, ylabel: str, depth: bool = True) -> None:
    plain(axes)
    axes.set_ylabel(ylabel)
    if depth:
        axes.set_xlabel(_DEPTH)
    if axes.get_legend_handles_labels()[0]:
        # above the panel: inside, some case always has its curve behind the legend
        axes.legend(
            frameon=False, fontsize=8, ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1
        )


def _predictors(statistics: Any) -> pd.DataFrame:
    rows = [
        ("simulated", statistics.get("rms_mm"), statistics.get("rms_low_mm"), statistics.get("rms_high_mm"))
    ]
    rows += [(label, statistics.get(column), None, None) for column, label, *_ in NULLS]
    table = pd.DataFrame(rows, columns=["predictor", "rms_mm", "rms_low_mm", "rms_high_mm"])
    numbers = table.columns[1:]
    table[numbers] = table[numbers].apply(pd.to_numeric)
    return table[table["rms_mm"].notna()].reset_index(drop=True)


def _dots(axes: Axes, table: pd.DataFrame) -> None:
    places = range(len(table))
    colours = [SIMULATED if name == "simulated" else GREY for name in table["predictor"]]
    for column in ("rms_low_mm", "rms_high_mm"):
        axes.plot(table[column], places, "|", color=SIMULATED, markersize=11, markeredgewidth=1.5)
    axes.hlines(places, table["rms_low_mm"], table["rms_high_mm"], color=SIMULATED, linewidth=1.5)
    axes.scatter(table["rms_mm"], places, c=colours, zorder=3)
    axes.set_yticks(places, list(table["predictor"]))
    axes.invert_yaxis()
    axes.set_xlim(left=0.0)
    axes.set_xlabel("pooled rms distance, mm")
    plain(axes)
