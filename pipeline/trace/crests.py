"""Pieces of wire: sub-voxel crests of the smoothed grey above the background, each an ordered tracklet."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from pipeline.arrays.grids import spread
from pipeline.arrays.jets import Blurred, gaussian_taps, smooth_voxels
from pipeline.arrays.lattice import sparse_zeros
from pipeline.model import Array, arc_length
from pipeline.trace._kernels.tracklets import Ground, Rules, tracklets
from pipeline.trace.subtraction import Subtraction

SEED_SIGMAS = 5.5
"""A tracklet starts at smoothed grey this many standard deviations up: noise gives none in 150 000 voxels."""
KEEP_SIGMAS = 3.0
"""It goes on down to grey this many standard deviations up."""
TURN = 0.75
"""Least cosine between the directions of two steps of one voxel: a wire turning within 1.5 voxels is none."""
PREFILTER = 1.5
"""Only voxels this many noises up are smoothed to look for seeds: one in fifteen of the lumen, most of the wire."""
BEND = 0.82
"""Least cosine between a crest's tangent and its run over the last 8 voxels: 35 degrees, a radius of 7 voxels."""
STRICT_BEND = 0.92
"""The same where a crossing is suspected: 23 degrees; tracklets get shorter, but none turns off at a crossing."""
LONGEST = 6000
"""Most points of a tracklet on either side of its seed."""


@dataclass(frozen=True, eq=False)
class Tracklet:
    """Ordered crest points (n, 3) in kernel coordinates with unit tangents and crest grey."""

    points: Array
    tangents: Array
    values: Array

    @cached_property
    def length(self) -> float:
        """Arc length, mm."""
        return float(arc_length(self.points)[-1])

    @property
    def grey(self) -> float:
        """Median crest grey."""
        return float(np.median(self.values))

    def reversed(self) -> "Tracklet":
        """The other way round."""
        return Tracklet(self.points[::-1], -self.tangents[::-1], self.values[::-1])


def find_crests(
    image: Subtraction, sigma_voxel: float, seed_sigmas: float = SEED_SIGMAS, bend: float = BEND
) -> list[Tracklet]:
    """All tracklets in the region, strongest first; ``sigma_voxel`` is the blur in which crests are looked for."""
    taps, sigma = gaussian_taps(sigma_voxel), sigma_voxel * image.voxel
    noise = spread(image.sampled_in(sigma_voxel))
    places = image.region.axis
    bright = places[image.grey.reshape(-1)[places] > PREFILTER * image.noise]
    image.counters["voxels_visited"] = image.counters.get("voxels_visited", 0.0) + bright.size
    smooth = smooth_voxels(image.grey, taps, bright)
    strong = np.flatnonzero(smooth > seed_sigmas * noise)
    seeds = bright[strong[np.argsort(-smooth[strong], kind="stable")]]
    low = KEEP_SIGMAS * noise
    # a crest of height low in a blur of sigma bends by about low / sigma^2
    rules = Rules(seed_sigmas * noise, low, 0.15 * low / sigma**2, TURN, bend, 0.7 * image.voxel)
    field, stamp = Blurred(image.grey, image.spacing, sigma), sparse_zeros(image.grey.shape, np.int32)
    found, first = tracklets(Ground(field, image.region.allowed, stamp), seeds, rules, LONGEST)
    return [Tracklet(*(part[a:b] for part in found)) for a, b in pairwise(first)]
