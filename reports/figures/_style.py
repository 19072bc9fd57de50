"""How things look: the colours, and the line of every column and trivial predictor that the schema shows."""

from collections.abc import Iterator
from itertools import cycle
from typing import Any

from reports.schema import ERRORS

Look = dict[str, Any]  # what matplotlib is told of a line, a legend, cells
ORANGE, SKY, GREEN, YELLOW = "#E69F00", "#56B4E9", "#009E73", "#F0E442"
BLUE, VERMILION, PURPLE, GREY = "#0072B2", "#D55E00", "#CC79A7", "#7F7F7F"
SIMULATED, TRACED, TRUTH = BLUE, ORANGE, GREEN
PALETTE = (BLUE, ORANGE, GREEN, PURPLE, VERMILION, SKY)
SEQUENTIAL = "cividis"
STAGE_COLOURS = {
    "load": "#BFBFBF",
    "segment": GREEN,
    "trace": ORANGE,
    "simulate": BLUE,
    "compare": PURPLE,
    "report": YELLOW,
}
# the styles that columns of the schema name, in the order in which they are drawn: the later lie over the earlier
LINES: dict[str, Look] = {
    "simulated high": {"color": SIMULATED, "linewidth": 0.9, "marker": "^", "markersize": 3},
    "truth": {"color": TRUTH, "linewidth": 3.5, "alpha": 0.6},
    "simulated": {"color": SIMULATED, "marker": "o", "markersize": 4},
    "floor": {"color": TRACED, "linewidth": 1.0},
    "traced": {"color": TRACED, "marker": "o", "markersize": 4},
    "traced high": {"color": TRACED, "linestyle": ":", "marker": "^", "markersize": 4},
    "traced tip": {"color": VERMILION, "linestyle": "--", "marker": "s", "markersize": 4},
    "truth tip": {"color": TRUTH, "linestyle": "--", "linewidth": 1.0},
    "overlap": {"color": VERMILION, "marker": "s", "markersize": 4},
}
# colour, line style and marker of the trivial predictors, in the order of their columns
_PREDICTOR_LINES: tuple[tuple[str, Any, str], ...] = (
    (PURPLE, "--", "s"),
    (GREY, ":", "v"),
    (GREEN, "-.", "D"),
    ("black", (0, (1, 3)), "x"),
    (SKY, (0, (5, 1)), "P"),
    (VERMILION, (0, (3, 1, 1, 1)), "*"),
    (YELLOW, (0, (6, 3)), "X"),
)


def predictors() -> Iterator[tuple[str, str, str, Any, str]]:
    """Column, label, colour, line style and marker of every trivial predictor of the schema, the centreline first."""
    for column, line in zip(ERRORS.shown("predictors"), cycle(_PREDICTOR_LINES), strict=False):
        yield column.name, column.shown["predictors"], *line


def lines(place: str) -> list[tuple[str, str, Look]]:
    """Column, label and style of every line that the schema shows at a place, in the order of drawing."""
    rank, spare = {style: i for i, style in enumerate(LINES)}, cycle(reversed(PALETTE))
    columns = sorted(ERRORS.shown(place), key=lambda column: rank.get(column.style, len(rank)))
    return [(c.name, c.shown[place], LINES.get(c.style) or {"color": next(spare)}) for c in columns]
