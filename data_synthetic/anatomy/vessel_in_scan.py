"""Finds a vessel filled with contrast among a scan's bright voxels (a tube, no sheet of bone), and the way through."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, find_objects, label
from scipy.spatial import cKDTree
from skimage.morphology import skeletonize

from data_synthetic.anatomy.centrelines import Tree
from data_synthetic.anatomy.from_tree import smooth_tube, widest_path
from data_synthetic.anatomy.tubes import Tube
from data_synthetic.geometry import Array, Index, ScanGrid, Volume, arc_lengths

Mask = NDArray[np.bool_]

LEVELS = np.linspace(0.1, 0.9, 9)
"""Shares of the way from the commonest grey to the brightest at which bright voxels are looked at."""
COARSE = 160
"""Voxels along an axis of the copy in which levels are compared."""
SMALLEST_VOXELS, LARGEST_SHARE = 150, 0.3
"""A vessel has more voxels than this, and takes no larger share of the scan."""
SAMPLES = 300
"""Places of a skeleton that are looked at."""
SHEET = 0.53
"""Share of the ball of twice the inscribed radius: a straight tube fills 3/8 of it, a sheet 11/16; this is half-way."""
MOSTLY = 0.5
"""Least share of the places that must look like a tube: a skull with vessels attached to it has fewer."""
THINNEST_VOXELS = 1.2
"""Least inscribed radius of the places that are looked at: noise has none."""
SURROUNDINGS = 2, 5
"""From and to how many voxels outside a vessel its background is read."""
BEFORE_MM = 5.0
"""Length left out at the beginning of the way: there the scan may cut the vessel off."""
SHORTEST_WAY_MM, LONGEST_WAY_MM = 22.0, 100.0
"""Length of the way: without its ends the shortest has room for two frames, 10 and 14 mm deep; the longest leads from
the neck to beyond a siphon."""
WIDEST_WAY_MM = 1.2
"""Largest radius of the way's tube: that of an aneurysm says nothing about the way past it."""


@dataclass(frozen=True, eq=False)
class Vessel:
    """The voxels of a vessel, and the grey inside and around it; its wall lies half-way between the two."""

    voxels: Mask
    grey: float
    background: float

    @property
    def threshold(self) -> float:
        """The half level."""
        return 0.5 * (self.grey + self.background)


def find_vessel(values: Volume, grid: ScanGrid) -> Vessel:
    """The longest bright tube of a scan; ValueError where there is none."""
    stride = tuple(-(-n // COARSE) for n in values.shape)
    coarse = values[tuple(slice(None, None, step) for step in stride)]
    spacing = grid.spacing_mm * stride
    found = [(tube_mm(part, spacing), place) for level in levels(coarse) for place, part in components(coarse, level)]
    if not found or max(found)[0] == 0.0:
        raise ValueError("no bright tube")
    _, (level, *voxel) = max(found)
    return _measured(values, level, np.array(voxel) * stride)


def levels(values: Volume) -> Array:
    """Grey values between what is commonest and what is brightest, the highest first."""
    counts, edges = np.histogram(values, 256, (float(values.min()), float(np.percentile(values, 99.98))))
    commonest = float(edges[int(np.argmax(counts))])
    return np.asarray(commonest + LEVELS[::-1] * (edges[-1] - commonest))


def components(values: Volume, level: float) -> Iterator[tuple[tuple[float, int, int, int], Mask]]:
    """The two largest connected parts above a level: the level with a voxel of each, and the part in its own box."""
    parts, _ = label(values > level)
    sizes = np.bincount(parts.ravel())
    sizes[0] = 0
    sizes[(sizes < SMALLEST_VOXELS) | (sizes > LARGEST_SHARE * values.size)] = 0
    boxes = find_objects(parts)
    for number in np.argsort(-sizes)[:2]:
        if sizes[number]:
            box = boxes[number - 1]
            part = np.pad(parts[box] == number, 1)
            i, j, k = np.argwhere(part)[0] - 1 + [axis.start for axis in box]
            yield (level, int(i), int(j), int(k)), part


def tube_mm(part: Mask, spacing_mm: Array) -> float:
    """Length (mm) of a part's skeleton, times the squared share of its places that look like a tube; 0 for a sheet."""
    inside = distance_transform_edt(part, sampling=spacing_mm)
    finest = float(np.min(spacing_mm))
    skeleton = np.argwhere(skeletonize(part) > 0)
    seen = skeleton[inside[tuple(skeleton.T)] > THINNEST_VOXELS * finest]
    if not len(seen):
        return 0.0
    chosen = seen[:: -(-len(seen) // SAMPLES)]
    share = float(np.mean([_filled(part, voxel, 2.0 * inside[tuple(voxel)] / spacing_mm) < SHEET for voxel in chosen]))
    return share**2 * len(seen) * finest if share > MOSTLY else 0.0


def _filled(part: Mask, centre: Index, radii: Array) -> float:
    """Share of an ellipsoid (radii in voxels) that lies inside; beyond the part's box is outside."""
    reach = np.ceil(radii).astype(int)
    low, high = np.maximum(centre - reach, 0), np.minimum(centre + reach + 1, part.shape)
    axes = [(np.arange(a, b) - c) / r for a, b, c, r in zip(low, high, centre, radii, strict=True)]
    ball = sum(x**2 for x in np.meshgrid(*axes, indexing="ij", sparse=True)) <= 1.0
    inside = part[tuple(slice(a, b) for a, b in zip(low, high, strict=True))]
    return float(np.count_nonzero(inside & ball)) / float(4.0 / 3.0 * np.pi * np.prod(radii))


def _measured(values: Volume, level: float, voxel: Index) -> Vessel:
    """The vessel that holds a voxel, bounded by the half level between its own grey and that around it."""
    vessel = _holding(values > level, voxel)
    greys = _greys(values, vessel)
    wall = _holding(values > 0.5 * sum(greys), voxel)
    # at the half level the vessel may be connected to a bone that the first level had kept apart
    if wall.any() and np.count_nonzero(wall) < 3 * np.count_nonzero(vessel):
        vessel, greys = wall, _greys(values, wall)
    return Vessel(vessel, *greys)


def _holding(bright: Mask, voxel: Index) -> Mask:
    """The connected part of bright voxels that holds this one, or one beside it."""
    parts, _ = label(bright)
    near = parts[tuple(slice(max(i - 2, 0), i + 3) for i in voxel.tolist())]
    number = int(np.bincount(near[near > 0]).argmax()) if near.any() else 0
    return np.asarray((parts == number) & (number > 0))


def _greys(values: Volume, vessel: Mask) -> tuple[float, float]:
    """Medians inside, where it is deeper than a voxel, and around it."""
    (box,) = find_objects(vessel.astype(np.uint8))
    box = tuple(slice(max(axis.start - 6, 0), axis.stop + 6) for axis in box)
    values, vessel = values[box], vessel[box]
    outside = distance_transform_edt(~vessel)
    around = (outside > SURROUNDINGS[0]) & (outside <= SURROUNDINGS[1])
    deep = distance_transform_edt(vessel) > 1.5
    return float(np.median(values[deep if deep.any() else vessel])), float(np.median(values[around]))


def find_way(vessel: Mask, grid: ScanGrid) -> Tube:
    """The widest long way along a vessel's skeleton, as a smooth tube; ValueError where there is none."""
    (box,) = find_objects(vessel.astype(np.uint8))
    part = np.pad(vessel[box], 1)
    inside, voxels = distance_transform_edt(part, sampling=grid.spacing_mm), np.argwhere(skeletonize(part) > 0)
    edges = cKDTree(voxels).query_pairs(1.8, output_type="ndarray")  # neighbours share a corner at least
    corner = np.array([axis.start for axis in box]) - 1
    tree = Tree(grid.to_mm(voxels + corner), inside[tuple(voxels.T)], edges)
    path = widest_path(tree, LONGEST_WAY_MM)
    arc = arc_lengths(tree.points_mm[path])
    path = path[arc > BEFORE_MM]
    if arc[-1] < SHORTEST_WAY_MM:
        raise ValueError(f"a way of {arc[-1]:.0f} mm")
    return smooth_tube("way", tree.points_mm[path], np.minimum(tree.radii_mm[path], WIDEST_WAY_MM), smoothing_mm=1.0)
