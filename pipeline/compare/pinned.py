"""The curve of least bending between the clamp and a given tip: the force on the tip is sought that brings it there."""

import numpy as np

from pipeline.model import Array, Clamp
from solver import GuideWire, VesselWall, relax

FIRST_N = 0.002
"""Forces that are tried to learn how the tip answers: they move the end of a wire of EI = 10 by about 0.1 mm."""
MOST_MM = 1.0
"""The tip is led there in steps no longer than this: further off, its answer is another one."""
MOST_TRIES, NEAR_MM = 40, 0.1


def pinned(wire: GuideWire, wall: VesselWall, clamp: Clamp, start_mm: Array, tip_mm: Array) -> Array | None:
    """The wire (n, 3) whose tip lies within 0.1 mm of ``tip_mm``, from a relaxed one (m, 3) on; None without one."""
    depth = float(np.sum(np.linalg.norm(np.diff(start_mm, axis=0), axis=1)))

    def pulled(force_N: Array, shape: Array) -> Array:
        """The wire under a force on its tip."""
        found = relax(
            wire,
            wall,
            depth_mm=depth,
            entry_mm=shape[0],
            entry_direction=clamp.direction,
            start_mm=shape,
            load_N=force_N,
        )
        return np.asarray(found.joints_mm)

    shape, force = start_mm, np.zeros(3)
    answer = np.column_stack([(pulled(FIRST_N * axis, shape)[-1] - shape[-1]) / FIRST_N for axis in np.eye(3)])
    for _ in range(MOST_TRIES):
        gap = tip_mm - shape[-1]
        if np.linalg.norm(gap) <= NEAR_MM:
            return shape
        step = gap * min(1.0, MOST_MM / float(np.linalg.norm(gap)))
        # a wire cannot be stretched: along it the tip hardly answers, and is asked for little
        more = np.linalg.lstsq(answer, step, rcond=0.02)[0]
        moved = pulled(force + more, shape)
        wrong = moved[-1] - shape[-1] - answer @ more
        answer = answer + np.outer(wrong, more) / max(float(more @ more), 1e-12)
        force, shape = force + more, moved
    return None
