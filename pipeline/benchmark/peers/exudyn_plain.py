"""Exudyn as a first script sets it up: the wall is a force callback, its Jacobian taken by Exudyn's differences."""

from __future__ import annotations

from pipeline.benchmark.peers import exudyn_cable
from pipeline.benchmark.peers.common import STEPS_B, Answer

NAME = "Exudyn, force callback alone"
PACKAGE = exudyn_cable.PACKAGE


def bend(n: int, steps: int = STEPS_B, pushes: int | None = None) -> Answer:
    """Scene B, see ``exudyn_cable.bend``."""
    return exudyn_cable.bend(n, steps, pushes, jacobian=False)
