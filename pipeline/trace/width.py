"""Is a curve's end as wide as the wire, and as round? A bead, a bubble of the reference or a jet of contrast medium is
wider; a tip that is folded back beside the wire is not round.
"""

import numpy as np

from pipeline.model import Array, arc_length
from pipeline.trace.profile import INDEPENDENT_VOXELS
from pipeline.trace.section import RING_BLURS, read_around, second_harmonic
from pipeline.trace.subtraction import CREST_VOXELS, Subtraction
from pipeline.trace.tube import Tube

ENDS_VOXELS, BODY_VOXELS = (3.0, 5.0), 8.0
"""Lengths of the end whose width is looked at, and how far from it the line is the wire's body."""
WIDE, WIDE_IN_MODEL = (1.2, 3.5), (1.22, 7.0)
"""How much wider than the body no wire's end is, and by how many standard deviations, where the background was measured
and where it is modelled. Of 250 right traces none was beyond 1.15 and 3 in the one, and 1.26 and 5.2 in the other;
J tips of 1.2 to 2 voxels radius had 1.17. A bead, a bubble or a jet of contrast medium at the tip has 1.22 to 1.8."""
FOLDED_VOXELS = 5.0
"""Length of the end whose roundness is looked at: as long as two strands beside each other are seen as one line."""
OUT_OF_ROUND, USUAL, WINDOWS = (0.05, 2.5), 0.75, 6
"""Least second harmonic over the grey on the axis, and over what most pieces of the body have (their upper quartile: a
long fold is beside some of it), of an end beside which a strand lies; and how many pieces there must be: of few, noise
makes one so much rounder than the end. Folds of 2 to 6 mm, 1.6 to 2.1 voxels beside the wire, have 0.07 to 0.12, the
body 0.02; noise alone is 2.5 times its upper quartile once in 6,000."""


def as_fitted(image: Subtraction, tube: Tube, places: Array) -> tuple[Array, Array]:
    """What the tube itself looks like at ``places_around`` a curve: how that bends and ends, and reading's blur."""
    with image.showing(tube.voxels, image.grey.reshape(-1)[tube.voxels] - tube.rest):
        return read_around(image, places)


def oblong_end(image: Subtraction, points: Array, read: tuple[Array, Array], fitted: tuple[Array, Array]) -> float:
    """How much farther out of round the end of a curve (n, 3) is than most of it; 0 where it is round enough.

    read : of ``read_around``.     fitted : of ``as_fitted``.
    """
    arc = arc_length(points)
    from_end = (arc[-1] - arc) / image.voxel
    count, body = np.sum(from_end < FOLDED_VOXELS), np.sum(from_end > 2.0 * FOLDED_VOXELS)
    if body < WINDOWS * count:
        return 0.0
    window = np.ones(count) / count
    turns = second_harmonic(read[0]) - second_harmonic(fitted[0])
    axis = np.convolve(read[1], window, "valid")  # an end that is dim has as much noise as all of it
    share = np.abs(np.convolve(turns, window, "valid")) / np.maximum(axis, max(float(np.median(axis)), 1e-9))
    least, times = OUT_OF_ROUND
    usual = float(np.quantile(share[: body - count + 1], USUAL))
    return float(share[-1]) / usual if share[-1] > max(least, times * usual) else 0.0


def wide_end(
    image: Subtraction, tube: Tube, points: Array, read: tuple[Array, Array], as_it_is: tuple[Array, Array]
) -> float:
    """How much wider than the wire is the end of the curve (n, 3) along it; 0 where that is not sure, or not too much.

    read : of ``read_around``.     as_it_is : of ``as_fitted``.
    """
    radius, arc = RING_BLURS * tube.sigma, arc_length(points)
    from_end = (arc[-1] - arc) / image.voxel
    seen, fitted = _ring_and_axis(read), _ring_and_axis(as_it_is)
    body = from_end > BODY_VOXELS
    if not body.any():
        return 0.0
    usual = _variance(_share(seen[:, body]), radius) - _variance(_share(fitted[:, body]), radius)
    least, sure = WIDE_IN_MODEL if image.modelled else WIDE
    found = [0.0]
    for length in ENDS_VOXELS:
        end = from_end < length
        own, expected = _share(seen[:, end]), _share(fitted[:, end])
        # a ring's mean has half of the noise of its axis
        axis_noise = image.noise_in(CREST_VOXELS) / np.sqrt(length / INDEPENDENT_VOXELS)
        noise = 0.5 * float(axis_noise / max(np.mean(seen[1, end]), 1e-9))
        more = _variance(own, radius) - _variance(expected, radius) - usual
        wider = float(np.sqrt(max(0.0, 1.0 + more / tube.sigma**2)))
        found += [wider] if wider > least and own - expected > sure * noise else []
    return max(found)


def _ring_and_axis(read: tuple[Array, Array]) -> Array:
    """Mean grey on the ring about each point of a curve, and the grey on it: (2, n)."""
    return np.stack([read[0].mean(axis=0), read[1]])


def _share(ring_and_axis: Array) -> float:
    """Grey on rings over that on their axes."""
    ring, axis = ring_and_axis.sum(axis=1)
    return float(np.clip(ring / max(axis, 1e-9), 1e-3, 0.995))


def _variance(share: float, radius: float) -> float:
    """Square of the blur s, mm^2, at which that is exp(-R^2 / 2 s^2)."""
    return -0.5 * radius**2 / float(np.log(share))
