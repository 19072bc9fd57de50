"""A lumen that the user brings: a centreline with radius, a closed surface or a label map. Out: LPS mm."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from pipeline.arrays.grids import LATTICE_VOXELS, lattice_mm
from pipeline.load.curves import SYSTEMS, markups_in, of_json, positions_of, unit_of_markup
from pipeline.load.geometry import Mask, Source, refused
from pipeline.load.guard import reachable, read_text, told
from pipeline.load.masks import read_mask
from pipeline.load.outside import millimetres, to_numbers
from pipeline.load.stated import stated_in_table
from pipeline.load.surfaces import read_stl, read_vtp
from pipeline.model import Array, Branches, Shapes, Volume

FAR_OUTSIDE, FAR_OUTSIDE_MM = 2.0, 1.5
"""Voxels and mm outside a given lumen, the larger counts, from which an entry was not meant for it: one in its wall is
the solver's to judge."""
LOOK_AT = (
    "check its axes (LPS or RAS), its grid (was the scan's geometry kept?), its unit, which label is meant, and "
    "whether it reaches to the entry"
)
"""What to look at where it was not."""


def meant_within_mm(voxel_mm: float, entry_sigma_mm: float | None) -> float:
    """How far outside a given lumen an entry, known to a standard deviation, may lie that is meant for it, mm."""
    return max(FAR_OUTSIDE * voxel_mm, FAR_OUTSIDE_MM, 2.0 * (entry_sigma_mm or 0.0))


def read_swc(path: Path) -> Branches:
    """A .swc tree: number, type, x, y, z, radius, parent (-1, or 0 where no node is 0: a root), LPS mm unless a comment
    states another."""
    lines = read_text(path).splitlines()
    rows = [line.encode().split() for line in lines if line.strip() and not line.lstrip().startswith("#")]
    try:
        table = np.array([to_numbers(row) for row in rows])
    except ValueError:
        got = "a line that is not seven numbers"
        raise refused(path, got, "seven numbers a line", "export it again as .swc") from None
    if table.ndim != 2 or table.shape[1] < 7:
        got = f"a table of shape {table.shape}"
        raise refused(path, got, "seven numbers a line", "export it again as .swc")
    reachable(path, table[:, :7], "numbers")
    child, parent = _parents(path, table[:, 0], table[:, 6])
    space, unit = stated_in_table(path, (), [line for line in lines if line.lstrip().startswith("#")])
    factor = millimetres(path, unit or "mm")
    points, radius = factor * table[:, 2:5] * SYSTEMS[space or "LPS"], factor * table[:, 5]
    if len(child) == 0 or not np.all(radius > 0):
        got = "no branch of positive radius"
        raise refused(path, got, "nodes with parents and radii", "check columns 6 and 7")
    return Branches(points[parent], points[child], radius[parent], radius[child])


def _parents(path: Path, node: Array, parent: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows of the nodes that have a parent, and of these parents; LoadError where it is not one that the file holds."""
    known, counts = np.unique(node, return_counts=True)
    if np.any(counts > 1):
        raise refused(path, f"node {known[counts > 1][0]:g} twice", "a number of its own for each", "number them anew")
    held = np.isin(parent, node)
    lost = ~held & (parent != -1) & (parent != 0)  # some count nodes from 1, and a root's parent is 0
    if np.any(lost):
        got = f"node {node[lost][0]:g} with the parent {parent[lost][0]:g}, which is none of the nodes"
        raise refused(path, got, "a node's number, or -1 for a root", "export the whole tree again")
    order = np.argsort(node)
    child, of = np.flatnonzero(held), order[np.searchsorted(node, parent[held], sorter=order)]
    edges = coo_array((np.ones(len(child)), (child, of)), shape=(len(node), len(node)))
    count, piece = connected_components(edges, directed=False)
    rings = np.setdiff1d(np.arange(count), piece[~held])
    if len(rings):  # a root in each piece makes a forest of it
        got = f"node {node[piece == rings[0]].min():g} among its own ancestors"
        raise refused(path, got, "a tree with a root, whose parent is -1", "export the tree again")
    return child, of


def read_markups_branches(path: Path) -> Branches:
    """Curves with a ``Radius`` measurement per control point (as VMTK writes), every markup one branch."""
    branches = []
    for markup in markups_in(path):
        points = positions_of(path, markup)
        named = {str(m.get("name", "")).lower(): m for m in reversed(markup.get("measurements", []))}
        values = named.get("radius", {}).get("controlPointValues")
        if values is None or len(values) != len(points):
            allowed = "a measurement named Radius with one of controlPointValues for every point"
            raise refused(path, f"curve {markup.get('name', '?')!r} without radii", allowed, "or give an .swc")
        with told(path):
            unit = named["radius"].get("units") or unit_of_markup(markup)
            radius = of_json(values) * millimetres(path, str(unit))
        if len(points) < 2 or not np.all(np.isfinite(points)) or not np.all((radius > 0) & np.isfinite(radius)):
            got = f"curve {markup.get('name', '?')!r} of {len(points)} points, radii {radius.tolist()[:4]}"
            raise refused(path, got, "two finite points or more, radii above 0", "correct the curve")
        branches.append((points[:-1], points[1:], radius[:-1], radius[1:]))
    if not branches:
        raise refused(path, "no control points", "at least one curve with radii", "or give an .swc")
    return Branches(*map(np.concatenate, zip(*branches, strict=True)))


def _closed(shapes: Shapes, path: Path) -> Shapes:
    """The surface itself; LoadError where it has no triangles, or an edge that an odd number of them share."""
    edges = np.sort(shapes.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    open_edges = int(np.sum(np.unique(edges, axis=0, return_counts=True)[1] % 2)) if len(edges) else -1
    if open_edges:
        got = "no triangles" if open_edges < 0 else f"{open_edges} open edges"
        raise refused(path, got, "a closed surface", "cap the vessel's ends (3D Slicer: Surface Toolbox)")
    return shapes


def _centreline(shapes: Shapes, path: Path) -> Branches:
    """The lines of a VMTK centreline as branches."""
    radius = np.asarray(shapes.radius_mm)
    if len(radius) != len(shapes.points_mm) or not np.all((radius > 0) & np.isfinite(radius)):
        got = f"{len(radius)} radii for {len(shapes.points_mm)} points"
        raise refused(path, got, "one finite radius above 0 for each point", "compute the centreline again")
    start = np.concatenate([line[:-1] for line in shapes.lines])
    end = np.concatenate([line[1:] for line in shapes.lines])
    return Branches(shapes.points_mm[start], shapes.points_mm[end], radius[start], radius[end])


SHORTEST_MM = 2.0
"""No vessel that a wire is pushed through is shorter: a file of this size is in metres."""
COARSEST_MM, MOST_FEET, MOST_WORK, MOST_INSIDE = 1.5, 2e7, 5e9, 6e6
"""Coarsest voxel of the lattice that a lumen is put on; most points on the wall, visits to voxels and voxels inside: an
aorta has 3 million; of a vessel of 50 mm radius branches took more than 14 GB to be found."""


def _in_bounds(path: Path, found: Branches | Shapes) -> Branches | Shapes:
    """What was read; LoadError where it is so large, or covers itself so often, that no lattice resolves it."""
    ends = found.points_mm if isinstance(found, Shapes) else np.concatenate([found.start_mm, found.end_mm])
    if float(np.ptp(ends, axis=0).max()) < SHORTEST_MM:
        got = f"a lumen of {np.ptp(ends, axis=0).max():.3g} mm"
        raise refused(path, got, f"{SHORTEST_MM:g} mm or more", "is it in metres? Convert it to mm")
    size = np.ptp(ends, axis=0) + 10.0
    voxel = lattice_mm(size)
    if voxel > COARSEST_MM:
        got = f"a lumen of {' x '.join(f'{n:.0f}' for n in size)} mm"
        allowed = f"a box that fits into {LATTICE_VOXELS:.0f} voxels of {COARSEST_MM:g} mm"
        raise refused(path, got, allowed, "is it in another unit than mm? Else cut it to the vessel")
    if isinstance(found, Shapes):
        a, b, c = (found.points_mm[found.triangles[:, k]] for k in range(3))
        area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
        amount, most = 8 * area / voxel**2 + 8 * len(found.triangles), MOST_FEET
        inside = abs(float(np.sum(a * np.cross(b, c)))) / 6.0
    else:
        thick = np.maximum(found.start_radius_mm, found.end_radius_mm) + 3.0
        box = np.abs(found.end_mm - found.start_mm) + 2 * thick[:, None]
        amount, most = float(np.prod(box / voxel, axis=1).sum()), MOST_WORK
        r, q = found.start_radius_mm, found.end_radius_mm
        length = np.linalg.norm(found.end_mm - found.start_mm, axis=1)
        inside = float(np.sum(np.pi / 3.0 * length * (r * r + r * q + q * q)))
    if amount > most:
        got = f"a wall {amount / most:.1f} times as large as can be put on a lattice"
        raise refused(path, got, "one vessel", "remove what covers itself, or make it coarser")
    if inside > MOST_INSIDE * voxel**3:
        got, allowed = (
            f"a lumen of {inside / 1000:.0f} ml",
            f"{MOST_INSIDE * voxel**3 / 1000:.0f} ml in a box of its size",
        )
        raise refused(path, got, allowed, "is it in another unit than mm, or are its radii diameters? Else cut it")
    return found


def read_lumen(source: Source | Path, least_voxels: int) -> Branches | Shapes | Volume:
    """What a file holds: .swc, .mrk.json or VMTK's .vtp a centreline with radius, .stl or .vtp a closed surface, else a
    label map or probabilities.

    Raises LoadError when the file does not hold a lumen; a label map of fewer than ``least_voxels`` is none.
    """
    source = source if isinstance(source, Source) else Source(source)
    path, name = source.path, source.path.name.lower()
    marks = name.endswith((".swc", ".mrk.json", ".stl", ".vtp"))
    if marks and isinstance(source, Mask) and (source.label, source.level) != (None, None):
        raise refused(path, "a label or level for a centreline or surface", "one for a label map", "leave it out")
    if not marks:
        return read_mask(source, least_voxels)
    with told(path):
        if name.endswith(".swc"):
            return _in_bounds(path, read_swc(path))
        if name.endswith(".mrk.json"):
            return _in_bounds(path, read_markups_branches(path))
        shapes = read_stl(path) if name.endswith(".stl") else read_vtp(path)
        centreline = shapes.radius_mm is not None and shapes.lines and not len(shapes.triangles)
        return _in_bounds(path, _centreline(shapes, path) if centreline else _closed(shapes, path))
