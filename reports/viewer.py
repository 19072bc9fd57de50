"""What the viewer in a case's page shows: every frame's curves, its scan as small pictures, the lumen's surface.

All of it stands in the page as JSON, so that a copied page works from a disk without a network; curves in LPS mm.
"""

import base64
import io
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from reports.case_files import GOOD, CaseFiles, thinned
from reports.colours import ERROR_SCALE_MM
from reports.export.vtp import Index, read_surface_vtp
from reports.frames_file import Array, FrameArrays, ScanCrop, Straightened

_MAX_TRIANGLES = 8_000  # 150 kB of page
_MAX_POINTS = 240  # of a curve: 0.5 mm apart on a wire of 120 mm
_PICTURES_BYTES = 1_000_000  # of all scans together, so that a page stays below 2 MB
_QUALITY = 60  # of JPEG: a wire of one voxel still shows
_PLANES, _MOST_PLANES = 1_800, 60  # across the wires, of all frames and of one: 10 kB
_MAX_FRAMES = 120
RANGES_MM = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
"""Offsets to which the strips along the wire may reach."""
_RANGE_MM, _SEEN_PERCENT = 1.0, 95  # the first where nothing was compared
_GEOMETRY = ("spacing_mm", "origin_mm", "direction", "shape")


def viewer_data(case: CaseFiles) -> dict[str, Any] | None:
    """The JSON of the viewer; None where no frame has a wire that was traced or simulated, or a picture."""
    rows = case.errors.set_index("frame")
    arrays = [case.read_frame(case.frames[place]) for place in thinned(len(case.frames), _MAX_FRAMES)]
    if not arrays:
        return None
    straight = [_straight(a.straightened, _PLANES // len(arrays)) for a in arrays]
    shrink = _shrink(arrays[0], len(arrays), _PICTURES_BYTES - sum(len(str(one)) for one in straight))
    frames = [
        _frame(a, rows.loc[a.frame] if a.frame in rows.index else {}, shrink) | {"straight": one}
        for a, one in zip(arrays, straight, strict=True)
    ]
    # a true wire alone, as of a case whose lumen was not found, is nothing of this study's
    if not any(frame["curves"].keys() - {"true"} or frame["pictures"] for frame in frames):
        return None
    worst = [frame["p95_mm"] if frame["status"] == "ok" else None for frame in frames]
    start = max(range(len(frames)), key=lambda i: (worst[i] is not None, worst[i] or 0.0, i))
    errors = [e for frame in frames for e in frame["error_mm"] if e is not None]
    least = max((one["across_mm"] for one in straight if one), default=0.0)
    return {
        "frames": frames,
        "start": start,
        "scale_mm": ERROR_SCALE_MM,
        "ranges_mm": RANGES_MM,
        "range_mm": range_mm(errors, least),
        "scan": None if case.scan is None else _scan(case.scan),
        "lumen": _lumen(case),
        "left_out": len(case.frames) - len(arrays),
    }


def range_mm(errors_mm: Sequence[float], least: float) -> float:
    """To which offset the strips along the wire reach at first, the same in every frame of a page: 95 % of its errors.

    least : what they show at least, mm, a sample of the scan that is seen behind.
    """
    wanted = max(float(np.percentile(errors_mm, _SEEN_PERCENT)) if errors_mm else _RANGE_MM, least)
    return next((mm for mm in RANGES_MM if mm >= wanted), RANGES_MM[-1])


def decimate(points_mm: Array, corners: Index, max_triangles: int = _MAX_TRIANGLES) -> tuple[Array, Index]:
    """Merge vertices (n, 3) of triangles (t, 3) on ever coarser lattices until few enough are left; for looking."""
    vertices, triangles = points_mm, corners
    size = float(np.ptp(vertices, axis=0).max()) / 400 if len(vertices) else 1.0
    while len(triangles) > max_triangles:
        keys = np.floor(points_mm / size).astype(np.int64)
        keys -= keys.min(axis=0)
        # one number a cell: rows would be compared byte by byte
        cells = np.ravel_multi_index(tuple(keys.T), tuple(keys.max(axis=0) + 1))
        _, inverse, counts = np.unique(cells, return_inverse=True, return_counts=True)
        vertices = np.zeros((len(counts), 3))
        np.add.at(vertices, inverse, points_mm)
        vertices /= counts[:, None]
        merged = inverse[corners]
        a, b, c = merged.T
        triangles = merged[(a != b) & (b != c) & (c != a)].astype(np.int64)
        size *= 1.25
    return vertices, triangles


def _frame(frame: FrameArrays, row: Any, shrink: float) -> dict[str, Any]:
    status = str(row.get("status", ""))
    sigma = np.zeros(0) if frame.trace_sigma_mm is None else np.asarray(frame.trace_sigma_mm)
    known = sigma[np.isfinite(sigma)]
    good = status in GOOD and frame.error_mm is not None
    return {
        "frame": frame.frame,
        "status": status,
        "good": good,
        **{name: _number(row.get(name)) for name in ("insertion_mm", "rms_mm", "p95_mm")},
        "curves": {name: _flat(_few(points)) for name, points in frame.curves.items()},
        "sigma_mm": _number(np.sqrt(np.mean(np.square(known)))) if len(known) else None,
        "arc_mm": _flat(_few(frame.arc_mm)) if good and frame.arc_mm is not None else [],
        "error_mm": _flat(_few(frame.error_mm)) if good and frame.error_mm is not None else [],
        "pictures": {axis: _jpeg(picture, shrink) for axis, picture in frame.mips.items()},
    }


def _straight(straight: Straightened | None, most: int) -> dict[str, Any] | None:
    """Two slabs along the wire, three samples thick, and ``most`` planes across it, one below the other."""
    if straight is None:
        return None
    values, middle = straight.values, straight.values.shape[1] // 2
    thick = slice(middle - 1, middle + 2)
    planes = values[thinned(len(values), min(most, _MOST_PLANES))]
    # seen along the wire: up the first direction, to the right the second
    below = planes[:, ::-1].reshape(-1, values.shape[2])
    return {
        "along_mm": straight.along_mm,
        "across_mm": straight.across_mm,
        "samples": values.shape[:2],
        "planes": len(planes),
        "normal": [round(float(x), 6) for x in straight.normal],
        "slabs": [_jpeg(values[:, :, thick].max(axis=2), 1.0), _jpeg(values[:, thick].max(axis=1), 1.0)],
        "across": _jpeg(below.T[:, ::-1], 1.0),
    }


def _few(values: Array) -> Array:
    return values[thinned(len(values), _MAX_POINTS)]


def _flat(values: Array) -> list[float | None]:
    """Numbers in a row, to a micrometre."""
    return [_number(v) for v in np.asarray(values, dtype=float).ravel()]


def _number(value: Any) -> float | None:
    number = np.nan if value is None else float(value)
    return round(float(number), 3) + 0.0 if np.isfinite(number) else None


def _scan(scan: ScanCrop) -> dict[str, Any]:
    masks = {axis: mask for axis, mask in scan.lumen_mips.items() if mask.any() and not mask.all()}
    return {
        **{name: np.asarray(getattr(scan, name)).tolist() for name in _GEOMETRY},
        "aligned": bool(np.allclose(scan.direction, np.eye(3), atol=1e-3)),
        "lumen": {axis: _uri(_picture((mask > 0).astype(np.uint8) * 255), "png") for axis, mask in masks.items()},
    }


def _lumen(case: CaseFiles) -> dict[str, Any] | None:
    """The surface on a lattice of 16 bits, little-endian, in base64."""
    path = case.folder / "view" / "lumen.vtp"
    if not path.exists():
        return None
    vertices, triangles = decimate(*read_surface_vtp(path))
    if not len(triangles):
        return None
    low, size = vertices.min(axis=0), max(float(np.ptp(vertices, axis=0).max()), 1e-6)
    lattice = np.round((vertices - low) / size * 65535).astype("<u2")
    packed = (base64.b64encode(a.tobytes()).decode("ascii") for a in (lattice, triangles.astype("<u4")))
    return dict(zip(("vertices", "triangles"), packed, strict=True)) | {"low_mm": _flat(low), "size_mm": size}


def _shrink(frame: FrameArrays, count: int, most_bytes: int) -> float:
    """The scale of all projections at which those of ``count`` frames like this one stay within what is left."""
    scale = 1.0
    while scale > 0.2 and count * sum(len(_jpeg(p, scale)) for p in frame.mips.values()) > most_bytes:
        scale *= 0.8
    return scale


def _jpeg(picture: NDArray[np.uint8], scale: float) -> str:
    image = _picture(picture)
    size: Sequence[int] = [max(1, round(scale * n)) for n in image.size]
    return _uri(image if scale == 1.0 else image.resize((size[0], size[1])), "jpeg", quality=_QUALITY)


def _picture(values: NDArray[np.uint8]) -> Image.Image:
    """An array (across, up) as a picture whose first row is at the top: up is turned."""
    return Image.fromarray(np.ascontiguousarray(values.T[::-1]))


def _uri(image: Image.Image, kind: str, **options: Any) -> str:
    buffer = io.BytesIO()
    image.save(buffer, format=kind, **options)
    return f"data:image/{kind};base64,{base64.b64encode(buffer.getvalue()).decode('ascii')}"
