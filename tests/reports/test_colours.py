"""One colour for one thing everywhere, seen on white paper and on the dark page."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from skimage.color import deltaE_ciede2000, rgb2lab

from reports import colours
from reports.figures._style import PALETTE

# Machado, Oliveira and Fernandes 2009: linear light as seen with every receptor, without those of red, of green
SEEN = (
    np.eye(3),
    np.array([[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]),
    np.array([[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]),
)
THINGS = {name: getattr(colours, name) for name in ("TRACED", "SIMULATED", "TRUE", "BAD", "FAR", "UNSCORED")}


def linear(colour: str) -> np.ndarray:
    channels = np.array(colours.rgb(colour))
    return np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)


def luminance(colour: str) -> float:
    """Relative luminance of WCAG 2.2."""
    return float(linear(colour) @ (0.2126, 0.7152, 0.0722))


def lab(colour: str, seen: np.ndarray) -> np.ndarray:
    light = np.clip(seen @ linear(colour), 0.0, 1.0)
    return rgb2lab(np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055))


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


@pytest.mark.parametrize(("seen", "least"), [*zip(SEEN, (28.0, 13.0, 13.0), strict=True)])
def test_curves_of_simulators_are_told_apart(seen: np.ndarray, least: float) -> None:
    """Teal lay beside blue, and slate and purple were blue without red or green."""
    pairs = combinations(PALETTE, 2)
    assert min(float(deltaE_ciede2000(lab(one, seen), lab(other, seen))) for one, other in pairs) >= least
    assert all(contrast(colour, page) >= 3.0 for colour in PALETTE for page in (colours.PAGE_LIGHT, colours.PAGE_DARK))
