"""Which scene tries which stage: the matrix that a test prints and checks for holes."""

from __future__ import annotations

from data_synthetic import catalogue

STAGES = ("load", "segment", "trace", "simulate", "compare", "report")

TRIED = {name: catalogue.describe(name).tries for name in catalogue.names()}
"""Stages that a scene was made to try; every scene runs through all of them."""


def matrix() -> str:
    """Scenes against stages as text."""
    width = max(map(len, TRIED))
    head = " " * width + "  " + "  ".join(STAGES)
    rows = [
        f"{name:{width}s}  " + "  ".join(("x" if s in tried else ".").center(len(s)) for s in STAGES)
        for name, tried in TRIED.items()
    ]
    return "\n".join([head, *rows])
