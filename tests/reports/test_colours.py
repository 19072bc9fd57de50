"""One colour for one thing everywhere, seen on white paper and on the dark page."""

from __future__ import annotations

import numpy as np
import pytest

from reports import colours

THINGS = {name: getattr(colours, name) for name in ("TRACED", "SIMULATED", "TRUE", "BAD", "FAR", "UNSCORED")}


def luminance(colour: str) -> float:
    """Relative luminance of WCAG 2.2."""
    channels = np.array(colours.rgb(colour))
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    return float(linear @ (0.2126, 0.7152, 0.0722))


def contrast(one: str, other: str) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("page", [colours.PAGE_LIGHT, colours.PAGE_DARK])
@pytest.mark.parametrize("name", THINGS)
def test_what_a_figure_shows_stands_out_by_three_to_one(name: str, page: str) -> None:
    assert contrast(THINGS[name], page) >= 3.0


def test_orange_would_not() -> None:
    """The colour that the traced wire had: the measure bites."""
    assert contrast("#E69F00", colours.PAGE_LIGHT) < 2.5
