"""A scene whose anatomy comes from a file: real vessels, made-up wire."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from data_synthetic.anatomy.centrelines import read_tree
from data_synthetic.anatomy.from_tree import way_through
from data_synthetic.catalogue.scene import Scene, Setup, enter, spread
from data_synthetic.rod.replay import Insertion
from data_synthetic.rod.steer import steer
from data_synthetic.rod.wire import TrueWire

Array = NDArray[np.float64]

ENTRY_ARC_MM = 3.0
MARGIN_MM = 6.0
"""Tissue around the way in the field of view."""


def scene_from_file(path: str | Path) -> Scene:
    """A scene along the widest way through a tree of .swc or .mrk.json; it says what was chosen in its ``why``."""
    path = Path(path)
    way = way_through(read_tree(path))
    tube = way.anatomy.tubes[0]
    low, high = tube.points_mm.min(axis=0), tube.points_mm.max(axis=0)
    fov = float(np.max(high - low)) + 2 * (MARGIN_MM + float(tube.radii_mm.max()))

    def setup(_rng: np.random.Generator, frames: int) -> Setup:
        entry, direction = enter(tube, ENTRY_ARC_MM)
        wire, axis = TrueWire(), _across(direction)
        trial = Insertion(wire, way.anatomy, 2.0, entry, direction, axis)
        usable = way.length_mm - ENTRY_ARC_MM - 4.0
        depths = tuple(np.arange(10.0, usable, 2.0).tolist())
        ahead = tube.points_mm[round(ENTRY_ARC_MM / tube.step_mm) :]
        roll, reached = steer(trial, ahead, depths, float(tube.radii_mm.max()) + 1.0)
        return Setup(
            way.anatomy,
            entry,
            direction,
            spread(8.0, max(reached, 12.0), frames),
            (roll,) * frames,
            0.5 * (low + high),
            material_axis=axis,
            wire=wire,
        )

    name = path.name.split(".")[0].replace(" ", "-").replace("(", "").replace(")", "").lower()
    why = f"vessels of {path.name}: {way.length_mm:.0f} mm of its widest way, {len(way.anatomy.tubes)} tubes near it"
    return Scene(name, why, fov, 192, 12, setup)


def _across(direction: Array) -> Array:
    """The world axis least aligned with a direction."""
    return np.asarray(np.eye(3)[int(np.argmin(np.abs(direction)))])
