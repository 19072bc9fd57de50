"""Points in order from .csv, .vtp, .mrk.json, and branches with radius from .swc and .mrk.json. Out: LPS mm."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.load import LoadError
from pipeline.load.surfaces import read_vtp

RAS_TO_LPS = np.array([-1.0, -1.0, 1.0])
_NAMES = (("x_mm", "y_mm", "z_mm"), ("x", "y", "z"))


@dataclass(frozen=True, eq=False)
class Branches:
    """Cones: start (n, 3), end (n, 3), and their radii (n,), mm, LPS."""

    start_mm: NDArray[np.float64]
    end_mm: NDArray[np.float64]
    start_radius_mm: NDArray[np.float64]
    end_radius_mm: NDArray[np.float64]


def _bad(path: Path, got: str, allowed: str, do: str) -> LoadError:
    return LoadError(f"{path}: got {got}; expected {allowed}; {do}")


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
        raise _bad(path, str(error), "seven numbers a line", "export it again as .swc") from error
    if table.ndim != 2 or table.shape[1] < 7:
        raise _bad(path, f"a table of shape {table.shape}", "seven numbers a line", "export it again as .swc")
    row_of = {int(n): i for i, n in enumerate(table[:, 0])}
    child = np.array([i for i in range(len(table)) if int(table[i, 6]) in row_of], dtype=np.int64)
    parent = np.array([row_of[int(table[i, 6])] for i in child], dtype=np.int64)
    points, radius = table[:, 2:5], table[:, 5]
    if len(child) == 0 or not np.all(radius > 0):
        raise _bad(
            path, "no branch of positive radius", "nodes with parents and radii", "check columns 6 and 7"
        )
    return Branches(points[parent], points[child], radius[parent], radius[child])


def _markups(path: Path) -> list[dict[str, Any]]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))["markups"]
        return [m for m in found if m.get("controlPoints")]
    except (ValueError, KeyError, TypeError) as error:
        raise _bad(path, repr(error), "a 3D Slicer markups file", "save the curve as .mrk.json") from error


def _positions(markup: dict[str, Any]) -> NDArray[np.float64]:
    points = np.array([p["position"] for p in markup["controlPoints"]], dtype=float).reshape(-1, 3)
    # 0 in old files means RAS, and so does a missing name
    lps = str(markup.get("coordinateSystem", "RAS")).upper() in {"LPS", "1"}
    return points if lps else points * RAS_TO_LPS


def read_markups_curve(path: Path) -> NDArray[np.float64]:
    """Control points (n, 3) of the first markup, LPS mm."""
    found = _markups(path)
    if not found:
        raise _bad(path, "no control points", "one curve", "save the curve as .mrk.json")
    return _positions(found[0])


def read_markups_branches(path: Path) -> Branches:
    """Curves with a ``Radius`` measurement per control point (as VMTK writes), every markup one branch."""
    start, end, first, last = [], [], [], []
    for markup in _markups(path):
        points = _positions(markup)
        values = [
            m.get("controlPointValues")
            for m in markup.get("measurements", [])
            if str(m.get("name", "")).lower() == "radius"
        ]
        if not values or values[0] is None or len(values[0]) != len(points):
            allowed = "a measurement named Radius with one of controlPointValues for every point"
            raise _bad(path, f"curve {markup.get('name', '?')!r} without radii", allowed, "or give an .swc")
        radius = np.array(values[0], dtype=float)
        start.append(points[:-1])
        end.append(points[1:])
        first.append(radius[:-1])
        last.append(radius[1:])
    if not start:
        raise _bad(path, "no control points", "at least one curve with radii", "or give an .swc")
    a, b = np.concatenate(start), np.concatenate(end)
    return Branches(a, b, np.concatenate(first), np.concatenate(last))


def read_csv_points(path: Path) -> NDArray[np.float64]:
    """Points (n, 3), LPS mm: columns x_mm, y_mm, z_mm (or x, y, z) by name, else the first three of a bare table."""
    with path.open(newline="") as file:
        rows = [r for r in csv.reader(file) if r and not r[0].lstrip().startswith("#")]
    if not rows:
        raise _bad(path, "an empty file", "points", "columns x_mm, y_mm, z_mm")
    head = [c.strip().lower() for c in rows[0]]
    columns = next(([head.index(c) for c in names] for names in _NAMES if set(names) <= set(head)), None)
    try:
        if columns is None:
            return np.array([[float(c) for c in r[:3]] for r in rows]).reshape(-1, 3)
        return np.array([[float(r[c]) for c in columns] for r in rows[1:]]).reshape(-1, 3)
    except (ValueError, IndexError) as error:
        allowed = "columns x_mm, y_mm, z_mm of numbers"
        raise _bad(path, f"{error} (header {head})", allowed, "name the columns") from error


def read_vtp_points(path: Path) -> NDArray[np.float64]:
    """Points (n, 3) of the first polyline, LPS mm; all points in order where the file has no lines."""
    shapes = read_vtp(path)
    points = shapes.points_mm[shapes.lines[0]] if shapes.lines else shapes.points_mm
    return points * RAS_TO_LPS if shapes.ras else points
