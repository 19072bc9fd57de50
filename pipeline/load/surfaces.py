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

from pipeline.load.geometry import LoadError, refused
from pipeline.load.guard import reachable, read_bytes, told
from pipeline.load.outside import misfits, to_numbers
from pipeline.model import Shapes
from reports.texts import TEXT_BYTES

MOST_UNPACKED = 256 * 2**20
RADIUS = "MaximumInscribedSphereRadius"
"""Name under which VMTK writes the radius of every point of a centreline."""
RAS_TO_LPS = np.array([-1.0, -1.0, 1.0])
_TYPES = {
    "Float32": "f4", "Float64": "f8", "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2",
    "Int32": "i4", "UInt32": "u4", "Int64": "i8", "UInt64": "u8",
}  # fmt: skip


_LPS, _RAS = "left[ _-]*posterior[ _-]*superior", "right[ _-]*anterior[ _-]*superior"
SPACE = re.compile(
    rf"(?<![a-z])(?:space|coordinate[ _-]?system)\"?\s*[:=]\s*\"?"
    rf"({_LPS}|{_RAS}|[RL][AP][SI]\b|[01](?![.,]?\d))",
    re.IGNORECASE,
)
_SPACES = {"1": "LPS", "0": "RAS"}  # as 3D Slicer numbers them
_IN_FIELD = re.compile(rb"Name=\"SPACE\"[^>]*>([\d\s]*)<")  # the text as character codes


def named_space(space: re.Match[str]) -> str:
    """The space that a match of ``SPACE`` names, in three letters."""
    word = space[1].upper()
    return _SPACES.get(word, {"L": "LPS", "R": "RAS"}[word[0]] if len(word) > 3 else word)


def space_of(head: bytes) -> str:
    """The space that the beginning of a file states: in a comment, or in VTK's field data; else empty."""
    if said := SPACE.search(head.decode("latin-1")):
        return named_space(said)
    if field := _IN_FIELD.search(head):
        return "".join(map(chr, map(int, field[1].split()))).strip("\0")
    return ""


def to_lps(path: Path, text: bytes, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (n, 3) of a file in LPS mm, which is what a file that states no space is taken for."""
    space = space_of(text[:4096])
    if space not in ("", "LPS", "RAS"):
        raise refused(path, f"space {space}", "LPS or RAS", "export it in one of these")
    return points * RAS_TO_LPS if space == "RAS" else points


class _Vtp:
    """One parsed .vtp file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        raw = read_bytes(path)
        if b"<!DOCTYPE" in raw or b"<!ENTITY" in raw:
            raise refused(path, "a document type with entities", "plain VTK PolyData", "write it again")
        self.room = MOST_UNPACKED
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
            return self._written(node, kind)
        tail = (node.text or "").encode() if form == "binary" else self.tail[int(node.get("offset", "0")) :]
        raw = form != "binary" and self.encoding == "raw"
        return np.frombuffer(self._payload(tail if raw else self._decoded(tail)), kind)

    def _written(self, node: ET.Element, kind: np.dtype[Any]) -> NDArray[Any]:
        """An array that is written out as text; LoadError where a number is none of its type."""
        values = to_numbers((node.text or "").encode().split())
        bad, allowed = misfits(values, kind)
        bad &= np.isfinite(values)
        if bad.any():
            got = f"{values[bad][0]:g} in an array of {node.get('type')}"
            raise refused(self.path, got, allowed, "write it again")
        return values.astype(kind)

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
            if len(data) < size + first:
                raise _cut_short(self.path, len(data) - size, first)
            return data[size : size + first]
        sizes = struct.unpack_from(f"{self.header[0]}{first}{self.header[1]}", data, 3 * size)
        ends = (3 + first) * size + np.cumsum([0, *sizes])
        blocks = []
        for a, b in itertools.pairwise(ends):
            unpack = zlib.decompressobj()
            blocks.append(unpack.decompress(data[a:b], self.room + 1))
            self.room -= len(blocks[-1])
            if self.room < 0:
                got = f"arrays that unpack to more than {MOST_UNPACKED / 2**20:.0f} MiB"
                raise refused(self.path, got, "less", "make the surface coarser, or save it uncompressed")
            if not unpack.eof:
                raise _cut_short(self.path, len(data[a:b]), b - a if len(data) < b else None)
        return b"".join(blocks)


def _cut_short(path: Path, there: int, said: int | None) -> LoadError:
    """An array that ends too early. there, said : bytes of it, the latter None where a packed block has no end."""
    got = f"{there} bytes of an array" + (f" that says {said}" if said is not None else ", packed, without their end")
    return refused(path, got, "all of it", "copy the file again")


def _cells(file: _Vtp, piece: ET.Element, kind: str, count: int) -> list[NDArray[np.int64]]:
    node = piece.find(kind)
    if node is None:
        _require_count(file.path, piece, kind, 0)
        return []
    arrays = {str(a.get("Name")): file.array(a).astype(np.int64) for a in node.findall("DataArray")}
    corners, ends = (arrays.get(name, np.zeros(0, np.int64)) for name in ("connectivity", "offsets"))
    _require_count(file.path, piece, kind, len(ends))
    return split_cells(file.path, kind, corners, ends, count)


def split_cells(
    path: Path, kind: str, corners: NDArray[np.int64], ends: NDArray[np.int64], count: int
) -> list[NDArray[np.int64]]:
    """The points of each cell by number, of all cells' corners and where each cell ends; LoadError for others.

    kind : what they are, for the message.     count : of points.
    """
    if len(ends) == 0:
        return []
    if np.any(np.diff(ends, prepend=0) < 0) or ends[-1] != len(corners) or np.any((corners < 0) | (corners >= count)):
        got = f"{kind} whose corners are not among its {count} points"
        raise refused(path, got, "whole cells", "write it again")
    return [c for c in np.split(corners, ends[:-1]) if len(c)]


def _piece(path: Path, file: _Vtp) -> tuple[ET.Element, ET.Element]:
    """The one piece of a file that has points, and these; LoadError for none, and for several."""
    pieces = [p for p in file.root.findall("./PolyData/Piece") if p.get("NumberOfPoints") != "0"]
    node = pieces[0].find("./Points/DataArray") if pieces else None
    if node is None or len(pieces) > 1:
        got = "no PolyData piece with points" if node is None else f"{len(pieces)} pieces with points"
        raise refused(path, got, "one <Piece> of <PolyData>", "export as PolyData, in one piece")
    return pieces[0], node


def _require_count(path: Path, piece: ET.Element, what: str, there: int) -> None:
    """LoadError where a piece holds another number of points or cells than it says."""
    said = piece.get(f"NumberOf{what}", str(there))
    if said != str(there):
        raise refused(path, f"{there} {what} where NumberOf{what} says {said}", "as many", "copy the file again")


def read_vtp(path: Path) -> Shapes:
    """Points, lines and triangles (polygons are fanned) of a .vtp file. Raises LoadError for any other content."""
    with told(path):
        file = _Vtp(path)
        piece, node = _piece(path, file)
        if node.get("NumberOfComponents", "3") != "3":
            got = f"Points of {node.get('NumberOfComponents')} numbers each"
            raise refused(path, got, 'NumberOfComponents="3"', "write it again")
        points = reachable(path, to_lps(path, file.head, file.array(node).astype(np.float64).reshape(-1, 3)))
        _require_count(path, piece, "Points", len(points))
        fans = [
            np.stack([np.full(len(p) - 2, p[0]), p[1:-1], p[2:]], axis=1)
            for p in _cells(file, piece, "Polys", len(points))
            if len(p) > 2
        ]
        triangles = np.concatenate(fans) if fans else np.zeros((0, 3), np.int64)
        named = {a.get("Name"): a for a in piece.findall("./PointData/DataArray")}
        radius = file.array(named[RADIUS]).astype(np.float64) if RADIUS in named else None
        return Shapes(points, triangles, tuple(_cells(file, piece, "Lines", len(points))), radius)


def read_stl(path: Path) -> Shapes:
    """Triangles of an .stl file; equal corners are merged so that the surface is closed."""
    raw = read_bytes(path)
    count = struct.unpack("<I", raw[80:84])[0] if len(raw) >= 84 else -1
    if len(raw) == 84 + 50 * count:
        record = np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("extra", "<u2")])
        corners = np.frombuffer(raw[84:], record)["corner"].reshape(-1, 3).astype(np.float64)
    elif len(raw) > TEXT_BYTES:
        got = f"{len(raw)} bytes for {count} triangles"
        raise refused(path, got, "84 + 50 bytes each (binary), or 64 MiB of text", "save it as binary .stl")
    else:
        found = re.findall(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", raw)
        try:
            corners = to_numbers([word for corner in found for word in corner]).reshape(-1, 3)
        except ValueError:
            got = "a vertex that is not three numbers"
            raise refused(path, got, "three numbers after each vertex", "export it again as .stl") from None
    if len(corners) == 0 or len(corners) % 3:
        raise refused(path, f"{len(corners)} corners", "triangles", "export a triangle surface as .stl")
    points, index = np.unique(reachable(path, corners), axis=0, return_inverse=True)
    return Shapes(to_lps(path, raw, points), index.reshape(-1, 3).astype(np.int64))
