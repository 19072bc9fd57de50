"""How bright a wire is along its length: in steps, since wires have coils of platinum, marker bands and plastic tips.

The brightness is read on the crest, as a share of its median. A wire without steps (nearly all frames) costs a look.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from pipeline.model import Array, arc_length
from pipeline.trace.link import extended, resampled
from pipeline.trace.subtraction import CREST_VOXELS, Subtraction

BACK_VOXELS = 14.0
"""How much of the wire before its apparent end enters the step fit."""
AHEAD_VOXELS = 8.0
"""How far ahead of the apparent end the wire is looked for along its tangent."""
BAND_VOXELS = 3.0
"""Length over which grey is averaged before it is called a step: a marker band of 1 mm."""
UNEVEN = (0.55, 1.6)
"""Shares of the usual grey between which a wire has no steps."""
STEP_SIGMAS = 5.0
"""The same in standard deviations of that mean."""
LINEAR = 0.15
"""Share of the usual grey above which brightness is compared by its logarithm: 0.2 to 1 is as much as 1 to 5."""
STEP_COST = 1.5
"""What a further step must save: the square of a threefold change of brightness over three samples."""
LEAST_LEVEL = 0.1
"""Share of the usual grey from which something is wire: a plastic tip has 0.15, streaks a few hundredths."""
INDEPENDENT_VOXELS = 1.7
"""Length of wire that holds one independent value of the noise of crest grey."""
SURE = 6.0
"""Standard deviations by which a fainter piece stands out of the noise, all of it taken together."""


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


def step_position(profile: Array, arc: Array, sigma: float) -> float:
    """Arc length at which a blurred step (height free, foot at 0) fits the profile best, least squares.

    Positions between the ends of ``arc`` are tried, every tenth of a blur.
    """
    tries = np.arange(arc[0], arc[-1], 0.1 * sigma)
    shape = ndtr((tries[:, None] - arc[None]) / sigma)
    height = shape @ profile / np.sum(shape**2, axis=1)
    cost = np.sum((profile - height[:, None] * shape) ** 2, axis=1)
    cost[height <= 0] = np.inf
    return float(tries[int(np.argmin(cost))])


def _segments(value: Array, cost: float) -> NDArray[np.int64]:
    """First samples of the constant pieces that fit ``value`` (n,) best, each at a ``cost`` (Potts model)."""
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


def _levels(profile: Array, arc: Array, edges: Array, sigma: float, beyond: bool = True) -> tuple[Array, float]:
    """Heights of blurred steps between edges that fit a profile best, and the sum of squares that is left.

    beyond : something may lie beyond the last edge, too.
    """
    inner = ndtr((arc[:, None] - edges[None]) / sigma)
    one, none = np.ones((len(arc), 1)), np.zeros((len(arc), 1))
    design = (np.hstack([one, inner]) - np.hstack([inner, none]))[:, : len(edges) + beyond]
    level = np.linalg.lstsq(design, profile, rcond=None)[0]
    return level, float(np.sum((profile - design @ level) ** 2))


def _sharpened(profile: Array, arc: Array, edges: Array, sigma: float) -> Array:
    """The edges moved, one after the other, to where blurred steps fit best."""
    for width in (1.0, 0.3):
        for n in range(len(edges)):
            tries = edges[n] + width * sigma * np.arange(-2, 3)
            low = edges[n - 1] if n else arc[0]
            high = edges[n + 1] if n + 1 < len(edges) else arc[-1]
            tries = tries[(tries > low + 0.5 * sigma) & (tries < high - 0.5 * sigma)]
            left = [_levels(profile, arc, np.concatenate([edges[:n], [t], edges[n + 1 :]]), sigma)[1] for t in tries]
            if left:
                edges[n] = tries[int(np.argmin(left))]
    return edges


def _is_even(share: Array, noise: float, voxels: float) -> bool:
    """Whether a profile (n,) before its end has no steps. noise : of one sample.  voxels : from one to the next."""
    width = max(1, round(BAND_VOXELS / voxels))
    mean = np.convolve(share, np.ones(width) / width, "valid")
    room = STEP_SIGMAS * noise * np.sqrt(INDEPENDENT_VOXELS / BAND_VOXELS)
    low, high = UNEVEN[0] - max(0.0, room - 0.35), UNEVEN[1] + max(0.0, room - 0.5)
    return bool(len(mean) == 0 or (mean.min() > low and mean.max() < high))


def ended(image: Subtraction, points: Array, blur_mm: float) -> tuple[Array, Steps]:
    """The path ended (or continued) where its crest ends, and its steps. points : (n, 3).  blur_mm : of the wire.

    The wire ends in the last piece that is bright; a step fitted to the profile of that piece alone tells where, so
    that a marker band or a coil of platinum is not taken for the wire's height.
    """
    h = image.voxel
    step = 0.25 * h
    line = resampled(extended(points, AHEAD_VOXELS * h, step), step)
    arc, grey = arc_length(line), image.along(line)
    blur = float(np.hypot(CREST_VOXELS * h, blur_mm))
    own = max(4, len(line) - round(AHEAD_VOXELS / 0.25))
    usual = max(float(np.median(grey[:own])), 1e-9)
    noise = image.noise_in(CREST_VOXELS) / usual
    edges, last = np.zeros(0), 0
    if not _is_even(grey[: max(1, own - 8)] / usual, noise, 0.25):
        edges = _edges(grey / usual, arc, noise, blur, h)
        level = _levels(grey / usual, arc, edges, blur)[0]
        seen = _seen(level, np.diff(edges, prepend=0.0, append=arc[-1]) / h, noise)
        last = int(np.flatnonzero(seen)[-1]) if seen.any() else 0
    end = _end_of(last, edges, arc, grey, (blur, h))
    if last and level[last] < level[last - 1]:
        # there are four samples a voxel, and INDEPENDENT_VOXELS voxels share one value of noise
        least = SURE**2 * 4.0 * INDEPENDENT_VOXELS * image.noise_in(CREST_VOXELS) ** 2
        if end - edges[last - 1] < BAND_VOXELS * h or _saved(grey, arc, edges[:last], end, (blur, h)) < least:
            last -= 1  # the blur of the end, not a part of the wire
            end = _end_of(last, edges, arc, grey, (blur, h))
    edges = edges[:last]
    line, edges = line[arc <= end], edges[edges < end - h]
    if not len(edges):
        return np.asarray(line), EVEN
    level = _levels(grey[arc <= end + 2 * blur] / usual, arc[arc <= end + 2 * blur], np.append(edges, end), blur)[0][
        :-1
    ]
    if level[-1] < LEAST_LEVEL:  # the blur of a bright end, once more: nothing of it is left beside its own step
        line, end, edges, level = line[: np.searchsorted(arc, edges[-1])], float(edges[-1]), edges[:-1], level[:-1]
    if not len(edges):
        return np.asarray(line), EVEN
    return np.asarray(line), Steps(edges / end, np.maximum(level, 0.0))


def _end_of(last: int, edges: Array, arc: Array, grey: Array, size: tuple[float, float]) -> float:
    """Arc at which the piece before edge ``last`` ends, by its own step alone. size : blur and voxel, mm."""
    blur, h = size
    start = edges[last - 1] + 0.5 * blur if last else arc[0]
    stop = edges[last] + 3.0 * blur if last < len(edges) else arc[-1]
    tail = (arc >= max(start, stop - (AHEAD_VOXELS + BACK_VOXELS) * h)) & (arc <= stop)
    return max(step_position(grey[tail], arc[tail], blur), float(arc[0]) + 2 * h)


def _saved(grey: Array, arc: Array, edges: Array, end: float, size: tuple[float, float]) -> float:
    """By how much a last piece lowers the sum of squares left of a profile, against a wire that ends without it.

    edges : (m,) of the pieces.  end : of the last one.  size : blur and voxel, mm.
    """
    blur, h = size
    start = max(float(edges[-2]) if len(edges) > 1 else float(arc[0]), float(edges[-1]) - BACK_VOXELS * h)
    near = (arc > start) & (arc < end + AHEAD_VOXELS * h)
    tries = np.arange(start + 2.0 * h, end + h, 0.2 * h)
    left = [_levels(grey[near], arc[near], np.array([e]), blur, beyond=False)[1] for e in tries]
    return min(left, default=np.inf) - _levels(grey[near], arc[near], np.array([edges[-1], end]), blur, beyond=False)[1]


def _seen(level: Array, voxels: Array, noise: float) -> NDArray[np.bool_]:
    """Which pieces, of these levels and lengths in voxels, are wire and not noise. noise : of one sample."""
    independent = np.maximum(1.0, voxels / INDEPENDENT_VOXELS)
    return np.asarray(level > np.maximum(LEAST_LEVEL, SURE * noise / np.sqrt(independent)))


def _edges(share: Array, arc: Array, noise: float, blur: float, h: float) -> Array:
    """Arcs at which the brightness (n,) of a wire steps up or down."""
    every = 2
    floor = max(LINEAR, 6.0 * noise)
    bright = np.arcsinh(share[::every] / floor)
    # three samples of half a voxel are one of independent noise
    cost = max(STEP_COST, 16.0 * 3.0 * (noise / floor) ** 2)
    first = _segments(bright, cost)
    edges = arc[::every][first[1:]] - 0.25 * h if len(first) > 1 else np.zeros(0)
    return _sharpened(share, arc, edges, blur)
