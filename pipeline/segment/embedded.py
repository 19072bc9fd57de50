"""A vessel in a block or a wall of its own whose grey is nearer to the vessel's than to what lies beyond it.

Resin of 300 around medium of 400 in air of -1000 is 0.93 of the contrast: the whole block was the lumen, and nothing
said so. Two plateaus below the wall that was found, of which the seed's lies within the other, tell it. What passes by
the other, as bone or medium that has settled, or follows it, as a part that is filled less, reaches that wall.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage.segmentation import find_boundaries

from pipeline.arrays.grids import spread
from pipeline.segment.bone import DEEP, LEAST, LOOKED_AT
from pipeline.segment.groups import two_groups
from pipeline.segment.levels import Vessel

CLEAR = 8.0
"""Spreads of a block's greys by which the seed is brighter: a vessel that is brightest in its middle reaches 4."""
GAP = 0.04
"""Least share of the contrast between the two plateaus: a vessel of hardly any noise has groups of 0.01."""
FURTHER_VOXELS = 1.0
"""How much deeper than the plateau begins the vessel's own wall must lie, to be none that was found."""
WITHIN = 0.52
"""Share of that wall: 0.95 in a block or a tube, 0.56 where the vessel leaves it at both ends, up to 0.45 where medium
has settled."""


class Block(NamedTuple):
    """What lies around the seed's plateau within what was found: its grey, and that at the seed."""

    grey: float
    at_seed: float

    @property
    def warning(self) -> str:
        """The sentence for the report where the two could not be parted."""
        return (
            f"segment: grey {self.grey:.0f} surrounds that at the entry, {self.at_seed:.0f}, within what was found: is "
            "it the wall of a phantom, filled with hardly more than that, or not at all? Then the lumen is too wide; "
            "fill it, or give the lumen as a file (manifest key lumen)"
        )


def surrounding(vessel: Vessel, blur_mm: float) -> Block | None:
    """What a segmented vessel, whose seed has the true one's grey, holds around that; None where it holds that alone.

    blur_mm : the wall's.
    """
    levels, values, plateau_mm = vessel.levels, vessel.distance.values, DEEP * blur_mm
    deep = vessel.deep(plateau_mm, LOOKED_AT)
    if levels.seed is None or len(deep) < LEAST:
        return None
    seed = np.array(levels.seed) - vessel.corner
    grey, at_seed = vessel.grey_around(deep), float(vessel.grey_around(seed[None])[0])
    bright, low, high, apart = two_groups(grey)
    if at_seed > 0.5 * (low + high):  # a thin vessel has no plateau of its own
        high, apart = at_seed, CLEAR * spread(grey[~bright])
    if not high - low >= max(apart, GAP * levels.contrast):
        return None
    middle = 0.5 * (low + high)
    mean = ndimage.uniform_filter(np.asarray(vessel.scan.values[vessel.box], np.float32), 3)
    alike = (values < -plateau_mm) & ((mean > middle) == (at_seed > middle))
    wall_mm = -plateau_mm - FURTHER_VOXELS * vessel.scan.voxel_mm
    if not _lies_within(alike, values < wall_mm, seed):
        return None
    return Block(low if at_seed > middle else high, at_seed)


def _lies_within(alike: NDArray[np.bool_], deeper: NDArray[np.bool_], seed: NDArray[np.int64]) -> bool:
    """Whether the part that hangs together with a seed ends where it is deep; at the box's faces it goes on."""
    if not alike[tuple(seed)]:
        return False
    numbers, _ = ndimage.label(alike)
    box = ndimage.find_objects(numbers)[numbers[tuple(seed)] - 1]
    wider = tuple(slice(max(0, s.start - 1), s.stop + 1) for s in box)
    part = numbers[wider] == numbers[tuple(seed)]
    wall = find_boundaries(part, mode="inner")
    return bool(np.count_nonzero(part) >= LEAST and np.mean(deeper[wider][wall]) > WITHIN)
