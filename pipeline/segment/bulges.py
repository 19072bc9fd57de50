"""The wall beside a wire that the scan shows: a bright wire on the wall lifts the grey there, and the wall bulges out.

A wire of 0.36 mm on the wall of a tube of 3 mm, in voxels of 0.3 mm, moved the wall by 1.2 voxels, and the trace, whose
background was read off that wall, by 0.4 voxel. A ball nearly as large as the vessel does not fit into such a bulge:
beside the wire the lumen is what such balls fill.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from pipeline.arrays.grids import indices_of, slopes_at
from pipeline.model import Array
from pipeline.segment.levels import BRIGHTER, GreyLevels, Index
from solver.grid import Grid

BRIGHT_NOISES = 4.0
"""Noises of a voxel above the vessel's grey from which a voxel that is BRIGHTER, too, is taken for the wire's."""
REACH_VOXELS = 3.0
"""How far a wire's blur moves the wall: around a bright voxel along the wall, and from a bright voxel in the lumen."""
FADES_VOXELS = 2.0
"""Length along the wall beyond that over which the change fades."""
MOST_VOXELS = 2.0
"""The most by which the wall is moved: bulges are 1.2 voxels high."""
THIN_VOXELS = 3.0
"""Radius of vessels up to which the wall is left alone: too few voxels are centres of balls."""
BALLS = 0.9
"""Least radius of a ball over the vessel's: 0.7 entered bulges of 4 voxels in a wall of radius 5 by half their height,
1 would leave out where the vessel is a little wider along the wire."""
BESIDE = 16
"""Bright voxels next to each other of which one, at least, looks straight at the vessel's middle."""
LEAST = 5
"""Bright voxels within REACH_VOXELS of one, itself included, from which it is no noise."""
NEAREST = 64
"""Balls next to a voxel among which the one is looked for that it is deepest in."""


def without_bulges(distance: Grid, scan: Grid, corner: Index, levels: GreyLevels) -> NDArray[np.float32]:
    """The signed distance with the wall drawn in beside a wire; as it was where none lies near the wall.

    distance : on a box of the ``scan`` that begins at its voxel ``corner``.
    """
    spacing = np.asarray(distance.spacing_mm)
    h = float(np.max(spacing))
    wire = _wire(distance, scan, corner, levels)
    middle, most = _middle(distance, wire) if len(wire) else (np.zeros((0, 3)), np.zeros(0))
    thick = most > THIN_VOXELS * h
    if not thick.any():
        return np.asarray(distance.values)
    lit, (centre, radius) = cKDTree(wire[thick] * spacing), _balls(distance, middle[thick], most[thick])
    near = _off_edge(distance, indices_of(np.abs(distance.values) < 2.0 * REACH_VOXELS * h))
    near = near[np.isfinite(lit.query(near * spacing, distance_upper_bound=3.0 * REACH_VOXELS * h)[0])]
    place, was = near * spacing, distance.values[tuple(near.T)].astype(float)
    away, ball = cKDTree(centre).query(place, min(NEAREST, len(centre)))
    held = np.min((away - radius[ball]).reshape(len(place), -1), axis=1)
    held = np.minimum(held, lit.query(place)[0])  # where the wire itself is seen, there is lumen
    along = lit.query(place - was[:, None] * _outwards(distance, near))[0] / h  # of its foot on the wall
    share = np.clip((REACH_VOXELS + FADES_VOXELS - along) / FADES_VOXELS, 0.0, 1.0)
    out = distance.values.copy()
    out[tuple(near.T)] += (share * np.clip(held - was, 0.0, MOST_VOXELS * h)).astype(np.float32)
    return np.asarray(out)


def _off_edge(distance: Grid, index: Index) -> Index:
    """Those of some voxels (n, 3) that do not lie on the side of the box."""
    return np.asarray(index[np.all((index > 0) & (index < np.array(distance.shape) - 1), axis=1)])


def _outwards(distance: Grid, index: Index) -> Array:
    """Unit normals (n, 3) along the box's axes, out of the vessel, at voxels (n, 3)."""
    slope = slopes_at(distance, index)
    return np.asarray(slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-9))


def _wire(distance: Grid, scan: Grid, corner: Index, levels: GreyLevels) -> Index:
    """The voxels (n, 3) of the box, in the lumen and near its wall, that are too bright for anything but a wire."""
    depth = -distance.values
    shell = _off_edge(distance, indices_of((depth > 0) & (depth < REACH_VOXELS * np.max(distance.spacing_mm))))
    grey = scan.values[tuple((shell + corner).T)]
    bright = max(levels.outside + BRIGHTER * levels.contrast, levels.inside + BRIGHT_NOISES * levels.noise)
    return np.asarray(shell[grey > bright])


def _balls(distance: Grid, middle: Array, most: Array) -> tuple[Array, Array]:
    """Centres (n, 3), mm from the box's first voxel, and radii (n,) of balls that fill the vessel beside a wire.

    middle, most : what ``_middle`` returns.
    """
    spacing = np.asarray(distance.spacing_mm)
    deep = indices_of(distance.values < -BALLS * most.min())
    away, nearest = cKDTree(middle).query(deep * spacing)
    radius = -distance.values[tuple(deep.T)].astype(float)
    kept = (radius >= BALLS * most[nearest]) & (away < most[nearest] + 2.0 * REACH_VOXELS * np.max(spacing))
    return deep[kept] * spacing, radius[kept]


def _middle(distance: Grid, wire: Index) -> tuple[Array, Array]:
    """The middle (n, 3), mm from the box's first voxel, of the vessel beside a wire's voxels (n, 3), and its radius.

    It is where the wall is farthest, on the way inwards from a voxel or from one of those BESIDE it: the bulge itself
    has a ridge in its middle, from which some look along it.
    """
    spacing = np.asarray(distance.spacing_mm)
    h = float(np.max(spacing))
    steps = 0.5 * h * np.arange(2 * int(-distance.values.min() / h) + 3)
    way = (wire * spacing)[:, None] - steps[:, None] * _outwards(distance, wire)[:, None]
    depth = -ndimage.map_coordinates(distance.values, np.moveaxis(way / spacing, 2, 0), order=1, mode="nearest")
    rising = np.logical_and.accumulate(depth >= np.maximum.accumulate(depth, axis=1) - 0.5 * h, axis=1)
    top = np.argmax(np.where(rising, depth, 0.0), axis=1)
    each = np.arange(len(wire))
    middle, most = way[each, top], depth[each, top]
    found = cKDTree(wire * spacing).query(wire * spacing, BESIDE, distance_upper_bound=REACH_VOXELS * h)
    beside = np.asarray(found[1])
    best = beside[each, np.argmax(np.append(most, 0.0)[beside], axis=1)]
    line = np.sum(beside < len(wire), axis=1) >= LEAST
    return middle[best], np.where(line, most[best], 0.0)
