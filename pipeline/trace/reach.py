"""How much further back or further on a wire may end, by the grey of all voxels around its end.

A profile read along the wire tells less: blurred by 0.7 voxel it holds 0.6 of what the voxels say of a blurred wire.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.grids import unflattened
from pipeline.model import Array, arc_length
from pipeline.trace.attempt import dense
from pipeline.trace.crest_profile import AHEAD_VOXELS, BACK_VOXELS
from pipeline.trace.link import extended, resampled
from pipeline.trace.subtraction import Subtraction, numbered
from pipeline.trace.tube import WINDOW, Tube

END_SIGMAS = 3.0
"""Standard deviations within which an end is possible."""
STEP_VOXELS = 0.25
"""Distance of the sources that stand for the wire, and of the ends that are tried."""
FURTHEST_STEP = 100.0
"""Distance (voxel) from the end up to which a stated step is used: further ones would take long and much memory."""


def _sources(image: Subtraction, line: Array, sigma: float) -> tuple[Array, Array]:
    """Grey (n,) of the voxels around a line (m, 3), and what a wire of height 1 up to each point gives them (n, m).

    Voxels that wire before the line lights up, too, are left out.
    """
    h = image.voxel
    with numbered(image, line, WINDOW * sigma) as (voxels, _):
        index = unflattened(voxels, image.grey.shape) * image.spacing
    square = np.sum((index[:, None] - line[None]) ** 2, axis=2)
    keep = np.argmin(square, axis=1) * STEP_VOXELS * h > WINDOW * sigma
    share = np.exp(-0.5 * square[keep] / sigma**2) * STEP_VOXELS * h / (np.sqrt(2.0 * np.pi) * sigma)
    return image.grey.reshape(-1)[voxels[keep]].astype(float), np.cumsum(share, axis=1)


def _costs(
    grey: Array, wire: Array, before: NDArray[np.int64], tries: NDArray[np.int64], now: int, levels: Array
) -> Array:
    """Sums of squares (t,) left by wires that end at sources ``tries`` (t,), with steps at sources ``before`` (s,).

    levels : (s + 1,) brightness between the steps as stated: one height is free, and the steps keep their distance from
    the end, which is ``now``. Empty where each piece's height is free and the steps stay where they are.
    """
    out = []
    for end in tries:
        edges = before + (end - now if len(levels) else 0)
        sums = [0.0 * grey, *(wire[:, edge] for edge in edges), wire[:, end]]
        design = np.stack([b - a for a, b in pairwise(sums)], axis=1)
        design = (design @ levels)[:, None] if len(levels) else design
        height = np.linalg.lstsq(design, grey, rcond=None)[0]
        out.append(float(np.sum((grey - design @ height) ** 2)))
    return np.array(out)


def _stated_back_mm(tube: Tube, end: float, voxel: float) -> float:
    """How far before the end (mm) the largest stated step lies; 0 where none is, or none near enough."""
    if not tube.steps.stated or not len(tube.steps.edges):
        return 0.0
    largest = int(np.argmax(np.abs(np.diff(np.log(tube.steps.levels)))))
    back = end * (1.0 - float(tube.steps.edges[largest]))
    return back if back < FURTHEST_STEP * voxel else 0.0


def end_range(image: Subtraction, tube: Tube) -> tuple[float, float]:
    """How much further back and further on (mm) the wire of a tube may end.

    An end is possible if it explains the grey to within three standard deviations of the best one. A stated step tells
    of the end, too: it lies as far before it as is stated.
    """
    h, step, skirt = image.voxel, STEP_VOXELS * image.voxel, WINDOW * tube.sigma
    points = resampled(dense(tube, step), step)
    end = float(arc_length(points)[-1])
    pinned = _stated_back_mm(tube, end, h)
    start = max(0, len(points) - round((pinned + BACK_VOXELS * h + skirt) / step))
    line = resampled(extended(points[start:], AHEAD_VOXELS * h, step), step)
    first = float(arc_length(points)[start])
    grey, wire = _sources(image, line, tube.sigma)
    own = (tube.steps.edges * end - first) / step
    before = own[(own * step > skirt) & (own < len(line) - 1)].astype(np.int64)
    now = round((end - first) / step)
    least = before[-1] if len(before) else round(skirt / step)
    levels = tube.steps.levels[-len(before) - 1 :] if pinned else np.zeros(0)
    if pinned:  # no step may leave the stretch that is looked at
        least = now - before[0] + round(skirt / step)
    tries = np.arange(least + round(tube.sigma / step), len(line))
    if not len(grey) or not len(tries):
        return 0.0, 0.0
    costs = _costs(grey - tube.offset, wire, before, tries, now, levels) / (image.noise * image.correlation) ** 2
    likely = tries[costs - costs.min() < END_SIGMAS**2] * step + first
    return max(0.0, end - float(likely[0])), max(0.0, float(likely[-1]) - end)
