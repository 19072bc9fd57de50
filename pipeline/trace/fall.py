"""Over which length does a wire's brightness fall at its end? A sharp end falls within its blur.

One that was drawn or pushed along itself while it was scanned falls over the way that it went: nobody sees where on
that way its end was last.
"""

import numpy as np
from scipy.special import ndtr

from pipeline.model import Array
from pipeline.trace.attempt import dense
from pipeline.trace.crest_profile import AHEAD_VOXELS, BACK_VOXELS, SAMPLES, CrestProfile
from pipeline.trace.profile import INDEPENDENT_VOXELS
from pipeline.trace.steps import best_end
from pipeline.trace.subtraction import CREST_VOXELS, Subtraction
from pipeline.trace.tube import Tube

WIDTHS = 1.0 + 0.2 * np.arange(21)
"""Widths of the fall that are tried, in blurs."""
SURE, LEAST = 2.5, 1.7
"""Standard deviations by which, and blurs from which, a fall is wider than a sharp end's: tips that moved by 1.5 to
3 mm in voxels of 0.3 mm fell over 1.9 to 3.3 blurs, sure by 2.9 to 9.6; of 26 right ones none was beyond both."""


def fall_mm(image: Subtraction, tube: Tube) -> float:
    """Half the length (mm) over which the brightness falls at a tube's end, beyond its blur; 0 where it may be sharp.

    A fall that is even over a length l has the variance l^2 / 12 besides the blur's.
    """
    crest = CrestProfile.of(image, dense(tube, image.voxel / SAMPLES), tube.sigma)
    end = tube.length_mm
    start = float(tube.steps.edges[-1]) * end + crest.blur if len(tube.steps.edges) else 0.0
    start = max(start, end - BACK_VOXELS * image.voxel)
    near = (crest.arc > start) & (crest.arc < end + AHEAD_VOXELS * image.voxel)
    arc, grey = crest.arc[near], crest.grey[near]
    tries = np.asarray(end + 0.1 * crest.blur * np.arange(-40, 41), float)
    costs = np.array([_left(arc, grey, tries, float(width) * crest.blur) for width in WIDTHS])
    best = int(np.argmin(costs))
    independent = (costs[0] - costs[best]) / (INDEPENDENT_VOXELS * SAMPLES)
    if WIDTHS[best] < LEAST or independent < (SURE * image.noise_in(CREST_VOXELS)) ** 2:
        return 0.0
    return float(np.sqrt(3.0 * (WIDTHS[best] ** 2 - 1.0)) * crest.blur)


def _left(arc: Array, grey: Array, tries: Array, width: float) -> float:
    """The least sum of squares that a fall of this width leaves."""
    shapes = ndtr((tries[:, None] - arc[None]) / width)
    end = best_end(tries, shapes, grey)
    shape = ndtr((end - arc) / width)
    return float(np.sum((grey - shape * (shape @ grey) / (shape @ shape)) ** 2))
