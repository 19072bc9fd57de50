"""Wires that users bring (.csv, .vtp, .mrk.json), and the true ones of a synthetic study (truth.json). Out: LPS mm."""

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.polyline import UNITS_MM
from pipeline.load.chain import one_chain
from pipeline.load.geometry import refused, unusable
from pipeline.load.guard import reachable, read_json, told
from pipeline.load.outside import millimetres, to_number
from pipeline.load.stated import stated_in_table
from pipeline.load.surfaces import RAS_TO_LPS, read_vtp
from pipeline.load.tables import rows_of
from pipeline.model import Array, Curve

_NAMES = (("x_mm", "y_mm", "z_mm"), ("x", "y", "z"), ("points:0", "points:1", "points:2"))
"""Of the columns of points, in small letters; the last are ParaView's."""


def markups_in(path: Path) -> list[dict[str, Any]]:
    """The markups of a 3D Slicer file that have control points."""
    found = read_json(path, "a 3D Slicer markups file")
    markups = found.get("markups") if isinstance(found, dict) else None
    if not isinstance(markups, list) or not all(isinstance(markup, dict) for markup in markups):
        raise refused(path, "no list of markups", "a 3D Slicer markups file", "save the curve as .mrk.json")
    return [markup for markup in markups if markup.get("controlPoints")]


AS_THEY_ARE = np.ones(3)
SYSTEMS: dict[str, NDArray[np.float64]] = {
    "LPS": AS_THEY_ARE, "1": AS_THEY_ARE, "RAS": RAS_TO_LPS, "0": RAS_TO_LPS,
}  # fmt: skip


def of_json(found: list[Any]) -> NDArray[np.float64]:
    """Numbers, or lists of them, as an array; ValueError for anything else: numpy takes "1" and true for numbers."""
    values = np.array(found)
    each = [value for row in found for value in (row if isinstance(row, list) else [row])]
    if values.size and (values.dtype.kind not in "iuf" or any(isinstance(value, bool) for value in each)):
        raise ValueError("something else than numbers")
    return values.astype(np.float64)


def unit_of_markup(markup: dict[str, Any]) -> str:
    """Of its coordinates, and of what is measured in lengths and states no other."""
    return str(markup.get("coordinateUnits", "mm"))


def positions_of(path: Path, markup: dict[str, Any]) -> NDArray[np.float64]:
    """Control points (n, 3) of a markup, LPS mm; a file that states no system is LPS, as in 3D Slicer, 0 is RAS."""
    system = str(markup.get("coordinateSystem", "LPS")).upper()
    if system not in SYSTEMS:
        raise refused(path, f"coordinateSystem {system!r}", "LPS or RAS", "save the curve again")
    factor = millimetres(path, unit_of_markup(markup))
    with told(path):
        each = [(p["position"], p.get("positionStatus", "defined")) for p in markup["controlPoints"]]
    unplaced = [n for n, (_, status) in enumerate(each) if status != "defined"]
    if unplaced:
        got = f"{len(unplaced)} control points that are not placed, the first is point {unplaced[0]}"
        raise refused(path, got, "defined positions", "place or delete them and save the curve again")
    try:
        points = of_json([position for position, _ in each])
    except ValueError:
        points = np.zeros(0)
    if points.ndim != 2 or points.shape[1] != 3:
        raise refused(path, "control points that are not three numbers", "positions [x, y, z]", "save the curve again")
    return reachable(path, points * SYSTEMS[system] * factor)


OPEN = ("Curve", "Line", "Fiducial")
"""Markups whose points may be a wire: the others enclose something (ClosedCurve, Plane, ROI) or measure it (Angle)."""


def read_markups_curve(path: Path) -> NDArray[np.float64]:
    """Control points (n, 3) of the one markup of a file, LPS mm; of several, of the one that is a curve."""
    found = markups_in(path)
    kinds = [str(markup.get("type", "Curve")) for markup in found]
    if len(found) == 1 and kinds[0] not in OPEN:
        raise refused(path, f"a markup of type {kinds[0]!r}", "a Curve, a Line or points", "draw the wire as a curve")
    found = found if len(found) == 1 else [m for m, kind in zip(found, kinds, strict=True) if kind == "Curve"]
    if len(found) != 1:
        several = f"{len(found)} curves with control points"
        raise refused(path, several, "one curve", "save the wire's curve alone, as .mrk.json")
    return positions_of(path, found[0])


def points_in_table(path: Path, rows: list[list[str]]) -> NDArray[np.float64]:
    """Points (n, 3) as written: columns x_mm, y_mm, z_mm (or x, y, z) by name, else the three of a bare table."""
    if not rows:
        raise refused(path, "an empty file", "points", "columns x_mm, y_mm, z_mm")
    head = [c.strip().lower() for c in rows[0]]
    columns = next(([head.index(c) for c in names] for names in _NAMES if set(names) <= set(head)), None)
    twice = [head[c] for c in columns or () if head.count(head[c]) > 1]
    if twice:
        raise refused(path, f"two columns {twice[0]}", "one of each", "leave out the other")
    if columns is None and any(c and not _is_number(c) for c in head[:3]):
        raise unusable(path, _without_points(head))
    wide = next((n for n, row in enumerate(rows) if any(cell.strip() for cell in row[len(head) :])), None)
    if wide is not None:  # 1,5,2,0,3,1 below three names was read as 1, 5, 2
        got = f"{len(rows[wide])} values in row {wide} below {len(head)} columns"
        raise refused(path, got, "as many", "write decimals with a point, and values separated by commas")
    if columns is None and len(head) != 3:
        raise unusable(path, f"has {len(head)} columns without names; expected x, y, z; name them above the table")
    taken, below = (range(3), rows) if columns is None else (columns, rows[1:])
    allowed = "columns x_mm, y_mm, z_mm of numbers"
    _require_one_wire(path, head, below)
    short = next((row for row in below if len(row) <= max(taken)), None)
    if short is not None:
        raise refused(path, f"a row of {len(short)} values, {', '.join(short)}", allowed, "write three in every row")
    try:
        return np.array([[to_number(row[c]) for c in taken] for row in below]).reshape(-1, 3)
    except ValueError as error:
        raise refused(path, f"{error} (header {head})", allowed, "name the columns") from error


_GROUPS = re.compile(r"(?:frame|curve|wire|line|case|step|id)(?:_?(?:id|index|number|no|nr))?")
"""Names of columns, in small letters, that tell several wires of one table apart."""


def _require_one_wire(path: Path, head: list[str], below: list[list[str]]) -> None:
    """LoadError for a table of several wires: its points made one, which went back to the entry with every frame."""
    for column in (c for c, name in enumerate(head) if _GROUPS.fullmatch(name)):
        groups = dict.fromkeys(row[column].strip() for row in below if len(row) > column)
        if 1 < len(groups) < len(below):
            named = ", ".join([*groups][:3]) + ", ..." * (len(groups) > 3)
            got = f"{len(groups)} wires, by its column {head[column]} ({named})"
            raise refused(path, got, "the points of one", "write a file for each, named in the order of the frames")


def _without_points(head: list[str]) -> str:
    """What is wrong with names of columns of which none are a point's, and what to do: metres stay metres."""
    unit = next((u for u in UNITS_MM if {f"{axis}_{u}" for axis in "xyz"} <= set(head)), "")
    if unit:
        return f"has columns in {unit}; expected x, y, z; name them so and write '# unit: {unit}' above"
    shown = ", ".join(c if c.isprintable() else ascii(c) for c in head[:8]) + " ..." * (len(head) > 8)
    return (
        f"has columns {shown}; expected x_mm, y_mm, z_mm (or x, y, z), separated by commas or semicolons; write them so"
    )


def _is_number(text: str) -> bool:
    try:
        to_number(text)
    except ValueError:
        return False
    return True


def read_vtp_points(path: Path) -> NDArray[np.float64]:
    """Points (n, 3) of the one curve of a file, LPS mm; all points in order where the file has no lines."""
    shapes = read_vtp(path)
    return one_chain(path, shapes.points_mm, shapes.lines) if shapes.lines else shapes.points_mm


READERS = {".vtp": read_vtp_points, ".mrk.json": read_markups_curve}
"""All but tables, in which the meaning of the numbers stands beside them."""
KINDS = (".csv", *READERS)


def distinct(points: Array) -> Array:
    """Points (n, 3) less those that repeat the one before."""
    return np.asarray(points[np.any(np.diff(points, axis=0, prepend=np.nan) != 0, axis=1)])


def read_curve(path: Path) -> Curve:
    """One curve, LPS mm, ordered from entry to tip; its uncertainty is unknown (NaN). A table is LPS mm, or says what.

    Repeated points are dropped. Raises LoadError for another kind of file, fewer than two points or a NaN.
    """
    kind = next((k for k in KINDS if path.name.lower().endswith(k)), None)
    if kind is None:
        raise refused(path, repr(path.suffix), ", ".join(KINDS), "export the curve in one of these")
    if kind == ".csv":
        rows, comments = rows_of(path)
        points = points_in_table(path, rows)
        space, unit = stated_in_table(path, rows, comments)
        points = points * SYSTEMS[space or "LPS"] * millimetres(path, unit or "mm")
    else:
        points = READERS[kind](path)
    if len(points):
        reachable(path, points)
        points = distinct(points)
    if len(points) < 2:
        raise refused(path, f"{len(points)} points", "two or more, all finite", "correct the file")
    return Curve(points, np.full(len(points), np.nan), source=f"given: {path.name}")


def read_truth(path: Path, frame_count: int | None) -> list[Array]:
    """True wires, one (n, 3) LPS mm curve per frame from the entry to the tip; repeated points are dropped.

    frame_count : None where not known.
    """
    expected = '{"frames": [{"points_mm": [[x, y, z], ...]}]}'
    found = read_json(path, expected)
    try:
        listed = [frame["points_mm"] for frame in found["frames"]]
    except (KeyError, TypeError, IndexError):
        raise unusable(path, f"cannot be read as truth; expected {expected}") from None
    curves = []
    for number, points in enumerate(listed):
        try:
            curves.append(of_json(points))
        except (ValueError, TypeError):
            raise unusable(path, f"frame {number} holds something else than numbers; expected {expected}") from None
    frame_count = len(curves) if frame_count is None else frame_count
    if len(curves) != frame_count or any(c.ndim != 2 or c.shape[1] != 3 for c in curves):
        few = "; where synth was interrupted the study is incomplete: give synth again" * (len(curves) > frame_count)
        raise unusable(path, f"holds {len(curves)} curves, expected {frame_count} of shape (n, 3), one per frame{few}")
    curves = [distinct(curve) for curve in curves]
    for number, curve in enumerate(curves):
        if len(curve) < 2:
            got = f"frame {number} holds {len(curve)} points"
            raise unusable(path, f"{got}; expected two or more, apart from each other")
        reachable(path, curve, f"frame {number}: points")
    return curves
