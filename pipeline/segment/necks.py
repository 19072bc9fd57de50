"""A vessel that goes on behind a neck too narrow to reach half the contrast: found by its axis, and opened.

A stenosis of one voxel radius peaks at a third of the contrast: connectedness ends there, and with it the lumen. The
other part of the vessel is as bright, connected to it at a lower grey, and lies straight ahead of its end; a vessel or
a bone that touches its flank does not.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.arrays.grids import spelt, unflattened
from pipeline.arrays.jets import Blurred, smooth_voxels, values_at
from pipeline.arrays.lattice import sparse_zeros
from pipeline.arrays.polyline import across
from pipeline.segment._kernels.connect import Affinity
from pipeline.segment._kernels.solids import cones
from pipeline.segment._kernels.voxels import components, gaps, shell
from pipeline.segment.config import SegmentConfig
from pipeline.segment.connect import connect, neighbours
from pipeline.segment.contact import inside_of
from pipeline.segment.levels import BRIGHTER, GreyLevels, Index, Region, Vessel
from pipeline.segment.surface import boxed
from pipeline.segment.thin import CREST_VOXELS, FULL, LEAST_RADIUS, Beyond, beyond_vessel
from solver.grid import Array, Grid

REACH = 14.0
"""Longest neck, voxels from end to end."""
WINDOW = 18.0
"""Voxels around an end of a vessel from which its direction is taken: more than vessels are thick."""
ROOT = 4.0
"""Voxels around an end over which its middle is taken."""
MOST_NECKS, MOST_TRIED = 4, 8
"""Necks that are passed, and ends that are tried for each."""
MOST_BEYOND = 200_000
"""Most bright voxels that may lie beyond the vessel: more are other tissue."""
SIDE_VOXELS = 2.0
"""How far off the straight way between two ends the neck's axis is looked for."""


def _points(flat: Index, grid: Grid) -> Array:
    """Indices (n, 3) of flat voxels, as floats."""
    return unflattened(flat, grid.shape).astype(float)


def _nearest(tree: cKDTree, points: Array) -> tuple[Array, Index]:
    """Distance (n,) from points (n, 3) to the nearest point of a tree, infinite beyond REACH, and its position."""
    away, at = tree.query(points, distance_upper_bound=REACH)
    return np.asarray(away, float), np.asarray(at, np.int64)


def _shell(flat: Index, grid: Grid) -> Index:
    """The voxels (flat) that have a 6-neighbour outside the set: the one nearest to a voxel outside is of these."""
    return np.asarray(flat[shell(boxed(flat, grid))])


def runs_along(points: Array, end: Array, heading: Array) -> bool:
    """Whether a vessel, voxels (n, 3), extends further along a heading (3,) than across it, near its ``end`` (3,)."""
    near = points[np.linalg.norm(points - end, axis=1) < WINDOW]
    spread = np.cov(near.T)
    side = np.eye(3) - np.outer(heading, heading)
    return bool(heading @ spread @ heading > np.linalg.eigvalsh(side @ spread @ side)[-1])


def _middle(points: Array, end: Array) -> Array:
    """The centroid (3,) of a vessel's voxels (n, 3) within ROOT of its ``end`` (3,)."""
    return np.asarray(points[np.linalg.norm(points - end, axis=1) < ROOT].mean(axis=0))


def _axis(grid: Grid, start: Array, stop: Array) -> Array:
    """The axis (n, 3) of a neck, voxels: the brightest points beside the straight way from ``start`` to ``stop``."""
    way = stop - start
    share = np.linspace(0.0, 1.0, int(np.ceil(2.0 * np.linalg.norm(way))) + 1)
    u, v = across(way / np.linalg.norm(way))
    steps = np.arange(-SIDE_VOXELS, SIDE_VOXELS + 0.1, 0.5)
    beside = (steps[:, None, None] * u + steps[None, :, None] * v).reshape(-1, 3)
    places = start + share[:, None, None] * way + beside
    seen = values_at(Blurred(grid.values, np.ones(3), CREST_VOXELS), places.reshape(-1, 3)).reshape(len(share), -1)
    # a place off the straight way is marked down, per voxel^2, by what noise may gain there
    seen = seen - 0.02 * np.ptp(seen) * np.sum(beside**2, axis=1)
    best = places[np.arange(len(share)), np.argmax(seen, axis=1)]
    window = np.ones(3) / 3.0
    inner = np.stack([np.convolve(best[:, a], window, "valid") for a in range(3)], axis=1)
    return np.concatenate([best[:1], inner, best[-1:]])


def _next(grid: Grid, beyond: Beyond, region: Region, affinity: Affinity, config: SegmentConfig) -> Region | None:
    """The region with what lies behind one neck; None where there is none."""
    levels, taps = region.levels, affinity.taps
    left = beyond.voxels[beyond.share >= FULL]
    if not config.least_voxels <= len(left) <= MOST_BEYOND:
        return None
    edge = _shell(left, grid)
    gap = gaps(edge, _shell(region.voxels, grid), grid.shape, REACH)
    tried = sparse_zeros((int(np.prod(grid.shape)),), np.bool_)

    @cache
    def vessel() -> tuple[Array, cKDTree]:
        """Made only for what is not bone."""
        own = _points(region.voxels, grid)
        return own, cKDTree(own)

    for _ in range(MOST_TRIED):
        n = int(np.argmin(gap)) if len(gap) else -1
        if n < 0 or not np.isfinite(gap[n]):
            break
        seed = unflattened(edge[n : n + 1], grid.shape)
        more, read = connect(grid, seed, affinity, config.threshold, neighbours(config.adjacency))
        tried[more] = True
        gap[tried[edge]] = np.inf
        gap[n] = np.inf
        neck = _neck(grid, vessel, more, levels, taps) if len(more) >= config.least_voxels else None
        if neck is not None:
            counters = {**region.counters, "voxels_read_again": region.counters["voxels_read_again"] + read}
            both = np.concatenate([region.voxels, more])
            return replace(region, voxels=both, necks=(*region.necks, neck), counters=counters)
    return None


def _neck(
    grid: Grid, vessel: Callable[[], tuple[Array, cKDTree]], more: Index, levels: GreyLevels, taps: NDArray[np.float32]
) -> Array | None:
    """The axis of the neck from the vessel to what is beyond; None where that is no other part of it."""
    core = smooth_voxels(grid.values, taps, more[:: max(1, len(more) // 2000)])
    if np.quantile(core, 0.75) > levels.outside + BRIGHTER * levels.contrast:  # bone
        return None
    own, tree = vessel()
    beyond = _points(more, grid)
    gap, at = _nearest(tree, beyond)
    n = int(np.argmin(gap))
    return _ahead(grid, (own, own[at[n]]), (beyond, beyond[n])) if np.isfinite(gap[n]) else None


def through_necks(
    grid: Grid, low: Index, region: Region, affinity: Affinity, config: SegmentConfig
) -> tuple[Region, Beyond | None]:
    """The region with all that lies behind its necks, and what is left beyond it, where that is known.

    low : flat indices of what is connected to it at a lower grey.
    """
    while len(low) and len(region.necks) < MOST_NECKS:
        beyond = beyond_vessel(grid, low, region.voxels, region.levels, affinity)
        grown = _next(grid, beyond, region, affinity, config)
        if grown is None:
            return region, beyond
        region = grown
    return region, None


def closed_necks(vessel: Vessel, least: int) -> list[Array]:
    """The axes of necks that are open to connectedness, but closed in the signed distance.

    The wall is looked for in smoothed grey: a neck of 1.0 to 1.4 voxels radius reaches half the contrast before the
    smoothing, and not after. least : voxels that a part must have.
    """
    flat, inner = inside_of(vessel.distance.values)
    number = components(inner)
    large = np.flatnonzero(np.bincount(number) >= least)
    if len(large) < 2:
        return []
    voxels = unflattened(flat, vessel.distance.shape) + vessel.corner
    necks: list[Array] = []
    pieces = sorted((voxels[number == n] for n in large), key=len, reverse=True)
    whole, left = pieces[0].astype(float), [p.astype(float) for p in pieces[1:]]
    while left:
        tree = cKDTree(whole)
        found = [_nearest(tree, piece) for piece in left]
        n = int(np.argmin([gap.min() for gap, _ in found]))
        gap, at = found[n]
        first = int(np.argmin(gap))
        if not np.isfinite(gap[first]):
            break
        piece = left.pop(n)
        axis = _ahead(vessel.scan, (whole, whole[at[first]]), (piece, piece[first]))
        if axis is not None:
            necks.append(axis)
            whole = np.concatenate([whole, piece])
    return necks


def _ahead(grid: Grid, here: tuple[Array, Array], there: tuple[Array, Array]) -> Array | None:
    """The axis of a neck between two parts, each voxels (n, 3) and its end (3,); None where they are not in line."""
    start, stop = _middle(*here), _middle(*there)
    heading = (stop - start) / np.linalg.norm(stop - start)
    on = runs_along(*here, heading) and runs_along(*there, heading)
    return _axis(grid, start, stop) if on else None


def add_necks(necks: Sequence[Array], vessel: Vessel, distance: NDArray[np.float32], blur_mm: float) -> tuple[str, ...]:
    """Lower the vessel's signed ``distance`` to that of the union with the necks; returns a sentence for each.

    blur_mm : the scanner's.
    """
    grid, spacing = vessel.scan, vessel.scan.spacing_mm
    sigma, said = CREST_VOXELS * grid.voxel_mm, []
    whole = float(np.hypot(blur_mm, sigma))
    for neck in necks:
        peak = values_at(Blurred(grid.values, spacing, sigma), neck * spacing)
        share = np.clip(vessel.levels.share(peak), 0.0, 0.75)
        radius = np.maximum(whole * np.sqrt(-2.0 * np.log1p(-share)), LEAST_RADIUS * grid.voxel_mm)
        at = (neck - vessel.corner) * spacing
        cones(at[:-1], at[1:], radius[:-1], radius[1:], spacing, float(distance.max()), distance)
        n = int(np.argmin(radius))
        said.append(_said(grid.to_mm(neck[n]), float(radius[n])))
    return tuple(said)


def _said(place_mm: Array, radius_mm: float) -> str:
    """What the report says of a neck."""
    where = spelt(place_mm)
    return (
        f"segment: the vessel narrows to a radius of about {radius_mm:.2f} mm at {where} mm, too thin for a wall; it "
        "was followed to what lies straight behind: look whether this is one vessel, or give the lumen as a file "
        "(manifest key lumen)"
    )
