"""How bright a wire is along its length: in steps, since wires have coils of platinum, marker bands and plastic tips.

The brightness is read on the crest, as a share of its median. A wire without steps (nearly all frames) costs a look.
"""

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Array
from pipeline.trace.crest_profile import AHEAD_VOXELS, BACK_VOXELS, SAMPLES, CrestProfile
from pipeline.trace.steps import EVEN, Steps, end_of_step, first_samples, levels_between, sharpened
from pipeline.trace.subtraction import CREST_VOXELS, Subtraction

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


def ended(image: Subtraction, points: Array, blur_mm: float) -> tuple[Array, Steps]:
    """The path (n, 3) ended (or continued) where its crest ends, and its steps. blur_mm : of the wire across.

    The wire ends in the last piece that is bright; a step fitted to the profile of that piece alone tells where, so
    that a marker band or a coil of platinum is not taken for the wire's height.
    """
    crest = CrestProfile.of(image, points, blur_mm)
    edges, end = _last_piece(crest, image.noise_in(CREST_VOXELS))
    edges = edges[edges < end - crest.voxel]
    if not len(edges):
        return crest.until(end), EVEN
    near = crest.arc <= end + 2 * crest.blur
    pieces = np.append(edges, end)
    levels = levels_between(pieces, crest.grey[near] / crest.usual, crest.arc[near], crest.blur)[0][:-1]
    if levels[-1] < LEAST_LEVEL:  # the blur of a bright end, once more: nothing of it is left beside its own step
        end, edges, levels = float(edges[-1]), edges[:-1], levels[:-1]
    steps = Steps(edges / end, np.maximum(levels, 0.0)) if len(edges) else EVEN
    return crest.until(end), steps


def _last_piece(crest: CrestProfile, noise: float) -> tuple[Array, float]:
    """Edges (m,) of the pieces that are wire, all but the end of the last one, and that end, mm."""
    edges, levels, last = _pieces(crest, noise / crest.usual)
    end = _end_of(last, edges, crest)
    if last and levels[last] < levels[last - 1]:
        least = SURE**2 * SAMPLES * INDEPENDENT_VOXELS * noise**2  # INDEPENDENT_VOXELS share one value of noise
        if end - edges[last - 1] < BAND_VOXELS * crest.voxel or _saved(crest, edges[:last], end) < least:
            last -= 1  # the blur of the end, not a part of the wire
            end = _end_of(last, edges, crest)
    return edges[:last], end


def _pieces(crest: CrestProfile, noise: float) -> tuple[Array, Array, int]:
    """Edges (m,) and levels (m + 1,) of all pieces, and the number of the last that is wire. noise : of one share."""
    share = crest.grey / crest.usual
    if _is_even(share[: max(1, crest.own - 8)], noise):
        return np.zeros(0), np.ones(1), 0
    edges = _edges(share, crest, noise)
    levels = levels_between(edges, share, crest.arc, crest.blur)[0]
    voxels = np.diff(edges, prepend=0.0, append=crest.arc[-1]) / crest.voxel
    return edges, levels, int(max(np.flatnonzero(_seen(levels, voxels, noise)), default=0))


def _is_even(share: Array, noise: float) -> bool:
    """Whether a profile (n,) before its end has no steps. noise : of one sample."""
    width = round(BAND_VOXELS * SAMPLES)
    mean = np.convolve(share, np.ones(width) / width, "valid")
    room = STEP_SIGMAS * noise * np.sqrt(INDEPENDENT_VOXELS / BAND_VOXELS)
    low, high = UNEVEN[0] - max(0.0, room - 0.35), UNEVEN[1] + max(0.0, room - 0.5)
    return bool(len(mean) == 0 or (mean.min() > low and mean.max() < high))


def _edges(share: Array, crest: CrestProfile, noise: float) -> Array:
    """Arcs at which the brightness (n,) of a wire steps up or down. noise : of one sample."""
    every = 2
    floor = max(LINEAR, 6.0 * noise)
    bright = np.arcsinh(share[::every] / floor)
    # three samples of half a voxel are one of independent noise
    cost = max(STEP_COST, 16.0 * 3.0 * (noise / floor) ** 2)
    first = first_samples(bright, cost)
    return sharpened(crest.arc[::every][first[1:]] - 0.25 * crest.voxel, share, crest.arc, crest.blur)


def _seen(levels: Array, voxels: Array, noise: float) -> NDArray[np.bool_]:
    """Which pieces, of these levels and lengths in voxels, are wire and not noise. noise : of one sample."""
    independent = np.maximum(1.0, voxels / INDEPENDENT_VOXELS)
    return np.asarray(levels > np.maximum(LEAST_LEVEL, SURE * noise / np.sqrt(independent)))


def _end_of(piece: int, edges: Array, crest: CrestProfile) -> float:
    """Arc at which a piece, the one before edge ``piece``, ends by its own step alone."""
    start = edges[piece - 1] + 0.5 * crest.blur if piece else crest.arc[0]
    stop = edges[piece] + 3.0 * crest.blur if piece < len(edges) else crest.arc[-1]
    start = max(start, stop - (AHEAD_VOXELS + BACK_VOXELS) * crest.voxel)
    tail = (crest.arc >= start) & (crest.arc <= stop)
    return max(end_of_step(crest.grey[tail], crest.arc[tail], crest.blur), float(crest.arc[0]) + 2 * crest.voxel)


def _saved(crest: CrestProfile, edges: Array, end: float) -> float:
    """By how much a last piece lowers the sum of squares left of the profile, against a wire that ends without it.

    edges : (m,) of the pieces.  end : of the last one.
    """
    h, last = crest.voxel, float(edges[-1])
    start = max(float(edges[-2]) if len(edges) > 1 else float(crest.arc[0]), last - BACK_VOXELS * h)
    near = (crest.arc > start) & (crest.arc < end + AHEAD_VOXELS * h)

    def left(*ends: float) -> float:
        return levels_between(np.array(ends), crest.grey[near], crest.arc[near], crest.blur, beyond=False)[1]

    without = min((left(e) for e in np.arange(start + 2.0 * h, end + h, 0.2 * h)), default=np.inf)
    return without - left(last, end)
