"""What does the scan show beyond a curve's end and outside the lumen? More vessel, or the wire, which has left it.

Read in the scan, as nothing else is known out there.
"""

import numpy as np

from pipeline.arrays.jets import Blurred, values_at
from pipeline.arrays.polyline import across, tip_tangent
from pipeline.model import Array
from pipeline.trace.onward import RAY_MM, RAY_STEP, TANGENT_MM
from pipeline.trace.section import PHI, RING_BLURS
from pipeline.trace.subtraction import CREST_VOXELS, Subtraction
from pipeline.trace.ways import cone

OUTSIDE_CONE = 0.85
"""Least cosine between the wire's end and the way on which the lumen may have ended too early."""
OUTSIDE_VOXELS = 1.5
"""Distance from the wall at which its blur is gone."""
BRIGHT = 0.5
"""Share of the vessel's contrast from which something outside the lumen is no tissue."""
BONE = 1.25
"""The same from which it is bone, or metal: ``segment.levels.BRIGHTER``."""
FEW = 0.1
"""Share of the ways below which what is bright on them is no vessel but the edge of bone, or a wire straight ahead."""
AHEAD_RAD = 0.15
"""Angle to the wire's end up to which a way is straight ahead: the nearest of ``cone``."""
THREAD_VOXELS, THREAD_RAD, THREAD_STEP = (3.0, 6.0), 1.75, 0.12
"""Where beyond a curve's end a thread is looked for: past the wall, as the end lies up to 1.8 voxels inside of it, and
before a wire that leaves by 2 mm ends; how far off the last direction (100 degrees: wires bend as they leave), and the
angle (rad) from one way to the next: half a voxel at its end."""
SHARES, ALONE, WIDER = (0.6, 1.8), 0.3, 1.25
"""Between which shares of the wire's own brightness a thread is the wire, the most of that that there is on a ring of
ALONE_BLURS about it, over ALONE_ROUND of the way round, and the most of the square of its width over the wire's. Wires
that had left the lumen had 0.84 to 1.1, 0.02 to 0.10 and 1.12; ahead of tips that are right the ring had 0.8 and more
(10 traces). A filled branch of 0.8 mm is 1.33 times as wide as a wire of 0.4 mm."""
ALONE_BLURS, ALONE_ROUND = 3.5, 0.75


def _scanned(image: Subtraction, points: Array) -> Array:
    """Blurred grey (n,) of the scan at points (n, 3)."""
    size = image.scan.spacing_mm
    field = Blurred(image.scan.values, size, CREST_VOXELS * float(size.min()))
    return np.asarray(values_at(field, image.in_scan(points) * size))


def seen_outside(image: Subtraction, line: Array) -> bool:
    """Whether the scan shows something as bright as the vessel, or a wire, just beyond the tip and outside the lumen.

    Then it is the lumen that ends there, not the wire.
    """
    h, tip = image.voxel, line[-1]
    heading = tip_tangent(line, TANGENT_MM)
    s = np.arange(1.0, RAY_MM, h)
    directions = cone(heading, float(np.arccos(OUTSIDE_CONE)), RAY_STEP)
    points = (tip + s[:, None, None] * directions).reshape(-1, 3)
    depth = image.depth_at(points).reshape(len(s), -1)
    out = np.mean(depth > OUTSIDE_VOXELS * h, axis=0) > 0.5
    if not out.any():
        return False
    grey = _scanned(image, points).reshape(len(s), -1)
    inside, outside = image.wall_greys
    if not inside > outside:
        return False
    beyond = np.ma.masked_array((grey - outside) / (inside - outside), depth <= OUTSIDE_VOXELS * h)[:, out]
    bright, bone = beyond.min(axis=0) > BRIGHT, beyond.max(axis=0) > BONE
    ahead = directions[out] @ heading > np.cos(AHEAD_RAD)
    return bool(np.mean(bright & ~bone) > FEW or (np.any(bright & ahead) and np.mean(bright) < FEW))


def thread_outside(image: Subtraction, line: Array, sigma: float) -> bool:
    """Whether something as bright and as thin as the wire, of blur ``sigma``, leads on from the tip through tissue.

    Where the frame alone shows the vessel, a wire in tissue passes for a thin vessel, and nothing stands out in that:
    the curve ends where the wire leaves the wide one. Where there is a reference, that is no part of the lumen.
    """
    if not image.without_reference:
        return False
    tissue, h = image.wall_greys[1], image.voxel
    usual = max(float(np.median(image.along(line[-round(TANGENT_MM / h) - 3 : -2]))), 1e-9)

    def shares(points: Array) -> Array:
        return (_scanned(image, points.reshape(-1, 3)).reshape(points.shape[:-1]) - tissue) / usual

    ways = cone(tip_tangent(line, TANGENT_MM), THREAD_RAD, THREAD_STEP)
    places = line[-1] + h * np.arange(THREAD_VOXELS[0], THREAD_VOXELS[1] + 1.0)[:, None, None] * ways
    axis = shares(places)
    bright = (axis.min(axis=0) > SHARES[0]) & (axis.max(axis=0) < SHARES[1])
    if not bright.any():
        return False
    axis, places, rings = axis[:, bright].mean(axis=0), places[:, bright, None], _rings(ways[bright])
    near, far = (shares(places + blurs * sigma * rings).mean(axis=0) for blurs in (RING_BLURS, ALONE_BLURS))
    alone = np.quantile(far, ALONE_ROUND, axis=1) < ALONE * axis
    # the share of a line of blur s on a ring of radius R is exp(-R^2 / 2 s^2); grey is read in a blur of its own
    widest = WIDER * (sigma**2 + (CREST_VOXELS * h) ** 2)
    return bool(np.any(alone & (near.mean(axis=1) < axis * np.exp(-0.5 * (RING_BLURS * sigma) ** 2 / widest))))


def _rings(ways: Array) -> Array:
    """Unit vectors (n, ANGLES, 3) across directions (n, 3)."""
    first, second = np.moveaxis(across(ways), 1, 0)
    return np.asarray(np.cos(PHI)[:, None] * first[:, None] + np.sin(PHI)[:, None] * second[:, None])
