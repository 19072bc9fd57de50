"""A scene whose anatomy comes from a file: real vessels, made-up wire."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from data_synthetic.anatomy.centrelines import read_tree
from data_synthetic.anatomy.from_tree import way_through
from data_synthetic.catalogue.scene import NamedScene, Setup, spread
from data_synthetic.geometry import world_axis_across
from data_synthetic.rod.steer import steer

ENTRY_ARC_MM, END_MM = 3.0, 4.0
"""How far inside the way's beginning the wire enters, and how far before its end it stops at the latest."""

MARGIN_MM = 6.0
"""Tissue around the way in the field of view."""

VOXELS_ACROSS = 2.5
"""Real vessels taper along the way: trees of cerebral arteries are segmented and traced with this many."""

SHORTEST_TRIAL_MM, TRIAL_STEP_MM, LEAST_PUSH_MM = 10.0, 2.0, 4.0
"""First depth and advance of a trial with some roll, and how far frames reach beyond the first even if all fail."""


def from_anatomy(path: str | Path) -> NamedScene:
    """A scene along the widest way through the vessels of an .swc tree or of a Slicer .mrk.json curve with radii."""
    path = Path(path)
    anatomy = way_through(read_tree(path))
    tube = anatomy.tubes[0]
    low, high = tube.points_mm.min(axis=0), tube.points_mm.max(axis=0)
    widest = float(tube.radii_mm.max())

    def plan(_rng: np.random.Generator, frames: int) -> Setup:
        depths = spread(8.0, tube.length_mm - ENTRY_ARC_MM - END_MM, frames)
        setup = Setup(anatomy, tube, ENTRY_ARC_MM, depths, (0.0,) * frames, 0.5 * (low + high))
        return replace(setup, material_axis=world_axis_across(setup.direction))

    return NamedScene(
        name=path.name.split(".")[0].replace(" ", "-").replace("(", "").replace(")", "").lower(),
        why=f"vessels of {path.name}: {tube.length_mm:.0f} mm of its widest way, {len(anatomy.tubes)} tubes near it",
        plan=plan,
        fov_mm=float(np.max(high - low)) + 2 * (MARGIN_MM + widest),
        size=192,
        frames=12,
        voxels_across=VOXELS_ACROSS,
        steer=lambda setup: steered(setup, 8.0, widest + 1.0),
    )


def steered(setup: Setup, first_mm: float, corridor_mm: float) -> Setup:
    """The roll that leads furthest along the way, and depths from ``first_mm`` to where it led.

    corridor_mm : how far the tip may be from the way and still be on it.
    """
    way = setup.tube.points_mm[setup.ahead]
    trials = tuple(np.arange(SHORTEST_TRIAL_MM, setup.depths_mm[-1], TRIAL_STEP_MM).tolist())
    roll, reached = steer(setup.insertion(), way, trials, corridor_mm)
    frames = len(setup.depths_mm)
    depths = spread(first_mm, max(reached, first_mm + LEAST_PUSH_MM), frames)
    return replace(setup, depths_mm=depths, rolls_deg=(roll,) * frames)
