"""A vessel in a block or a wall of its own whose grey is nearer to the vessel's than to what lies beyond it.

Resin of 300 around medium of 400 in air of -1000 is 0.93 of the contrast: the whole block was the lumen, and nothing
said so. Two plateaus below the wall that was found, of which the seed's lies within the other, tell it. What passes by
the other, as bone or medium that has settled, or follows it, as a part that is filled less, reaches that wall.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage.filters import threshold_otsu
from skimage.segmentation import find_boundaries

from pipeline.arrays.grids import spread, unflattened
from pipeline.segment.bone import DEEP
from pipeline.segment.groups import ASHMANS_D
from pipeline.segment.levels import Index, box_from, grey_around
from solver.grid import Grid

LOOKED_AT, LEAST = 20_000, 100
"""Voxels below the wall that are looked at, and the least of the vessel's that tell anything."""
FURTHER_VOXELS = 1.0
"""How much deeper than the plateau begins the vessel's own wall must lie, to be none that was found."""
WITHIN = 0.8
"""Share of that wall: 0.95 and more in a block or a tube, 0.5 where medium has settled."""


def surrounding(
    grid: Grid, distance: Grid, corner: Index, seed: tuple[int, ...] | None, blur_mm: float
) -> float | None:
    """The grey of what a segmented vessel holds around the true one, of another plateau than at the seed; or None.

    distance : signed, mm, from the wall that was found, on a box that begins at ``corner`` of the scan.  seed : a voxel
    whose grey is the vessel's.  blur_mm : the wall's.
    """
    values, plateau_mm = distance.values, DEEP * blur_mm
    deep = np.flatnonzero(values < -plateau_mm)
    if seed is None or len(deep) < LEAST:
        return None
    index = unflattened(deep[:: max(1, len(deep) // LOOKED_AT)], distance.shape)
    at_seed = float(grey_around(grid, np.array([seed]))[0])
    other = _other_plateau(grey_around(grid, index + corner), at_seed)
    if other is None:
        return None
    mean = ndimage.uniform_filter(np.asarray(grid.values[box_from(corner, distance.shape)], np.float32), 3)
    middle = 0.5 * (at_seed + other)
    alike = (values < -plateau_mm) & ((mean > middle) == (at_seed > middle))
    wall_mm = -plateau_mm - FURTHER_VOXELS * float(np.min(grid.spacing_mm))
    return other if _lies_within(alike, values < wall_mm, np.array(seed) - corner) else None


def _other_plateau(grey: NDArray[np.float64], at_seed: float) -> float | None:
    """The median of the greys (n,) on the other side of Otsu's threshold than the seed's, where it is a plateau."""
    if np.ptp(grey) == 0.0:
        return None
    middle = threshold_otsu(grey)
    others = grey[(grey > middle) != (at_seed > middle)]
    if len(others) < LEAST:
        return None
    other = float(np.median(others))
    return other if abs(at_seed - other) > ASHMANS_D * spread(others) else None


def _lies_within(alike: NDArray[np.bool_], deeper: NDArray[np.bool_], seed: NDArray[np.int64]) -> bool:
    """Whether the part that hangs together with a seed ends where it is deep; at the box's faces it goes on."""
    numbers, _ = ndimage.label(alike)
    if not alike[tuple(seed)]:
        return False
    box = ndimage.find_objects(numbers)[numbers[tuple(seed)] - 1]
    part = np.pad(numbers[box] == numbers[tuple(seed)], 1)
    wall = find_boundaries(part, mode="inner")[1:-1, 1:-1, 1:-1]
    return bool(np.count_nonzero(part) >= LEAST and np.mean(deeper[box][wall]) > WITHIN)
