"""3D Slicer markups curves (.mrk.json), LPS mm."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reports.atomic import write_text

Array = NDArray[np.float64]
_SCHEMA = (
    "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/"
    "markups-schema-v1.0.3.json#"
)
_POSITION_DIGITS = 6  # a nanometre: below any voxel, above float noise


def write_markups_curve(
    path: Path, points_mm: ArrayLike, name: str, colour: tuple[float, float, float] = (0.0, 0.447, 0.698)
) -> None:
    """Write a curve through points (n, 3), LPS mm, in order.

    colour : red, green, blue from 0 to 1.
    """
    points = checked_points(points_mm, path)
    markup = {
        "type": "Curve",
        "coordinateSystem": "LPS",
        "coordinateUnits": "mm",
        "locked": True,
        "labelFormat": "%N-%d",
        "controlPoints": [_control_point(name, i, p) for i, p in enumerate(points, start=1)],
        "measurements": [],
        "display": {"visibility": True, "color": list(colour), "selectedColor": list(colour)},
    }
    write_text(path, json.dumps({"@schema": _SCHEMA, "markups": [markup]}, indent=1, allow_nan=False) + "\n")


def checked_points(points_mm: ArrayLike, path: Path) -> Array:
    """Points as a float64 array (n, 3); raises ValueError for another shape or a value that is not finite."""
    points = np.asarray(points_mm, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or not np.all(np.isfinite(points)):
        raise ValueError(f"{path}: got points of shape {points.shape}; give finite LPS coordinates (n, 3) in mm")
    return points


def _control_point(name: str, number: int, point: Array) -> dict[str, Any]:
    return {
        "id": str(number),
        "label": f"{name}-{number}",
        "position": [round(float(x), _POSITION_DIGITS) for x in point],
        "orientation": [-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0],
        "selected": True,
        "locked": True,
        "visibility": False,  # a curve is read as a line; 400 glyphs would hide it
        "positionStatus": "defined",  # without it some versions take the point as a preview
    }
