"""Which thin branches are the vessel's own, and which a thin vessel that passes by beside it.

At the faintest grey at which branches are followed, a vessel two voxels beside another is connected to it: their blurs
meet. A branch leads into the vessel at its own grey, or ends there; beside a vessel that passes by the grey falls, and
it goes on both ways.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from skimage.measure import label

from pipeline.arrays.grids import spelt, unflattened
from pipeline.arrays.jets import smooth_voxels
from pipeline.segment.levels import Index, Region
from pipeline.segment.thin import SKIRT
from solver.grid import Array, Grid

BRIGHT = 0.95
"""Quantile of its voxels' grey that counts as a branch's: most lie on its flanks."""
HELD = 0.75
"""Share of a branch's grey that is found all the way to the vessel. Between tubes of 1.7 voxels radius, blurred by 0.8
voxel, it falls to 0.4 of the thin one's over a gap of 1.7 voxels."""
CONNECTED = 0.1
"""Share of a branch's bright voxels that are connected to the vessel: noise breaks a faint branch up."""
NEAR = SKIRT + 1.0
"""Voxels from the vessel up to which a branch may be leading into it."""
WINDOW = 18
"""Voxels around such a place that are looked at."""
MOST_TRIED = 12
"""Such places of a branch that are looked at, the nearest first: a root is among these."""
BOTH_WAYS = 5.0
"""How far a branch goes on both ways from there if it passes by: a root is two voxels deep."""


@dataclass(frozen=True, eq=False)
class _Low:
    """What is connected to a vessel at the faintest grey: its voxels, flat and (n, 3), and which are the vessel's."""

    grid: Grid
    region: Region
    flat: Index
    places: Index
    of_vessel: NDArray[np.bool_]


def with_own(grid: Grid, low: Index, region: Region, branches: list[Index]) -> Region:
    """The region with those of the branches (flat voxels each) that do not just pass by, and where the others do.

    low : flat voxels, of ``low_region``.
    """
    if not branches:
        return region
    low = np.sort(low)
    all_of = _Low(grid, region, low, unflattened(low, grid.shape), np.isin(low, region.voxels))
    tree = cKDTree(all_of.places[all_of.of_vessel])
    own, others = [region.thin], []
    for branch in branches:
        points = unflattened(branch, grid.shape)
        if _leads_in(all_of, tree, points):
            own.append(branch)
        else:
            others.append(points[np.argmin(tree.query(points)[0])])
    return replace(region, thin=np.concatenate(own), passing=tuple(others))


def warning(grid: Grid, passing: Sequence[Index]) -> tuple[str, ...]:
    """One sentence for the report on the thin vessels that pass by, or none. passing : where they do, voxels."""
    if not passing:
        return ()
    place, count = f"at [{spelt(grid.to_mm(passing[0]))}] mm", len(passing)
    first = f"the first {place}" if count > 1 else place
    return (
        f"segment: {count} thin vessel{'s' * (count > 1)} beside the lumen {'are' if count > 1 else 'is'} taken for no "
        f"branch of it, as the grey falls between them ({first}); look at the picture; if this is a branch, give the "
        "lumen as a file (manifest key lumen)",
    )


def _leads_in(low: _Low, vessel: cKDTree, branch: Index) -> bool:
    """Whether a branch, voxels (n, 3), leads into the vessel anywhere; true, too, where it is nowhere near."""
    away = np.asarray(vessel.query(branch)[0])
    near = away <= max(NEAR, float(away.min()))
    places = islice(_apart(branch[near], away[near]), MOST_TRIED)
    return any(not _passes_by(low, branch, place) for place in places)


def _apart(points: Index, away: Array) -> Iterator[Index]:
    """Points (n, 3) half a window apart from each other, the nearest to the vessel first."""
    left = np.ones(len(points), bool)
    while left.any():
        place = points[np.argmin(np.where(left, away, np.inf))]
        left &= np.linalg.norm(points - place, axis=1) > WINDOW / 2
        yield place


def _passes_by(low: _Low, branch: Index, place: Index) -> bool:
    """Whether a branch goes on to both sides of a place and is not connected to the vessel there at its own grey."""
    first, last = np.maximum(place - WINDOW, 0), np.minimum(place + WINDOW + 1, low.grid.shape)
    here = branch[_within(branch, first, last)]
    if not _goes_both_ways(here - place, _at_edge(here, low.grid.shape)):
        return False
    slab = slice(*np.searchsorted(low.flat, np.array([first[0], last[0]]) * int(np.prod(low.grid.shape[1:]))))
    near = _within(low.places[slab], first, last)
    flat, places, of_vessel = (of[slab][near] for of in (low.flat, low.places, low.of_vessel))
    share = np.zeros(last - first, np.float32)
    seen = smooth_voxels(low.grid.values, low.region.taps, flat)
    share[tuple((places - first).T)] = low.region.levels.share(seen)
    own = share[tuple((here - first).T)]
    least = HELD * np.quantile(own, BRIGHT)
    number = np.asarray(label(share >= least, connectivity=3))
    vessel = np.setdiff1d(number[tuple((places[of_vessel] - first).T)], 0)
    return bool(np.mean(np.isin(number[tuple((here - first).T)], vessel)[own >= least]) < CONNECTED)


def _within(points: Index, first: Index, last: Index) -> NDArray[np.bool_]:
    return np.asarray(np.all((points >= first) & (points < last), axis=1))


def _at_edge(points: Index, shape: tuple[int, ...]) -> bool:
    """Whether points (n, 3) come so near to the scan's edge that nobody sees how they go on."""
    return bool(np.any((points < NEAR) | (points >= np.array(shape) - NEAR)))


def _goes_both_ways(offsets: Index, unseen: bool) -> bool:
    """Whether a branch, as offsets (n, 3) from a place, goes on to both sides. unseen : one end is not seen."""
    heading = np.linalg.svd(offsets - offsets.mean(axis=0), full_matrices=False)[2][0]
    along = offsets @ heading
    far = min if not unseen else max
    return bool(far(float(along.max()), float(-along.min())) >= BOTH_WAYS)
