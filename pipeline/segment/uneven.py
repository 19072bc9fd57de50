"""Vessels whose contrast is not the same everywhere: the medium settles, mixes or decays along the vessel.

The local level is measured in the lumen's core, block by block, and carried on by a few millimetres. The contrast is
divided by it, and the vessel is segmented again, until it no longer grows.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from pipeline.arrays.grids import spread, unflattened
from pipeline.segment._kernels.voxels import eroded, extent, rebased
from pipeline.segment.contact import numbered
from pipeline.segment.levels import GreyLevels, Index, Region, box_from
from solver.grid import Array, Grid, read_only

BLOCK = 5
"""Edge of a block, voxels."""
CORE = 2
"""Voxels that a core lies inside the region: deeper than the wall's blur."""
LEAST = 12
"""Least number of core voxels in a block whose median is believed."""
EVEN = 0.82
"""Share of the contrast that all blocks reach in a vessel that is filled evenly."""
SURE = 3.0
"""Standard deviations by which a block is below EVEN before the vessel is called unevenly filled."""
LOWEST, HIGHEST = 0.25, 1.1
"""Shares of the contrast to which levels are clipped: brighter is bone or metal, darker is tissue."""
SMOOTH = 0.7
"""Standard deviation, in blocks, of the Gaussian that smooths the levels."""
CARRIED_BLOCKS = 2
"""How far beyond the last block with a core a level is carried."""
GROWN = 1.01
"""Growth of the region from one round to the next below which it counts as whole."""
ROUNDS = 8
"""Rounds at most; each takes the lumen on by CARRIED_BLOCKS."""


@dataclass(frozen=True, eq=False)
class Filling:
    """Share of the contrast in each block of the box that begins at ``corner``.

    least : the lowest of any block with a core, plus SURE standard deviations; 1 at most.
    """

    share: Array
    corner: Index
    least: float


def core_voxels(voxels: Index, grid: Grid, low: Index, shape: tuple[int, ...]) -> Index:
    """Indices (n, 3), in the box that begins at ``low``, of the voxels that lie CORE layers inside; ascending."""
    wider = shape[0] + 2, shape[1] + 2, shape[2] + 2
    flat = np.sort(rebased(voxels, grid.shape, 1 - low, wider))
    return unflattened(eroded(numbered(wider, flat), CORE), wider) - 1


def filling(grid: Grid, region: Region) -> Filling:
    """The share of the contrast that the vessel has, block by block, measured in its core."""
    first, last = extent(region.voxels, grid.shape)
    margin = CARRIED_BLOCKS * BLOCK + CORE
    low = np.maximum(first - margin, 0)
    high = np.minimum(last + margin + 1, grid.shape)
    core = core_voxels(region.voxels, grid, low, tuple(int(n) for n in high - low))
    shape = tuple(int(-(-n // BLOCK)) for n in high - low)
    if len(core) == 0:
        return Filling(np.ones(shape), low, 1.0)
    grey = region.levels.share(grid.values[tuple((core + low).T)].astype(float))
    block: Index = np.asarray(np.ravel_multi_index(tuple((core // BLOCK).T), shape), np.int64)
    order = np.lexsort((grey, block))
    block, grey = block[order], grey[order]
    name, first, count = (np.asarray(a) for a in np.unique(block, return_index=True, return_counts=True))
    good = count >= LEAST
    level = np.clip(grey[first + count // 2], LOWEST, HIGHEST)[good]
    if not good.any():
        return Filling(np.ones(shape), low, 1.0)
    sums, weight = np.zeros(int(np.prod(shape))), np.zeros(int(np.prod(shape)))
    sums[name[good]], weight[name[good]] = level * count[good], count[good]
    top, below = (ndimage.gaussian_filter(a.reshape(shape), SMOOTH, mode="constant") for a in (sums, weight))
    known = below > 1e-3 * float(weight.max())
    share = np.where(known, top / np.maximum(below, 1e-9), 1.0)
    # the scatter of blocks about the mean of their neighbours is the noise of their levels, correlated or not
    least = level + SURE * spread(level - share.reshape(-1)[name[good]])
    away, at = ndimage.distance_transform_edt(~known, return_indices=True)
    carried = share[tuple(at)]
    share = np.where(away <= CARRIED_BLOCKS, carried, 1.0)
    return Filling(np.asarray(share, float), low, min(1.0, float(least.min())))


def filled(grid: Grid, levels: GreyLevels, found: Filling) -> Grid:
    """The grid as if the vessel had its full contrast everywhere: grey above ``outside`` over the local share."""
    shape = np.minimum(np.array(found.share.shape) * BLOCK, np.array(grid.shape) - found.corner)
    step, first = np.full(3, 1.0 / BLOCK), 0.5 / BLOCK - 0.5
    share = ndimage.affine_transform(found.share, step, first, tuple(shape), order=1, mode="nearest")
    values = np.array(grid.values, np.float32)
    box = box_from(found.corner, shape)
    out = np.float32(levels.outside)
    values[box] = out + (values[box] - out) / np.minimum(share, 1.0).astype(np.float32)
    return grid.with_values(read_only(values))


def evened(grid: Grid, region: Region, again: Callable[[Grid], Region]) -> tuple[Grid, Region, float]:
    """Grid and region of the vessel, its contrast evened out where it varies, and the least share of contrast in it.

    again : segments another grid from the same seeds.
    """
    found = filling(grid, region)
    if found.least >= EVEN:
        return grid, region, found.least
    shown = grid
    for _ in range(ROUNDS):
        shown = filled(grid, region.levels, found)
        grown = again(shown)
        growth = len(grown.voxels) / len(region.voxels)
        region = replace(grown, levels=region.levels)
        if growth < GROWN:
            break
        found = filling(grid, region)
    return shown, region, found.least


def warning(least: float) -> tuple[str, ...]:
    """One sentence for the report, or none."""
    if least >= EVEN:
        return ()
    return (
        f"segment: the vessel's contrast falls to {100 * least:.0f} % in it, allowed {100 * EVEN:.0f} %; its wall "
        "was taken half way to the local level: look whether the lumen is whole, or scan again with the vessel filled",
    )
