"""Crests through given voxels: where a thin bright line runs, to a fraction of a voxel, and how bright it is."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.jets import Blurred, new_probe, ridge_step, to_ridge
from pipeline.arrays.lattice import entry_point, unravelled

ROUNDS = 6
STILL = 0.1
"""Longest further step, in voxels, of a point that has arrived at a crest: on a flank without one steps stay longer."""
FURTHEST = 1.8
"""Furthest, in voxels, that a point may move to its crest: beyond that lies another crest."""


@entry_point
def crests(field: Blurred, voxels: NDArray[Any], outside: float, sharp: float) -> tuple[NDArray[Any], NDArray[Any]]:
    """Crest points (n, 3), index * spacing, to which the flat voxels lead, if any, and the blurred grey there.

    On a crest the weaker curvature across it is at least ``sharp`` (1/mm^2) times the height above ``outside``; on a
    flank it is less, or of the other sign.
    """
    probe, spacing = new_probe(), field.spacing
    p, out, step = probe.place, probe.jet, probe.step
    at, peak = np.empty((voxels.shape[0], 3)), np.empty(voxels.shape[0])
    size = min(spacing[0], spacing[1], spacing[2])
    count = 0
    for voxel in voxels:
        i, j, k = unravelled(voxel, field.grey.shape)
        p[0], p[1], p[2] = i * spacing[0], j * spacing[1], k * spacing[2]
        probe.tangent[:] = 0.0
        middle = to_ridge(field, probe, ROUNDS)
        moved = (p[0] - i * spacing[0]) ** 2 + (p[1] - j * spacing[1]) ** 2 + (p[2] - k * spacing[2]) ** 2
        ridge_step(out, probe.tangent, size, step)
        left = step[0] ** 2 + step[1] ** 2 + step[2] ** 2
        crest = middle < -sharp * (out[0] - outside) and out[0] > outside
        if crest and moved < (FURTHEST * size) ** 2 and left < (STILL * size) ** 2:
            at[count] = p
            peak[count] = out[0]
            count += 1
    return at[:count], peak[:count]
