"""Scenes from a user's own anatomy, and trials that find the roll and depths by which a wire follows its way."""

from dataclasses import replace
from itertools import takewhile
from pathlib import Path

import numpy as np

from data_synthetic.anatomy.centrelines import read_tree
from data_synthetic.anatomy.from_tree import way_through
from data_synthetic.catalogue.scene import NamedScene, Setup, name_after, spread
from data_synthetic.geometry import Array, arc_lengths, world_axis_across
from data_synthetic.rod.replay import TrueFrame, TrueInsertion, replay

ROLLS_DEG = (0.0, 90.0, 180.0, 270.0, 30.0, 120.0, 210.0, 300.0, 60.0, 150.0, 240.0, 330.0)
COARSE_MM = 0.8
"""Node spacing of the trials."""
LARGEST_JUMP_MM = 2.0
"""A tip that springs further than this in one step has left the quiet part of the insertion."""
DEEPEST_MM = 0.25
"""A trial in which the wire is pressed further into the wall than this is stuck: it is not pushed on."""


def _on_the_way(insertion: TrueInsertion, frame: TrueFrame, way_mm: Array, corridor_mm: float) -> bool:
    """Whether the tip is near the way, far enough along it (0.7 of the depth: wires bulge), not stuck, not snapped."""
    away = np.linalg.norm(way_mm - frame.points_mm[-1], axis=1)
    foot = int(np.argmin(away))
    short = arc_lengths(way_mm)[foot] < 0.7 * frame.depth_mm - corridor_mm
    if away[foot] > corridor_mm or short or frame.jump_mm > LARGEST_JUMP_MM:
        return False
    phi = insertion.wall.distance_and_gradient(frame.points_mm)[0]
    return bool(np.max(phi + insertion.wire.radius_mm) < DEEPEST_MM)


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
        return Setup(anatomy, tube, ENTRY_ARC_MM, depths, (0.0,) * frames, 0.5 * (low + high))

    return NamedScene(
        name=name_after(path).lower(),
        why=f"vessels of {path.name}: {tube.length_mm:.0f} mm of its widest way, {len(anatomy.tubes)} tubes near it",
        plan=plan,
        fov_mm=float(np.max(high - low)) + 2 * (MARGIN_MM + widest),
        size=192,
        frames=12,
        voxels_across=VOXELS_ACROSS,
        steer=lambda setup: steered(setup, 8.0, widest + 1.0),
    )


def steered(setup: Setup, first_mm: float, corridor_mm: float) -> Setup:
    """The roll that leads furthest along the way from the entry, and depths from ``first_mm`` to where it led.

    corridor_mm : how far the tip may be from the way and still be on it.
    """
    setup = replace(setup, material_axis=world_axis_across(setup.direction))
    trial = replace(setup.insertion(), step_mm=COARSE_MM, advance_mm=COARSE_MM)
    way, furthest, best_roll = setup.tube.points_mm[setup.ahead], 0.0, 0.0
    depths = np.arange(SHORTEST_TRIAL_MM, setup.depths_mm[-1], TRIAL_STEP_MM).tolist()
    for roll in ROLLS_DEG:
        on_the_way = takewhile(lambda frame: _on_the_way(trial, frame, way, corridor_mm), replay(trial, depths, roll))
        reached = max((frame.depth_mm for frame in on_the_way), default=0.0)
        if reached > furthest:
            furthest, best_roll = reached, roll
        if furthest >= depths[-1]:
            break
    frames = len(setup.depths_mm)
    last = max(furthest, first_mm + LEAST_PUSH_MM)
    return replace(setup, depths_mm=spread(first_mm, last, frames), rolls_deg=(best_roll,) * frames)
