"""A way through the vessel of a real scan: from its widest end past its widest place."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, convolve, distance_transform_edt, label, maximum_filter
from skimage.graph import MCP_Geometric
from skimage.morphology import skeletonize

from data_synthetic.anatomy.from_tree import smooth_tube
from data_synthetic.anatomy.tubes import Tube
from data_synthetic.geometry import Array, Index, ScanGrid, Volume, arc_lengths

Mask = NDArray[np.bool_]

BEFORE_MM, AFTER_MM = 75.0, 20.0
"""The way begins this far before the widest place (an aneurysm, where there is one) and ends this far after it."""
WIDE_ENOUGH, NEAR_VOXELS = 0.8, 6
"""Share of the widest end's radius from which an end may be the inlet, and how near to an end its radius is taken."""


def vessel_threshold(values: Volume) -> float:
    """Half the grey value of the vessel: the median of what is brighter than a quarter of the brightest."""
    top = float(np.percentile(values, 99.9))
    return 0.5 * float(np.median(values[values > 0.25 * top]))


def find_way(values: Volume, grid: ScanGrid, threshold: float) -> tuple[Mask, Tube]:
    """The voxels of the vessel, dilated by two, and the way as a tube.

    The vessel is the largest bright component; the way starts at its widest end and stays longest with the path to its
    widest place.
    """
    parts, _ = label(values > threshold)
    sizes = np.bincount(parts.ravel())
    sizes[0] = 0
    vessel = parts == int(np.argmax(sizes))
    inside = distance_transform_edt(vessel, sampling=grid.spacing_mm)
    ends = _ends(vessel)
    widest = np.array(np.unravel_index(int(np.argmax(inside)), inside.shape))
    away = np.linalg.norm((ends - widest) * grid.spacing_mm, axis=1)
    # largest inscribed radius near each end: an end's own voxel is always at the wall
    width = maximum_filter(inside, 2 * NEAR_VOXELS + 1, mode="constant")[tuple(ends.T)]
    width *= away > 2 * inside.max()
    # skeletons have spurs: of the widest ends the furthest is the inlet
    inlet = ends[int(np.argmax(away * (width > WIDE_ENOUGH * width.max())))]
    cost = np.where(vessel, 1.0 / (0.05 + inside / inside.max()) ** 3, -1.0)
    search = MCP_Geometric(cost, sampling=tuple(grid.spacing_mm.tolist()))
    search.find_costs([tuple(inlet.tolist())])
    path, neck = _past(search, ends, widest, inside, grid)
    return binary_dilation(vessel, iterations=2), _cut(path, neck, inside, grid)


def _ends(vessel: Mask) -> Index:
    """End points (n, 3) of the skeleton."""
    skeleton = skeletonize(vessel) > 0
    neighbours = convolve(skeleton.astype(np.uint8), np.ones((3, 3, 3), dtype=np.uint8), mode="constant")
    return np.argwhere(skeleton & (neighbours == 2))


def _past(search: MCP_Geometric, ends: Index, widest: Index, inside: Array, grid: ScanGrid) -> tuple[Index, int]:
    """The path that shares most with the one to the widest place and goes on furthest; where the two part."""
    to_widest = [tuple(p) for p in search.traceback(tuple(widest.tolist()))]
    best: tuple[float, Index, int] = (-np.inf, np.zeros((0, 3), dtype=np.int64), 0)
    for end in ends:
        path = search.traceback(tuple(end.tolist()))
        shared = next(
            (i for i, (a, b) in enumerate(zip(path, to_widest, strict=False)) if tuple(a) != b), len(path) - 1
        )
        beyond = np.array(path[shared:])
        wide = inside[tuple(beyond.T)] > 0.7
        usable = float(np.argmin(wide)) if not wide.all() else float(len(beyond))
        score = shared + min(usable * float(grid.spacing_mm.min()), AFTER_MM) * 4.0
        if score > best[0]:
            best = (score, np.array(path), shared)
    return best[1], best[2]


def _cut(path: Index, neck: int, inside: Array, grid: ScanGrid) -> Tube:
    """The stretch of the path about the neck, smoothed."""
    points = grid.to_mm(path)
    arc = arc_lengths(points)
    first = int(np.searchsorted(arc, max(arc[neck] - BEFORE_MM, 6.0)))
    radius = inside[tuple(path.T)]
    last = int(np.searchsorted(arc, min(arc[neck] + AFTER_MM, arc[-1] - 2.0)))
    narrow = np.flatnonzero(radius[neck:last] < 0.6)
    last = neck + int(narrow[0]) if len(narrow) else last
    # an aneurysm's own radius says nothing about the way past it
    return smooth_tube("way", points[first:last], np.minimum(radius[first:last], 1.2), smoothing_mm=1.0)
