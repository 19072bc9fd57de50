"""The curve of least bending between the clamp and a given tip.

A force across the tip and the length of the wire are sought that bring the tip there. The length must be free: a wire
that bends less than the real one is shorter, and no force on its tip could push it back.
"""

import numpy as np

from pipeline.arrays.polyline import tip_tangent, to_length
from pipeline.model import Array, Clamp, arc_length
from solver import GuideWire, VesselWall, relax

FIRST_N = 0.002
"""Forces, N, that are tried to learn how the tip responds: they move the end of a wire of EI = 10 by about 0.1 mm."""
MOST_MM = 1.0
"""The tip is led there in steps no longer than this: over more, its response is not linear."""
MOST_TRIES, NEAR_MM = 25, 0.1


def pinned(wire: GuideWire, wall: VesselWall, clamp: Clamp, start_mm: Array, tip_mm: Array) -> Array | None:
    """The wire (n, 3) whose tip lies within 0.1 mm of ``tip_mm``, begun from a relaxed one (m, 3); None without one."""

    def pulled(force_N: Array, shape: Array) -> Array:
        """The wire of a shape's length, under a force on its tip."""
        found = relax(
            wire,
            wall,
            depth_mm=float(arc_length(shape)[-1]),
            entry_mm=shape[0],
            entry_direction=clamp.direction,
            start_mm=shape,
            load_N=force_N,
        )
        return np.asarray(found.joints_mm)

    shape, force = start_mm, np.zeros(3)
    answer = np.column_stack([(pulled(FIRST_N * axis, shape)[-1] - shape[-1]) / FIRST_N for axis in np.eye(3)])
    for _ in range(MOST_TRIES):
        gap, tangent = tip_mm - shape[-1], tip_tangent(shape)
        if np.linalg.norm(gap) <= NEAR_MM:
            return shape
        step = gap * min(1.0, MOST_MM / float(np.linalg.norm(gap)))
        along = float(step @ tangent)
        length = float(arc_length(shape)[-1]) + along
        if length < MOST_MM:
            return None
        # along the wire the tip hardly responds to a force: there the length is changed instead
        more = np.linalg.lstsq(answer, step - along * tangent, rcond=0.02)[0]
        moved = pulled(force + more, to_length(shape, length))
        wrong = moved[-1] - shape[-1] - along * tangent - answer @ more
        answer = answer + np.outer(wrong, more) / max(float(more @ more), FIRST_N**2)
        force, shape = force + more, moved
    return shape if np.linalg.norm(tip_mm - shape[-1]) <= NEAR_MM else None
