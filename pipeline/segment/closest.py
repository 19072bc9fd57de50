"""Closest points of a wall for every voxel around it: found in slabs side by side, then across where these meet."""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.cores import side_by_side
from pipeline.segment._kernels.distance import Owned, propagate

SLABS = 4
"""Fixed: how a tie between two closest points ends depends on the slabs, and may not depend on the cores."""


def find_closest(box: Owned, voxels: NDArray[np.int64], foot: NDArray[np.float64], outer_mm: float) -> int:
    """Give every voxel inside the wall, and outside as far as ``outer_mm``, the closest of the feet around it.

    voxels : flat; these own a foot already (see ``Owned``), and hand it on.  Returns the number of hand-overs.
    """
    planes, plane = len(box.owner), box.owner[0].size
    voxels = np.sort(voxels)
    cuts = np.unique([part[0] // plane for part in np.array_split(voxels, SLABS)[1:] if len(part)])
    cuts = cuts[cuts > 0].astype(np.int64)

    def within(part: NDArray[np.int64], first: int, stop: int) -> int:
        return propagate(box, part, foot, outer_mm, first, stop)

    parts = np.split(voxels, np.searchsorted(voxels, cuts * plane))
    slabs = zip(parts, [0, *cuts], [*cuts, planes], strict=True)
    visits: int = sum(side_by_side(*(partial(within, *slab) for slab in slabs)))
    meeting = [np.flatnonzero(box.owner[cut - 1 : cut + 1]) + (cut - 1) * plane for cut in cuts]
    return visits + within(np.unique(np.concatenate([voxels[:0], *meeting])), 0, planes)
