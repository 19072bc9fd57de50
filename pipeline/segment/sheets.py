"""Membranes between vessels that touch: sheets in the lumen that are darker than what lies on both sides of them.

The blur of a membrane thinner than a voxel leaves grey above half height all over it, and the wall that is found knows
nothing of it. One of 0.12 mm between vessels of 0.3 mm voxels still takes 15 % of the contrast: in each voxel little
more than the noise, over the sheet far more.
"""

from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.arrays.cores import in_parts
from pipeline.arrays.grids import unflattened
from pipeline.arrays.jets import smooth_voxels
from pipeline.arrays.lattice import sparse_zeros
from pipeline.segment._kernels.voxels import rebased
from pipeline.segment.contact import Contact, contacts, parts
from pipeline.segment.levels import Index, Vessel
from solver.grid import Grid, read_only

STEP = 2.5
"""Voxels to either side, 1.7 to 2.8 once they are whole ones, at which a sheet's grey is compared: its blur, with the
smoothing, has a deviation of 1.1."""
WAYS = [np.rint(STEP * way / np.linalg.norm(way)).astype(np.int64) for way in np.indices((3, 3, 3)).reshape(3, 27).T - 1
        if tuple(way) > (0, 0, 0)]  # fmt: skip
"""Steps across a sheet, of the 13 directions of a lattice."""
LONGEST = 2.0
"""Longest step over STEP of the smallest voxels: across slices of 2 mm it would reach round a bend of the vessel."""
DARKER, SIGMAS = 0.08, 4.0
"""Share of the contrast, and standard deviations of the smoothed noise, by which both sides are brighter."""
DEEP = 2.0
"""Voxels from the wall from which grey is the plateau's. Half of those of a parted vessel are not its membrane's."""
APART = 1.8
"""Voxels of a sheet are linked across corners, sqrt(3), and not across a gap."""
LEAST, WIDE = 100, 5.0
"""Voxels of a sheet at least, and over the square of its depth in voxels. At the crotch of 10 branches there are 37 to
76, in uneven filling 3 times that square at most; between vessels that touch 126 and more, 16 times and more."""
LEAST_AREA = 2.0
"""Least area of an opening that a sheet fills, in voxel faces, over the square of the vessel's radius: 0.2 to 1.0 at
crotches of branches, 3 to 15 between vessels that touch."""
NEXT_TO = 0.1
"""Depth in voxels that is left within a sheet, so that what lies on its two sides still meets there."""


def open_ones(vessel: Vessel, seen: tuple[Contact, ...], sheet: Index) -> tuple[Contact, ...]:
    """Places where vessels that do not branch from each other are open to each other, by their shape or by a sheet.

    seen : those by its shape.  sheet : voxels of sheets, none where it is not filled alike across: a wire in a fainter
    layer leaves a sheet between it and the brighter one.
    """
    if not len(sheet):
        return seen
    parted = contacts(_parted(vessel.distance, sheet), LEAST_AREA)
    # an opening that both find is larger by the one or by the other
    alone = [c for c in seen if all(np.linalg.norm(c.place_mm - o.place_mm) > _across(o) for o in parted)]
    return (*parted, *alone) if parted else seen


def _across(opening: Contact) -> float:
    """Diameter, mm, of a round opening of that area."""
    return 2.0 * float(np.sqrt(opening.area_mm2 / np.pi))


def sheets(vessel: Vessel) -> Index:
    """The voxels (flat, of the vessel's box) of sheets that may part the vessel."""
    scan, distance = vessel.scan, vessel.distance
    shape, depth = distance.shape, -distance.values.reshape(-1)
    spacing, inner = distance.spacing_mm, np.flatnonzero(depth > 0)
    if not len(inner):
        return inner
    voxel = distance.voxel_mm
    there = rebased(inner, shape, vessel.corner, scan.shape)
    share = vessel.levels.share(smooth_voxels(scan.values, vessel.taps, there))
    # no brighter than the plateau: beside a wire everything is dark. The level's own may be a membrane's
    deep = share[depth[inner] > DEEP * voxel]
    grey = sparse_zeros(shape, np.float32)
    share = np.minimum(share, max(1.0, float(np.median(deep))) if len(deep) else 1.0)
    grey.reshape(-1)[inner] = share
    ways = [way for way in WAYS if np.linalg.norm(way * spacing) <= LONGEST * STEP * voxel]
    least = max(DARKER, SIGMAS * vessel.levels.noise_after(vessel.taps) / vessel.levels.contrast)
    inner = np.asarray(inner[share.max() - share > least])  # nothing beside the others is so much brighter
    dark = inner[np.concatenate(in_parts(partial(_darker, grey, ways), inner)) > least]
    if not len(dark):
        return dark
    part = parts(unflattened(dark, shape).astype(float), APART)
    count, deepest = np.bincount(part), np.zeros(part.max() + 1)
    np.maximum.at(deepest, part, depth[dark] / voxel)
    return dark[(count >= np.maximum(LEAST, WIDE * deepest**2))[part]]


def _darker(grey: NDArray[np.float32], ways: list[Index], voxels: Index) -> NDArray[np.float32]:
    """By how much both sides of voxels (flat) are brighter than these, the most of all ways across."""
    at, last = unflattened(voxels, grey.shape), np.array(grey.shape) - 1
    least_side = np.zeros(len(voxels), np.float32)
    for way in ways:
        one, other = (grey[tuple(np.clip(at + step, 0, last).T)] for step in (way, -way))
        np.maximum(least_side, np.minimum(one, other), out=least_side)
    return np.asarray(least_side - grey.reshape(-1)[voxels])


def _parted(distance: Grid, sheet: Index) -> Grid:
    """The signed distance with sheets (flat voxels) for walls."""
    spacing, values = distance.spacing_mm, distance.values.copy()
    inner = np.flatnonzero(values < 0)
    tree = cKDTree(unflattened(sheet, distance.shape) * spacing)
    away = tree.query(unflattened(inner, distance.shape) * spacing, distance_upper_bound=-float(values.min()))[0]
    depth = np.maximum(away, NEXT_TO * distance.voxel_mm)
    values.reshape(-1)[inner] = np.maximum(values.reshape(-1)[inner], -depth)
    return distance.with_values(read_only(values))
