"""Is a curve's end as wide as the wire? A bead, an air bubble of the reference or a jet of contrast medium is wider."""

import numpy as np

from pipeline.model import Array, arc_length
from pipeline.trace.profile import INDEPENDENT_VOXELS
from pipeline.trace.section import RING_BLURS, read_around
from pipeline.trace.subtraction import CREST_VOXELS, Subtraction
from pipeline.trace.tube import Tube

ENDS_VOXELS, BODY_VOXELS = (3.0, 5.0), 8.0
"""Lengths of the end whose width is looked at, and how far from it the line is the wire's body."""
WIDE, WIDE_IN_MODEL = (1.2, 3.5), (1.22, 7.0)
"""How much wider than the body no wire's end is, and by how many standard deviations, where the background was measured
and where it is modelled. Of 250 right traces none was beyond 1.15 and 3 in the one, and 1.26 and 5.2 in the other;
J tips of 1.2 to 2 voxels radius had 1.17. A bead, a bubble or a jet of contrast medium at the tip has 1.22 to 1.8."""


def wide_end(image: Subtraction, tube: Tube, points: Array, read: tuple[Array, Array]) -> float:
    """How much wider than the wire is the end of the curve (n, 3) along it; 0 where that is not sure, or not too much.

    What the tube itself looks like, read the same way, takes out how the curve bends and ends, and the blur of reading.
    read : of ``read_around``.
    """
    radius, arc = RING_BLURS * tube.sigma, arc_length(points)
    from_end = (arc[-1] - arc) / image.voxel
    seen = _ring_and_axis(read)
    with image.showing(tube.voxels, image.grey.reshape(-1)[tube.voxels] - tube.rest):
        fitted = _ring_and_axis(read_around(image, points, tube.sigma))
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
