"""What is not known beside the error: by source, by what was stated, and the frames in which a tip may have let go."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from reports.case_files import CaseFiles
from reports.colours import BAD, SIMULATED, TRACED
from reports.figures._drawing import Drawing, legend, new_figure, plain
from reports.figures._style import GREY, PURPLE, UNCERTAINTY, Look
from reports.schema import BUDGET, ENTRIES
from reports.tables import has, read_if_there

_ROW_INCH, _REST_INCH = 0.24, 1.1
_BARS = ["u_mm", "distal_u_mm"]
MORE_ALONE, NOT_ALONE = "more alone than together", "not computed alone"


def budget(case: CaseFiles) -> Drawing | None:
    """Uncertainty by source, and the error with the clamp and the depth taken from elsewhere.

    Both are of our solver's wire, so that there is none beside another simulator's.
    """
    sources, entries = (read_if_there(case.folder / table.file, table) for table in (BUDGET, ENTRIES))
    computed = sources[sources[_BARS].notna().any(axis="columns")]
    shown = [table for table, rows in ((sources, computed), (entries, entries)) if len(rows)]
    if not shown or case.handed_in:
        return None
    figure = new_figure(max(_REST_INCH + _ROW_INCH * max(len(computed), len(entries)), 2.6))
    panels = iter(figure.subplots(1, len(shown), squeeze=False, width_ratios=[1.5, 1.0][-len(shown) :]).ravel())
    if len(computed):
        _by_source(next(panels), computed)
    if len(entries):
        _by_entry(next(panels), entries)
    # the caption says why where there is one
    note = pd.Series(MORE_ALONE, index=_more_alone(sources), dtype="string")
    unknown = pd.Series(NOT_ALONE, index=sources.index.difference(computed.index), dtype="string")
    return Drawing(figure, pd.concat(shown, ignore_index=True).assign(note=pd.concat([note, unknown])))


def _more_alone(sources: pd.DataFrame) -> "pd.Index[int]":
    """Rows of single inputs, which stand above that of all of them, that have a longer bar than these."""
    every = sources["source"].eq("inputs")
    single, most = sources.loc[~every.cummax(), _BARS], sources.loc[every, _BARS].max()
    return single.index[single.gt(most).any(axis="columns")]


def _by_source(axes: Axes, table: pd.DataFrame) -> None:
    """A bar for each row, and a thin one for the wire's end."""
    places = np.arange(len(table))
    colours = [{"u_val": UNCERTAINTY, "error": SIMULATED}.get(name, GREY) for name in table["source"]]
    axes.barh(places - 0.15, table["u_mm"], 0.45, color=colours, label="whole wire")
    axes.barh(places + 0.25, table["distal_u_mm"], 0.2, color=PURPLE, label="last 10 mm")
    names = [name.replace("_", " ") for name in table["source"]]
    axes.set_yticks(places, ["error" if n == "error" else "all: u val" if n == "u val" else n for n in names])
    axes.set_ylim(len(table) - 0.5, -0.5)
    axes.xaxis.set_major_locator(MaxNLocator(5))  # more of 0.025, 0.050, ... run into each other
    axes.set_xlabel("u across the wire, mm")
    plain(axes)
    legend(axes, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1)


def _by_entry(axes: Axes, table: pd.DataFrame) -> None:
    places = np.arange(len(table))
    axes.plot(table["rms_mm"], places, "o", color=SIMULATED, label="rms")
    around: Look = {"fillstyle": "none", "markersize": 10, "markeredgewidth": 1.6}  # it hid a dot at the same place
    axes.plot(table["distal10_rms_mm"], places, "s", color=PURPLE, label="last 10 mm", **around)
    axes.plot(table["tip_median_mm"], places, "x", color=BAD, label="tip, median")
    rows = zip(table["clamp"], table["depth"], strict=True)
    axes.set_yticks(places, [f"clamp {clamp},\ndepth {depth}" for clamp, depth in rows], fontsize=8)
    axes.set_ylim(len(table) - 0.5, -0.5)
    most = float(np.nanmax(table[["rms_mm", "distal10_rms_mm", "tip_median_mm"]].to_numpy(dtype=float)))
    axes.set_xlim(0.0, 1.1 * most if most > 0.0 else None)  # marks at the right end are whole, however near they are
    axes.set_xlabel("distance to the traced wire, mm")
    plain(axes)
    legend(axes, ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.1, columnspacing=0.8)


def release_frames(case: CaseFiles) -> Drawing | None:
    """Probability of the shapes that the simulated and the traced wire have, in the frames in which there are two."""
    good = case.good
    if not has(good, "release"):
        return None
    two = good[good["release"].notna()]
    figure = new_figure(2.6)
    axes = figure.subplots()
    axes.axhspan(0.2, 0.8, color="0.93", linewidth=0)
    axes.plot(two["insertion_mm"], two["release"], "o", color=SIMULATED, markersize=9, label="shape simulated")
    real: Look = {"color": TRACED, "markersize": 9, "markeredgewidth": 2, "label": "shape of the traced wire"}
    axes.plot(two["insertion_mm"], two["release_real"], "x", **real)
    for frame, depth, p in zip(two["frame"], two["insertion_mm"], two["release"], strict=True):
        axes.annotate(f"{frame}", (depth, p), (7, 0), textcoords="offset points", fontsize=8)
    axes.set_xlim(*_limits(good["insertion_mm"]))
    axes.set_ylim(-0.05, 1.05)  # marks at the ends are whole
    axes.set_xlabel("insertion depth, mm")
    axes.set_ylabel("share of the ensemble")
    plain(axes)
    legend(axes, ncols=2, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.1)
    columns = ["frame", "insertion_mm", "release", "release_real", "log_score_bits", "released", "released_at_mm"]
    return Drawing(figure, two[columns])


def _limits(depths: "pd.Series[float]") -> tuple[float, float]:
    return float(depths.min()) - 2.0, float(depths.max()) + 2.0
