"""The grey levels and the noise around one seed: of the vessel, and of what surrounds it."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from pipeline.segment.groups import two_groups
from pipeline.segment.levels import GreyLevels, box_around, median
from pipeline.segment.noise import noise_left, smoothed, voxel_noise
from solver.grid import Grid

BOXES_MM = 6.0, 10.0, 17.0, 30.0
"""Half widths of the box around a seed in which the levels are estimated, the next where the vessel fills one: of a
carotid artery and what is around it, up to an aorta, of which the first holds nothing but its own noise."""
LEAST_BOX = 8
"""Its least half width in voxels."""
EDGE, APART, WIDE = 0.25, 1.0, 0.2
"""Share of the contrast below the seed's grey from which a voxel is not the vessel's. Then how far apart two greys
around it are, over the brighter one's distance from the vessel, and the least share of the box that the brighter one
fills: medium that has settled is a vessel's second grey, and must be none that surrounds it."""
LEAST_DARK = 0.05
"""Least share of the box that lies off the vessel, two voxels from anything as bright."""
ALIKE = 0.05
"""Share of the contrast by which levels of a box and of a larger one may differ to be the same."""
STEP = 0.3
"""Least part of the contrast that lies between the two voxels inside a wall and the two outside it: 0.6 at a blur of a
voxel. In a vessel of 9 mm that is 10 % brighter in its middle 0.2 lies between that and what is around it."""


class _Levels(NamedTuple):
    """Median grey of the bright region that holds the seed, that of what is darker, the region, and how much of its
    wall is seen: 0 where little is darker, 1 where enough is, 2 where grey falls to that in a step."""

    inside: float
    outside: float
    region: NDArray[np.bool_]
    seen: int


def _surroundings(grey: NDArray[Any], seed: float) -> tuple[float, float]:
    """A first guess of what surrounds the vessel, and the grey below which voxels are no part of that.

    Of two well apart it is the brighter: the other may be air, or what lies beyond a round field of view. They are
    apart by Ashman's D, as two greys of a vessel are, and by as much as the brighter one is from the vessel.
    """
    darkest = float(np.percentile(grey, 10))
    clear = ~ndimage.binary_dilation(grey > seed - EDGE * (seed - darkest), iterations=2)
    dark = grey[clear]
    if dark.size < LEAST_DARK * grey.size:
        return darkest, -np.inf
    bright, bottom, top, apart = two_groups(dark)
    if np.count_nonzero(bright) < WIDE * grey.size or not top - bottom >= max(apart, APART * (seed - top)):
        return darkest, -np.inf
    return top, 0.5 * (bottom + top)


def _two_levels(grey: NDArray[Any], seed: float, at: tuple[int, ...], known: float | None) -> _Levels:
    """The two levels in a box, by fixed point. known : the outer one, where it is.

    The region's median is held near the seed's grey, lest bone that touches it be taken for the vessel.
    """
    outside, floor = _surroundings(grey, seed) if known is None else (known, np.inf)
    inside = seed
    region = apart = np.zeros(grey.shape, bool)
    for _ in range(6):
        bright = grey > 0.5 * (inside + outside)
        if not bright[at]:
            break
        labels, _ = ndimage.label(bright)
        region = labels == labels[at]
        whole = median(grey[region], inside)
        inside = median(grey[ndimage.binary_erosion(region)], whole)
        inside = min(inside, seed + 0.5 * (seed - outside))
        apart = ~ndimage.binary_dilation(bright, iterations=2)
        outside = median(grey[apart & (grey > floor)], outside)
    dark = bool(np.mean(apart) >= LEAST_DARK)
    seen = dark + (dark and _step(grey, region) >= STEP * (inside - outside))
    return _Levels(inside, outside, region, seen)


def _step(grey: NDArray[Any], region: NDArray[np.bool_]) -> float:
    """Grey in the two voxels inside a region's edge, less that in the two outside it; NaN where it has no edge."""
    within = region & ~ndimage.binary_erosion(region, iterations=2, border_value=1)
    around = ndimage.binary_dilation(region, iterations=2) & ~region
    return median(grey[within], np.nan) - median(grey[around], np.nan)


def levels_at(grid: Grid, index: NDArray[Any], outside: float | None = None) -> tuple[GreyLevels, NDArray[np.int64]]:
    """GreyLevels around one seed voxel, and the voxel (3,) to start at: that of median smoothed grey among its 3^3.

    outside : the grey around the vessel, where it is known.
    """
    most, smaller = -1, None
    for half in BOXES_MM:
        now, at, seen = _levels_in(grid, box_around(grid, index, half, LEAST_BOX), index, outside)
        if smaller is not None and seen == most == 1 and _alike(now, smaller):
            break  # a wall without a step: beyond it a larger box sees the body's own, against air
        if seen > most:
            levels, found, most = now, at, seen
        if seen == 2:
            break
        smaller = now
    return levels, found


def _alike(one: GreyLevels, other: GreyLevels) -> bool:
    """Whether both levels of two boxes are the same."""
    return max(abs(one.inside - other.inside), abs(one.outside - other.outside)) < ALIKE * other.contrast


def _levels_in(
    grid: Grid, box: tuple[slice, slice, slice], index: NDArray[Any], known: float | None
) -> tuple[GreyLevels, NDArray[np.int64], int]:
    """What ``levels_at`` returns, of a box around the seed, and how much of the wall is seen in it."""
    raw = np.asarray(grid.values[box], np.float32)
    grey = smoothed(raw)
    start = np.array([s.start for s in box])
    # a seed may be half a voxel off, and a wire may lie on it: the median of 3^3 voxels is the lumen's still
    near = box_around(grid, index, 0.0, 1)
    inner = tuple(slice(s.start - o, s.stop - o) for s, o in zip(near, start, strict=True))
    around = grey[inner]
    seed = float(np.median(around))
    best = np.unravel_index(int(np.argmin(np.abs(around - seed))), around.shape)
    at = tuple(int(b) + s.start for b, s in zip(best, inner, strict=True))
    inside, outside, region, seen = _two_levels(grey, seed, at, known)
    found = start + np.array(at)
    noise = voxel_noise(raw - grey, region)
    left = noise_left(raw, region, grey > 0.5 * (inside + outside), noise)
    return GreyLevels(inside, outside, noise, left, tuple(found.tolist()), inside), found, seen
