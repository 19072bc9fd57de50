"""How bright a wire is along its length where the manifest says so: where it must end, and how it looks until there.

A step of the profile (the end of a coil) shows where the tip is, even where the tip itself cannot be seen.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.ndimage import gaussian_filter1d

from pipeline.model import Array, arc_length
from pipeline.ranges import Profile
from pipeline.trace.crest_profile import AHEAD_VOXELS, BACK_VOXELS, CrestProfile
from pipeline.trace.steps import Steps, best_end
from pipeline.trace.subtraction import Subtraction

RAMP = 0.1
"""Largest change of brightness (of its logarithm) from one piece of a ramp to the next."""
TRIES = 0.5
"""Distance, in blurs, of the ends that are tried; about the best of them, they are tried ten times as closely."""
BLUR_SAMPLES = 10
"""Samples of the profile in one blur."""


@dataclass(frozen=True, eq=False)
class Opacity:
    """Brightness per length (n,) at distances (n,) from the tip, mm; linear between, constant beyond."""

    distance: Array
    value: Array

    @staticmethod
    def of(profile: Profile | None) -> "Opacity | None":
        """What the manifest states; None where it states nothing."""
        if profile is None:
            return None
        pairs = [(0.0, profile)] if isinstance(profile, (int, float)) else profile
        distance, value = np.array(pairs, float).T
        return Opacity(distance, value)

    def at(self, distance: Array) -> Array:
        """Brightness (n,) at distances (n,) from the tip."""
        return np.interp(distance, self.distance, self.value)

    def crests(self, from_tip: Array, blur: float) -> Array:
        """The blurred brightness at distances from the tip (any shape); negative ones lie beyond it, without wire."""
        step = blur / BLUR_SAMPLES
        at = np.arange(-5.0 * blur, max(float(from_tip.max()), 0.0) + 5.0 * blur, step)
        sharp = np.where(at < 0.0, 0.0, self.at(at))
        return np.interp(from_tip, at, gaussian_filter1d(sharp, BLUR_SAMPLES, mode="nearest"))

    def steps(self, length: float, missing: float) -> Steps:
        """The profile of a line of this length that ends ``missing`` mm before the tip, in evenly bright pieces."""
        low, high = missing, missing + length
        knots = np.unique(np.clip([low, *self.distance, high], low, high))
        cuts = [low]
        for a, b in pairwise(knots):
            first, last = self.at(np.array([a + 1e-6 * (b - a), b - 1e-6 * (b - a)]))
            cuts += np.linspace(a, b, int(np.ceil(abs(np.log(last / first)) / RAMP)) + 2)[1:].tolist()
        edges = np.array(cuts)
        level = self.at(0.5 * (edges[:-1] + edges[1:]))
        usual = float(np.median(self.at(np.linspace(low, high, 1000))))
        return Steps((high - edges[1:-1])[::-1] / length, level[::-1] / usual, stated=True, missing_mm=missing)


def _end(opacity: Opacity, grey: Array, arc: Array, tries: Array, blur: float) -> float:
    """The end, of several, at which the stated profile (its height free) fits the grey (n,) along the line best."""
    return best_end(tries, opacity.crests(tries[:, None] - arc[None], blur), grey)


def ended_as_stated(image: Subtraction, points: Array, blur_mm: float, opacity: Opacity) -> tuple[Array, Steps]:
    """The path (n, 3) ended (or continued) where the stated profile fits its crest best, and its steps.

    Where that is further on than the path reaches, the path is left as it is: ``missing_mm`` of its steps says how far.
    """
    crest = CrestProfile.of(image, points, blur_mm)
    arc, grey, blur, h = crest.arc, crest.grey, crest.blur, crest.voxel
    furthest = float(arc[-1] + opacity.distance[-1])
    end = _end(opacity, grey, arc, np.arange(arc[0] + 2 * h, furthest + 1e-9, TRIES * blur), blur)
    if end >= arc[-1]:
        own = float(arc[-1]) - AHEAD_VOXELS * h
        return crest.until(own), opacity.steps(own, end - own)
    near = (arc > end - BACK_VOXELS * h) & (arc < end + AHEAD_VOXELS * h)
    tries = np.clip(end + TRIES * blur * np.linspace(-2.0, 2.0, 41), arc[0] + 2 * h, arc[-1])
    kept = crest.until(_end(opacity, grey[near], arc[near], tries, blur))
    return kept, opacity.steps(float(arc_length(kept)[-1]), 0.0)
