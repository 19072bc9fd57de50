"""segment: scan -> lumen. Fuzzy connectedness finds the vessel, its grey values say where the wall lies."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.arrays.axis_order import in_memory_order, reorder
from pipeline.model import Lumen, Volume
from pipeline.segment.affinity import Affinity, Levels, estimate_affinity
from pipeline.segment.config import SegmentConfig
from pipeline.segment.connect import connect, connect_relative, neighbours
from pipeline.segment.contact import contacts, warning
from pipeline.segment.levels import deepest, levels_at, scanner_blur
from pipeline.segment.surface import Site, prepare, signed_distance
from pipeline.segment.thin import add_balls, balls, thin_branches
from pipeline.status import FrameStatus, StageError
from solver.grid import Grid

__all__ = ["segment"]

LEAST_CONTRAST = 2.0
"""Contrast over the noise of one voxel below which no vessel is looked for (Dice falls below 0.97 at 2.2)."""
LEVEL_TOLERANCE = 0.03
"""Change of the wall's level, in contrasts, that is worth a second surface; a smaller one just shifts the wall."""
THIN_TOLERANCE = 0.004
"""The same where no vessel is thick: there level, curvature and blur hang together."""
SURFACE_ROUNDS = 3
"""Surfaces at most beyond the first: only a vessel as thin as its blur, whose plateau is not seen, needs them."""


def _failed(got: str, allowed: str, do: str) -> StageError:
    return StageError(FrameStatus.SEGMENT_FAILED, f"segment: {got}; expected {allowed}; {do}")


def _seed_voxels(grid: Grid, seeds_mm: ArrayLike) -> NDArray[np.int64]:
    """The voxels of the seeds; a seed outside the volume has no lumen."""
    points = np.atleast_2d(np.asarray(seeds_mm, float))
    index = np.rint(grid.to_index(points)).astype(np.int64)
    outside = np.any((index < -1) | (index > np.array(grid.shape)), axis=1)
    if outside.all():
        got = f"seeds: got {np.round(points, 1).tolist()} mm"
        low, high = grid.to_mm([0, 0, 0]), grid.to_mm(np.array(grid.shape) - 1)
        allowed = f"a point inside the scan, {np.round(low, 1).tolist()} to {np.round(high, 1).tolist()} mm"
        raise _failed(got, allowed, "check entry_mm or lumen_seed_mm (LPS mm)")
    return np.asarray(np.clip(index[~outside], 0, np.array(grid.shape) - 1))


def _start(grid: Grid, seeds: NDArray[np.int64]) -> tuple[Levels, NDArray[np.int64]]:
    """Levels at the seed of greatest contrast over noise, and all the seeds moved to typical grey beside them."""
    found = [levels_at(grid, seed) for seed in seeds]
    levels = max((f[0] for f in found), key=lambda a: a.contrast / max(a.noise, 1e-9))
    if not levels.contrast > LEAST_CONTRAST * levels.noise:
        got = f"grey: got {levels.inside:.0f} at the seed, {levels.outside:.0f} around, noise {levels.noise:.0f}"
        allowed = "a lumen brighter than its surroundings by twice the noise"
        raise _failed(got, allowed, "move the seed (lumen_seed_mm) well into the vessel")
    return levels, np.array([f[1] for f in found], np.int64)


def _connected(
    grid: Grid, seeds: NDArray[np.int64], affinity: Affinity, config: SegmentConfig
) -> tuple[NDArray[np.int64], float]:
    """Flat indices of the vessel's voxels and the number of voxels read; too few of them are no vessel."""
    offsets = neighbours(config.adjacency)
    if len(config.other_seeds_mm):
        others = _seed_voxels(grid, np.array(config.other_seeds_mm))
        order, read = connect_relative(grid, seeds, others, affinity, config.threshold, offsets)
    else:
        order, read = connect(grid, seeds, affinity, config.threshold, offsets)
    if len(order) < config.least_voxels:
        allowed = f"at least {config.least_voxels} voxels (segment.least_voxels)"
        got = f"connected voxels: got {len(order)}"
        raise _failed(got, allowed, "move the seed (lumen_seed_mm) or lower segment.threshold")
    return order, read


def _wall(site: Site, levels: Levels, outer_mm: float) -> tuple[NDArray[np.float32], float, dict[str, float]]:
    """Signed distance, the wall's level and counters: the level is taken again from the surface it leads to."""
    values, counters = signed_distance(site, levels, outer_mm)
    for _ in range(SURFACE_ROUNDS):
        again = deepest(site.volume, site.grid.with_values(values), levels, site.taps, counters["blur_mm"])
        thin = -float(values.min()) < 4 * counters["blur_mm"]
        if abs(again.half - levels.half) < (THIN_TOLERANCE if thin else LEVEL_TOLERANCE) * levels.contrast:
            break
        levels = again
        del values  # before the next takes its place in memory
        values, counters = signed_distance(site, levels, outer_mm)
    # what is left of the change moves the wall by change over steepness
    steepness = levels.contrast / (np.sqrt(2 * np.pi) * counters["blur_mm"])
    values += np.float32((again.half - levels.half) / steepness)
    return values, again.half, counters


def segment(volume: Volume, seeds_mm: ArrayLike, config: SegmentConfig | None = None) -> Lumen:
    """The vessel that holds the seeds.

    volume : grey values, brighter inside the vessel.  seeds_mm : (m, 3) LPS mm, points inside it.
    Returns a Lumen whose distance is float32 mm, negative inside, on the vessel's own box; exact to
    ``config.outer_mm`` outside; its warnings name places where two vessels have merged. Raises StageError
    (SEGMENT_FAILED) when the seeds lie in no bright vessel.
    Udupa and Samarasekera 1996 for the connectedness; the wall is the half-level surface, blur corrected.
    """
    config = config or SegmentConfig()
    grid, axes = in_memory_order(volume)
    levels, seeds = _start(grid, _seed_voxels(grid, seeds_mm))
    affinity = estimate_affinity(levels, config.homogeneity_sigma, config.feature_sigma, config.scale)
    order, read = _connected(grid, seeds, affinity, config)
    thin, more = thin_branches(grid, seeds, order, levels, affinity)
    site = prepare(grid, order, affinity.taps, config.margin_mm, thin)
    values, level, counters = _wall(site, levels, config.outer_mm)
    blur = scanner_blur(counters["blur_mm"], affinity.taps, float(np.min(grid.spacing_mm)))
    touching = contacts(site.grid.with_values(values))
    if len(thin):
        found = balls(grid, thin, site.box.corner, levels, blur)
        add_balls(values, np.asarray(grid.spacing_mm), found, config.outer_mm)
    total = float(np.prod(grid.shape))
    counters |= {
        "voxels_total": total, "voxels_read": read, "voxels_read_again": more, "voxels_skipped": total - read,
        "voxels_visited": float(len(order)), "voxels_thin": float(len(thin)),
        "touching_places": float(len(touching)),
        "noise": levels.noise, "scanner_blur_mm": blur,
    }  # fmt: skip
    distance, mask = site.grid.with_values(values), site.grid.with_values((values < 0).view(np.uint8))
    return Lumen(reorder(distance, axes), reorder(mask, axes), level, warning(touching), counters)
