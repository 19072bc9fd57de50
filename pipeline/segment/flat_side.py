"""Is a vessel's wall flat on one side, all along it? So is the surface of contrast medium that fills it in part.

It faces up, whatever the way of the vessel, and what lies beyond it has nothing to show.
"""

import numpy as np

from pipeline.arrays.grids import normals_at, spelt
from solver.grid import Grid

NEAR_VOXELS, LOOKED_AT, TRIED = 0.6, 4000, 300
"""Distance from the wall, places at which its normal is taken, and how many of these directions are tried."""
ALIKE_DEG = 12.0
"""Angle between normals that face one way."""
LEAST, TIMES = 0.11, 2.0
"""Share of the wall that faces one way, and that over what faces the other way, from which it is a surface. In the 27
scenes of the catalogue it is 0.03 to 0.10, and 1.2 times the other side's at most, as in a channel of flat walls; of
vessels filled half or three quarters it is 0.18 to 0.3 and 3 to 4 times."""


def flat_side(distance: Grid) -> tuple[str, ...]:
    """One sentence for the report where a wall is flat on one side, or none. distance : signed, mm."""
    near = np.abs(distance.values) < NEAR_VOXELS * distance.voxel_mm
    _, normals = normals_at(distance, near, LOOKED_AT)
    if not len(normals):
        return ()
    tried = normals[:: max(1, len(normals) // TRIED)]
    alike = tried @ normals.T
    limit = float(np.cos(np.radians(ALIKE_DEG)))
    share, opposite = np.mean(alike > limit, axis=1), np.mean(alike < -limit, axis=1)
    best = int(np.argmax(share))
    if not share[best] > max(LEAST, TIMES * float(opposite[best])):
        return ()
    way = spelt(tried[best], 2)
    return (
        f"segment: {100 * share[best]:.0f} % of the vessel's wall is flat and faces one way, LPS ({way}): where that "
        "is up, the contrast medium may fill the vessel in part, and the lumen is that part; or the scan's edge cuts "
        "it, or it is made so; look at the picture, fill it, or give the lumen as a file (manifest key lumen)",
    )
