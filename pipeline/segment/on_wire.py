"""Scans that show the wire as well: a seed on a wire several voxels thick finds the wire instead of its vessel."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.grids import indices_of
from pipeline.model import Array
from pipeline.segment.levels import grey_around
from solver.grid import Grid

AS_THIN, AS_THIN_VOXELS = 1.25, 0.5
"""Greatest depth of a region that may be the wire: so many radii of the wire plus so many voxels. 0.9 mm wires in
voxels of 0.1 to 0.3 mm have 1.1 radii, and no vessel that a wire goes through is as narrow."""
OFF_VOXELS, OFF_BLURS, SHELL_VOXELS = 2.0, 2.5, 1.5
"""How far outside its wall the wire's blur is gone, and how thick the shell is in which the vessel is looked for."""
NEAR_MM = 3.0
"""Distance from the seeds within which the vessel is looked for."""
VESSEL_SHARE = 0.75
"""Quantile of the shell's grey that is the vessel's: a wire at the wall has tissue on up to half of its sides."""
SWALLOWED = 0.9
"""Least share of the wire's voxels that must lie in the vessel around it."""


def _inside(distance: Grid) -> NDArray[np.bool_]:
    return np.asarray(distance.values < 0)


def beside(scan: Grid, distance: Grid, seeds_mm: Array, wire_radius_mm: float, blur_mm: float) -> Array | None:
    """A seed (1, 3) LPS mm beside a region as thin as the wire; None if it is thicker, or no place is near enough.

    distance : signed, of the region, on a box of the scan.  blur_mm : the scanner's.
    """
    h = scan.voxel_mm
    inside = distance.values[_inside(distance)]
    if not inside.size or -float(np.percentile(inside, 1)) > AS_THIN * wire_radius_mm + AS_THIN_VOXELS * h:
        return None
    low = max(OFF_VOXELS * h, OFF_BLURS * blur_mm)
    shell = indices_of((distance.values > low) & (distance.values < low + SHELL_VOXELS * h))
    place = distance.to_mm(shell)
    near = np.min(np.linalg.norm(place[:, None] - np.atleast_2d(seeds_mm), axis=2), axis=1) < NEAR_MM
    if not near.any():
        return None
    place = place[near]
    grey = grey_around(scan, np.rint(scan.to_index(place)).astype(np.int64))
    return np.asarray(place[[int(np.argmin(np.abs(grey - np.quantile(grey, VESSEL_SHARE))))]])


def swallowed(thin: Grid, vessel: Grid) -> bool:
    """Whether a vessel (signed distance) holds a thin region, as it must if that is the wire in it."""
    index = np.rint(vessel.to_index(thin.to_mm(indices_of(_inside(thin))[::7]))).astype(np.int64)
    held: NDArray[Any] = np.all((index >= 0) & (index < np.array(vessel.shape)), axis=1)
    held[held] = vessel.values[tuple(index[held].T)] < 0
    return bool(held.mean() > SWALLOWED)
