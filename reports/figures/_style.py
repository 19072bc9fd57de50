"""How things look: the colours, and the line of every column and trivial predictor that the schema shows."""

from collections.abc import Iterator
from itertools import cycle
from typing import Any

from reports.colours import SIMULATED, TRACED, TRUE
from reports.schema import ERRORS

Look = dict[str, Any]  # what matplotlib is told of a line, a legend, cells
PURPLE, BROWN, ROSE, SLATE = "#9A5B9F", "#8C6D1F", "#B8586B", "#5D6D8A"
INK, GREY = "#222222", "#767676"
PALETTE = (SIMULATED, "#776600", "#AA77FF", "#22AA00", "#BB8877", "#007766")
"""Of curves without a colour of their own: none is a wire's but ours, nor that of what failed. Any two are 28 apart
(CIEDE2000), and 13 for who sees no red or no green; teal beside ours was 23, slate 12, and purple 4 without red."""
UNCERTAINTY = "#1F8A8A"
SPARE = ("#7A7A00", UNCERTAINTY)  # of columns without a style: no predictor has these colours
SEQUENTIAL = ("#D8CBE3", "#5B0F7A")
"""From little to much: away from the paper, and on a dark page, where lightness is turned, away from that as well."""
STAGE_COLOURS = {
    "load": "#C8C8C8",
    "segment": GREY,
    "trace": TRACED,
    "clamp": "#F3C08A",
    "simulate": SIMULATED,
    "compare": "#E3B5E6",
    "report": INK,
}
# the styles that columns of the schema name, in the order in which they are drawn: the later lie over the earlier
LINES: dict[str, Look] = {
    "simulated high": {"color": SIMULATED, "linewidth": 0.9, "marker": "^", "markersize": 3},
    "truth": {"color": TRUE, "linewidth": 3.5},
    "simulated": {"color": SIMULATED, "marker": "o", "markersize": 4},
    "floor": {"color": TRACED, "linewidth": 1.0},
    "uncertainty": {"color": UNCERTAINTY},
    "traced": {"color": TRACED, "marker": "o", "markersize": 4},
    "traced high": {"color": TRACED, "linestyle": ":", "marker": "^", "markersize": 4},
    "traced tip": {"color": INK, "linestyle": "--", "marker": "s", "markersize": 4},
    "truth tip": {"color": TRUE, "linestyle": "--", "linewidth": 1.0},
    "overlap": {"color": PURPLE, "marker": "s", "markersize": 4},
}
# colour, line style and marker of the trivial predictors, in the order of their columns
_PREDICTOR_LINES: tuple[tuple[str, Any, str], ...] = (
    (PURPLE, "--", "s"),
    (GREY, ":", "v"),
    (BROWN, "-.", "D"),
    (INK, (0, (1, 3)), "x"),
    (ROSE, (0, (5, 1)), "P"),
    (SLATE, (0, (3, 1, 1, 1)), "*"),
    (TRACED, (0, (6, 3)), "X"),
)


def predictors() -> Iterator[tuple[str, str, str, Any, str]]:
    """Column, label, colour, line style and marker of every trivial predictor of the schema, the centreline first."""
    for column, line in zip(ERRORS.shown("predictors"), cycle(_PREDICTOR_LINES), strict=False):
        yield column.name, column.shown["predictors"], *line


def lines(place: str) -> list[tuple[str, str, Look]]:
    """Column, label and style of every line that the schema shows at a place, in the order of drawing."""
    rank, spare = {style: i for i, style in enumerate(LINES)}, cycle(SPARE)
    columns = sorted(ERRORS.shown(place), key=lambda column: rank.get(column.style, len(rank)))
    return [(c.name, c.shown[place], LINES.get(c.style) or {"color": next(spare)}) for c in columns]
