"""Branches too thin to reach half the contrast: followed at a lower grey, and given the radius that their peak tells.

A cylinder of radius r blurred by sigma peaks at 1 - exp(-r^2 / 2 sigma^2) of the contrast: two voxels across and a blur
of 0.8 voxel leave half of it, one and a third a quarter. Connectedness at half height ends there. Such a branch is
connected to the vessel at a lower grey, and beyond the vessel's blurred skirt it is long, thin and nowhere bright.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.arrays.grids import indices_of, spelt
from pipeline.arrays.jets import Blurred, smooth_voxels
from pipeline.arrays.lattice import sparse_zeros
from pipeline.segment._kernels.connect import FULL as FULL_STRENGTH
from pipeline.segment._kernels.connect import Affinity
from pipeline.segment._kernels.contact import Inner, along_cores
from pipeline.segment._kernels.crests import crests
from pipeline.segment._kernels.solids import cones
from pipeline.segment._kernels.voxels import largest, rebased
from pipeline.segment._kernels.wall import PAD, dilate
from pipeline.segment.connect import connect, neighbours
from pipeline.segment.contact import numbered, parts
from pipeline.segment.levels import GreyLevels, Index, Vessel
from pipeline.segment.surface import into_box, padded_box
from solver.grid import Array, Grid

FAINTEST = 0.09
"""Least share of the contrast at which branches are followed: at a lower one, other tissue would be followed, too."""
SIGMAS = 4.5
"""The same in standard deviations of the smoothed noise: of a hundred million voxels 300 are above by chance, hardly
ever several side by side."""
SKIRT = 3
"""Layers around the voxels at FULL that the vessel's own blur may fill: from 0.65 to 0.09 it falls in two voxels."""
MISSED = 2
"""Layers around what connectedness found that may be the vessel still, where as bright as FULL; so has the wall."""
SHORTEST = 6
"""Voxels from end to end of a branch."""
FATTEST = 45.0
"""Most voxels per step along a branch: room for its cross-section where the skirt ends, and for oblique steps."""
FAINT, FAINT_FATTEST = 0.3, 250.0
"""Least share of the contrast that a thicker branch reaches, and most voxels per step along it, to be told as faint: a
radius of seven voxels, with its blur. Tissue has thousands."""
BRIGHTEST = 0.75
"""Share of the contrast above which something is no thin branch, but a vessel that connectedness did not reach."""
FULL = 0.65
"""Share of the contrast that a vessel thick enough for a surface at half height reaches: at a radius of 1.5 voxels."""
CREST_VOXELS = 0.7
"""Blur in which the crest is looked for."""
BRIDGE_VOXELS = 7.0
"""Longest gap over which pieces are joined: a skirt on both sides and a voxel more."""
LEAST_RADIUS = 0.6
"""Voxels: a thinner tube falls between the nodes of the distance and comes to pieces."""
OVERLAP_VOXELS = 1.0
"""Balls of LEAST_RADIUS that are no farther apart overlap, others are bridged: taken for one piece up to 2 voxels
apart, 4 to 8 of 18 branches of 0.67 voxels radius came to pieces."""
NEAR_VOXELS = 3.0
"""Radius in which a crest point is compared with the highest one."""
HIGHEST = 0.85
"""Least height of a crest point over that of the highest one within NEAR_VOXELS; half a blur off a crest it is 0.88."""
SHARP = 0.4
"""Least curvature of a crest over that of a Gaussian line of its height; half a blur off the middle it is still 0.7."""


@dataclass(frozen=True, eq=False)
class Beyond:
    """What is connected to a vessel at the faintest grey and lies beyond the skirt of its blur.

    voxels : flat, ascending.  inner : the same in a box.  share : their smoothed grey (n,) over the contrast.  thick :
    whether any part of the vessel is thick enough for a surface at half height.
    """

    voxels: Index
    inner: Inner
    share: NDArray[Any]
    thick: bool


Balls = tuple[Array, Array]
"""Thin branches as balls: centres (n, 3) mm along the box's axes from its first voxel, radii (n,) mm."""


def _low_affinity(levels: GreyLevels, affinity: Affinity) -> Affinity | None:
    """Tables that link any two voxels whose mean is above the faintest grey; None where noise leaves no room."""
    least = max(FAINTEST, SIGMAS * levels.noise_after(affinity.taps) / levels.contrast)
    if least > 0.4:
        return None
    mean = affinity.low + 0.5 / affinity.scale * np.arange(len(affinity.feature))
    feature = (mean >= levels.outside + least * levels.contrast).astype(np.float32)
    alike = np.full_like(affinity.homogeneity, FULL_STRENGTH)
    return affinity._replace(homogeneity=alike, feature=feature)


def _layers(around: Index, of: Index, shape: tuple[int, int, int], count: int) -> NDArray[np.uint8]:
    """For voxels ``of`` a padded box (flat): 1 for those ``around``, 2, 3, ... in layers around them, 0 beyond."""
    state = sparse_zeros(shape, np.uint8)
    state.reshape(-1)[around] = 1
    dilate(state, around, count)
    return np.asarray(state.reshape(-1)[of])


def beyond_skirt(
    volume: Grid, order: Index, low: Index, bright: float, taps: NDArray[Any]
) -> tuple[Index, Inner, bool]:
    """Voxels of ``low`` that the blur of the vessel does not reach, flat and ascending, and the same voxels in a box.

    order : the vessel's voxels, of which those from a grey ``bright`` on count, and so do those in MISSED layers around
    it. Also returns whether there are any.
    """
    corner, shape = padded_box(low, volume, 0.0, order)  # a low segment.threshold finds more than the faintest grey
    main, wide = (into_box(o, volume, corner, shape) for o in (order, low))
    near = low[_layers(main, wide, shape, MISSED) > 0]
    thick = near[smooth_voxels(volume.values, taps, near) >= bright]
    inner = np.sort(wide[_layers(into_box(thick, volume, corner, shape), wide, shape, SKIRT) == 0])
    return rebased(inner, shape, corner - PAD, volume.shape), numbered(shape, inner), len(thick) > 0


def beyond_vessel(volume: Grid, low: Index, order: Index, levels: GreyLevels, affinity: Affinity) -> Beyond:
    """What lies beyond the vessel ``order``, among the voxels of ``low_region``."""
    found, inner, thick = beyond_skirt(volume, order, low, levels.outside + FULL * levels.contrast, affinity.taps)
    share = levels.share(smooth_voxels(volume.values, affinity.taps, found))
    return Beyond(found, inner, share, thick)


def low_region(volume: Grid, seeds: Index, levels: GreyLevels, affinity: Affinity) -> tuple[Index, float]:
    """Flat indices of the voxels connected to the seeds at the faintest grey, and the number of voxels read."""
    tables = _low_affinity(levels, affinity)
    return (np.zeros(0, np.int64), 0.0) if tables is None else connect(volume, seeds, tables, 0.5, neighbours(6))


def branches(beyond: Beyond) -> tuple[list[Index], list[Index]]:
    """The voxels (flat) of each thin branch among those beyond the vessel, and of each that is thick, but too faint.

    The latter is no part of the lumen: filled to less than half, it never reaches the wall's level.
    """
    if not beyond.thick or len(beyond.voxels) < SHORTEST:
        return [], []
    part, steps = along_cores(beyond.inner, np.ones(len(beyond.voxels), bool))
    count = np.bincount(part)
    length, most = largest(part, steps + 1, len(count)), largest(part, beyond.share, len(count))
    long = (length >= SHORTEST) & (most <= BRIGHTEST)
    faint = long & (length >= 2 * SHORTEST) & (count > FATTEST * length) & (count <= FAINT_FATTEST * length)
    faint &= most >= FAINT
    together = np.argsort(part, kind="stable")
    each = [np.asarray(own, np.int64) for own in np.split(beyond.voxels[together], np.cumsum(count)[:-1])]
    thin = long & (count <= FATTEST * length)
    return [each[number] for number in np.flatnonzero(thin)], [each[number] for number in np.flatnonzero(faint)]


def warning(grid: Grid, faint: Sequence[Index]) -> tuple[str, ...]:
    """One sentence for the report on branches that are filled too little, or none. faint : a voxel of each."""
    if not faint:
        return ()
    place, count = f"[{spelt(grid.to_mm(faint[0]))}]", len(faint)
    many = f"{count} things like branches are" if count > 1 else "something like a branch is"
    return (
        f"segment: {many} too faint for the wall's level, half of the vessel's contrast, and left out of the lumen "
        f"({'the first ' * (count > 1)}at {place} mm); where it is a branch that is filled too little, and a wire may "
        "go there, scan with it filled, or give the lumen as a file (manifest key lumen)",
    )


def _highest(points: Array, share: Array) -> NDArray[np.bool_]:
    """Which points (n, 3), in voxels, have no much brighter one within NEAR_VOXELS; points on a crest's flank have."""
    near = cKDTree(points).query_ball_point(points, NEAR_VOXELS)
    return np.array([s >= HIGHEST * share[n].max() for s, n in zip(share, near, strict=True)], bool)


def balls(vessel: Vessel, thin: Index, blur_mm: float) -> Balls:
    """Crest points of thin branches and the radii that their peaks tell. blur_mm : the scanner's."""
    volume, spacing = vessel.scan, vessel.scan.spacing_mm
    sigma = CREST_VOXELS * volume.voxel_mm
    whole = float(np.hypot(blur_mm, sigma))
    at, peak = crests(Blurred(volume.values, spacing, sigma), thin, vessel.levels.outside, SHARP / whole**2)
    share = np.clip(vessel.levels.share(peak), 0.0, 0.95)
    radius = whole * np.sqrt(-2.0 * np.log1p(-share))
    good = np.flatnonzero(share > 0)
    good = good[_highest(at[good] / volume.voxel_mm, share[good])]
    # several voxels lead to one point of the crest: one ball per third of a voxel
    _, first = np.unique(np.rint(3.0 * at[good] / spacing), axis=0, return_index=True)
    thickest = np.maximum(radius[good][first], LEAST_RADIUS * volume.voxel_mm)
    return at[good][first] - vessel.corner * spacing, thickest


def _nearest(places: Array, points: Array) -> tuple[Array, NDArray[np.int64]]:
    """Distance from each point to the nearest place, and which that is."""
    away, at = cKDTree(places).query(points)
    return np.asarray(away, float), np.asarray(at, np.int64)


def joined(points: Array, vessel: Array, reach: float) -> tuple[NDArray[np.bool_], Array]:
    """Which points (n, 3) are connected to the vessel's (m, 3) over gaps of at most ``reach``, and the bridges.

    A bridge, of (b, 2, 3), leads from a point to the place to which it is joined. Pieces are joined nearest first, as
    in Prim's minimum spanning tree: the gaps are the skirts that were cut out of one connected region.
    """
    piece = parts(points, OVERLAP_VOXELS)
    gap, at = _nearest(vessel, points)
    foot = vessel[at]
    free, bridges = np.ones(len(points), bool), []
    while free.any():
        n = int(np.argmin(np.where(free, gap, np.inf)))
        if gap[n] > reach:
            break
        own = piece == piece[n]
        bridges.append((points[n], foot[n]))
        free &= ~own
        away, at = _nearest(points[own], points)
        nearer = free & (away < gap)
        gap[nearer], foot[nearer] = away[nearer], points[own][at[nearer]]
    return ~free, np.array(bridges).reshape(-1, 2, 3)


def add_balls(distance: NDArray[np.float32], spacing: Array, found: Balls, outer_mm: float) -> None:
    """Lower the signed distance to that of the union with the balls connected to the vessel, and with their bridges."""
    vessel = indices_of(distance < 0).astype(float)
    centre, radius = found
    if len(radius) == 0 or len(vessel) == 0:
        return
    kept, bridges = joined(centre / spacing, vessel, BRIDGE_VOXELS)
    centre, radius = centre[kept], radius[kept]
    cones(centre, centre, radius, radius, spacing, outer_mm, distance)
    if len(bridges):
        start, end = bridges[:, 0] * spacing, bridges[:, 1] * spacing
        thick = radius[cKDTree(centre).query(start)[1]]
        cones(start, end, thick, thick, spacing, outer_mm, distance)
