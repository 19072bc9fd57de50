"""Vessels that can be drawn on paper: what they should show is known beforehand."""

from __future__ import annotations

import numpy as np

from data_synthetic import shapes
from data_synthetic.scene import Scene, Setup, enter, spread
from data_synthetic.tubes import Anatomy
from data_synthetic.wire import TrueWire

ENTRY_ARC_MM = 4.0
"""The entry lies this far inside the vessel's beginning, clear of its rounded end."""

STRAIGHT_WIRE = TrueWire(rest_curvature_per_mm=((0.0, 0.0),))


def plain_setup(
    anatomy: Anatomy,
    frames: int,
    last_mm: float,
    *,
    roll_deg: float = 0.0,
    wire: TrueWire | None = None,
    first_mm: float = 8.0,
) -> Setup:
    """Enter the first tube, push to ``last_mm`` with one roll."""
    entry, direction = enter(anatomy.tubes[0], ENTRY_ARC_MM)
    points = np.concatenate([t.points_mm for t in anatomy.tubes])
    return Setup(
        anatomy,
        entry,
        direction,
        spread(first_mm, last_mm, frames),
        (roll_deg,) * frames,
        0.5 * (points.min(axis=0) + points.max(axis=0)),
        wire=wire or TrueWire(),
    )


def _straight(_rng: np.random.Generator, frames: int) -> Setup:
    return plain_setup(shapes.straight(), frames, 36.0)


def _bend(_rng: np.random.Generator, frames: int) -> Setup:
    return plain_setup(shapes.bend(), frames, 38.0)


def _bifurcation(_rng: np.random.Generator, frames: int) -> Setup:
    return plain_setup(shapes.bifurcation(), frames, 30.0)


PLAIN = (
    Scene("straight", "a curved tip in a straight vessel: contact without any turn", 57.6, 192, 6, _straight),
    Scene("bend", "one bend in one plane: bending and wall alone decide", 48.0, 160, 6, _bend),
    Scene("bifurcation", "the tip takes the branch that it points at", 48.0, 160, 6, _bifurcation),
)
