"""What lies ahead of a curve's end and is not seen as wire: a line that the reference has, too, or a dark one."""

import numpy as np

from pipeline.arrays.jets import Blurred, values_at
from pipeline.arrays.polyline import tip_tangent
from pipeline.model import Array
from pipeline.trace.subtraction import CREST_VOXELS, Subtraction
from pipeline.trace.ways import cone

FIRST_VOXELS, VOXELS = 2.0, 4
"""Where, and over what length, the grey ahead is averaged: beyond the wire's own blur."""
WIDEST_RAD = 0.5
"""How far off the curve's last direction: the wire bends."""
HIDDEN = 0.4
"""Share of the wire's brightness, and of the contrast medium's, that the reference has there at the least."""
FEWEST, INDEPENDENT_VOXELS = 8, 1.5
"""Ways of which one can be told from the rest; voxels of crest grey whose noise is one."""
AROUND_RAD = 0.6
"""From here on ways are beside a wire that goes on: 3 voxels aside at their ends."""
DARK, DARK_NOISES, DARK_VOXELS = 0.1, 5.0, 6
"""Share of the wire's brightness, and noises of the mean, by which one way is darker than others, and its length."""


def hidden_ahead(image: Subtraction, points: Array) -> bool:
    """Whether the reference, within the lumen ahead of a curve's end (n, 3), is as bright as the wire: it has one, too.

    Subtraction leaves nothing there: a wire that reaches as far in the frame seems to end where that one begins.
    """
    rays, (inside, outside) = _rays(image, points, VOXELS), image.wall_greys
    if image.modelled or not len(rays):
        return False
    ahead, frame = rays.reshape(-1, 3), Blurred(image.scan.values, image.spacing, CREST_VOXELS * image.voxel)
    reference = values_at(frame, ahead + image.region.corner * image.spacing) - image.along(ahead)
    least = HIDDEN * max(float(np.median(image.along(points))), abs(inside - outside))
    return bool(reference.reshape(rays.shape[:2]).mean(axis=1).max() - inside > least)


def dark_ahead(image: Subtraction, points: Array) -> bool:
    """Whether one way ahead of a curve's end (n, 3) is much darker than what lies around it.

    A wire whose end is less dense than the contrast medium (plastic) goes on so: 6 mm were missing, and ok. A front of
    contrast is as dark on all ways.
    """
    on, around = _rays(image, points, DARK_VOXELS), _rays(image, points, DARK_VOXELS, AROUND_RAD)
    if not len(on) or len(around) < FEWEST:
        return False
    darkest, usual = (image.along(r.reshape(-1, 3)).reshape(r.shape[:2]).mean(axis=1) for r in (on, around))
    noise = image.noise_in(CREST_VOXELS) / np.sqrt(DARK_VOXELS / INDEPENDENT_VOXELS)
    least = max(DARK * float(np.median(image.along(points))), DARK_NOISES * noise)
    return bool(np.median(usual) - darkest.min() > least)


def _rays(image: Subtraction, points: Array, voxels: int, off_rad: float = 0.0) -> Array:
    """Straight ways (m, voxels, 3) ahead of a curve's end, ``off_rad`` and more from it, that lie within the lumen."""
    away = image.voxel * np.arange(FIRST_VOXELS, FIRST_VOXELS + voxels)[:, None]
    last = tip_tangent(points, voxels * image.voxel)
    headings = cone(last, off_rad + WIDEST_RAD, 0.5 * WIDEST_RAD)
    headings = headings[headings @ last <= np.cos(off_rad) + 1e-9]
    rays = points[-1] + away * headings[:, None]
    within = image.depth_at(rays.reshape(-1, 3)).reshape(rays.shape[:2]) < -image.voxel
    return np.asarray(rays[within.all(axis=1)])
