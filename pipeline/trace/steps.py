"""Brightness in steps, each blurred as the image is: found in a profile, and fitted to it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from pipeline.model import Array


@dataclass(frozen=True, eq=False)
class Steps:
    """Brightness (m,) over the usual one, between edges (m - 1,) in shares of the wire's length from its start.

    stated : by the manifest, not found.  missing_mm : how far, if so, the wire goes on beyond the line that was found.
    """

    edges: Array
    levels: Array
    stated: bool = False
    missing_mm: float = 0.0

    def at(self, share: Array) -> Array:
        """Brightness (n,) at shares (n,) of the length."""
        return np.asarray(self.levels[np.searchsorted(self.edges, share)])


EVEN = Steps(np.zeros(0), np.ones(1))


def end_of_step(grey: Array, arc: Array, blur: float) -> float:
    """Arc length at which a blurred step (height free, foot at 0) fits a profile (n,) best, least squares.

    Ends between those of ``arc`` are tried, every tenth of a blur.
    """
    tries = np.arange(arc[0], arc[-1], 0.1 * blur)
    return best_end(tries, ndtr((tries[:, None] - arc[None]) / blur), grey)


def best_end(tries: Array, shapes: Array, grey: Array) -> float:
    """The one of the ends (t,) whose shape (t, n), times any positive height, fits the grey (n,) best."""
    height = shapes @ grey / np.maximum(np.sum(shapes**2, axis=1), 1e-12)
    cost = np.sum((grey - height[:, None] * shapes) ** 2, axis=1)
    cost[height <= 0] = np.inf
    return float(tries[int(np.argmin(cost))])


def first_samples(value: Array, cost: float) -> NDArray[np.int64]:
    """First samples of the constant pieces that fit ``value`` (n,) best, each at a ``cost`` (Potts model).

    By dynamic programming over where the last piece begins (Friedrich et al. 2008), in time proportional to n squared.
    """
    n = len(value)
    total, square = (np.concatenate([[0.0], np.cumsum(v)]) for v in (value, value**2))
    best, first = np.zeros(n + 1), np.zeros(n + 1, np.int64)
    for stop in range(1, n + 1):
        start = np.arange(stop)
        sums = total[stop] - total[:stop]
        costs = best[:stop] + square[stop] - square[:stop] - sums**2 / (stop - start) + cost
        first[stop] = int(np.argmin(costs))
        best[stop] = costs[first[stop]]
    found = [n]
    while found[-1]:
        found.append(int(first[found[-1]]))
    return np.array(found[:0:-1], np.int64)


def levels_between(edges: Array, grey: Array, arc: Array, blur: float, beyond: bool = True) -> tuple[Array, float]:
    """Heights of blurred steps between edges that fit a profile (n,) best, and the sum of squares that is left.

    beyond : something may lie beyond the last edge, too.
    """
    inner = ndtr((arc[:, None] - edges[None]) / blur)
    one, none = np.ones((len(arc), 1)), np.zeros((len(arc), 1))
    design = (np.hstack([one, inner]) - np.hstack([inner, none]))[:, : len(edges) + beyond]
    level = np.linalg.lstsq(design, grey, rcond=None)[0]
    return level, float(np.sum((grey - design @ level) ** 2))


AROUND = 4
"""Edges to either side of one that is moved which are fitted with it: with all of 149, of a coil in voxels of 0.03 mm,
that took 19 s."""


def sharpened(edges: Array, grey: Array, arc: Array, blur: float) -> Array:
    """The edges moved, one after the other, to where blurred steps fit a profile (n,) best around them."""
    edges = edges.copy()
    for width in (1.0, 0.3):
        for n in range(len(edges)):
            first, stop = max(0, n - AROUND), min(n + AROUND + 1, len(edges))
            begin = edges[first] if first else arc[0]
            end = edges[stop - 1] if stop < len(edges) else arc[-1]
            near = (arc >= begin) & (arc <= end)
            tries = edges[n] + width * blur * np.arange(-2, 3)
            low = edges[n - 1] if n else arc[0]
            high = edges[n + 1] if n + 1 < len(edges) else arc[-1]
            tries = tries[(tries > low + 0.5 * blur) & (tries < high - 0.5 * blur)]
            moved = [np.concatenate([edges[first:n], [t], edges[n + 1 : stop]]) for t in tries]
            left = [levels_between(one, grey[near], arc[near], blur)[1] for one in moved]
            if left:
                edges[n] = tries[int(np.argmin(left))]
    return edges
