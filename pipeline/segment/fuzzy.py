"""Segmentation by fuzzy connectedness: the voxels connected to the seeds by similar grey, and their thin branches.

Udupa and Samarasekera, Graph. Models Image Process. 58 (1996) 246.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from pipeline.arrays.grids import spelt, unflattened
from pipeline.segment import valley
from pipeline.segment._kernels.connect import Affinity
from pipeline.segment.around_seed import levels_at
from pipeline.segment.config import SegmentConfig
from pipeline.segment.connect import connect, connect_relative, estimate_affinity, neighbours
from pipeline.segment.levels import GreyLevels, Index, Region, failed, seed_voxels
from pipeline.segment.necks import through_necks
from pipeline.segment.thin import beyond_vessel, branches, low_region
from solver.grid import Grid

LEAST_CONTRAST = 2.0
"""Contrast over the noise of one voxel below which no vessel is looked for (Dice falls below 0.97 at 2.2)."""

_MOVE = "move entry_mm (or lumen_seed_mm, where the case gives it) well into the vessel"
"""entry_mm first: it is the seed of every case that gives no other."""


INVERTED = (
    "; or the vessel is not filled (air, water: darker than what is around it, with a bright wire): give its lumen as "
    "a file (manifest key lumen) and leave the scans as they are; or the scan is inverted, and the wire is dark, too: "
    "turn its grey round"
)
"""An unfilled phantom whose grey is turned round has a dark wire, and no frame of it is traced; with a lumen that was
given, its own scans were traced to 0.02 mm, with a reference and without."""


def _at(grid: Grid, seeds: Index) -> str:
    """Where the seeds lie, and the grey there: a seed beside the vessel is what most often goes wrong."""
    said = [
        f"[{spelt(place)}] mm (LPS), grey {grid.values[tuple(seed)]:.0f}"
        for place, seed in zip(grid.to_mm(seeds), seeds, strict=True)
    ]
    return f"; the seed is at {' and '.join(said[:3])}"


def _start(grid: Grid, seeds: Index, outside: float | None) -> tuple[GreyLevels, Index]:
    """Levels at the seed of greatest contrast over noise, and all the seeds moved to typical grey beside them.

    outside : the grey around the vessel, where that at the seed is not the brightest.
    """
    found = [levels_at(grid, seed, outside) for seed in seeds]
    levels = max((f[0] for f in found), key=lambda a: a.contrast / max(a.noise, 1e-9))
    if not levels.contrast > LEAST_CONTRAST * levels.noise:
        got = f"grey: got {levels.inside:.0f} at the seed, {levels.outside:.0f} around, noise {levels.noise:.0f}"
        got += _at(grid, seeds)
        allowed = "a lumen brighter than its surroundings by twice the noise"
        dark = levels.contrast < -LEAST_CONTRAST * levels.noise  # contrast is inside less outside
        raise failed(got, allowed, f"{_MOVE}{INVERTED * dark}")
    return levels, np.array([f[1] for f in found], np.int64)


def _connected(
    grid: Grid, seeds: Index, levels: GreyLevels, affinity: Affinity, config: SegmentConfig
) -> tuple[Index, float]:
    """Flat indices of the vessel's voxels and the number of voxels read; too few of them are no vessel."""
    offsets = neighbours(config.adjacency)
    if len(config.other_seeds_mm):
        others = seed_voxels(grid, np.array(config.other_seeds_mm))
        order, read = connect_relative(grid, seeds, others, affinity, config.threshold, offsets)
    else:
        order, read = connect(grid, seeds, affinity, config.threshold, offsets)
    if len(order) < config.least_voxels:
        allowed = f"at least {config.least_voxels} voxels (segment.least_voxels)"
        got = f"connected voxels: got {len(order)}{_at(grid, seeds)} (its wall would be at {levels.half:.0f})"
        raise failed(got, allowed, f"{_MOVE}, or lower segment.threshold")
    return order, read


def fuzzy_region(
    grid: Grid,
    seeds_mm: ArrayLike,
    config: SegmentConfig,
    noise_left: tuple[float, ...] | None = None,
    outside: float | None = None,
) -> Region:
    """The vessel that holds the seeds ((m, 3) LPS mm); raises StageError where they lie in none.

    grid : C-contiguous grey, brighter inside the vessel.  noise_left : see ``GreyLevels``, where the grid no longer
    shows it.  outside : see ``_start``.
    """
    levels, seeds = _start(grid, seed_voxels(grid, seeds_mm), outside)
    levels = levels if noise_left is None else replace(levels, noise_left=noise_left)
    affinity = estimate_affinity(levels, config)
    order, read = _connected(grid, seeds, levels, affinity, config)
    low, more = low_region(grid, seeds, levels, affinity)
    total = float(np.prod(grid.shape))
    counters = {
        "voxels_total": total, "voxels_read": read, "voxels_read_again": more, "voxels_skipped": total - read,
    }  # fmt: skip
    region = Region(order, np.zeros(0, np.int64), levels, affinity.taps, counters)
    beyond = None
    if not len(config.other_seeds_mm):  # what lies behind a neck might be what those seeds are to cut off
        region, beyond = through_necks(grid, low, region, affinity, config)
    if len(low) > len(region.voxels):
        found, faint = branches(beyond or beyond_vessel(grid, low, region.voxels, levels, affinity))
        region = valley.with_own(grid, low, region, found)
        region = replace(
            region, faint=tuple(unflattened(np.array([one[len(one) // 2]]), grid.shape)[0] for one in faint)
        )
    counters = {**region.counters, "voxels_visited": float(len(region.voxels)), "voxels_thin": float(len(region.thin))}
    return replace(region, counters=counters)
