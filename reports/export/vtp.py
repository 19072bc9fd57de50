"""VTK poly data (.vtp): wires as polylines with point arrays, surfaces as triangles. LPS mm.

Written by hand, because the vtk wheel would cost 592 MB: inline base64, little-endian, one 8-byte length
before each block. ASCII would be smaller code, but VTK's text reader stops at the first NaN.
"""

import base64
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reports.atomic import write_bytes
from reports.export.slicer import Array, checked_points

Index = NDArray[np.int64]
_TYPES = {"Float64": "<f8", "Int64": "<i8"}
_LENGTH_BYTES = 8  # header_type UInt64


def write_polyline_vtp(path: Path, points_mm: ArrayLike, point_arrays: Mapping[str, ArrayLike] | None = None) -> None:
    """Write one polyline through points (n, 3), LPS mm, with arrays (n,) or (n, 3) such as ``error_mm``."""
    points = checked_points(points_mm, path)
    offsets = np.array([len(points)] if len(points) else [], dtype=np.int64)
    _write(path, points, "Lines", (np.arange(len(points)), offsets), point_arrays or {})


def write_surface_vtp(path: Path, vertices_mm: ArrayLike, triangles: ArrayLike) -> None:
    """Write a triangle surface: vertices (n, 3) in LPS mm, triangles (t, 3) of vertex indices."""
    vertices, faces = checked_surface(path, vertices_mm, triangles)
    _write(path, vertices, "Polys", (faces.ravel(), 3 * np.arange(1, len(faces) + 1)), {})


def write_collection(folder: Path, stem: str) -> Path | None:
    """Write ``stem``.pvd over the files ``stem``_NNN.vtp of a folder, the frame being ParaView's time; None without."""
    root = ET.Element("VTKFile", type="Collection", version="0.1", byte_order="LittleEndian")
    sets = ET.SubElement(root, "Collection")
    for path in sorted(folder.glob(f"{stem}_[0-9]*.vtp")):
        frame = path.stem.removeprefix(f"{stem}_")
        if frame.isdecimal():  # else a copy of the user's own
            ET.SubElement(sets, "DataSet", timestep=str(int(frame)), group="", part="0", file=path.name)
    if not len(sets):
        return None
    collection = folder / f"{stem}.pvd"
    write_bytes(collection, ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")
    return collection


def checked_surface(path: Path, vertices_mm: ArrayLike, triangles: ArrayLike) -> tuple[Array, Index]:
    """Vertices (n, 3) and triangles (t, 3) as arrays; ValueError for another shape or an index that points nowhere."""
    vertices = checked_points(vertices_mm, path)
    faces = np.asarray(triangles, dtype=np.int64)
    inside = bool(np.all((faces >= 0) & (faces < len(vertices))))
    if faces.ndim != 2 or faces.shape[1] != 3 or not inside:
        raise ValueError(f"{path}: got triangles {faces.shape}; give (t, 3) indices into the {len(vertices)} vertices")
    return vertices, faces


def read_surface_vtp(path: Path) -> tuple[Array, Index]:
    """Vertices (n, 3) and triangles (t, 3) as written here; ValueError for ASCII, compressed and appended forms."""
    root = ET.parse(path).getroot()
    places = root.find("./PolyData/Piece/Points/DataArray")
    corners = root.find("./PolyData/Piece/Polys/DataArray[@Name='connectivity']")
    inline = all(a.get("format") == "binary" for a in root.iter("DataArray"))
    if places is None or corners is None or not inline or root.get("header_type") != "UInt64" or root.get("compressor"):
        raise ValueError(f"{path}: not an uncompressed inline .vtp; only the files that this package writes are read")
    vertices, triangles = (
        np.frombuffer(base64.b64decode((a.text or "").strip())[_LENGTH_BYTES:], _TYPES[str(a.get("type"))])
        for a in (places, corners)
    )
    return vertices.reshape(-1, 3), triangles.reshape(-1, 3)


def _write(
    path: Path, points: Array, kind: str, cells: tuple[Index, Index], point_arrays: Mapping[str, ArrayLike]
) -> None:
    """Write points and their cells: kind Lines or Polys; cells: vertices of all cells, and where each cell ends."""
    attributes = {"type": "PolyData", "version": "1.0", "byte_order": "LittleEndian", "header_type": "UInt64"}
    root = ET.Element("VTKFile", attributes)
    counts = {"NumberOfPoints": str(len(points)), f"NumberOf{kind}": str(len(cells[1]))}
    data_set = ET.SubElement(root, "PolyData")
    # 3D Slicer takes the axes from a text in the field data; a comment it does not read
    space = {"type": "String", "Name": "SPACE", "NumberOfTuples": "1", "format": "ascii"}
    ET.SubElement(ET.SubElement(data_set, "FieldData"), "Array", space).text = " ".join(str(c) for c in b"LPS\0")
    piece = ET.SubElement(data_set, "Piece", counts)
    data = ET.SubElement(piece, "PointData")
    for name, values in point_arrays.items():
        array, n = np.asarray(values, dtype=np.float64), len(points)
        if array.shape not in ((n,), (n, 3)):
            raise ValueError(f"{path}: point array {name} has shape {array.shape}; give ({n},) or ({n}, 3)")
        _append(data, name, array, "Float64")
    _append(ET.SubElement(piece, "Points"), "Points", points, "Float64")
    block = ET.SubElement(piece, kind)
    for name, indices in zip(("connectivity", "offsets"), cells, strict=True):
        _append(block, name, indices, "Int64")
    write_bytes(path, ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")


def _append(parent: ET.Element, name: str, values: NDArray[Any], kind: str) -> None:
    content = np.ascontiguousarray(values, dtype=_TYPES[kind]).tobytes()
    length = len(content).to_bytes(_LENGTH_BYTES, "little")
    components = str(values.shape[1]) if values.ndim == 2 else "1"
    attributes = {"type": kind, "Name": name, "NumberOfComponents": components, "format": "binary"}
    ET.SubElement(parent, "DataArray", attributes).text = base64.b64encode(length + content).decode("ascii")
