"""How much noise a fit sees: correlated noise does not average out over the wire as white noise does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.model import Array
from pipeline.trace.scene import Scene

CLEAR_VOXELS = 7.0
"""Distance from the wire from which grey is taken for noise alone."""
PLACES = 300
"""Places at which the templates are tried: a standard deviation to 4 per cent."""
HALF = 4
"""Half width of the templates in voxels."""


@dataclass(frozen=True)
class Inflation:
    """Factors on standard deviations of a fit that took the noise for white: across the wire, and at its tip."""

    across: float = 1.0
    along: float = 1.0


def _templates(sigma: float) -> tuple[list[Array], list[Array]]:
    """What the fit multiplies noise with: a sideways step of a piece of wire (three runs of the axes), and an end's."""
    x = np.arange(-HALF, HALF + 1) / sigma
    bell, side = np.exp(-0.5 * x**2), x * np.exp(-0.5 * x**2)
    long = np.ones(2 * HALF + 1)
    sideways = [
        np.einsum("i,j,k->ijk", *rows)
        for rows in ((side, bell, long), (long, side, bell), (bell, long, side), (side, long, bell))
    ]
    return sideways, [np.einsum("i,j,k->ijk", bell, bell, bell)]


def _spread(patches: NDArray[np.float32], templates: list[Array]) -> float:
    """Root mean square response of unit-norm templates."""
    shapes = np.stack([t.ravel() / np.linalg.norm(t) for t in templates])
    response = patches.reshape(len(patches), -1) @ shapes.T
    return float(np.sqrt(np.mean(np.minimum(response**2, 9 * np.median(response**2) / 0.4549))))


def inflation(scene: Scene, curve: Array, sigma_mm: float) -> Inflation:
    """Measured at places of the lumen away from the wire; 1 where there is no room to measure.

    curve : (n, 3) kernel coordinates.  sigma_mm : blur of the wire. White noise gives 1 by construction.
    """
    box = scene.region.box
    h = float(scene.spacing.min())
    if scene.spacing.max() > 1.5 * h:
        return Inflation()
    index = np.stack(np.unravel_index(scene.region.within[::7], box.shape), axis=1)
    inner = np.all((index >= HALF) & (index < np.array(box.shape) - HALF), axis=1)
    index = index[inner]
    if len(index) and len(curve):
        far = cKDTree(curve).query(index * scene.spacing, distance_upper_bound=CLEAR_VOXELS * h)[0]
        index = index[~np.isfinite(far)]
    offset = np.arange(-HALF, HALF + 1)
    known = box.values[tuple(index.T)] < 0
    index = index[known][:: max(1, int(known.sum()) // PLACES)]
    if len(index) < 50:
        return Inflation()
    i, j, k = (index[:, axis, None] + offset for axis in range(3))
    patches = scene.grey[i[:, :, None, None], j[:, None, :, None], k[:, None, None, :]]
    read = np.mean(patches != 0, axis=(1, 2, 3)) > 0.8
    if read.sum() < 50:
        return Inflation()
    # voxels outside the halo were not read and are 0: the response is put on the scale of those that were
    share = np.sqrt(np.mean(patches[read] != 0))
    across, along = (_spread(patches[read], t) for t in _templates(sigma_mm / h))
    return Inflation(max(0.8, across / share / scene.noise), max(0.8, along / share / scene.noise))
