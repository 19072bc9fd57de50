"""Readers of the files that ``reports.export`` writes for 3D Slicer: only the tests read these back."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk
from numpy.typing import NDArray

Array = NDArray[np.float64]


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
