"""Analytic anatomies: simple shapes for small tests, the circle of Willis, and trees read from files."""

from __future__ import annotations

from data_synthetic.shapes.simple import (
    bend,
    bifurcation,
    end_aneurysm,
    helix,
    kissing,
    s_curve,
    side_aneurysm,
    stenosed,
    straight,
)
from data_synthetic.shapes.willis import WillisPlan, circle_of_willis

__all__ = [
    "WillisPlan",
    "bend",
    "bifurcation",
    "circle_of_willis",
    "end_aneurysm",
    "helix",
    "kissing",
    "s_curve",
    "side_aneurysm",
    "stenosed",
    "straight",
]
