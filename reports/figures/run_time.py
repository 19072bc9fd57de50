"""Seconds by stage, for every frame and in all."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from reports.case_files import CaseFiles
from reports.figures._drawing import Drawing, legend, new_figure, plain, whole_numbers
from reports.figures._style import STAGE_COLOURS
from reports.tables import has


def run_time(case: CaseFiles) -> Drawing | None:
    """Stacked seconds per frame, and the totals of the case."""
    seconds = {stage: f"{stage}_s" for stage in STAGE_COLOURS}
    names = {stage: name for stage, name in seconds.items() if has(case.timings, name) and case.timings[name].any()}
    if not names:
        return None
    whole = case.timings["frame"].isna()
    frames, totals = case.timings[~whole], case.timings[whole]
    known = {stage: float(totals[name].sum()) for stage, name in names.items() if totals[name].sum() > 0}
    figure = new_figure(3.6)
    panels = figure.subplots(1, 1 + bool(len(frames)), squeeze=False, width_ratios=(2.0, 1.0)[-1 - bool(len(frames)) :])
    if len(frames):
        _stacked(panels[0, 0], frames, [stage for stage, name in names.items() if has(frames, name)])
    _totals(panels[0, -1], known)
    return Drawing(figure, case.timings[["case", "frame", *names.values()]])


def _stacked(axes: Axes, frames: pd.DataFrame, stages: list[str]) -> None:
    base = np.zeros(len(frames))
    for stage in stages:
        seconds = frames[f"{stage}_s"].fillna(0.0).to_numpy()
        axes.bar(frames["frame"], seconds, bottom=base, color=STAGE_COLOURS[stage], label=stage, width=0.85)
        base = base + seconds
    axes.set_xlabel("frame")
    axes.set_ylabel("seconds")
    whole_numbers(axes.xaxis)
    legend(axes, ncols=3)
    axes.set_ylim(top=1.25 * max(float(base.max()), 1e-9))
    plain(axes)


def _totals(axes: Axes, seconds: dict[str, float]) -> None:
    values = list(seconds.values())
    bars = axes.barh(list(seconds), values, color=[STAGE_COLOURS[name] for name in seconds])
    axes.bar_label(bars, labels=[f"{v:.3g} s" for v in values], padding=3, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlim(right=1.3 * max([*values, 1e-9]))
    axes.set_xlabel("seconds, whole case")
    plain(axes)
