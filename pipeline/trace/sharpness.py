"""Is the scanner as sharp along one of its axes as along another? The vessel's wall tells, whatever the wire is.

A blur that is 1.3 times as wide along one axis makes a round wire as oblong as two in contact.
"""

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import ndtr

from pipeline.model import Array
from pipeline.trace.subtraction import Subtraction

WALL_BLURS, CLEAR_BLURS = 2.5, 3.5
"""How far from the wall, in the scanner's blurs, its profile is read, and how far from the wire, in the wire's."""
THINNED, LEAST_PLACES = 3, 1000
"""One voxel of so many is read, and how many there must be: 7000 give the differences to 3 % of the blur's square."""


def blur_by_axis(image: Subtraction, points: Array, sigma: float) -> Array:
    """How much larger the square of the scanner's blur is along each axis (3,) than usual, mm^2; 0 where nothing tells.

    points, sigma : the wire's curve (n, 3) and blur, which is left out.  The profile of a wall with the unit normal n
    is as wide as the sum of n_k^2 times the square of the blur along axis k; a wall that lies off, or bends, moves it.
    """
    box, blur = image.region.box.values, image.wall_blur_mm
    at = image.region.sample[::THINNED]
    at = at[np.all((at > 0) & (at < np.array(box.shape) - 1), axis=1)]
    at = at[np.abs(box[tuple(at.T)]) < WALL_BLURS * blur]
    at = at[cKDTree(points).query(at * image.spacing)[0] > CLEAR_BLURS * sigma]
    inside, outside = image.wall_greys
    if len(at) < LEAST_PLACES or not inside > outside:
        return np.zeros(3)
    rise = np.stack([box[tuple((at + step).T)] - box[tuple((at - step).T)] for step in np.eye(3, dtype=int)], axis=1)
    rise = rise / (2.0 * image.spacing)
    steep = np.maximum(np.sum(rise**2, axis=1), 0.25)  # slices drawn together make distances along them shorter
    depth = box[tuple(at.T)] / np.sqrt(steep) / blur
    share = (image.scan.values[tuple((at + image.region.corner).T)] - outside) / (inside - outside)
    density = np.exp(-0.5 * depth**2) / np.sqrt(2.0 * np.pi)
    wider = (rise**2 / steep[:, None]) * (0.5 * depth * density / blur**2)[:, None]
    found = np.linalg.lstsq(np.column_stack([wider, density]), share - ndtr(-depth), rcond=None)[0][:3]
    return np.asarray(found - found.mean())
