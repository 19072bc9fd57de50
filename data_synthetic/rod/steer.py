"""Which roll keeps the wire on its way: tried out coarsely, as an operator would."""

from dataclasses import replace

import numpy as np

from data_synthetic.geometry import Array, arc_lengths
from data_synthetic.rod.replay import TrueFrame, TrueInsertion, replay

ROLLS_DEG = (0.0, 90.0, 180.0, 270.0, 30.0, 120.0, 210.0, 300.0, 60.0, 150.0, 240.0, 330.0)
COARSE_MM = 0.8
"""Node spacing of the trials."""

LARGEST_JUMP_MM = 2.0
"""A tip that springs further than this in one step has left the quiet part of the insertion."""

DEEPEST_MM = 0.25
"""A trial in which the wire is pressed further into the wall than this is stuck: it is not pushed on."""


def steer(
    insertion: TrueInsertion, way_mm: Array, depths_mm: tuple[float, ...], corridor_mm: float
) -> tuple[float, float]:
    """The roll in degrees that leads furthest along a way (n, 3), and the depth to which the tip stayed on it.

    The way starts at the entry. corridor_mm : how far the tip may be from the way and still be on it.
    """
    trial = replace(insertion, step_mm=COARSE_MM, advance_mm=COARSE_MM)
    best = (0.0, 0.0)
    for roll in ROLLS_DEG:
        reached = 0.0
        for frame in replay(trial, depths_mm, roll):
            if not _on_the_way(trial, frame, way_mm, corridor_mm):
                break
            reached = frame.depth_mm
        if reached > best[1]:
            best = (roll, reached)
        if best[1] >= depths_mm[-1]:
            break
    return best


def _on_the_way(insertion: TrueInsertion, frame: TrueFrame, way_mm: Array, corridor_mm: float) -> bool:
    """Near the way, about as far along it as the wire is long (it may bulge, so 0.7), not stuck, no wild snap."""
    away = np.linalg.norm(way_mm - frame.points_mm[-1], axis=1)
    foot = int(np.argmin(away))
    short = arc_lengths(way_mm)[foot] < 0.7 * frame.depth_mm - corridor_mm
    if away[foot] > corridor_mm or short or frame.jump_mm > LARGEST_JUMP_MM:
        return False
    phi = insertion.wall.distance_and_gradient(frame.points_mm)[0]
    return bool(np.max(phi + insertion.wire.radius_mm) < DEEPEST_MM)
