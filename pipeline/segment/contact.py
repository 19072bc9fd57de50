"""Vessels that run side by side so close that their lumens have merged: found, so that the report can say so.

The core of a vessel is where the depth (distance to the wall) is at least 0.7 of the local thickness. Where two vessels
touch flank to flank, the opening between them is shallow and their cores stay apart; at a branching the cores join, or
one of them ends there, within the other's radius. Vessels have merged where they meet though they are far apart along
the cores, and go on there in both directions.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from pipeline.arrays.grids import spelt, unflattened
from pipeline.arrays.lattice import sparse_zeros
from pipeline.segment._kernels.contact import Cores, Inner, along_cores, meetings, nearest_core, runs_on, thickness
from pipeline.segment._kernels.voxels import rebased
from pipeline.segment.levels import Index
from solver.grid import Array, Grid

CORE = 0.7
"""Depth over local thickness in a core: tubes of radius r have separate cores until they overlap by r / 2. At 0.8 noise
breaks tubes of two voxels radius into pieces that look like neighbours; at 0.6 two vessels at 0.5 mm voxels merge."""
FAR = 3.0
"""Distance along a core, in sums of both radii, from which two stretches of one vessel do not count as neighbours."""
ONWARD = 1.0
"""How far (local radii) both vessels must go on beyond the contact, both ways: a branch ends there, and does not."""
WINDOW = 2.5
"""Half width, in local radii, of the box around the contact in which that is looked for."""
ADJACENT = 1.8
"""Faces of one opening are linked across corners, sqrt(3) voxels."""
LEAST_FACES = 4
"""Voxel faces shared by two vessels below which they do not count as touching."""
MOST_FACES = 2000
"""Most faces that are looked at; of more, only every second, third, ...: a head taken for a vessel has 100 000."""
LONG = 3.0
"""Length over radius from which a core is a vessel's: what is shorter is a bump of the wall, or the opening itself."""
LEAST_DEPTH = 0.75
"""Depth in voxels that a vessel's core reaches: the ripple that noise leaves on a wall does not."""


@dataclass(frozen=True)
class Contact:
    """A place where the vessel meets what it should not: where (LPS mm), and the area of the opening, mm^2."""

    place_mm: Array
    area_mm2: float


MOST_NAMED = 4
"""Places that a warning names; the largest."""


def how_many(places: Sequence[object]) -> str:
    """Their number in words: 1 place, 2 places."""
    return f"{len(places)} place{'s' * (len(places) != 1)}"


def named(places: Sequence[Contact]) -> str:
    """The largest places in words, each with its area."""
    largest = sorted(places, key=lambda c: -c.area_mm2)[:MOST_NAMED]
    return ", ".join(f"[{spelt(c.place_mm)}] mm ({c.area_mm2:.1f} mm²)" for c in largest)


def warning(places: tuple[Contact, ...]) -> tuple[str, ...]:
    """One sentence for the report, or none."""
    if not places:
        return ()
    return (
        f"segment: vessels that run side by side are open to each other in {how_many(places)}, allowed 0; largest "
        f"at {named(places)}; a simulated wire may slip across there: look at the picture (where a branch leaves at 20 "
        "degrees or less it may be its crotch), scan with smaller voxels, or give the lumen as a file (manifest key "
        "lumen)",
    )


def parts(points: Array, apart: float) -> Index:
    """Number (n,) of the connected component of each point (n, 3); points at most ``apart`` from another are linked."""
    pairs = cKDTree(points).query_pairs(apart, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points),) * 2)
    return np.asarray(connected_components(links, directed=False)[1], np.int64)


def numbered(shape: tuple[int, ...], flat: Index) -> Inner:
    """The voxels (flat, ascending) of a lumen in a box of this shape."""
    ids = sparse_zeros(shape, np.int32)
    ids.reshape(-1)[flat] = np.arange(1, len(flat) + 1)
    return Inner(ids, flat)


def inside_of(values: NDArray[np.float32]) -> tuple[Index, Inner]:
    """The voxels where a signed distance is negative: flat, ascending, and in a box with an empty layer around.

    Kernels step to neighbours without checking for a box's border.
    """
    flat, shape = np.flatnonzero(values < 0), tuple(n + 2 for n in values.shape)
    return flat, numbered(shape, rebased(flat, values.shape, np.ones(3, np.int64), shape))


def _vessels_only(core: NDArray[np.bool_], cores: Cores, thick: Array, voxel: float) -> NDArray[np.bool_]:
    """The core (n,) without parts too short or too thin to be a vessel's."""
    part, steps = cores
    length, radius = np.zeros(part.max() + 1), np.zeros(part.max() + 1)
    np.maximum.at(length, part[core], steps[core] * voxel)
    np.maximum.at(radius, part[core], thick[core])
    good = (length >= LONG * radius) & (radius >= LEAST_DEPTH * voxel)
    return np.asarray(core & good[part])


def contacts(distance: Grid, least_area: float = 0.0) -> tuple[Contact, ...]:
    """Places where vessels that do not branch from each other are open to each other.

    distance : signed distance, mm, negative inside; C-contiguous.  least_area : of an opening, over the square of the
    vessel's radius.
    """
    values, spacing = distance.values, distance.spacing_mm
    inner, voxels = inside_of(values)
    if len(inner) == 0:
        return ()
    depth = -values.reshape(-1)[inner].astype(np.float64)
    thick = thickness(voxels, depth, spacing)
    core = depth >= CORE * thick
    cores = along_cores(voxels, core)
    voxel = distance.voxel_mm
    owner = nearest_core(voxels, _vessels_only(core, cores, thick, voxel))
    found = meetings(voxels, owner, cores, np.ceil(FAR * thick / voxel).astype(np.int32))
    if len(found) < LEAST_FACES:
        return ()
    at = unflattened(inner, values.shape)
    every = -(-len(found) // MOST_FACES)
    # of all faces: between some of them only, an opening falls into parts, of which one alone is at the fork
    opening = parts(at[found[:, 0]].astype(float), ADJACENT)[::every]
    found = found[::every]
    crotch = _in_crotch(found, opening, at, spacing, cores, thick)
    found = found[_go_on(found, voxels, cores, thick / voxel) & ~crotch]
    if len(found) == 0:
        return ()
    # a face stands for as many as were passed over, of an area each
    face = every * float(np.prod(spacing) ** (2 / 3))
    openings = _openings(at[found[:, 0]], thick[found[:, 1]], voxel)
    return tuple(
        Contact(distance.to_mm(own.mean(axis=0)), len(own) * face)
        for own, radius in openings
        if every * len(own) >= LEAST_FACES and len(own) * face >= least_area * radius**2
    )


def _go_on(found: Index, voxels: Inner, cores: Cores, radius: Array) -> NDArray[np.bool_]:
    """Whether both vessels go on both ways from each of the ``meetings`` found (m, 3); radius : (n,) in voxels."""
    passes = {}
    for voxel in np.unique(found[:, 1:]):
        window, least = (int(np.ceil(far * radius[voxel])) for far in (WINDOW, ONWARD))
        passes[voxel] = runs_on(voxels, cores, int(voxel), window, least)
    return np.array([passes[p] and passes[q] for _, p, q in found], bool)


def _in_crotch(
    found: Index, opening: Index, at: Index, spacing: Array, cores: Cores, thick: Array
) -> NDArray[np.bool_]:
    """Whether ``meetings`` found (m, 3), of openings (m,), belong to one at which one vessel branches from the other.

    At less than 45 degrees it is so long that at its far end both go on both ways. at : (n, 3) places in voxels.
    """
    part, steps = cores
    last = np.zeros(part.max() + 1, steps.dtype)
    np.maximum.at(last, part[part >= 0], steps[part >= 0])
    ends = np.flatnonzero((part >= 0) & ((steps == 0) | (steps == last[part])))
    out = np.zeros(len(found), bool)
    for n in np.unique(opening):
        own = opening == n
        both_ways = np.concatenate([found[own, 1:], found[own, :0:-1]])
        for one in np.unique(part[both_ways[:, 0]]):
            sides = both_ways[part[both_ways[:, 0]] == one]
            far = ONWARD * float(thick[sides[:, 0]].max() / spacing.min())
            near = [e for e in ends[part[ends] == one] if np.min(np.abs(steps[sides[:, 0]] - steps[e])) <= far]
            if len(set(steps[near])) == 1:  # with both ends in it, it is the opening's own core
                away = np.linalg.norm((at[near][:, None] - at[sides[:, 1]]) * spacing, axis=2)
                out[own] |= bool(np.any(away <= thick[sides[:, 1]] + spacing.min()))
    return out


def _openings(places: Index, radius: Array, voxel: float) -> list[tuple[Index, float]]:
    """The faces (n, 3) of each opening, in voxels, and the vessel's radius there, mm; radius : at each face."""
    group = parts(places.astype(float), 2.0 * float(np.median(radius)) / voxel)
    each = [group == n for n in range(group.max() + 1)]
    return [(places[own], float(np.median(radius[own]))) for own in each]
