"""How smooth a fitted curve is before any grey is seen: a prior on differences of its control points."""

import numpy as np

from pipeline.model import Array

STIFFNESS = 2.0
"""Standard deviation (voxel) of third differences of control points: it carries gaps and leaves bends free."""
FULL_KNOT = 8.0
"""Knot distance (voxel) from which that holds; below, it falls with the cube of the distance, as third differences of
one and the same bend do: else a short wire, which has two intervals whatever its length, curls up in the noise."""
TIGHTEST = 10.0
"""Radius (voxel) of the bend that second differences of a short wire get as standard deviation: it cannot turn back."""
TAIL, CLOSE_KNOT, WIDE_TAIL = 5.0, 6.0, 20.0
"""Square of a difference, in those deviations, from which it counts half, where knots are closer than so many voxels,
as in hooks: with 3 a curve at a contrast of 2 wandered off in noise (5 voxels, and ok), with 9 the tip of half a circle
of 2.7 voxels stayed 0.55 voxel off. And the same of other wires: with 5 one right frame in 30 was refused, since its
tip followed the noise."""


def smoothness(controls: Array, knot: float, voxel: float) -> Array:
    """Inverse of the prior's covariance (3 k, 3 k) of control points (k, 3) about ``knot`` mm apart.

    Its tails are Cauchy's: half a circle of 4 voxels has third differences of 9 standard deviations. A Gaussian prior
    straightened it, and its tip lay 0.2 voxel outwards.

    The fit's covariance takes these weights, 1 / (1 + s^2 / 5) at s standard deviations, for the prior's curvature.
    At 3 to 5 that is too much, as Cauchy's own is negative there: sigma of hooks needs ``bends.hook_error``.
    """
    tail = TAIL if knot < CLOSE_KNOT * voxel else WIDE_TAIL
    loose = STIFFNESS * min(1.0, knot / (FULL_KNOT * voxel)) ** 3 * voxel
    block = _heavy_tailed(controls, 3, loose, tail)
    if knot < FULL_KNOT * voxel:
        block += _heavy_tailed(controls, 2, knot**2 / (TIGHTEST * voxel), tail)
    return np.asarray(np.kron(block, np.eye(3)))


def _heavy_tailed(controls: Array, order: int, spread: float, tail: float) -> Array:
    """The same (k, k) of one axis, of differences ``spread`` large: weighted anew as large as they are now."""
    difference = np.diff(np.eye(len(controls)), n=order, axis=0)
    size = np.sum((difference @ controls) ** 2, axis=1) / spread**2
    return np.asarray(difference.T @ (difference / (spread**2 * (1.0 + size / tail))[:, None]))
