"""A lumen that the user brings: a centreline with radius, a closed surface or a label map. Out: LPS mm."""

from pathlib import Path

import numpy as np

from pipeline.load import load, read_header
from pipeline.load.curves import markups_in, positions_of
from pipeline.load.geometry import refused, unusable
from pipeline.load.surfaces import read_stl, read_vtp
from pipeline.model import Branches, Shapes, Volume


def read_swc(path: Path) -> Branches:
    """A .swc tree: number, type, x, y, z, radius, parent (-1 = root), lengths in mm."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
        table = np.array([r.split() for r in lines if r.strip() and not r.lstrip().startswith("#")], float)
    except ValueError as error:
        raise refused(path, str(error), "seven numbers a line", "export it again as .swc") from error
    if table.ndim != 2 or table.shape[1] < 7:
        got = f"a table of shape {table.shape}"
        raise refused(path, got, "seven numbers a line", "export it again as .swc")
    row_of = {int(n): i for i, n in enumerate(table[:, 0])}
    child = np.array([i for i in range(len(table)) if int(table[i, 6]) in row_of], dtype=np.int64)
    parent = np.array([row_of[int(table[i, 6])] for i in child], dtype=np.int64)
    points, radius = table[:, 2:5], table[:, 5]
    if len(child) == 0 or not np.all(radius > 0):
        got = "no branch of positive radius"
        raise refused(path, got, "nodes with parents and radii", "check columns 6 and 7")
    return Branches(points[parent], points[child], radius[parent], radius[child])


def read_markups_branches(path: Path) -> Branches:
    """Curves with a ``Radius`` measurement per control point (as VMTK writes), every markup one branch."""
    branches = []
    for markup in markups_in(path):
        points = positions_of(markup)
        named = {str(m.get("name", "")).lower(): m for m in reversed(markup.get("measurements", []))}
        values = named.get("radius", {}).get("controlPointValues")
        if values is None or len(values) != len(points):
            allowed = "a measurement named Radius with one of controlPointValues for every point"
            raise refused(path, f"curve {markup.get('name', '?')!r} without radii", allowed, "or give an .swc")
        radius = np.array(values, dtype=float)
        if len(points) < 2 or not np.all(np.isfinite(points)) or not np.all((radius > 0) & np.isfinite(radius)):
            got = f"curve {markup.get('name', '?')!r} of {len(points)} points, radii {radius.tolist()[:4]}"
            raise refused(path, got, "two finite points or more, radii above 0", "correct the curve")
        branches.append((points[:-1], points[1:], radius[:-1], radius[1:]))
    if not branches:
        raise refused(path, "no control points", "at least one curve with radii", "or give an .swc")
    return Branches(*map(np.concatenate, zip(*branches, strict=True)))


def _closed(shapes: Shapes, path: Path) -> Shapes:
    """The surface itself; LoadError where an edge does not have two triangles."""
    edges = np.sort(shapes.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    open_edges = int(np.sum(np.unique(edges, axis=0, return_counts=True)[1] % 2)) if len(edges) else -1
    if open_edges:
        got = "no triangles" if open_edges < 0 else f"{open_edges} open edges"
        raise refused(path, got, "a closed surface", "cap the vessel's ends (3D Slicer: Surface Toolbox)")
    return shapes


def _labels(path: Path, least_voxels: int) -> Volume:
    """A label map; LoadError where fewer than ``least_voxels`` are labelled."""
    volume = load(read_header(path))
    count = np.count_nonzero(volume.values)
    if count < least_voxels:
        allowed = f"at least {least_voxels} (segment.least_voxels)"
        raise refused(path, f"{count} labelled voxels", allowed, "check the label map")
    return volume


def read_lumen(path: Path, least_voxels: int) -> Branches | Shapes | Volume:
    """What a file holds: .swc or .mrk.json a centreline with radius, .stl or .vtp a closed surface, else a label map.

    Raises LoadError when the file does not hold a lumen; a label map of fewer than ``least_voxels`` is none.
    """
    name = path.name.lower()
    if not path.exists():
        raise unusable(path, "no such file; check lumen in the manifest (relative to the manifest itself)")
    if name.endswith(".swc"):
        return read_swc(path)
    if name.endswith(".mrk.json"):
        return read_markups_branches(path)
    if name.endswith((".stl", ".vtp")):
        return _closed(read_stl(path) if name.endswith(".stl") else read_vtp(path), path)
    return _labels(path, least_voxels)
