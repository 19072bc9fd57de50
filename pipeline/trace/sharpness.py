"""Is the scanner as sharp along one of its axes as along another? The vessel's wall tells, whatever the wire is.

A blur that is 1.3 times as wide along one axis makes a round wire as oblong as two in contact.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.special import ndtr

from pipeline.model import Array
from pipeline.trace.subtraction import Subtraction

WALL_BLURS, CLEAR_BLURS = 2.5, 3.5
"""How far from the wall, in the scanner's blurs, its profile is read, and how far from the wire, in the wire's."""
THINNED, LEAST_PLACES = 3, 1000
"""One voxel of so many is read, and how many there must be: 7000 give the differences to 3 % of the blur's square."""
CELL_MM, SURE_STEP = 6.0, 5.0
"""Cells in which the medium is as bright all over, and how many standard deviations of it a step has to have: contrast
that decays along the vessel by 60 % passes for a blur otherwise, as the vessel turns."""
SURELY = 0.35
"""Least difference that is told, over the blur's square. Where vessels run along one axis the wall says 0.3 of scanners
that are as sharp along all; of a cone-beam scanner whose rays come from half a turn and its cone it said 0.7 to 0.8,
and the wire 0.7."""
INNER_BLURS, EVEN = 1.5, 1.2
"""From how far inside, in blurs, the medium of a cell may differ from its level by so many standard deviations of noise
(rms): 0.9 to 1.05 in most, 1.2 where contrast decays, 1.4 to 2.8 where it has settled or a bone lies in the lumen."""


def blur_by_axis(image: Subtraction, points: Array, sigma: float) -> Array | None:
    """How much larger the square of the scanner's blur is along each axis (3,) than usual, mm^2; None where no wall is
    there to tell, or it tells of no difference.

    points, sigma : the wire's curve (n, 3) and blur, which is left out.  The profile of a wall with the unit normal n
    is as wide as the sum of n_k^2 times the square of the blur along axis k; a wall that lies off, or bends, moves it.
    """
    box, blur, at = image.region.box.values, image.wall_blur_mm, _beside_wall(image, points, sigma)
    if len(at) < LEAST_PLACES:
        return None
    rise = np.stack([box[tuple((at + step).T)] - box[tuple((at - step).T)] for step in np.eye(3, dtype=int)], axis=1)
    rise = rise / (2.0 * image.spacing)
    steep = np.maximum(np.sum(rise**2, axis=1), 0.25)  # slices drawn together make distances along them shorter
    depth = box[tuple(at.T)] / np.sqrt(steep) / blur
    grey = image.scan.values[tuple((at + image.region.corner).T)].astype(float)
    cells = (at * image.spacing // CELL_MM).astype(int).T
    cell = np.ravel_multi_index(tuple(cells), tuple(cells.max(axis=1) + 1))
    level, height, square = _step_in(cell, ndtr(-depth), grey)
    even = _even(cell, (grey - level - height * ndtr(-depth)) / image.noise, depth < -INNER_BLURS)
    even &= height * np.sqrt(square) > SURE_STEP * image.noise  # elsewhere there is no medium to tell
    if np.count_nonzero(even) < LEAST_PLACES:
        return None
    cell, depth, rise, steep = cell[even], depth[even], rise[even], steep[even]
    share, density = (grey - level)[even] / height[even], np.exp(-0.5 * depth**2) / np.sqrt(2.0 * np.pi)
    wider = (rise**2 / steep[:, None]) * (0.5 * depth * density / blur**2)[:, None]
    left = [_beside_step(cell, ndtr(-depth), column) for column in (*wider.T, density, share)]
    found = np.linalg.lstsq(np.column_stack(left[:-1]), left[-1], rcond=None)[0][:3]
    return np.asarray(found - found.mean()) if np.ptp(found) > SURELY * blur**2 else None


def _beside_wall(image: Subtraction, points: Array, sigma: float) -> NDArray[np.int64]:
    """Voxels (n, 3) of the box near the wall and away from the wire."""
    box = image.region.box.values
    at = image.region.sample[::THINNED]
    at = at[np.all((at > 0) & (at < np.array(box.shape) - 1), axis=1)]
    at = at[np.abs(box[tuple(at.T)]) < WALL_BLURS * image.wall_blur_mm]
    return np.asarray(at[cKDTree(points).query(at * image.spacing)[0] > CLEAR_BLURS * sigma])


def _even(cell: NDArray[np.int64], rest: Array, inner: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which places lie in cells of one grey inside. rest : (n,), over the noise, what a step leaves of the grey."""
    square = np.bincount(cell, inner * rest**2) / np.maximum(np.bincount(cell, inner), 1)
    return np.asarray(square[cell] < EVEN**2)


def _step_in(cell: NDArray[np.int64], step: Array, values: Array) -> tuple[Array, Array, Array]:
    """Level, height and sum of squares (n,) of the step that fits values (n,) best within their cell."""
    count = np.maximum(np.bincount(cell), 1)  # of an empty one
    middle, usual = (np.bincount(cell, x) / count for x in (step, values))
    away = step - middle[cell]
    square = np.bincount(cell, away**2)
    height = np.bincount(cell, away * values) / np.maximum(square, 1e-9)
    return np.asarray((usual - height * middle)[cell]), np.asarray(height[cell]), np.asarray(square[cell])


def _beside_step(cell: NDArray[np.int64], step: Array, values: Array) -> Array:
    """What a step within each cell does not explain of values (n,)."""
    level, height, _ = _step_in(cell, step, values)
    return np.asarray(values - level - height * step)
