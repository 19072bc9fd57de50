"""From a mask and grey to a signed distance: half-level surface, closest points, correction of the blur's bias.

Where the vessel is filled unevenly across, or tissue differs around it, the wall's level is that of its own sides.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.cores import in_parts
from pipeline.arrays.grids import unflattened
from pipeline.arrays.lattice import sparse_zeros
from pipeline.model import Counters
from pipeline.segment._kernels.contact import Inner
from pipeline.segment._kernels.distance import Owned, distances, lost_feet
from pipeline.segment._kernels.voxels import extent, rebased
from pipeline.segment._kernels.wall import PAD, Wall, dilate, feet, mean_around, smooth_lattice, surface_voxels
from pipeline.segment.blurred import blur_of_wall, half_level_offset
from pipeline.segment.closest import find_closest
from pipeline.segment.contact import numbered
from pipeline.segment.levels import GreyLevels, Index, Vessel, failed, grey_around, plateau, scanner_blur
from pipeline.segment.sides import BESIDE, Sides, sides_of
from solver.grid import Array, Grid, read_only

LAYERS = 4
"""Layers around the mask in which grey is smoothed: two may still be inside, two more feed the spline."""
DEEP = 3
"""Mark of the last layer (mask = 1) that may be inside: connectedness is off by up to half a voxel, noise by one."""
LEVEL_TOLERANCE = 0.03
"""Change of the wall's level, in contrasts, that is worth a second surface; a smaller one just shifts the wall."""
THIN_TOLERANCE = 0.004
"""The same where no vessel is thick: there level, curvature and blur depend on each other."""
SURFACE_ROUNDS = 3
"""Surfaces at most beyond the first: only a vessel as thin as its blur, whose plateau is not seen, needs them."""
MOVES = 0.85
"""Share of the noise that smoothing leaves that moves the wall. Measured over it: 0.7 to 0.9 where noise is white or
correlated over half a voxel, as a scanner's, 1.0 to 1.2 over 0.8, 1.4 over 1.5 voxels (tubes; forks 0.7 and less)."""
PLACES = 30_000
"""Places on the wall, or so, at which its filling is looked at."""


Shape = tuple[int, int, int]
NONE: Index = np.zeros(0, np.int64)


@dataclass(frozen=True, eq=False)
class Site:
    """A region about to get a surface: its padded box, and its mask with layers around it.

    volume : C-contiguous grey.  corner : the volume's voxel that is (PAD, PAD, PAD) of the box.  state : uint8 box,
    mask 1, layers 2, 3, ...  near : flat indices where it is set.
    """

    volume: Grid
    taps: NDArray[np.float32]
    corner: Index
    state: NDArray[np.uint8]
    near: Index

    def from_first(self, feet: Array) -> Array:
        """Places (n, 3) of the padded box, mm, from the volume's first voxel."""
        return np.asarray(feet + (self.corner - PAD) * self.volume.spacing_mm)

    @property
    def grid(self) -> Grid:
        """The box without its padding, holding nothing yet."""
        empty = np.broadcast_to(np.float32(0), [n - 2 * PAD for n in self.state.shape])
        return Grid(empty, self.volume.spacing_mm, self.volume.to_mm(self.corner), self.volume.direction)

    def vessel(self, found: "SignedDistance") -> Vessel:
        """The vessel whose wall was found here."""
        return Vessel(self.volume, self.grid.with_values(read_only(found.values)), found.levels, self.taps)


def padded_box(voxels: Index, grid: Grid, margin_mm: float, more: Index = NONE) -> tuple[Index, Shape]:
    """The box of the voxels (flat) with ``margin_mm`` around them: its first voxel, and its shape once padded.

    more : further voxels that the box must hold, or none.
    """
    margin = np.ceil(margin_mm / grid.spacing_mm).astype(np.int64)
    ends = np.stack([extent(flat, grid.shape) for flat in (voxels, more) if len(flat)])
    low = np.maximum(ends[:, 0].min(axis=0) - margin, 0)
    high = np.minimum(ends[:, 1].max(axis=0) + margin + 1, grid.shape)
    a, b, c = (int(n) + 2 * PAD for n in high - low)
    return low, (a, b, c)


def into_box(voxels: Index, grid: Grid, corner: Index, shape: Shape) -> Index:
    """Flat indices in a padded box of flat indices in the grid."""
    return np.asarray(rebased(voxels, grid.shape, PAD - corner, shape))


def boxed(voxels: Index, grid: Grid) -> Inner:
    """The voxels (flat) of a grid in a padded box of their own, in their order."""
    corner, shape = padded_box(voxels, grid, 0.0)
    return numbered(shape, into_box(voxels, grid, corner, shape))


def prepare(volume: Grid, order: Index, taps: NDArray[np.float32], margin_mm: float, more: Index = NONE) -> Site:
    """The site of the voxels at flat indices ``order`` of a C-contiguous volume; the rest as in ``padded_box``."""
    corner, shape = padded_box(order, volume, margin_mm, more)
    state = sparse_zeros(shape, np.uint8)
    flat = into_box(order, volume, corner, shape)
    state.reshape(-1)[flat] = 1
    dilate(state, flat, LAYERS)
    return Site(volume, taps, corner, state, np.flatnonzero(state))


def _half_level_wall(site: Site, level: float, inside: NDArray[np.uint8]) -> tuple[Index, Wall]:
    """The voxels (flat) next to the surface where smoothed grey is ``level``, and the wall there; marks ``inside``."""
    lattice = sparse_zeros(site.state.shape, np.float32)
    values, spacing = site.volume.values, site.volume.spacing_mm
    # where two parts meet, both smooth the tile, alike
    in_parts(lambda part: smooth_lattice(values, site.corner, site.taps, site.state, part, lattice), site.near)
    voxels = surface_voxels(site.state, lattice, level, DEEP, site.near, inside)
    parts = in_parts(lambda part: feet(lattice, level, spacing, part, inside), voxels)
    return voxels, Wall(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def _own(site: Site, levels: GreyLevels, voxels: Index, normal: Array) -> NDArray[np.bool_]:
    """Which surface voxels (flat box indices) have vessel, not bone, BESIDE them: the wall of bone is steeper."""
    if not np.isfinite(levels.brightest):
        return np.ones(len(voxels), bool)
    index = unflattened(voxels, site.state.shape) - PAD + site.corner
    inwards = np.rint(index - BESIDE * normal).astype(np.int64)
    return np.asarray(grey_around(site.volume, inwards) <= levels.brightest)


def _corrected(
    wall: Wall, voxels: Index, owner: NDArray[np.int32], blur_mm: float, voxel: float, blurs: Array | float
) -> Wall:
    """The wall moved out by the blur's offset, its curvature averaged over the neighbourhood, and by so many blurs.

    Curvature is a second derivative of noisy grey: its mean over 5^3 voxels is what the offset is taken from.
    """
    bend = np.clip(wall.curvature, -1.0 / voxel, 1.0 / voxel)
    good, sharp = np.isfinite(wall.distance), bend
    bend = np.concatenate(in_parts(lambda part: mean_around(owner, part, sharp, good, 2), voxels))
    offset = half_level_offset(bend, blur_mm) + blur_mm * blurs
    foot = wall.foot + offset[:, None] * wall.normal
    return wall._replace(distance=wall.distance - offset, foot=foot, curvature=bend)


def signed(box: Owned, wall: tuple[Array, Array, Array], outer_mm: float, pad: int) -> NDArray[np.float32]:
    """Signed distances on a box without its padding, from every voxel's foot and the wall's normal and curvature there.

    wall : feet (n, 3), normals (n, 3), curvatures (n,).  The result lies in the memory of ``box.owner``, whose entries
    it overwrites one by one: one box is held instead of two.
    """
    shape = tuple(n - 2 * pad for n in box.owner.shape)
    values = box.owner.reshape(-1).view(np.float32)[: int(np.prod(shape))].reshape(shape)
    distances(box, wall, outer_mm, values)
    return values


@dataclass(frozen=True, eq=False)
class SignedDistance:
    """The distance from the wall, and what was learnt on the way.

    values : float32, mm, negative inside, on the site's grid; ``outer_mm`` wherever the wall is further away outside.

    levels : the wall is at their half level.  blur_mm : the whole blur of the wall, scanner's and smoothing's.
    wall : some places (n, 3) on it, mm from the scan's first voxel, and outward normals (n, 3).  sides : what lies
    along it, where that differs.
    """

    values: NDArray[np.float32]
    levels: GreyLevels
    blur_mm: float
    counters: Counters
    wall: tuple[Array, Array]
    sides: Sides | None = None

    def noise_mm(self, taps: NDArray[np.float32]) -> float:
        """Standard deviation (mm) of the wall's place by noise: what is left of it over the wall's steepness."""
        levels = self.levels
        return float(MOVES * levels.noise_after(taps) * np.sqrt(2 * np.pi) * self.blur_mm / levels.contrast)


def signed_distance(site: Site, levels: GreyLevels, outer_mm: float, sides: Sides | None = None) -> SignedDistance:
    """The distance from the half-level surface, corrected for blur; raises StageError where there is no surface.

    sides : what lies along the wall, where that is known to differ.
    """
    spacing = site.volume.spacing_mm
    inside = sparse_zeros(site.state.shape, np.uint8)
    owner = np.full(site.state.shape, 0, np.int32)  # written to all over: in large pages, which zeros are not given
    box = Owned(owner, inside, spacing)
    level = levels.half if sides is None else sides.level(levels)
    voxels, wall = _half_level_wall(site, level, inside)
    good = np.isfinite(wall.distance)
    if not good.any():
        got = f"got no place where smoothed grey is {level:.0f}, half way between the vessel and its surroundings"
        do = "the vessel is thinner than its blur: scan with smaller voxels, or set segment.scale = 0"
        raise failed(got, "a surface", f"{do}; or a wire lies at entry_mm: name a reference without one")
    seen = voxels[good]
    owner.reshape(-1)[seen] = np.flatnonzero(good) + 1
    own = good.copy()
    own[good] = _own(site, levels, seen, wall.normal[good])
    own = own if own.any() else good
    blurs, whole = (0.0, np.ones(len(voxels))) if sides is None else sides.at(site.from_first(wall.foot))
    blur = blur_of_wall((wall.steepness / whole)[own], wall.curvature[own], levels.contrast)
    wall = _corrected(wall, voxels, owner, blur, site.volume.voxel_mm, blurs)
    inside.reshape(-1)[seen] = wall.distance[good] < 0
    visits = find_closest(box, seen, wall.foot, outer_mm)
    stray = lost_feet(box, voxels, wall.foot, good, blur * float(np.max(np.abs(blurs))))
    if len(stray):
        wall.curvature[stray] = 0.0
        visits += find_closest(box, voxels[stray], wall.foot, outer_mm)
    values = signed(box, (wall.foot, wall.normal, wall.curvature), outer_mm, PAD)
    counters = {"surface_voxels": float(len(voxels)), "distance_visits": float(visits)}
    some = np.flatnonzero(good)[:: max(1, np.count_nonzero(good) // PLACES)]
    return SignedDistance(values, levels, blur, counters, (site.from_first(wall.foot[some]), wall.normal[some]))


def wall_of(site: Site, levels: GreyLevels, outer_mm: float, wire: bool = False) -> SignedDistance:
    """The distance from the wall, whose level is estimated again from each surface found until it hardly changes.

    wire : whether the scan shows one, which is brighter than the vessel.
    """
    voxel = site.volume.voxel_mm
    found = signed_distance(site, levels, outer_mm)
    for _ in range(SURFACE_ROUNDS):
        own = scanner_blur(found.blur_mm, site.taps, voxel)
        again = plateau(site.vessel(found), own)
        thin = -float(found.values.min()) < 4 * found.blur_mm
        near = abs(again.half - levels.half) < (THIN_TOLERANCE if thin else LEVEL_TOLERANCE) * levels.contrast
        # a surface made before bone was noticed has the bone in its blur: one more round
        if near and bool(again.foreign) == bool(levels.foreign):
            break
        levels = again
        del found  # before the next takes its place in memory
        found = signed_distance(site, levels, outer_mm)
    sides = sides_of(replace(site.vessel(found), levels=again), found.wall, wire)
    if sides is not None:
        levels = again
        found = signed_distance(site, levels, outer_mm, sides)
    # what is left of the change moves the wall by change over steepness
    steepness = levels.contrast / (np.sqrt(2 * np.pi) * found.blur_mm)
    values = found.values
    values += np.float32((again.half - levels.half) / steepness)
    return replace(found, levels=again, sides=sides)
