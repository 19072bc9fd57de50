"""Does a wire go on from its tip, too faint to be followed? The brightest way on, in short straight pieces, tells.

A wire 1.5 noises bright is 6 standard deviations over 3 mm, and may be 2 over any one of them.
"""

from collections.abc import Callable
from functools import cache

import numpy as np

from pipeline.arrays.grids import spread, unflattened
from pipeline.arrays.polyline import across
from pipeline.model import Array
from pipeline.trace.subtraction import Subtraction

CONE, CONE_STEP = 0.6, 0.15
"""Least cosine between the wire's end and the way on (53 degrees), and the angle (rad) from one first piece to the
next: 0.75 voxel at its end."""
TURN, TURN_STEP = 0.35, 0.175
"""Largest angle (rad) between two pieces, a bend of 14 voxels radius, and from one that is tried to the next."""
PIECE_VOXELS, SAMPLES, PIECES = 5.0, 3, 6
"""Length of a piece, at how many places grey is read on it, and how many are put together: 9 mm of voxels of 0.3 mm."""
KEPT = 30
"""How many ways are continued, the brightest with ends in different voxels: with 10 a wire of 1.2 noises was lost."""
QUICK, MAYBE = 8, 5.0
"""How many are followed at first, in a third of the time, and the height from which KEPT are: noise has 4.5 (median),
a wire of 1.2 noises 10."""
FIRST_VOXELS = 1.0
"""How much is left out just beyond the tip, as the fit of the wire takes some of it."""
SURE = 7.0
"""Standard deviations of its mean from which the brightest of all ways is no noise: where nothing lies beyond a tip it
had at most 5.9 with a reference and 6.5 without (90 and 50 tips), along 6 and 13 mm of wire 1.7 and 1.2 noises bright
7.5 and 9.3. Only in white noise: a correlated one, or contrast that the reference does not match to 2 %, makes 8."""
FEWER = 0.3
"""Standard deviations that a way may have less for each piece that it has less, as it was chosen among fewer: the most
that 300 tips in noise had was 3.9 with one piece, 5.1 with two, 6.4 with six."""
PLACES = 500
"""Pieces of which the noise is taken: to 5 per cent."""
APART = np.array([1 << 42, 1 << 21, 1])
"""Makes one number of a voxel's three, negative ones too."""
Grey = Callable[[Array], Array]
"""Grey (n,) at points (n, 3)."""


@cache
def _rings(widest: float, step: float) -> Array:
    """Directions (n, 3) up to ``widest`` (rad) off the first axis, ``step`` apart."""
    rings = [np.array([[1.0, 0.0, 0.0]])]
    for angle in np.arange(step, widest, step):
        phi = np.arange(0.0, 2 * np.pi, step / np.sin(angle))
        ring = np.sin(angle) * np.stack([np.cos(phi), np.sin(phi)], axis=1)
        rings.append(np.insert(ring, 0, np.cos(angle), axis=1))
    return np.concatenate(rings)


def cone(heading: Array, widest: float, step: float) -> Array:
    """Directions (..., n, 3) up to ``widest`` (rad) off headings (..., 3), ``step`` apart."""
    axes = np.concatenate([heading[..., None, :], across(heading)], axis=-2)
    return np.asarray(_rings(widest, step) @ axes)


def _longer(
    image: Subtraction, along: Grey, ways: Array, sums: Array, headings: Array, kept: int
) -> tuple[Array, Array, Array]:
    """The ``kept`` brightest of ways (m, n, 3) with one more piece, the sums (m,) of their grey, last directions."""
    first = ways.shape[1] == 1
    widest, step = (float(np.arccos(CONE)), CONE_STEP) if first else (TURN + 0.01, TURN_STEP)
    fans = cone(headings, widest, step)
    parent, heading = np.repeat(np.arange(len(ways)), fans.shape[1]), fans.reshape(-1, 3)
    s = (np.arange(1, SAMPLES + 1) * PIECE_VOXELS / SAMPLES + FIRST_VOXELS * first) * image.voxel
    points = ways[parent, -1] + s[:, None, None] * heading
    total = sums[parent] + along(points.reshape(-1, 3)).reshape(SAMPLES, -1).mean(axis=0)
    order = np.argsort(-total, kind="stable")
    voxels = np.rint(points[-1][order] / image.spacing).astype(np.int64) @ APART
    best = order[np.sort(np.unique(voxels, return_index=True)[1])[:kept]]
    return np.concatenate([ways[parent[best]], points[-1][best][:, None]], axis=1), total[best], heading[best]


def _noise(image: Subtraction) -> float:
    """Standard deviation of a piece's mean grey: of pieces at places well inside the lumen, in all directions."""
    deep = image.deep(1.0)
    places = deep if len(deep) > PLACES else image.region.within
    rng = np.random.default_rng(0)
    index = unflattened(rng.choice(places, PLACES), image.region.box.shape)
    heading = rng.normal(size=(PLACES, 3))
    heading /= np.linalg.norm(heading, axis=1)[:, None]
    s = (np.arange(SAMPLES) - 0.5 * (SAMPLES - 1)) * PIECE_VOXELS / SAMPLES * image.voxel
    points = index * image.spacing + s[:, None, None] * heading
    return max(spread(image.along(points.reshape(-1, 3)).reshape(SAMPLES, -1).mean(axis=0)), 1e-6)


def ways_on(image: Subtraction, tip: Array, heading: Array, kept: int = KEPT, along: Grey | None = None) -> Array:
    """Of the brightest ways on from a tip, of 1 to PIECES pieces (PIECES, 2): mean grey, and how many standard
    deviations that stands out, as if it had PIECES of them.

    kept : how many ways are continued.  along : other grey of points than the image's, with its noise.
    """
    noise, found = _noise(image), []
    ways, sums, headings = tip[None, None], np.zeros(1), heading[None]
    for n in range(1, PIECES + 1):
        ways, sums, headings = _longer(image, along or image.along, ways, sums, headings, kept)
        found.append((float(sums[0]) / n, float(sums[0]) / (noise * np.sqrt(n)) + FEWER * (PIECES - n)))
    return np.array(found)


def highest(ways: Array, least: float) -> float:
    """The most standard deviations of the ways (n, 2) whose mean grey is above ``least``, what a wire has; else 0."""
    return float(np.max(ways[ways[:, 0] > least, 1], initial=0.0))
