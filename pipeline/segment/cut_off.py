"""Is the vessel brighter than the scan's greys go? Of what is cut off, half the level lies too far out on the wall."""

import numpy as np

from pipeline.arrays.grids import unflattened
from pipeline.segment.bone import LEAST
from pipeline.segment.levels import Index
from solver.grid import Grid

AT_TOP = 0.5
"""Share of the vessel's depth with the scan's greatest grey, from which the level inside is that one."""
LOOKED_AT = 200_000
"""Places of the vessel's box that are looked at: a few thousand lie deep in it."""
STILL = 0.5
"""Share of voxels outside it that are what the next one is, from which a scan has no noise: its vessel may be flat."""


def cut_off(scan: Grid, distance: Grid, corner: Index) -> tuple[str, ...]:
    """One sentence for the report where the vessel's grey is cut off, or none.

    distance : signed distance on the vessel's box, which begins at ``corner`` of the scan.
    """
    h = float(np.min(distance.spacing_mm))
    some = np.random.default_rng(0).integers(distance.values.size, size=LOOKED_AT)
    depth, index = distance.values.reshape(-1)[some], unflattened(some, distance.values.shape) + corner
    deep, out = index[depth < -h], index[depth > 2.0 * h]
    if min(len(deep), len(out)) < LEAST:
        return ()
    top = scan.values[tuple(deep.T)] == scan.values.max()
    beside = np.minimum(np.add(out, [0, 0, 1]), np.array(scan.shape) - 1)
    still = scan.values[tuple(out.T)] == scan.values[tuple(beside.T)]
    if np.mean(top) < AT_TOP or np.mean(still) > STILL:
        return ()
    return (
        f"segment: {100 * np.mean(top):.0f} % of the vessel's depth have the scan's greatest grey: what is brighter is "
        "cut off, and its wall may lie up to 0.5 voxel too far out; export the scan with a wider window, or more bits",
    )
