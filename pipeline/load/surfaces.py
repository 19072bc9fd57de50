"""Triangles and polylines from .vtp (ASCII, inline base64 or appended, zlib or not) and .stl (ASCII or binary).

Out: LPS mm.
"""

import base64
import itertools
import re
import struct
import xml.etree.ElementTree as ET
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.load.geometry import refused
from pipeline.model import Shapes

RAS_TO_LPS = np.array([-1.0, -1.0, 1.0])
_TYPES = {
    "Float32": "f4", "Float64": "f8", "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2",
    "Int32": "i4", "UInt32": "u4", "Int64": "i8", "UInt64": "u8",
}  # fmt: skip


def to_lps(text: bytes, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (n, 3) of a file in LPS mm: 3D Slicer says SPACE=RAS in a comment or header, all else is taken as LPS."""
    return points * RAS_TO_LPS if b"SPACE=RAS" in text[:4096] else points


class _Vtp:
    """One parsed .vtp file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        raw = path.read_bytes()
        self.head = raw[:4096]
        self.tail = b""
        match = re.search(rb"<AppendedData[^>]*encoding=\"(raw|base64)\"[^>]*>\s*_", raw)
        if match:
            self.encoding = match.group(1).decode()
            end = raw.rfind(b"</AppendedData>")
            self.tail = raw[match.end() : end]
            raw = raw[: match.end()] + b"</AppendedData></VTKFile>"
        try:
            self.root = ET.fromstring(raw)
        except ET.ParseError as error:
            raise refused(path, f"broken XML ({error})", "a VTK PolyData file", "write it again") from error
        order = "<" if self.root.get("byte_order", "LittleEndian") == "LittleEndian" else ">"
        self.header = order + ("Q" if self.root.get("header_type") == "UInt64" else "I")
        self.compressed = bool(self.root.get("compressor"))
        if self.compressed and "ZLib" not in str(self.root.get("compressor")):
            got = f"compressor {self.root.get('compressor')}"
            raise refused(path, got, "vtkZLibDataCompressor or none", "save it uncompressed")

    def array(self, node: ET.Element) -> NDArray[Any]:
        """One DataArray, flat."""
        kind = np.dtype(self.header[0] + _TYPES[str(node.get("type"))])
        form = node.get("format")
        if form == "ascii":
            return np.array((node.text or "").split(), dtype=float).astype(kind)
        tail = (node.text or "").encode() if form == "binary" else self.tail[int(node.get("offset", "0")) :]
        raw = form != "binary" and self.encoding == "raw"
        return np.frombuffer(self._payload(tail if raw else self._decoded(tail)), kind)

    def _decoded(self, text: bytes) -> bytes:
        """Decode base64 in which VTK codes the header apart from the data when it compresses."""
        clean = b"".join(text.split())
        if not self.compressed:
            return base64.b64decode(clean)
        size = struct.calcsize(self.header)
        blocks = struct.unpack(self.header, base64.b64decode(clean[:24])[:size])[0]
        coded = 4 * ((((3 + blocks) * size) + 2) // 3)
        return base64.b64decode(clean[:coded]) + base64.b64decode(clean[coded:])

    def _payload(self, data: bytes) -> bytes:
        """The content of one binary array: a length, or a table of zlib blocks, comes first."""
        size = struct.calcsize(self.header)
        first = struct.unpack(self.header, data[:size])[0]
        if not self.compressed:
            return data[size : size + first]
        sizes = struct.unpack_from(f"{self.header[0]}{first}{self.header[1]}", data, 3 * size)
        ends = (3 + first) * size + np.cumsum([0, *sizes])
        return b"".join(zlib.decompress(data[a:b]) for a, b in itertools.pairwise(ends))


def _cells(file: _Vtp, piece: ET.Element, kind: str) -> list[NDArray[np.int64]]:
    node = piece.find(kind)
    if node is None:
        return []
    arrays = {str(a.get("Name")): file.array(a).astype(np.int64) for a in node.findall("DataArray")}
    if "offsets" not in arrays or len(arrays["offsets"]) == 0:
        return []
    return [c for c in np.split(arrays["connectivity"], arrays["offsets"]) if len(c)]


def read_vtp(path: Path) -> Shapes:
    """Points, lines and triangles (polygons are fanned) of a .vtp file. Raises LoadError for any other content."""
    file = _Vtp(path)
    piece = file.root.find("./PolyData/Piece")
    node = None if piece is None else piece.find("./Points/DataArray")
    if piece is None or node is None:
        raise refused(path, "no PolyData piece with points", "one <Piece> of <PolyData>", "export as PolyData")
    points = to_lps(file.head, file.array(node).astype(np.float64).reshape(-1, 3))
    fans = [
        np.stack([np.full(len(p) - 2, p[0]), p[1:-1], p[2:]], axis=1)
        for p in _cells(file, piece, "Polys")
        if len(p) > 2
    ]
    triangles = np.concatenate(fans) if fans else np.zeros((0, 3), np.int64)
    return Shapes(points, triangles, tuple(_cells(file, piece, "Lines")))


def read_stl(path: Path) -> Shapes:
    """Triangles of an .stl file; equal corners are merged so that the surface is closed."""
    raw = path.read_bytes()
    count = struct.unpack("<I", raw[80:84])[0] if len(raw) >= 84 else -1
    if len(raw) == 84 + 50 * count:
        record = np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("extra", "<u2")])
        corners = np.frombuffer(raw[84:], record)["corner"].reshape(-1, 3).astype(np.float64)
    else:
        found = re.findall(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", raw)
        try:
            corners = np.array(found, dtype=float).reshape(-1, 3)
        except ValueError as error:
            raise refused(path, str(error), "three numbers after each vertex", "export it again as .stl") from error
    if len(corners) == 0 or len(corners) % 3:
        raise refused(path, f"{len(corners)} corners", "triangles", "export a triangle surface as .stl")
    points, index = np.unique(corners, axis=0, return_inverse=True)
    return Shapes(to_lps(raw, points), index.reshape(-1, 3).astype(np.int64))
