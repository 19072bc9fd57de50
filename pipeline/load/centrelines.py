"""Centrelines with radius, as branches of a vessel tree: .swc, and 3D Slicer curves with radii. Out: LPS mm."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.load.curves import markups_in, positions_of
from pipeline.load.geometry import refused
from pipeline.model import Branches


def read_swc(path: Path) -> Branches:
    """A .swc tree: number, type, x, y, z, radius, parent (-1 = root), lengths in mm."""
    rows = [
        r.split()
        for r in path.read_text(encoding="utf-8").splitlines()
        if r.strip() and not r.lstrip().startswith("#")
    ]
    try:
        table = np.array(rows, dtype=float)
    except ValueError as error:
        raise refused(path, str(error), "seven numbers a line", "export it again as .swc") from error
    if table.ndim != 2 or table.shape[1] < 7:
        raise refused(
            path, f"a table of shape {table.shape}", "seven numbers a line", "export it again as .swc"
        )
    row_of = {int(n): i for i, n in enumerate(table[:, 0])}
    child = np.array([i for i in range(len(table)) if int(table[i, 6]) in row_of], dtype=np.int64)
    parent = np.array([row_of[int(table[i, 6])] for i in child], dtype=np.int64)
    points, radius = table[:, 2:5], table[:, 5]
    if len(child) == 0 or not np.all(radius > 0):
        raise refused(
            path, "no branch of positive radius", "nodes with parents and radii", "check columns 6 and 7"
        )
    return Branches(points[parent], points[child], radius[parent], radius[child])


def read_markups_branches(path: Path) -> Branches:
    """Curves with a ``Radius`` measurement per control point (as VMTK writes), every markup one branch."""
    start, end, first, last = [], [], [], []
    for markup in markups_in(path):
        points = positions_of(markup)
        values = [
            m.get("controlPointValues")
            for m in markup.get("measurements", [])
            if str(m.get("name", "")).lower() == "radius"
        ]
        if not values or values[0] is None or len(values[0]) != len(points):
            allowed = "a measurement named Radius with one of controlPointValues for every point"
            raise refused(
                path, f"curve {markup.get('name', '?')!r} without radii", allowed, "or give an .swc"
            )
        radius = np.array(values[0], dtype=float)
        start.append(points[:-1])
        end.append(points[1:])
        first.append(radius[:-1])
        last.append(radius[1:])
    if not start:
        raise refused(path, "no control points", "at least one curve with radii", "or give an .swc")
    a, b = np.concatenate(start), np.concatenate(end)
    return Branches(a, b, np.concatenate(first), np.concatenate(last))
