"""What a rigid fit leaves of the grey at a wall, worked out once for all that is asked of it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Array
from pipeline.register.patches import spread_out
from pipeline.register.points import StaticPoints
from pipeline.register.shift import METAL_SCALES, METAL_VOXELS, Solved, near_metal

BRIGHTER = 0.1
"""Metal is brighter than the brightest of a patch by so much of its contrast: a moved wall is not."""


class Left(NamedTuple):
    """At each of the points (n,): the gain of grey, the grey that is left, and whether it is away from metal."""

    gain: Array
    grey: Array
    clear: NDArray[np.bool_]


def left_of(s: StaticPoints, last: Solved, *, taken: bool) -> Left:
    """What is left by the rigid fit's last step, itself ``taken`` off, or not."""
    return Left(last.gain, last.rest if taken else last.rest + last.change, _clear(s, last))


def _clear(s: StaticPoints, last: Solved) -> NDArray[np.bool_]:
    """Which points (n,) are away from metal: brighter than expected, and than what a wall that moved shows."""
    clear, doubtful = np.ones(len(s.grey), bool), np.flatnonzero(~last.clear)
    top, bottom = (
        spread_out(of.reduceat(s.centred, s.starts), s.starts, len(s.grey)) for of in (np.maximum, np.minimum)
    )
    above = last.rest + last.gain * (s.centred - top - BRIGHTER * (top - bottom))
    metal = np.minimum(last.rest, above) > METAL_SCALES * last.scale
    clear[doubtful] = ~near_metal(s.points_mm[doubtful], metal[doubtful], METAL_VOXELS * s.voxel_mm)
    return clear
