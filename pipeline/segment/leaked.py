"""A vessel that hangs together with tissue: between two tissues, the brighter one is what surrounds it.

With its entry in the darker of two, as in gel beside plastic or in fat beside muscle, a vessel is told from that one,
and the other, at 0.4 to 0.5 of the contrast, is half vessel: lumens were nine tenths body.
"""

import numpy as np
from scipy import ndimage

from pipeline.arrays.grids import unflattened
from pipeline.segment._kernels.voxels import extent
from pipeline.segment.levels import Index, Region, grey_around
from pipeline.segment.uneven import core_voxels
from solver.grid import Grid

DIM = 0.65
"""Share of the contrast below which a core voxel may be tissue: a vessel whose contrast decays by 60 % has few."""
MOST = 0.5
"""Share of the core that must be so dim."""
TIMES = 1.5
"""Its depth over that of the rest, from which it is no vessel: 1.8 to 3.5 in tissue, 1 in a vessel that decays."""
LOOKED_AT, LEAST = 20_000, 100


def tissue_in(grid: Grid, region: Region) -> float | None:
    """The grey of tissue that makes most of a region and is far thicker than the vessel in it; None where none does."""
    first, last = extent(region.voxels, grid.shape)
    shape = tuple(int(n) for n in last - first + 1)
    core = core_voxels(region.voxels, grid, first, shape)
    grey = grey_around(grid, core[:: max(1, len(core) // LOOKED_AT)] + first)
    limit = region.levels.outside + DIM * region.levels.contrast
    dim = grey < limit
    if np.count_nonzero(dim) < max(LEAST, MOST * len(dim)):
        return None
    index = unflattened(region.voxels, grid.shape)
    bright = grey_around(grid, index) >= limit
    thick, thin = (_depth(index[part] - first, shape) for part in (~bright, bright))
    return float(np.median(grey[dim])) if thick > TIMES * thin else None


def _depth(index: Index, shape: tuple[int, ...]) -> float:
    """Depth of a part (n, 3) of a box, voxels: the 95th percentile of the distances to what is not of it."""
    part = np.zeros(tuple(n + 2 for n in shape), bool)
    part[tuple((index + 1).T)] = True
    return float(np.percentile(ndimage.distance_transform_edt(part)[part], 95)) if len(index) else 0.0


def warning(tissue: float | None, vessel: float) -> tuple[str, ...]:
    """One sentence for the report where tissue of some grey hung together with a vessel, of another; or none."""
    if tissue is None:
        return ()
    return (
        f"segment: something of grey {tissue:.0f} that is far thicker than the vessel, of {vessel:.0f}, hangs together "
        "with it: it is taken for what surrounds it; where it is a part of the vessel that is filled less, as a sac, "
        "scan with the vessel filled, or give the lumen as a file (manifest key lumen)",
    )
