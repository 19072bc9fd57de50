"""Several simulators side by side: error along the wire and over depth, and who is nearest where."""

from dataclasses import dataclass
from itertools import cycle

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from reports.figures._drawing import Drawing, legend, new_figure, plain, positive_axis
from reports.figures._style import GREEN, ORANGE, PALETTE, PURPLE, SIMULATED, VERMILION, Look

OURS = "wireval"
_STRIP = (-0.34, 0.06)  # of the nearest, below the axis: where it begins and how high it is, in shares of the panel
_FAINT = 0.3  # of a lead that is not clear


@dataclass(frozen=True, eq=False)
class SimulatorFiles:
    """Tables of a comparison: simulators.csv and where.csv."""

    simulators: pd.DataFrame
    where: pd.DataFrame


def colours(names: "pd.Series[str]") -> dict[str, str]:
    """The solver's own in its colour, every other simulator in one of its own."""
    spare = cycle((ORANGE, GREEN, PURPLE, VERMILION, *PALETTE[5:]))
    return {name: SIMULATED if name == OURS else next(spare) for name in dict.fromkeys(names)}


def who_is_nearest(files: SimulatorFiles) -> Drawing | None:
    """Error in bins of the distance from the tip and of the depth; a strip below with the colour of the nearest."""
    where = files.where
    if where.empty:
        return None
    figure = new_figure(4.4, 10.0)
    panels = figure.subplots(1, 2, sharey=True)
    shown = colours(where["simulator"])
    for axes, (along, rows) in zip(panels, where.groupby("along", sort=False), strict=False):
        _panel(axes, rows, shown)
        axes.set_xlabel(f"{along}, mm")
        positive_axis(axes, [where["rms_mm"]])
    panels[0].invert_xaxis()
    panels[0].set_ylabel("rms distance to the traced wire, mm")
    legend(figure, *panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=6)
    return Drawing(figure, where)


def _panel(axes: Axes, rows: pd.DataFrame, shown: dict[str, str]) -> None:
    for name, mine in rows.groupby("simulator", sort=False):
        middle = 0.5 * (mine["low_mm"] + mine["high_mm"])
        axes.plot(middle, mine["rms_mm"], "o-", color=shown[str(name)], label=str(name), markersize=4)
    for row in rows[rows["lead"].notna()].to_dict("records"):
        if row["lead"] == "tie":
            continue
        alpha = 1.0 if row["lead"] == "clear" else _FAINT
        look: Look = {"color": shown[row["simulator"]], "alpha": alpha, "transform": axes.get_xaxis_transform()}
        width = row["high_mm"] - row["low_mm"]
        strip = Rectangle((row["low_mm"], _STRIP[0]), width, _STRIP[1], clip_on=False, **look)
        axes.add_patch(strip)
    axes.text(0.0, _STRIP[0] - 0.03, "nearest (pale: not clear)", transform=axes.transAxes, fontsize=8, va="top")
    plain(axes)
