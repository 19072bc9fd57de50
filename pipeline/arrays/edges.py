"""One blurred edge, or two beside each other: what grey over the distance from a wall tells.

A vessel in a wall of its own, as silicone in air or water, has two.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.special import ndtr

from solver.grid import Array

NEEDED = 2.0
"""How far inside and outside it must be known."""
EVERY = 0.5
LEAST = 100
"""Voxels that a distance needs."""
ONE_STEP = 0.004
"""Misfit of one step, over the contrast, from which two are tried: noise of a tenth leaves 0.001 of it."""
FITS = 0.55
"""Misfit of two steps over that of one from which they are two: 0.02 to 0.5 in layers of 1.3 to 7 voxels, 0.8 and more
in vessels without (27 scenes)."""
BOWED = 0.9
"""The same over that of one step of a vessel that is brightest in its middle: its parabola takes up a thin layer."""
THINNEST = 0.8
"""Voxels: two edges that are nearer to each other are one that is blurred."""
ONE = [-8.0, 0.4], [4.0, 3.0]
"""Where one edge and its blur may lie, in voxels."""
STARTS = (-4.0, 4.0), (-2.0, 2.0), (-0.5, 1.5), (0.0, 3.0)
"""Where the inner edge and how thick the layer may be, in voxels, for the fit to begin with."""


@dataclass(frozen=True)
class Layer:
    """What surrounds a vessel: the greys of vessel, layer and what lies beyond, and the edges between them.

    inner, outer : voxels from the wall that is known, outwards.  blur : of the edges, voxels.
    """

    vessel: float
    grey: float
    beyond: float
    inner: float
    outer: float
    blur: float

    @property
    def floor(self) -> float:
        """The grey below which there is no vessel; half way from it to the vessel's is met at the wall on average."""
        return 2.0 * float(self.at(np.array([self.inner]))[0]) - self.vessel

    def at(self, off: NDArray[Any]) -> Array:
        """Grey (n,) at distances (n,) from the wall that is known, voxels."""
        greys = np.array([self.vessel, self.grey, self.beyond])
        return np.asarray(_steps(off, np.array([self.inner, self.outer]), self.blur) @ greys)


def layer_in(off: NDArray[Any], grey: NDArray[Any]) -> Layer | None:
    """The layer that grey (n,) at distances (n,) from a wall, in voxels, tells of; None where it falls in one step.

    It is told by distances in classes, whose middles stand for them, and by the means of the classes. A straight vessel
    along the voxels has few distances: their middles alone made two edges of one, and around a wire their means did.
    """
    middles, means, greys = _profile(off, grey)
    layer = _layer(middles, greys)
    return None if layer is None or _layer(means, greys) is None else layer


def _layer(off: Array, grey: Array) -> Layer | None:
    """The layer in a profile: greys (n,) at distances (n,)."""
    contrast = float(np.ptp(grey)) if len(grey) else 0.0
    if contrast <= 0.0 or off[0] > -NEEDED or off[-1] < NEEDED:
        return None
    one = _fitted(lambda q: _steps(off, q[:1], q[1]), grey, [0.0, 1.0], ONE)
    if one[1] < ONE_STEP * contrast:
        return None
    room = [-8.0, THINNEST, 0.4], [2.0, 9.0, 2.0]
    fits = [_fitted(lambda q: _steps(off, np.cumsum(q[:2]), q[2]), grey, [*start, 1.0], room) for start in STARTS]
    (inner, thick, blur), misfit, (vessel, layer, beyond) = min(fits, key=lambda fit: fit[1])
    slack = 0.05 * contrast
    ordered = grey.max() + slack > vessel > layer > beyond > grey.min() - slack
    if not ordered or misfit > FITS * one[1]:
        return None
    if misfit > BOWED * _fitted(lambda q: _bowed(off, *q), grey, [0.0, 1.0], ONE)[1]:
        return None
    return Layer(vessel, layer, beyond, inner, inner + thick, blur)


def _profile(off: NDArray[Any], grey: NDArray[Any]) -> tuple[Array, Array, Array]:
    """Middles and means of classes of distances, EVERY wide, and the median greys there, of LEAST voxels each."""
    bins = np.rint(off / EVERY).astype(np.int16)
    steps, count = np.unique(bins, return_counts=True)
    every = np.split(np.argsort(bins, kind="stable"), np.cumsum(count)[:-1])  # once through all, not once a class
    classes = [own for own in every if len(own) >= LEAST]
    steps = steps[count >= LEAST]
    means, greys = (np.array([f(a[own]) for own in classes], float) for f, a in ((np.mean, off), (np.median, grey)))
    return np.asarray(EVERY * steps, float), means, greys


def _steps(off: NDArray[Any], edges: Array, blur: float) -> Array:
    """Shares (n, levels) of the greys between blurred edges, at distances (n,)."""
    inside = np.stack([ndtr((edge - off) / blur) for edge in edges], axis=1)
    return np.diff(inside, axis=1, prepend=0.0, append=1.0)


def _bowed(off: NDArray[Any], edge: float, blur: float) -> Array:
    """The same for one edge of a vessel that is brightest in its middle: a parabola within, one grey beyond."""
    inside, beyond = _steps(off, np.array([edge]), blur).T
    depth = np.minimum(off - edge, 0.0)
    return np.stack([inside, inside * depth, inside * depth**2, beyond], axis=1)


def _fitted(
    shares: Callable[[Array], Array], grey: Array, start: list[float], room: tuple[list[float], list[float]]
) -> tuple[Array, float, Array]:
    """Edges and blur, the misfit (rms) and the greys, by least squares; the greys are linear."""

    def greys(q: Array) -> Array:
        return np.asarray(np.linalg.lstsq(shares(q), grey, rcond=None)[0])

    def left(q: Array) -> Array:
        return np.asarray(shares(q) @ greys(q) - grey)

    found = least_squares(left, start, bounds=room)
    return found.x, float(np.sqrt(np.mean(found.fun**2))), greys(found.x)
