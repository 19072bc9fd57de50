"""segment: scan -> lumen. A method finds the vessel's voxels, its grey values say where the wall lies."""

import numpy as np
from numpy.typing import ArrayLike

from pipeline.arrays.grids import in_memory_order, reorder
from pipeline.model import Lumen, Volume
from pipeline.segment import bone, uneven
from pipeline.segment.config import SegmentConfig
from pipeline.segment.contact import contacts, warning
from pipeline.segment.fuzzy import fuzzy_region
from pipeline.segment.levels import brighter, scanner_blur
from pipeline.segment.necks import add_necks, closed_necks
from pipeline.segment.surface import prepare, wall_of
from pipeline.segment.thin import add_balls, balls
from pipeline.segment.uneven import evened
from solver.grid import read_only

__all__ = ["segment"]

METHOD = fuzzy_region
"""How the vessel's voxels are found: (grid, seeds_mm, config) -> Region."""


def segment(volume: Volume, seeds_mm: ArrayLike, config: SegmentConfig | None = None) -> Lumen:
    """The vessel that holds the seeds.

    volume : grey values, brighter inside the vessel.  seeds_mm : (m, 3) LPS mm, points inside it.
    Returns a Lumen whose distance is float32 mm, negative inside, on the vessel's own box; exact to
    ``config.outer_mm`` outside; its warnings name places where two vessels have merged. Raises StageError
    (SEGMENT_FAILED) when the seeds lie in no bright vessel. The wall is the half-level surface, blur corrected.
    """
    config = config or SegmentConfig()
    grid, axes = in_memory_order(volume)
    region = METHOD(grid, seeds_mm, config)
    grid, region, least = evened(grid, region, lambda shown: METHOD(shown, seeds_mm, config))
    site = prepare(grid, region.voxels, region.taps, config.margin_mm, region.thin)
    wall = wall_of(site, region.levels, config.outer_mm)
    blur = scanner_blur(wall.blur_mm, region.taps, float(np.min(grid.spacing_mm)))
    open_ones = contacts(site.grid.with_values(read_only(wall.values)))
    bright = bone.touching(grid, site.grid.with_values(read_only(wall.values)), site.corner, wall.levels)
    if len(region.thin):
        found = balls(grid, region.thin, site.corner, region.levels, blur)
        add_balls(wall.values, np.asarray(grid.spacing_mm), found, config.outer_mm)
    said = warning(open_ones) + brighter(wall.levels) + bright + uneven.warning(least)
    box = wall.values, site.corner
    said += add_necks(region.necks, box, grid, region.levels, blur)
    said += add_necks(closed_necks(*box, grid, config.least_voxels), box, grid, region.levels, blur)
    distance = reorder(site.grid.with_values(read_only(wall.values)), axes)
    return Lumen(
        distance, wall.levels.half, said,
        {**region.counters, **wall.counters, "touching_places": float(len(open_ones))},
        {"noise": region.levels.noise, "wall_noise_mm": wall.noise_mm, "blur_mm": wall.blur_mm,
         "scanner_blur_mm": blur, "least_filling": least},
    )  # fmt: skip
