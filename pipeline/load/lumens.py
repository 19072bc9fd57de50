"""A lumen that the user brings, as the file has it: a label map, a closed surface, or a centreline with radius."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.load import load, read_header
from pipeline.load.centrelines import read_markups_branches, read_swc
from pipeline.load.geometry import LoadError, refused
from pipeline.load.surfaces import read_stl, read_vtp
from pipeline.model import Branches, Shapes, Volume


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
        msg = f"{path}: no such file; check lumen in the manifest (relative to the manifest itself)"
        raise LoadError(msg)
    if name.endswith(".swc"):
        return read_swc(path)
    if name.endswith(".mrk.json"):
        return read_markups_branches(path)
    if name.endswith((".stl", ".vtp")):
        return _closed(read_stl(path) if name.endswith(".stl") else read_vtp(path), path)
    return _labels(path, least_voxels)
