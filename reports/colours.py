"""One colour for one thing, wherever it is drawn: figures, pages, viewer, 3D Slicer.

Of the Okabe-Ito palette, which the colour-blind tell apart, those that stand out by 3:1 or more from white paper and
from the dark page alike (WCAG 2.2, 1.4.11; ``tests/reports/test_colours.py``): yellow, sky blue and orange do not.
"""

TRACED = "#D55E00"
"""The wire as it was found in the scan."""
SIMULATED = "#0072B2"
"""The simulator's wire."""
TRUE = "#009E73"
"""The wire of a synthetic study, as it was drawn into the scan."""
WIRES = {"traced": TRACED, "simulated": SIMULATED, "true": TRUE}
LUMEN = "#8A949E"
BAD = "#B8336F"
"""What failed; no wire has this colour."""
FAR = "#E5007D"
"""Where the simulated wire is farthest from the traced one: its colour runs from SIMULATED to this."""
UNSCORED = "#767676"
"""Simulated wire that was compared with nothing: the clamp's reach, failed frames. Grey is on no scale of errors."""
ERROR_SCALE_MM = (0.02, 2.0)
"""Where colours of distances to the traced wire begin and end, on a logarithmic scale: the same in every figure, case
and run, so that two pictures can be compared. What a trace knows no better is dark; 2 mm off is another vessel."""
PAGE_LIGHT, PAGE_DARK = "#FFFFFF", "#15181C"


def rgb(colour: str) -> tuple[float, float, float]:
    """Red, green and blue from 0 to 1 of a colour ``#RRGGBB``."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red / 255, green / 255, blue / 255
