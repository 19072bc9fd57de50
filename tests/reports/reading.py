"""Readers of the files that ``reports.export`` writes for other programs: only the tests read these back."""

from __future__ import annotations

import base64
import json
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]
_TYPES = {"Float64": "<f8", "Int64": "<i8"}
_LENGTH_BYTES = 8  # header_type UInt64


@dataclass(frozen=True, eq=False)
class Labels:
    """A label map indexed x, y, z with its geometry in LPS mm; ``segments`` names the labels 1, 2, ..."""

    values: NDArray[Any]
    spacing_mm: Array
    origin_mm: Array
    direction: Array
    segments: tuple[str, ...]


def read_markups_curve(path: Path) -> Array:
    """Points (n, 3) in LPS mm of the first curve of a file; RAS is turned. ValueError for another markup."""
    markup = json.loads(path.read_text(encoding="utf-8"))["markups"][0]
    units = markup.get("coordinateUnits", "mm")
    if markup["type"] not in ("Curve", "ClosedCurve") or units not in ("mm", ["mm", "UCUM", "millimeter"]):
        msg = f"{path}: got a {markup['type']!r} in {units!r}; only a curve in mm can be read"
        raise ValueError(msg)
    kept = [p["position"] for p in markup["controlPoints"] if p.get("positionStatus", "defined") == "defined"]
    points = np.array(kept, dtype=np.float64).reshape(-1, 3)
    # older writers say "0" for RAS, which is LPS with the first two axes reversed
    reversed_axes = str(markup.get("coordinateSystem", "LPS")) in ("RAS", "0")
    return np.asarray(points * (-1.0, -1.0, 1.0)) if reversed_axes else points


def read_segmentation_nrrd(path: Path) -> Labels:
    """Read back a segmentation, indexed x, y, z."""
    image: Any = sitk.ReadImage(str(path))
    keys = sorted(k for k in image.GetMetaDataKeys() if k.startswith("Segment") and k.endswith("_Name"))
    values = sitk.GetArrayFromImage(image).T
    spacing, origin = np.array(image.GetSpacing()), np.array(image.GetOrigin())
    direction = np.array(image.GetDirection()).reshape(3, 3)
    return Labels(values, spacing, origin, direction, tuple(image.GetMetaData(k) for k in keys))


@dataclass(frozen=True, eq=False)
class PolyData:
    """What a .vtp holds.

    points_mm : (n, 3) LPS mm.     lines : one index array each.     triangles : (t, 3) indices.
    point_arrays : name -> (n,) or (n, 3).
    """

    points_mm: Array
    lines: tuple[Index, ...] = ()
    triangles: Index = field(default_factory=lambda: np.zeros((0, 3), np.int64))
    point_arrays: Mapping[str, Array] = field(default_factory=dict)


def read_vtp(path: Path) -> PolyData:
    """Read back a .vtp as written here; raises ValueError for the ASCII, compressed and appended forms."""
    root = ET.parse(path).getroot()
    piece = root.find("./PolyData/Piece")
    inline = all(a.get("format") == "binary" for a in root.iter("DataArray"))
    if piece is None or not inline or root.get("header_type") != "UInt64" or root.get("compressor"):
        msg = f"{path}: not an uncompressed inline .vtp; only the files that this package writes are read"
        raise ValueError(msg)
    points = _arrays(piece, "Points")["Points"]
    lines = _cells(piece, "Lines")
    triangles = np.array(_cells(piece, "Polys"), dtype=np.int64).reshape(-1, 3)
    return PolyData(points, lines, triangles, _arrays(piece, "PointData"))


def _arrays(piece: ET.Element, block: str) -> dict[str, NDArray[Any]]:
    return {str(a.get("Name")): _parse(a) for a in piece.findall(f"./{block}/DataArray")}


def _parse(element: ET.Element) -> NDArray[Any]:
    content = base64.b64decode((element.text or "").strip())[_LENGTH_BYTES:]
    values = np.frombuffer(content, dtype=_TYPES[str(element.get("type"))])
    components = int(element.get("NumberOfComponents", "1"))
    return values.reshape(-1, components) if components > 1 else values


def _cells(piece: ET.Element, kind: str) -> tuple[Index, ...]:
    arrays = _arrays(piece, kind)
    if not arrays or not len(arrays["offsets"]):
        return ()
    return tuple(np.split(arrays["connectivity"], arrays["offsets"][:-1]))
