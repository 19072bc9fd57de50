"""Whether a lumen that the user brings goes where the scan's vessel goes, from the entry that both share.

A mirrored or turned one shares its first millimetres: there its wall is right, and no shift or size tells the rest. Two
things do together: much of it has not the vessel's grey, and what has goes on outside of it. A vessel that is
half filled has the first alone, a branch that was left out the second alone.
"""

from collections.abc import Callable, Iterator
from itertools import permutations, product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from pipeline.arrays.grids import indices_of, sampled, spelt, spread
from pipeline.model import Array, Lumen, Volume
from pipeline.segment.shown import LEAST_NOISES

POINTS = 4000
LEAST_NEAR = 10
"""Fewer points deep in the lumen at the entry, or voxels around them, tell no grey."""
DEEP_VOXELS, AROUND_VOXELS = 1.0, (2.0, 4.0)
"""How deep points lie, and how far outside the wall the grey around is taken."""
ASTRAY = 0.2
"""Share of a lumen's inside without the vessel's grey from which it is looked where the vessel goes. In the catalogue's
scenes 0.3 to 1 of lumens flipped or swapped about the entry; of right ones 0, but of branches three voxels across 0.3.
"""
FITS = 0.8
"""Share with the vessel's grey from which other axes are named."""
BETTER = 0.01
"""By how much less simple axes must fit better: a bend in a plane fits two flips alike."""
BLUR_VOXELS = 1.0
RAS = np.diag([-1.0, -1.0, 1.0])


class Greys(NamedTuple):
    """Grey of the vessel and of what is around it, by the entry."""

    vessel: float
    around: float

    def like_vessel(self, grey: NDArray[Any]) -> NDArray[np.bool_]:
        """Which of these greys are the vessel's."""
        return np.asarray(np.abs(grey - self.vessel) < 0.5 * abs(self.vessel - self.around))


def astray(lumen: Lumen, scan: Volume, entry_mm: Array, direction: Array, wider: Callable[[Array], Volume]) -> str:
    """A sentence where a lumen leaves the vessel that a scan shows. wider : the scan around points (n, 3), LPS mm.

    entry_mm, direction : where the wire goes in (3,), LPS mm, and how (3,).
    """
    voxel = float(np.max(scan.spacing_mm))
    points, depth = _deep(lumen, DEEP_VOXELS * voxel)
    away = np.linalg.norm(points - entry_mm, axis=1)
    if len(points) < LEAST_NEAR:
        return ""
    radius = float(depth[away < away.min() + 4.0 * voxel].max())
    near = points[away < away.min() + 1.5 * radius]
    greys = _greys(lumen, scan, near, radius)
    if greys is None:
        return ""
    seen = _within(scan, points)
    share = 1.0 - float(np.mean(greys.like_vessel(_mean_around(scan, points[seen])))) if seen.any() else 0.0
    beyond = _beyond(scan, entry_mm, direction, greys) if share >= ASTRAY else None
    place = None if beyond is None else _left_at(lumen, scan, near, radius, beyond)
    if place is None:
        return ""
    axes = _axes_that_fit(points, entry_mm, greys, wider)
    fits = f": with its coordinates as {axes} it lies in the vessel" if axes else ", and whether it is turned"
    return (
        f"the given lumen lies beside the vessel: {100 * share:.0f} % of its inside has not the grey of the vessel at "
        f"the entry, and that vessel leaves it near [{spelt(place)}] mm; check its axes (LPS or RAS){fits}"
    )


def _deep(lumen: Lumen, least_mm: float) -> tuple[Array, Array]:
    """About POINTS voxels (n, 3), LPS mm, at least so deep in a lumen, and their depth (n,)."""
    grid = lumen.distance
    index = indices_of(np.ascontiguousarray(grid.values < -least_mm))
    index = index[:: max(1, len(index) // POINTS)]
    return grid.to_mm(index), -grid.values[tuple(index.T)].astype(float)


def _within(scan: Volume, points_mm: Array) -> NDArray[np.bool_]:
    """Which places (n, 3) the scan holds with the voxels around them."""
    index = scan.to_index(points_mm)
    return np.asarray(np.all((index >= 1.0) & (index <= np.array(scan.shape) - 2.0), axis=1))


def _mean_around(scan: Volume, points_mm: Array) -> Array:
    """Mean grey (n,) of the voxels at places (n, 3) and their six neighbours: 0.4 of the noise."""
    index = np.rint(scan.to_index(points_mm)).astype(int)
    steps = np.concatenate([np.zeros((1, 3), int), np.eye(3, dtype=int), -np.eye(3, dtype=int)])
    return np.asarray(np.mean([scan.values[tuple((index + step).T)] for step in steps], axis=0, dtype=float))


def _greys(lumen: Lumen, scan: Volume, near_mm: Array, radius_mm: float) -> Greys | None:
    """Grey in the lumen by the entry and around it; None where there are few voxels, or no contrast."""
    voxel = float(np.max(scan.spacing_mm))
    grid, (least, most) = lumen.distance, (n * voxel for n in AROUND_VOXELS)
    shell = grid.to_mm(indices_of(np.ascontiguousarray((grid.values > least) & (grid.values < most))))
    middle = near_mm.mean(axis=0)
    shell = shell[np.linalg.norm(shell - middle, axis=1) < 2.0 * radius_mm + most]
    inside, around = near_mm[_within(scan, near_mm)], shell[_within(scan, shell)]
    if min(len(inside), len(around)) < LEAST_NEAR:
        return None
    found = Greys(float(np.median(_mean_around(scan, inside))), float(np.median(_mean_around(scan, around))))
    noise = spread(scan.values[tuple(np.rint(scan.to_index(around)).astype(int).T)].astype(float))
    return found if abs(found.vessel - found.around) > LEAST_NOISES * noise else None


def _beyond(scan: Volume, entry_mm: Array, direction: Array, greys: Greys) -> NDArray[np.bool_]:
    """Voxels with the vessel's grey beyond the entry: the inlet before it is no way out of the lumen."""
    # noise would lead from voxel to voxel through what is around
    smooth = ndimage.gaussian_filter(scan.values, BLUR_VOXELS, output=np.float32)
    first, steps = (scan.origin_mm - entry_mm) @ direction, (scan.to_mm(np.eye(3)) - scan.origin_mm) @ direction
    along = first + sum(step * index for step, index in zip(steps, np.indices(scan.shape, sparse=True), strict=True))
    return np.asarray(greys.like_vessel(smooth) & (along > 0.0))


def _left_at(lumen: Lumen, scan: Volume, near_mm: Array, radius_mm: float, vessel: NDArray[np.bool_]) -> Array | None:
    """Where (3,), LPS mm, the vessel of the entry first lies outside the lumen; None where less than its width does."""
    voxel = float(np.max(scan.spacing_mm))
    parts, _ = ndimage.label(vessel)
    at = np.rint(scan.to_index(near_mm[_within(scan, near_mm)])).astype(int)
    counts = np.bincount(parts[tuple(at.T)])
    counts[0] = 0
    if not counts.any():
        return None
    distance = sampled(lumen.distance, scan, float(np.max(lumen.distance.values))).values
    out = np.argwhere((parts == np.argmax(counts)) & (distance > AROUND_VOXELS[0] * voxel))
    if len(out) * float(np.prod(scan.spacing_mm)) < 4.0 / 3.0 * np.pi * radius_mm**3:
        return None
    places = scan.to_mm(out)
    return np.asarray(places[np.argmin(np.linalg.norm(places - near_mm.mean(axis=0), axis=1))])


def _axes_that_fit(points_mm: Array, entry_mm: Array, greys: Greys, wider: Callable[[Array], Volume]) -> str:
    """The flip or swap of axes, the simplest of equals, by which a lumen comes to lie in the vessel; empty without."""
    tried = [(named, (points_mm - about) @ turn.T + about) for named, turn, about in _other_axes(entry_mm)]
    scan = wider(np.concatenate([points for _, points in tried]))
    best, fits = FITS, ""
    for named, points in tried:
        seen = _within(scan, points)
        share = np.count_nonzero(greys.like_vessel(_mean_around(scan, points[seen]))) / len(points)
        if share > best + (BETTER if fits else 0.0):
            best, fits = share, named
    return fits


def _other_axes(entry_mm: Array) -> Iterator[tuple[str, Array, Array]]:
    """Flips and swaps of axes, RAS first, then by how much they change: their name, matrix (3, 3) and centre (3,)."""
    orders, flips = permutations(range(3)), list(product((1.0, -1.0), repeat=3))
    turns = [np.diag(signs)[list(order)] for order in orders for signs in flips]
    turns.sort(key=lambda turn: (not np.array_equal(turn, RAS), -np.trace(np.abs(turn)), -turn.sum()))
    for about, where in ((np.zeros(3), ""), (np.array(entry_mm, float), " about the entry")):
        for turn in turns:
            if not np.array_equal(turn, np.eye(3)):
                axes = [("-" if row.sum() < 0.0 else "") + "xyz"[int(np.argmax(np.abs(row)))] for row in turn]
                yield f"({', '.join(axes)}){where}", turn, about
