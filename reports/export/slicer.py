"""Files of 3D Slicer, LPS mm: markups curves (.mrk.json), and segmentations (.seg.nrrd) through SimpleITK."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk
from numpy.typing import ArrayLike, NDArray

from reports.atomic import replacing, write_text
from reports.colours import LUMEN, SIMULATED, rgb

Array = NDArray[np.float64]
_SCHEMA = (
    "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/"
    "markups-schema-v1.0.3.json#"
)
_POSITION_DIGITS = 6  # a nanometre: below any voxel, above float noise


def write_markups_curve(
    path: Path, points_mm: ArrayLike, name: str, colour: str = SIMULATED, measured_mm: Mapping[str, float] | None = None
) -> None:
    """Write a curve through points (n, 3), LPS mm, in order.

    colour : #RRGGBB.     measured_mm : lengths that stand among its measurements, by name.
    """
    points = checked_points(points_mm, path)
    markup = {
        "type": "Curve",
        "name": name,
        "coordinateSystem": "LPS",
        "coordinateUnits": "mm",
        "locked": True,
        "labelFormat": "%N-%d",
        "controlPoints": [_control_point(name, i, p) for i, p in enumerate(points, start=1)],
        "measurements": _measurements(points, measured_mm or {}),
        "display": {"visibility": True, "color": list(rgb(colour)), "selectedColor": list(rgb(colour))},
    }
    # no indent: compiled code, 4 times as fast, and two thirds of the bytes
    write_text(path, json.dumps({"@schema": _SCHEMA, "markups": [markup]}, allow_nan=False) + "\n")


def _measurements(points: Array, measured_mm: Mapping[str, float]) -> list[dict[str, Any]]:
    """The length, which 3D Slicer computes itself, and what it cannot; without what is no number."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    values = {"length": float(steps.sum()), **measured_mm}
    known = {name: round(value, _POSITION_DIGITS) for name, value in values.items() if np.isfinite(value)}
    shown = {"enabled": True, "units": "mm", "printFormat": "%-#4.4g%s"}
    return [{"name": name, "value": value, **shown} for name, value in known.items()]


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


def write_segmentation_nrrd(
    path: Path,
    values: NDArray[Any],
    spacing_mm: ArrayLike,
    origin_mm: ArrayLike,
    direction: ArrayLike,
    segments: Sequence[str] = ("lumen",),
) -> None:
    """Write a label map (nx, ny, nz), label k being ``segments[k - 1]``, compressed.

    spacing_mm (3,); origin_mm (3,) LPS centre of voxel (0, 0, 0); direction (3, 3), column a = axis a in LPS.
    The name must end in .seg.nrrd, by which Slicer knows a segmentation.
    """
    if not path.name.endswith(".seg.nrrd"):
        raise ValueError(f"{path}: a segmentation's name must end in .seg.nrrd; Slicer would open it as a grey volume")
    # SimpleITK's numpy view is z, y, x; transposing here is the only place in this package where the two meet
    image: Any = sitk.GetImageFromArray(np.ascontiguousarray(np.asarray(values, dtype=np.uint8).T))
    image.SetSpacing(np.asarray(spacing_mm, dtype=np.float64).tolist())
    image.SetOrigin(np.asarray(origin_mm, dtype=np.float64).tolist())
    image.SetDirection(np.asarray(direction, dtype=np.float64).ravel().tolist())
    for key, text in _metadata(values.shape, segments).items():
        image.SetMetaData(key, text)
    with replacing(path) as temporary:
        try:
            sitk.WriteImage(image, str(temporary), useCompression=True)
        except RuntimeError as error:  # of a full disk SimpleITK says no more than that it could not write
            raise OSError(f"SimpleITK: {str(error).strip().splitlines()[-1]}") from error


def _metadata(shape: tuple[int, ...], segments: Sequence[str]) -> dict[str, str]:
    extent = " ".join(f"0 {n - 1}" for n in shape)
    common = {
        "Segmentation_MasterRepresentation": "Binary labelmap",  # read by Slicer 4.11 to 5.0
        "Segmentation_SourceRepresentation": "Binary labelmap",  # its name since 5.1
        "Segmentation_ContainedRepresentationNames": "Binary labelmap|",
        "Segmentation_ReferenceImageExtentOffset": "0 0 0",
    }
    for i, name in enumerate(segments):
        common |= {
            f"Segment{i}_ID": name.replace(" ", "_"),
            f"Segment{i}_Name": name,
            f"Segment{i}_LabelValue": str(i + 1),
            f"Segment{i}_Layer": "0",
            f"Segment{i}_Color": " ".join(f"{value:.4f}" for value in rgb(LUMEN)),
            f"Segment{i}_Extent": extent,
        }
    return common
