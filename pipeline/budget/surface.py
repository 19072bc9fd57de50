"""Lumens whose surface is displaced at random: a smooth random field is added to the signed distance."""

import numpy as np

from pipeline.model import Array
from solver import Grid, VesselWall

KNOT_VOXELS = 1.9
"""Distance in voxels between the knots of the cubic splines that a field is made of: it is correlated as by a Gaussian
of 0.82 of that. A segmented carotid of 0.2 to 0.6 mm voxels is correlated as by one of 1.4 to 1.8 voxels."""
MEAN_SQUARE = 151.0 / 315.0
"""Sum over the knots of the squared weights of a cubic B-spline, mean over a cell; in space its third power."""


def _weights(count: int, knot: float) -> Array:
    """Weights (count, knots) of cubic B-splines, ``knot`` voxels apart, at each of ``count`` voxels."""
    knots = int(np.ceil(count / knot)) + 3
    t = np.abs(np.arange(count)[:, None] / knot - (np.arange(knots)[None] - 1.0))
    return np.where(t < 1.0, 2.0 / 3.0 - t * t + 0.5 * t**3, np.maximum(2.0 - t, 0.0) ** 3 / 6.0)


def offset_field(grid: Grid, rng: np.random.Generator) -> Array:
    """A smooth random field (nx, ny, nz) of standard deviation 1, as smooth in mm along all axes."""
    knot_mm = KNOT_VOXELS * float(np.mean(grid.spacing_mm))
    pairs = zip(grid.shape, grid.spacing_mm, strict=True)
    weights = [_weights(n, max(knot_mm / h, 1.0)).astype(np.float32) for n, h in pairs]
    field = rng.standard_normal([w.shape[1] for w in weights], dtype=np.float32)
    for w in weights:  # contracts the first axis and puts the new one last: after three all are in place
        field = np.tensordot(field, w, (0, 1))
    return np.asarray(field / np.float32(MEAN_SQUARE**1.5))


def displaced(wall: VesselWall, number: int, sigma_mm: float, seed: int) -> VesselWall:
    """The wall with its surface displaced at random, standard deviation ``sigma_mm``; the same for the same number."""
    if sigma_mm == 0.0:
        return wall
    rng = np.random.default_rng([seed, 1, number])
    return wall.shifted(np.float32(sigma_mm) * offset_field(wall.distance, rng))
