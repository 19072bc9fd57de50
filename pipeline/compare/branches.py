"""Which branch of the vessel a point lies in: the lumen as a graph of slices at equal path length from the entry.

Slices that follow each other one by one are a branch; where a slice has two after it, or two before it, branches meet
(the Reeb graph of the path length). A dead end that is short against the vessel beside it (a bump, a flat sac) is part
of that vessel.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skimage.measure import label

from pipeline.compare.ways import cheapest_ways, nearest
from pipeline.model import Array
from solver import Grid

SLICE_VOXELS = 2.0
"""Thickness of a slice: two, so that neighbours of neighbours are never in the same one."""
BUMP_RADII = 2.0
"""A dead end that is shorter than so many radii of the vessel that it leaves is no branch."""
Labels = NDArray[np.integer[Any]]


@dataclass(frozen=True, eq=False)
class Branches:
    """inside_mm (n, 3) : the lumen's voxels.     names (n,) : the number of the branch of each.

    meetings : where branches meet, middle (3,) mm, radius in mm, and the names of those that do.
    """

    inside_mm: Array
    names: Labels
    meetings: tuple[tuple[Array, float, frozenset[int]], ...]

    def at(self, point_mm: Array) -> set[int]:
        """The branches that a point lies in: one, or all that meet where it lies."""
        own = {int(self.names[nearest(self.inside_mm, point_mm)])}
        for middle, radius, names in self.meetings:
            if np.linalg.norm(point_mm - middle) <= radius:
                own |= names
        return own


def branches_of(distance: Grid, entry_mm: Array) -> Branches:
    """The branches of a lumen seen from an entry; ``distance`` in mm to its wall, negative inside."""
    lumen = distance.values < 0
    ways = cheapest_ways(np.where(lumen, 1.0, np.inf), distance.spacing_mm, distance.to_index(entry_mm))
    assert ways is not None  # a lumen has voxels
    inside, way = ways.voxels, ways.total
    at, thick = tuple(inside.T), SLICE_VOXELS * float(distance.spacing_mm.mean())
    bands = np.zeros(lumen.shape, np.int32)
    reached = np.isfinite(way)
    bands[at] = np.where(reached, np.floor(np.where(reached, way, 0.0) / thick) + 1, 0)
    slices = np.asarray(label(bands, connectivity=3), dtype=np.int32)
    # what cannot be reached from the entry is no branch of this vessel and has the number 0
    nodes, middle = slices[at], distance.to_mm(inside.astype(float))
    depth = -distance.values[at].astype(np.float64)
    graph = _Graph(nodes, bands[at], depth, _touching(slices, inside), thick)
    names = graph.names()
    places = [(middle[nodes == node].mean(axis=0), graph.radius[node], names_of) for node, names_of in graph.met(names)]
    return Branches(middle, names[nodes], tuple(places))


def _touching(slices: Labels, inside: NDArray[np.int64]) -> Labels:
    """The pairs (n, 2) of slices that share a face of a voxel, each once; inside (m, 3) : all voxels of slices."""
    found = []
    for axis in range(3):
        here = inside[inside[:, axis] < slices.shape[axis] - 1]
        low, high = slices[tuple(here.T)], slices[tuple((here + np.eye(3, dtype=np.int64)[axis]).T)]
        touch = (low != high) & (low > 0) & (high > 0)
        found.append(np.stack([low[touch], high[touch]], axis=1))
    return np.asarray(np.unique(np.concatenate(found), axis=0))


class _Graph:
    """Slices by number from 1: the band of each, its largest radius in mm, what follows it and what precedes it."""

    def __init__(self, slices: Labels, band: Labels, depth: Array, edges: Labels, thick_mm: float) -> None:
        """slices, band, depth : (n,) of each voxel.     edges : of ``_touching``."""
        count = int(slices.max()) + 1
        self.thick_mm, self.band, self.radius = thick_mm, np.zeros(count, dtype=np.int64), np.zeros(count)
        kept = slices > 0
        self.band[slices[kept]] = band[kept]  # all voxels of a slice are in one band
        np.maximum.at(self.radius, slices[kept], depth[kept])
        self.after: dict[int, set[int]] = {node: set() for node in range(1, count)}
        self.before: dict[int, set[int]] = {node: set() for node in range(1, count)}
        for a, b in edges.tolist():
            low, high = (a, b) if self.band[a] < self.band[b] else (b, a)
            self.after[low].add(high)
            self.before[high].add(low)
        self.order = sorted(self.after, key=lambda node: int(self.band[node]))
        self.real = self._real_branches()

    def _real_branches(self) -> Mapping[int, set[int]]:
        """For each slice, the next ones that lead far or to a junction; a short dead end beside them is a bump."""
        end: dict[int, int] = {}
        for node in reversed(self.order):
            end[node] = max([int(self.band[node]), *(end[one] for one in self.after[node])])
        found = {}
        for node, after in self.after.items():
            least = self.band[node] + BUMP_RADII * self.radius[node] / self.thick_mm
            far = {one for one in after if end[one] > least or len(self.before[one]) > 1}
            found[node] = far or ({max(after, key=lambda one: end[one])} if after else set())
        return found

    def names(self) -> Labels:
        """The branch of each slice; a bump has the name of the vessel that it is on."""
        names, used = np.zeros(len(self.band), dtype=np.int64), 0
        for node in self.order:
            before = self.before[node]
            parent = next(iter(before)) if len(before) == 1 else None
            goes_on = parent is not None and (len(self.real[parent]) < 2 or node not in self.real[parent])
            used += not goes_on
            names[node] = names[parent] if parent is not None and goes_on else used
        return names

    def met(self, names: Labels) -> list[tuple[int, frozenset[int]]]:
        """The slices at which branches meet, each with their names."""
        forks = [(node, {node, *after}) for node, after in self.real.items() if len(after) > 1]
        joins = [(node, {node, *before}) for node, before in self.before.items() if len(before) > 1]
        return [(node, frozenset(int(names[one]) for one in all_of)) for node, all_of in forks + joins]
