"""How much noise a fit sees: correlated noise does not average out over the wire as white noise does."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.special import ndtr

from pipeline.arrays.grids import unflattened
from pipeline.model import Array
from pipeline.trace.region import HALO_VOXELS
from pipeline.trace.subtraction import Subtraction
from pipeline.trace.tube import Tube

CLEAR_VOXELS = 3.5
"""Distance from the wire's axis from which grey less the fitted wire is taken for noise alone: nearer, the fit has
taken some of it away."""
BESIDE_VOXELS = 12.0
"""Distance up to which it is taken for that: noise and background are those of the wire's own surroundings."""
PLACES = 300
"""Places at which the templates are tried, in DEPTHS groups: a standard deviation to 6 per cent in each."""
DEPTHS = 4
"""Groups of places by their depth in the lumen: near the wall the background is known less well."""
LEAST = 50
"""Places below which nothing is measured."""
HALF = 4
"""Half width of the templates in voxels."""


def _templates(sigma: float) -> tuple[list[Array], list[Array]]:
    """Patterns by which the fit takes noise for a shift: sideways, of a piece of wire along an axis; and of its end.

    The end's is a blob made orthogonal to a change of amplitude and of offset, which are fitted, too.
    """
    x = np.arange(-HALF, HALF + 1) / sigma
    bell, side = np.exp(-0.5 * x**2), x * np.exp(-0.5 * x**2)
    long = np.ones(2 * HALF + 1)
    sideways = [
        np.einsum("i,j,k->ijk", *rows)
        for rows in ((side, bell, long), (long, side, bell), (bell, long, side), (side, long, bell))
    ]
    half = ndtr(x)
    blob = np.einsum("i,j,k->ijk", bell, bell, bell)
    ends = [_orthogonal(blob, np.einsum("i,j,k->ijk", h, bell, bell)) for h in (half, half[::-1])]
    return sideways, [np.moveaxis(e, 0, axis) for e in ends for axis in range(3)]


def _orthogonal(template: Array, taken: Array) -> Array:
    """The part of a template that is orthogonal to another one (``taken``) and to a constant."""
    basis = np.linalg.qr(np.stack([taken.ravel(), np.ones(taken.size)], axis=1))[0]
    flat = template.ravel()
    return np.asarray((flat - basis @ (basis.T @ flat)).reshape(template.shape))


def _responses(patches: NDArray[np.float32], templates: list[Array]) -> Array:
    """Squared responses (places, templates) of unit-norm templates."""
    shapes = np.stack([t.ravel() / np.linalg.norm(t) for t in templates])
    return np.asarray((patches.reshape(len(patches), -1) @ shapes.T) ** 2, float)


def _spread(square: Array) -> float:
    """Root mean square, from squares that are cut off at three (robust) standard deviations."""
    return float(np.sqrt(np.mean(np.minimum(square, 9 * np.median(square) / 0.4549))))


def _places(image: Subtraction, curve: Array) -> NDArray[np.int64]:
    """Voxels of the lumen (n, 3) away from the curve, with room for a template around them."""
    box = image.region.box
    index = unflattened(image.region.within[::7], box.shape)
    inner = np.all((index >= HALF) & (index < np.array(box.shape) - HALF), axis=1)
    index = index[inner]
    index = index[box.values[tuple(index.T)] < 0]
    if len(index) and len(curve):
        most = BESIDE_VOXELS * image.voxel
        far = cKDTree(curve).query(index * image.spacing, distance_upper_bound=most)[0]
        index = index[(far > CLEAR_VOXELS * image.voxel) & np.isfinite(far)]
    return np.asarray(index[:: max(1, len(index) // PLACES)])


def _patches(image: Subtraction, tube: Tube, index: NDArray[np.int64]) -> tuple[NDArray[np.float32], Array]:
    """Patches of grey less the tube's around places (n, 3), and the share (n,) of each that was read: the rest is 0."""
    offset = np.arange(-HALF, HALF + 1)
    i, j, k = (index[:, axis, None] + offset for axis in range(3))
    at = (i[:, :, None, None], j[:, None, :, None], k[:, None, None, :])
    with image.showing(tube.voxels, tube.rest):
        patches = image.grey[at]
    # not by grey that is 0: of whole greys much of the noise is
    box = image.region.box
    return patches, np.asarray(np.mean(box.values[at] < HALO_VOXELS * np.min(box.spacing_mm), axis=(1, 2, 3)))


def inflation(image: Subtraction, curve: Array, tube: Tube) -> tuple[Array, Array]:
    """Factors (n,) on standard deviations of a fit that took the noise for white: across the wire, and at its tip.

    curve : (n, 3) kernel coordinates of the ``tube`` that was fitted. Measured at places of the lumen beside the wire,
    at several depths in it; 1 where there is no room to measure. White noise gives 1 by construction.
    """
    h, white = image.voxel, (np.ones(len(curve)), np.ones(len(curve)))
    index = _places(image, curve)
    if image.thick_slices or len(index) < LEAST:
        return white
    patches, read = _patches(image, tube, index)
    known = read > 0.8
    if known.sum() < LEAST:
        return white
    # voxels outside the halo were not read and are 0: the response is put on the scale of those that were
    scale = image.noise**2 * read[known, None]
    squares = [_responses(patches[known], t) / scale for t in _templates(tube.sigma / h)]
    depth = image.region.box.values[tuple(index[known].T)]
    groups = np.array_split(np.argsort(depth), max(1, min(DEPTHS, len(depth) // LEAST)))
    middle = [np.mean(depth[g]) for g in groups]
    factors = ([max(0.8, _spread(square[g])) for g in groups] for square in squares)
    across, along = (np.interp(image.depth_at(curve), middle, f) for f in factors)
    return across, along
