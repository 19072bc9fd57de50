"""Several simulators side by side: error along the wire and over depth, and who is nearest where."""

from dataclasses import dataclass
from itertools import cycle

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb

from reports.colours import SIMULATED
from reports.figures._drawing import Drawing, legend, new_figure, plain, positive_axis
from reports.figures._style import PALETTE
from reports.schema import OURS
from reports.verdict import NEVER_NEAREST

_FAINT = 0.3  # of a lead that is not clear
_SHADES = ((0.0, 1.0), (0.0, 0.5), (0.5, 0.5))  # white that is added, share of the colour that is kept


@dataclass(frozen=True, eq=False)
class SimulatorFiles:
    """Tables of a comparison: simulators.csv and where.csv."""

    simulators: pd.DataFrame
    where: pd.DataFrame


def leads(where: pd.DataFrame) -> pd.DataFrame:
    """Of where.csv the rows of who is nearest."""
    return where[where["lead"].notna() & ~where["lead"].isin(NEVER_NEAREST)]


def colours(names: "pd.Series[str]") -> dict[str, str]:
    """The solver's own in its colour, every other simulator in one of its own; beyond fifteen they repeat."""
    shades = (white + kept * np.array(to_rgb(colour)) for white, kept in _SHADES for colour in PALETTE[1:])
    spare = cycle(to_hex(tuple(shade.tolist())) for shade in shades)
    return {name: SIMULATED if name == OURS else next(spare) for name in dict.fromkeys(names)}


def who_is_nearest(files: SimulatorFiles) -> Drawing | None:
    """Error in bins of the distance from the earliest tip and of the depth; below, the colour of the nearest."""
    where = files.where
    if where.empty:
        return None
    figure = new_figure(4.4, 10.0)
    panels = figure.subplots(2, 2, sharex="col", sharey="row", height_ratios=(14, 1))
    shown = colours(where["simulator"])
    for (axes, strip), (along, rows) in zip(panels.T, where.groupby("along", sort=False), strict=False):
        for number, (name, mine) in enumerate(rows.groupby("simulator", sort=False)):
            middle, rms = unbroken(mine)
            # where lines lie on each other the wider ones below are seen beside those above, and in their gaps
            below = 1.0 - number / max(len(shown) - 1, 1)
            look = {"markersize": 3.5 + 4.0 * below, "linewidth": 1.3 + 2.2 * below}
            style = "osD^v"[number % 5] + ("-", "--", "-.", ":")[number % 4]
            axes.plot(middle, rms, style, color=shown[str(name)], label=str(name), **look)
        plain(axes)
        _nearest(strip, rows, shown)
        strip.set_xlabel(f"{along}, mm")
    positive_axis(panels[0, 0], [where["rms_mm"]])
    panels[0, 0].invert_xaxis()
    panels[0, 0].set_ylabel("rms distance to the traced wire, mm")
    panels[1, 0].set_ylabel("nearest", rotation=0, ha="right", va="center", fontsize=8)
    # at the left and two abreast: what a phone shows of the figure before it is panned
    legend(figure, *panels[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
    return Drawing(figure, where)


def unbroken(rows: pd.DataFrame) -> tuple[list[float], list[float]]:
    """Where errors are and these, with a NaN between two bins that do not touch: no line crosses an empty one."""
    low, high, middle, error = (rows[name].to_numpy(float) for name in ("low_mm", "high_mm", "middle_mm", "rms_mm"))
    middle = np.where(np.isnan(middle), 0.5 * (low + high), middle)  # of earlier results
    after = np.flatnonzero(low[1:] > high[:-1]) + 1
    middles = np.insert(middle, after, 0.5 * (high[after - 1] + low[after]))
    return middles.tolist(), np.insert(error, after, np.nan).tolist()


def _nearest(axes: Axes, rows: pd.DataFrame, shown: dict[str, str]) -> None:
    """A strip with the colour of the nearest in each bin; white where several are as near, words where none may be."""
    found = leads(rows)
    if found.empty:
        axes.text(0.5, 0.5, "fewer than two may be the nearest", transform=axes.transAxes, ha="center", va="center")
    for row in found.query("lead != 'tie'").to_dict("records"):
        alpha = 1.0 if row["lead"] == "clear" else _FAINT
        span = row["low_mm"], row["high_mm"]
        axes.axvspan(*span, color=shown[row["simulator"]], alpha=alpha, linewidth=0)
    axes.set_yticks([])
