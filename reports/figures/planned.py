"""How many of the planned frames are how good: a curve that failed frames cannot flatter."""

import numpy as np
import pandas as pd

from reports.colours import SIMULATED
from reports.figures._drawing import Drawing, new_figure, plain
from reports.figures._style import GREY
from reports.figures.run import RunFiles
from reports.schema import ALL

_CLEAR_CURVES = 15
_MOST_MM = 100.0  # beyond it a frame may as well have failed


def planned_within(run: RunFiles) -> Drawing | None:
    """Share of all planned frames whose 95th percentile is at most so large; validation cases alone."""
    planned = _planned(run)
    found = {case: _reached(run.errors[case]) if case in run.errors else np.zeros(0) for case in planned}
    everything = np.sort(np.concatenate([np.zeros(0), *found.values()]))
    if not len(everything):
        return None
    figure = new_figure(3.4)
    axes = figure.subplots()
    curves = {}
    if len(planned) > 1:
        pale = min(1.0, _CLEAR_CURVES / len(planned))  # hundreds become a cloud, dense where most cases are
        for case, values in found.items():
            curves[case] = _curve(values, planned[case], everything[-1])
            axes.step(*curves[case], where="post", color=GREY, linewidth=0.8, alpha=pale)
    across, share = _curve(everything, max(run.planned, sum(planned.values())), everything[-1])
    axes.step(across, share, where="post", color=SIMULATED, linewidth=2.0)
    axes.set_ylim(0.0, 1.02)
    axes.set_xlim(left=0.0)
    axes.set_xlabel("95th percentile of the distance, simulated to traced wire, mm")
    axes.set_ylabel("share of all planned frames")
    plain(axes)
    curves = {ALL if curves else next(iter(planned)): (across, share)} | curves  # a single case is all there is
    parts = [pd.DataFrame({"case": case, "p95_mm": x, "share_of_planned": y}) for case, (x, y) in curves.items()]
    return Drawing(figure, pd.concat(parts))


def _planned(run: RunFiles) -> dict[str, int]:
    """Frames that were planned in each validation case with scans; a case that crashed had some, too."""
    table = run.summary[~run.summary["role"].isin(["calibration"]) & ~run.summary["status"].isin(["simulated"])]
    return {str(case): int(count) for case, count in zip(table["case"], table["frames"].fillna(0), strict=True)}


def _reached(errors: pd.DataFrame) -> np.ndarray:
    """95th percentiles of a case's frames that are ok, ascending."""
    values = errors.loc[errors["status"] == "ok", "p95_mm"].dropna().to_numpy(dtype=float)
    return np.sort(values[values <= _MOST_MM])


def _curve(values: np.ndarray, planned: int, last: float) -> tuple[np.ndarray, np.ndarray]:
    """Steps at the values (n,), from 0 to ``last``: where they are, and how high."""
    return np.concatenate([[0.0], values, [last]]), np.append(np.arange(len(values) + 1), len(values)) / max(planned, 1)
