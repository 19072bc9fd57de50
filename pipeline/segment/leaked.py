"""A vessel that hangs together with tissue: between two tissues, the brighter one is what surrounds it.

With its entry in the darker of two, as in gel beside plastic or in fat beside muscle, a vessel is told from that one,
and the other, at 0.4 to 0.5 of the contrast, is half vessel: lumens were nine tenths body.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from pipeline.segment._kernels.voxels import extent, rebased
from pipeline.segment.levels import Region, box_from, grey_around
from pipeline.segment.uneven import core_voxels
from solver.grid import Grid

DIM = 0.65
"""Share of the contrast below which a core voxel may be tissue: a vessel whose contrast decays by 60 % has few."""
MOST = 0.5
"""Share of the core that must be so dim."""
TIMES = 1.5
"""Its depth over that of the rest, from which it is no vessel: 1.8 to 3.5 in tissue, 1 in a vessel that decays."""
LOOKED_AT, LEAST = 20_000, 100
"""Core voxels that are looked at, and the least that tell anything."""
DEPTH_VOXELS = 4_000_000
"""Voxels of the box in which depths are measured; of a larger one every second or third along each axis."""


def tissue_in(grid: Grid, region: Region) -> float | None:
    """The grey of tissue that makes most of a region and is far thicker than the vessel in it; None where none does."""
    first, last = extent(region.voxels, grid.shape)
    a, b, c = (int(n) for n in last - first + 1)
    core = core_voxels(region.voxels, grid, first, (a, b, c))
    grey = grey_around(grid, core[:: max(1, len(core) // LOOKED_AT)] + first)
    limit = region.levels.outside + DIM * region.levels.contrast
    dim = grey < limit
    if np.count_nonzero(dim) < max(LEAST, MOST * len(dim)):
        return None
    inside = np.zeros((a, b, c), bool)
    inside.reshape(-1)[rebased(region.voxels, grid.shape, -first, (a, b, c))] = True
    bright = ndimage.uniform_filter(np.asarray(grid.values[box_from(first, (a, b, c))], np.float32), 3) >= limit
    thick, thin = (_depth(inside & part) for part in (~bright, bright))
    return float(np.median(grey[dim])) if thick > TIMES * thin else None


def _depth(part: NDArray[np.bool_]) -> float:
    """Depth of a part of a box, voxels: the 95th percentile of the distances to what is not of it."""
    step = int(np.ceil(np.cbrt(part.size / DEPTH_VOXELS)))
    part = np.pad(part[::step, ::step, ::step], 1)
    return step * float(np.percentile(ndimage.distance_transform_edt(part)[part], 95)) if part.any() else 0.0


def warning(tissue: float | None, vessel: float) -> tuple[str, ...]:
    """One sentence for the report where tissue of some grey hung together with a vessel, of another; or none."""
    if tissue is None:
        return ()
    return (
        f"segment: something of grey {tissue:.0f} that surrounds the vessel, of {vessel:.0f}, or is far thicker, hangs "
        "together with it: it is taken for what lies around it; where it is a part of the vessel that is filled less, "
        "as a sac, scan with the vessel filled, or give the lumen as a file (manifest key lumen)",
    )
