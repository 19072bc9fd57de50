"""The cheapest ways from one voxel of a lumen to all others, from neighbour to neighbour."""

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from pipeline.arrays.grids import unflattened
from pipeline.model import Array

STEPS = np.array([step for step in product((-1, 0, 1), repeat=3) if step > (0, 0, 0)])
"""To half of a voxel's 26 neighbours: the others are reached by going back."""


@dataclass(frozen=True, eq=False)
class Ways:
    """voxels (n, 3) : indices of those of finite cost, in the order of ``np.argwhere``.

    total (n,) : the cost of the cheapest way to each, infinite where there is none.     before (n,) : the number of the
    voxel that comes before it on that way, negative where none does.
    """

    voxels: NDArray[np.int64]
    total: Array
    before: NDArray[np.int32]

    def to(self, number: int) -> NDArray[np.int64] | None:
        """The voxels (m, 3) of the way to one of them, by its number; None where there is no way."""
        if not np.isfinite(self.total[number]):
            return None
        way = [number]
        while self.before[way[-1]] >= 0:
            way.append(int(self.before[way[-1]]))
        return self.voxels[way[::-1]]


def nearest(points: NDArray[Any], place: Array) -> int:
    """The number of the point, of (n, 3), that is nearest to a place (3,) in the same unit."""
    return int(np.argmin(np.sum((points - place) ** 2, axis=1)))


def cheapest_ways(cost: Array, spacing_mm: Array, start: Array) -> Ways | None:
    """Ways through voxels of finite cost (per mm) from that nearest to ``start`` (3,), an index; None without any.

    A step costs its length times the mean cost of its ends, as in skimage.graph.MCP_Geometric, which takes four times
    as long where a hundredth of the box is lumen: nearly all of it to number voxels that no way leads through. Of a
    million voxels in 200^3 both take as long.
    """
    # a margin of one voxel, so that none has neighbours beyond the array
    inside = np.pad(cost, 1, constant_values=np.inf)
    at = np.flatnonzero(inside < np.inf)
    if len(at) == 0:
        return None
    voxels, costs = unflattened(at, inside.shape) - 1, inside.ravel()[at].astype(np.float64)
    begin = nearest(voxels, start)
    steps = _steps(at, costs, inside.shape, spacing_mm)
    total, before = dijkstra(steps, directed=False, indices=[begin], return_predecessors=True)
    return Ways(voxels, total[0], before[0])


def _steps(at: NDArray[np.int64], costs: Array, shape: tuple[int, ...], spacing_mm: Array) -> coo_array:
    """What the steps between voxels cost, each once; at (n,) : their places in an array of that shape."""
    numbers = np.full(np.prod(shape), -1, np.int32)
    numbers[at] = np.arange(len(at))
    found, middle = [], np.ravel_multi_index((1, 1, 1), shape)
    for step in STEPS:
        to = numbers[at + np.ravel_multi_index(tuple(step + 1), shape) - middle]
        here = np.flatnonzero(to >= 0).astype(np.int32)
        there = to[here]
        length = float(np.linalg.norm(step * spacing_mm))
        found.append((0.5 * length * (costs[here] + costs[there]), here, there))
    value, here, there = (np.concatenate(part) for part in zip(*found, strict=True))
    return coo_array((value, (here, there)), shape=(len(at), len(at)))
