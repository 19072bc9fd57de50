"""segment: scan -> lumen. A method finds the vessel's voxels, its grey values say where the wall lies."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from pipeline.arrays.cores import side_by_side
from pipeline.arrays.edges import Layer
from pipeline.arrays.fingerprint import known_with_place
from pipeline.arrays.grids import in_memory_order, reorder
from pipeline.model import Lumen, Volume
from pipeline.segment import bone, leaked, noise, thin, uneven, valley
from pipeline.segment.config import SegmentConfig
from pipeline.segment.contact import Contact, contacts, warning
from pipeline.segment.cut_off import cut_off
from pipeline.segment.embedded import Block, surrounding
from pipeline.segment.ends import ends
from pipeline.segment.flat_side import flat_side
from pipeline.segment.fuzzy import fuzzy_region
from pipeline.segment.layered import layer_around, surrounded, with_layer_alone
from pipeline.segment.levels import GreyLevels, Region, Vessel, brighter, scanner_blur
from pipeline.segment.necks import add_necks, closed_necks
from pipeline.segment.on_wire import beside, swallowed
from pipeline.segment.sheets import open_ones, sheets
from pipeline.segment.surface import NONE, SignedDistance, Site, prepare, wall_of
from pipeline.segment.uneven import evened
from pipeline.status import StageError
from solver.grid import Grid

__all__ = ["segment"]

METHOD = fuzzy_region
"""How the vessel's voxels are found: a function with the arguments of ``fuzzy_region`` that returns a Region."""


ON_THE_WIRE = (
    "; or a seed lies on the wire, which this scan shows: name a point of the vessel beyond its tip, or beside it "
    "(lumen_seed_mm), or give a scan without it (reference)"
)

BLUR_UNSURE = 0.15
"""Share by which the scanner's blur may be less than the wall's looks, where a wire lies beside that (12 % were seen),
or whose noise is less than its whole greys (14 %)."""


@dataclass(frozen=True, eq=False)
class _Found:
    """The vessel found from seeds: its region, and its wall on the site's box; the site's grid has even contrast.

    least : lowest share of the contrast along the vessel.  blur : the scanner's, mm.  layer : what lies around it.
    tissue : grey of what hung together with it.
    block : what surrounds it, and could not be parted from it.
    """

    region: Region
    least: float
    site: Site
    wall: SignedDistance
    blur: float
    layer: Layer | None = None
    tissue: float | None = None
    block: Block | None = None

    @property
    def vessel(self) -> Vessel:
        """The vessel, with whatever was added to it so far."""
        return self.site.vessel(self.wall)

    @property
    def as_begun(self) -> Vessel:
        """The same with the grey levels that its voxels were found by."""
        return replace(self.vessel, levels=self.region.levels)


def _found(grid: Grid, seeds_mm: ArrayLike, config: SegmentConfig, wire: bool) -> _Found:
    """The vessel; where it lies in a wall or a block of its own, the one that is found with that around it.

    Where no vessel is left within that, there was none, and what was found stays; of a block it is told, but not where
    the seed may lie on a wire, which is such a part.
    """
    found = _as_shown(grid, seeds_mm, config, wire, METHOD)
    vessel = replace(found.as_begun, scan=grid)
    layer = layer_around(vessel)
    if layer is not None:
        method = partial(METHOD, noise_left=vessel.levels.noise_left)
        with suppress(StageError):
            return replace(_as_shown(with_layer_alone(layer, vessel), seeds_mm, config, wire, method), layer=layer)
    block = surrounding(vessel, found.wall.blur_mm)
    if block is not None and block.grey < block.at_seed:
        method = partial(METHOD, outside=block.grey)
        with suppress(StageError):
            return replace(_as_shown(grid, seeds_mm, config, wire, method), tissue=block.grey)
    return found if wire else replace(found, block=block)


def _as_shown(
    grid: Grid, seeds_mm: ArrayLike, config: SegmentConfig, wire: bool, method: Callable[..., Region]
) -> _Found:
    region = method(grid, seeds_mm, config)
    tissue = leaked.tissue_in(grid, region)
    if tissue is not None:
        method = partial(method, outside=tissue)
        region = method(grid, seeds_mm, config)
    shown, region, least = evened(grid, region, lambda filled: method(filled, seeds_mm, config))
    site = prepare(shown, region.voxels, region.taps, config.margin_mm, region.thin)
    wall = wall_of(site, region.levels, config.outer_mm, wire)
    blur = scanner_blur(wall.blur_mm, region.taps, grid.voxel_mm)
    across = 1.0 if wall.sides is None else wall.sides.least
    return _Found(region, min(least, across), site, wall, blur, tissue=tissue)


def _around_wire(grid: Grid, found: _Found, seeds_mm: ArrayLike, config: SegmentConfig, wire_mm: float) -> _Found:
    """The vessel around the wire, where what was found is a wire of radius ``wire_mm``; otherwise what was found."""
    seed = beside(grid, found.vessel.distance, np.asarray(seeds_mm, float), wire_mm, found.blur)
    if seed is None:
        return found
    try:
        around = _found(grid, seed, config, wire=True)
    except StageError:  # nothing but tissue around it
        return found
    return around if swallowed(found.vessel.distance, around.vessel.distance) else found


def _beside_wire(grid: Grid, seeds_mm: ArrayLike, config: SegmentConfig, wire_mm: float | None) -> _Found:
    """The vessel, where the scan may show a wire of radius ``wire_mm`` in it."""
    if wire_mm is None:
        return _found(grid, seeds_mm, config, wire=False)
    try:
        found = _found(grid, seeds_mm, config, wire=True)
    except StageError as error:
        raise StageError(error.status, f"{error}{ON_THE_WIRE}") from error
    return _around_wire(grid, found, seeds_mm, config, wire_mm)


def _few_greys(scan: Grid, levels: GreyLevels) -> bool:
    """Whether noise is less than a step of the scan's greys, so that an edge has few of them."""
    return scan.values.dtype.kind in "iu" and levels.noise < 1.0


def _levels(found: _Found, *, unsure: bool) -> dict[str, float]:
    """What is known of its greys and its wall.     unsure : whether the scanner's blur is not told well by that."""
    region, wall = found.region, found.wall
    levels = {"noise": region.levels.noise, "wall_noise_mm": wall.noise_mm(region.taps), "blur_mm": wall.blur_mm}
    levels |= {"scanner_blur_mm": found.blur, "least_filling": found.least}
    levels |= {"blur_unsure": BLUR_UNSURE} if unsure else {}
    return levels | ({} if found.layer is None else {"layer": found.layer.grey})


def _of_the_vessel(scan: Grid, found: _Found) -> tuple[str, ...]:
    """Sentences on what surrounds it, and fills it."""
    layer = () if found.layer is None else (surrounded(found.layer, float(np.mean(scan.spacing_mm))),)
    tissue = leaked.warning(found.tissue, found.region.levels.inside)
    block = () if found.block is None else (found.block.warning,)
    sides = () if found.wall.sides is None else found.wall.sides.warning()
    vessel = replace(found.vessel, scan=scan)
    return layer + tissue + block + sides + cut_off(vessel) + flat_side(vessel.distance)


def _touching(vessel: Vessel, *, even: bool) -> tuple[tuple[Contact, ...], tuple[str, ...]]:
    """Vessels that it is open to, and sentences on bone.     even : whether it is filled alike across."""
    seen, sheet, bright = side_by_side(
        lambda: contacts(vessel.distance), lambda: sheets(vessel) if even else NONE, lambda: bone.touching(vessel)
    )
    return open_ones(vessel, seen, sheet), bright


def _beside_it(found: _Found) -> tuple[str, ...]:
    """Sentences on vessels that pass by, and on branches that are left out."""
    scan, region = found.site.volume, found.region
    return valley.warning(scan, region.passing) + thin.warning(scan, region.faint)


def segment(
    volume: Volume, seeds_mm: ArrayLike, config: SegmentConfig | None = None, wire_radius_mm: float | None = None
) -> Lumen:
    """The vessel that holds the seeds.

    volume : grey values, brighter inside the vessel.  seeds_mm : (m, 3) LPS mm, points inside it.  wire_radius_mm : of
    the wire, where the scan shows one: seeds may lie on it.
    Returns a Lumen whose distance is float32 mm, negative inside, on the vessel's own box; exact to
    ``config.outer_mm`` outside; its warnings name places where two vessels have merged, or one goes on beyond its end.
    Raises StageError (SEGMENT_FAILED) when the seeds lie in no bright vessel. The wall is the half-level surface, blur
    corrected.
    """
    config = config or SegmentConfig()
    scan, axes = in_memory_order(volume)
    found = _beside_wire(scan, seeds_mm, config, wire_radius_mm)
    region, wall, blur, vessel, begun = found.region, found.wall, found.blur, found.vessel, found.as_begun
    touching, bright = _touching(vessel, even=wall.sides is None)
    if len(region.thin):
        branches = thin.balls(begun, region.thin, blur)
        thin.add_balls(wall.values, scan.spacing_mm, branches, config.outer_mm)
    other = brighter(wall.levels, wire_radius_mm is not None) + bright + uneven.warning(found.least)
    said = noise.warning(config.scale, region.levels.noise_after(region.taps), region.levels.contrast)
    said += _of_the_vessel(scan, found) + warning(touching) + _beside_it(found)
    said += other or bone.two_greys(vessel, wall.blur_mm)
    said += add_necks(region.necks, begun, wall.values, blur)
    said += add_necks(closed_necks(begun, config.least_voxels), begun, wall.values, blur)
    said += ends(vessel, wall.wall)
    return Lumen(
        reorder(vessel.distance, axes), wall.levels.half, said,
        {**region.counters, **wall.counters, "touching_places": float(len(touching))},
        _levels(found, unsure=wire_radius_mm is not None or _few_greys(scan, region.levels)),
        known_with_place(volume),
    )  # fmt: skip
