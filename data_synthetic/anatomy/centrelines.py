"""Centrelines with radii from files: SWC trees (BraVa) and 3D Slicer curves with a Radius measurement."""

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from data_synthetic.geometry import Array, Index

LONGEST_EDGE_MM = 5.0
"""Longer SWC edges join trees that are not joined in the body (BraVa opens the circle of Willis); they are cut."""


@dataclass(frozen=True, eq=False)
class Tree:
    """Points (n, 3) LPS mm, radii (n,) mm, and undirected edges (m, 2) between points.

    meant : points among which the wire's way is to be found (a slice); the others are neighbours.
    """

    points_mm: Array
    radii_mm: Array
    edges: Index
    meant: slice = field(default_factory=lambda: slice(None))


def read_tree(path: str | Path) -> Tree:
    """A tree from .swc or .mrk.json; the siblings of a .mrk.json in its folder come along as neighbours.

    Raises ValueError when the file is neither, or holds no radii.
    """
    path = Path(path)
    if path.name.endswith(".swc"):
        return _read_swc(path)
    if path.name.endswith(".mrk.json"):
        beside = sorted(p for p in path.parent.glob("*.mrk.json") if p != path and p.is_file())
        curves = [_read_curve(p) for p in (path, *beside)]
        points, radii = (np.concatenate(parts) for parts in zip(*curves, strict=True))
        ends = np.cumsum([len(own) for own, _ in curves])
        starts = np.setdiff1d(np.arange(ends[-1]), ends - 1)  # where edges start: at all but a curve's last point
        return Tree(points, radii, np.column_stack([starts, starts + 1]), slice(0, int(ends[0])))
    raise ValueError(
        f"anatomy: {path}: got {path.suffix!r}; allowed: .swc, .mrk.json (with a Radius measurement); convert it"
    )


def _read_swc(path: Path) -> Tree:
    """Columns id, type, x, y, z, radius, parent; comments start with #."""
    try:
        rows = np.loadtxt(path, comments="#", ndmin=2, encoding="utf-8")
    except ValueError:
        allowed = "lines of 7 numbers, id type x y z radius parent"
        raise ValueError(f"anatomy: {path}: cannot be read; allowed: {allowed}; save it again") from None
    if not np.isfinite(rows).all():
        raise ValueError(f"anatomy: {path}: got numbers that are not finite; correct them")
    if rows.shape[1] != 7:
        raise ValueError(
            f"anatomy: {path}: got {rows.shape[1]} columns; an SWC line has 7: id type x y z radius parent"
        )
    place = {int(i): k for k, i in enumerate(rows[:, 0])}
    points, radii = rows[:, 2:5], rows[:, 5]
    joined = [(k, place[int(p)]) for k, p in enumerate(rows[:, 6]) if int(p) in place]
    edges = np.array(joined, dtype=np.int64).reshape(-1, 2)
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    # points that coincide (BraVa repeats branch points) become one of the larger radius, else edges have no length
    unique, inverse = np.unique(points.round(6), axis=0, return_inverse=True)
    inverse = inverse.ravel()
    radius = np.zeros(len(unique))
    np.maximum.at(radius, inverse, radii)
    merged = np.sort(inverse[edges[length <= LONGEST_EDGE_MM]], axis=1)
    merged = np.unique(merged[merged[:, 0] != merged[:, 1]], axis=0)
    return Tree(unique, radius, merged)


def _read_curve(path: Path) -> tuple[Array, Array]:
    """Points (n, 3) and radii (n,) of one Slicer curve; RAS coordinates are turned into LPS."""
    try:
        markup = json.loads(path.read_text(encoding="utf-8"))["markups"][0]
        points = np.array([p["position"] for p in markup["controlPoints"]], dtype=np.float64).reshape(-1, 3)
        measured = {m["name"]: m.get("controlPointValues") for m in markup.get("measurements", [])}
        radii = np.array(measured.get("Radius") or [], dtype=np.float64)
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, OverflowError, RecursionError):
        allowed = "a 3D Slicer markups file with the control points of a curve and their Radius; save it again"
        raise ValueError(f"anatomy: {path}: cannot be read; allowed: {allowed}") from None
    if markup.get("coordinateSystem", "LPS") in ("RAS", 0):
        points *= [-1.0, -1.0, 1.0]
    if radii.shape != (len(points),) or not len(points):
        raise ValueError(
            f"anatomy: {path}: got no Radius measurement per control point; add one in Slicer (Extract Centerline)"
        )
    if not (np.isfinite(points).all() and np.isfinite(radii).all()):
        raise ValueError(f"anatomy: {path}: got points or radii that are not finite; correct them")
    return points, radii
