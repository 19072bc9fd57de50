"""What changes while the wire goes in: errors, tip, skill, forces, and with truth the trace, against depth."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullLocator

from reports.case_files import CaseFiles
from reports.colours import BAD, SIMULATED, TRACED
from reports.figures._drawing import Drawing, FrameAxis, from_zero, legend, new_figure, plain, positive_axis
from reports.figures._style import GREY, SLATE, Look, lines, predictors
from reports.schema import ERRORS
from reports.tables import has

_Panel = tuple[Axes, list[str]]  # with the columns that it shows


def error_by_depth(case: CaseFiles) -> Drawing | None:
    """Pooled and 95th percentile error per frame, the trivial predictors above, the trace's sigma below."""
    good = _by_depth(case.good)
    if not has(good, "rms_mm"):
        return None
    figure = new_figure(4.2)
    axes, rivals = figure.subplots(), _with_strongest(case, good)
    for column, label, colour, style, marker in rivals:
        dots = {"marker": marker if len(good) == 1 else "", "linestyle": style, "linewidth": 1.2}
        _line(axes, good, column, f"predictor: {label}", color=colour, **dots)
    shown = [*_lines(axes, good, "error_by_depth"), *(column for column, *_ in rivals)]
    positive_axis(axes, [good[column] for column in shown])
    if has(good, "trace_sigma_mm"):
        floor = good["insertion_mm"], axes.get_ylim()[0], good["trace_sigma_mm"]
        axes.fill_between(*floor, color=TRACED, alpha=0.15, linewidth=0)
    _mark_failed(axes, case)
    _finish({axes: "distance, mm"})
    table = _table(case, shown)
    if len(rivals) > len(list(predictors())):  # the caption speaks of it where there is one
        table = table.assign(strongest_null=case.statistics["strongest_null"])
    return Drawing(figure, table, frames=_depths(case, axes))


def _with_strongest(case: CaseFiles, good: pd.DataFrame) -> list[tuple[str, str, str, Any, str]]:
    """The predictors of every case, and the strongest of this one, which its verdict names, where it is none of them.

    The strongest is called so.
    """
    strongest = f"null_{case.statistics.get('strongest_null')}_rms_mm"
    every = [(column, label + " (strongest)" * (column == strongest), *look) for column, label, *look in predictors()]
    if strongest in ERRORS.names and has(good, strongest) and strongest not in (column for column, *_ in every):
        label = ERRORS[strongest].shown.get("rivals") or str(case.statistics["strongest_null"]).replace("_", " ")
        every.append((strongest, f"{label} (strongest)", SLATE, "-", "*"))
    return every


OTHER_BRANCH = "tips in different branches"


def tip_by_depth(case: CaseFiles) -> Drawing | None:
    """Distance of the tips and angle between their tangents."""
    good = _by_depth(case.good)
    if not has(good, "tip_mm"):
        return None
    figure, (top, tips), (bottom, angles) = _two_panels(good, 4.6, "tip_by_depth", "tip_angle_by_depth")
    wrong = good[good["branch_ok"].eq(other=False).fillna(value=False).astype(bool)]
    if len(wrong):
        _line(top, wrong, "tip_mm", OTHER_BRANCH, marker="X", linestyle="", color=BAD)
    positive_axis(top, [good[column] for column in tips])
    from_zero(bottom)
    _mark_failed(top, case)
    _finish({top: "tip distance, mm", bottom: "tip angle, degrees"})
    table = _table(case, [*tips, *angles, "branch_ok"])
    table.loc[wrong.index, "note"] = OTHER_BRANCH  # the caption speaks of the cross where there is one
    return Drawing(figure, table, frames=_depths(case, top, bottom))


def truth_by_depth(case: CaseFiles) -> Drawing | None:
    """With truth: how far the trace is from the true wire, and the simulated wire from both."""
    good = _by_depth(case.good)
    if not has(good, "trace_mean_mm", "trace_max_mm", "trace_tip_mm", "truth_rms_mm", "truth_tip_mm"):
        return None
    figure, (top, traced), (bottom, simulated) = _two_panels(good, 5.4, "trace_by_depth", "truth_by_depth")
    positive_axis(top, [good[column] for column in traced])
    positive_axis(bottom, [good[column] for column in simulated])
    _finish({top: "traced to true wire, mm", bottom: "simulated wire, mm"})
    return Drawing(figure, _table(case, ["rms_mm", *traced, *simulated]), frames=_depths(case, top, bottom))


def skill_by_depth(case: CaseFiles) -> Drawing | None:
    """Skill per frame, and the pooled error with its interval beside those of the trivial predictors."""
    good = _by_depth(case.good)
    if not has(good, "skill"):
        return None
    figure = new_figure(3.6)
    left, right = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
    left.axhline(0.0, color=BAD, linewidth=1.0, linestyle="--", label="no better")
    shown = _lines(left, good, "skill_by_depth")
    _finish({left: _skill_axis(left, float(good[shown].min().min()))})
    table = _pooled(case.statistics)
    _dots(right, table)
    numbers = pd.concat([good[["frame", "insertion_mm", *shown]], table])
    return Drawing(figure, numbers, frames=_depths(case, left))


def _skill_axis(axes: Axes, least: float) -> str:
    """Scale y from the least skill to 1; returns its label. Below -1, where it has no end, it is logarithmic."""
    if least >= -1.0:
        axes.set_ylim(min(-0.1, least - 0.05), 1.02)
        return "skill (1 is perfect)"
    axes.set_yscale("symlog", linthresh=1.0, linscale=2.0)
    axes.set_ylim(1.5 * least, 1.02)
    decades = [-(10.0**n) for n in range(int(np.log10(1.5 * -least)) + 1)]
    axes.set_yticks([*reversed(decades), -0.5, 0.0, 0.5, 1.0])
    axes.yaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
    axes.yaxis.set_minor_locator(NullLocator())
    return "skill (1 is perfect; below -1 logarithmic)"


def forces_by_depth(case: CaseFiles) -> Drawing | None:
    """Push force at the introducer and the deepest overlap with the soft wall."""
    good = _by_depth(case.good)
    if not has(good, "push_force_N", "max_penetration_mm"):
        return None
    figure, (top, forces), (bottom, overlaps) = _two_panels(good, 4.6, "force_by_depth", "overlap_by_depth")
    top.axhline(0.0, color="0.6", linewidth=0.8)
    if has(good, "num_push_N"):
        push, bound = good["push_force_N"], good["num_push_N"]
        top.fill_between(good["insertion_mm"], push - bound, push + bound, color=SIMULATED, alpha=0.15, linewidth=0)
        forces = [*forces, "num_push_N"]
    from_zero(bottom)
    _finish({top: "push force, N", bottom: "deepest overlap\nwith the wall, mm"})
    return Drawing(figure, _table(case, [*forces, *overlaps]), frames=_depths(case, top, bottom))


def _by_depth(table: pd.DataFrame) -> pd.DataFrame:
    # a withdrawn wire visits a depth twice: the order of the frames is kept and the line goes back
    return table[table["insertion_mm"].notna()]


def _depths(case: CaseFiles, *panels: Axes) -> list[FrameAxis]:
    """The depth of every frame, for these panels."""
    known = _by_depth(case.errors)
    depths = {int(n): float(mm) for n, mm in zip(known["frame"], known["insertion_mm"], strict=True)}
    return [FrameAxis(axes, depths) for axes in panels]


def _table(case: CaseFiles, columns: Sequence[str]) -> pd.DataFrame:
    """What a figure shows of every frame, each column once."""
    return case.errors[list(dict.fromkeys(["frame", "status", "insertion_mm", *columns]))]


def _two_panels(good: pd.DataFrame, height_inch: float, *places: str) -> tuple[Figure, _Panel, _Panel]:
    """A figure of two panels, one above the other, with the lines of two places."""
    figure = new_figure(height_inch)
    panels = zip(figure.subplots(2, 1, sharex=True), places, strict=True)
    top, bottom = ((axes, _lines(axes, good, place)) for axes, place in panels)
    return figure, top, bottom


def _lines(axes: Axes, good: pd.DataFrame, place: str) -> list[str]:
    """Draw what the schema shows at a place; returns its columns in the order of the file."""
    for column, label, style in lines(place):
        _line(axes, good, column, label, **({"marker": "_"} if len(good) == 1 else {}) | style)
    return [column.name for column in ERRORS.shown(place)]


def _line(axes: Axes, table: pd.DataFrame, column: str, label: str, **style: Any) -> None:
    if has(table, column):
        axes.plot(table["insertion_mm"], table[column], label=label or None, **style)


def _mark_failed(axes: Axes, case: CaseFiles) -> None:
    failed = _by_depth(case.errors.drop(case.good.index))
    if len(failed):
        look: Look = {"transform": axes.get_xaxis_transform(), "label": "frame without result"}
        axes.plot(failed["insertion_mm"], [0.02] * len(failed), "x", color=BAD, **look)


def _finish(panels: Mapping[Axes, str]) -> None:
    """Label the vertical axis of each panel, and the depth below the last."""
    for axes, label in panels.items():
        plain(axes)
        axes.set_ylabel(label)
        if axes.get_legend_handles_labels()[0]:
            # above the panel: inside, some case always has its curve behind the legend
            legend(axes, ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1)
    axes.set_xlabel("insertion depth, mm")


def _pooled(statistics: Mapping[str, Any]) -> pd.DataFrame:
    """Pooled error of the simulation, with its interval, and of every predictor that has one."""
    numbers = ["rms_mm", "rms_low_mm", "rms_high_mm"]
    rows = [("simulated", *(statistics.get(name) for name in numbers))]
    for column in ERRORS.shown("predictors", "rivals"):
        label = column.shown.get("predictors") or column.shown.get("rivals")
        rows.append((label, statistics.get(column.name), None, None))
    table = pd.DataFrame(rows, columns=["predictor", *numbers])
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
