"""Is the vessel brighter than the scan's greys go? Of what is cut off, half the level lies too far out on the wall."""

import numpy as np

from pipeline.arrays.grids import unflattened
from pipeline.segment.bone import LEAST
from pipeline.segment.levels import Vessel

AT_TOP = 0.5
"""Share of the vessel's depth with one grey, from which the level inside is that one, and not the vessel's."""
FAR_VOXELS, LOWEST = 4.0, 0.01
"""Distance outside from which noise is looked for, and the least share of the scan's greys that is no cut-off dark."""
LOOKED_AT = 200_000
"""Places of the vessel's box that are looked at: a few thousand lie deep in it."""
STILL = 0.5
"""Share of voxels out there that are what the next one is, from which a scan has no noise: its vessel may be flat."""


def cut_off(vessel: Vessel) -> tuple[str, ...]:
    """One sentence for the report where the vessel's grey is cut off, or none."""
    scan, distance = vessel.scan, vessel.distance
    h = distance.voxel_mm
    some = np.random.default_rng(0).integers(distance.values.size, size=LOOKED_AT)
    depth, index = distance.values.reshape(-1)[some], unflattened(some, distance.values.shape) + vessel.corner
    deep, out = index[depth < -h], index[depth > FAR_VOXELS * h]
    grey, beside = (
        scan.values[tuple(np.minimum(out + step, np.array(scan.shape) - 1).T)] for step in ([0, 0, 0], [0, 0, 1])
    )
    low, high = float(scan.values.min()), float(scan.values.max())
    seen = grey > low + LOWEST * (high - low)  # a window cuts off what is dark, too
    if len(deep) < LEAST or np.count_nonzero(seen) < LEAST or np.mean((grey == beside)[seen]) > STILL:
        return ()
    same = np.unique(scan.values[tuple(deep.T)], return_counts=True)[1].max() / len(deep)
    if same < AT_TOP:
        return ()
    return (
        f"segment: {100 * same:.0f} % of the vessel's depth have one and the same grey: what is brighter is cut off, "
        "and its wall lies half a voxel and more too far out; export the scan with a wider window, or more bits",
    )
