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
from reports.export.vtp import Index, read_surface_vtp
from reports.frames_file import Array, FrameArrays, ScanCrop

_MAX_TRIANGLES = 8_000  # 150 kB of page
_MAX_POINTS = 240  # of a curve: 0.5 mm apart on a wire of 120 mm
_PICTURES_BYTES = 1_000_000  # of all scans together, so that a page stays below 2 MB
_QUALITY = 60  # of JPEG: a wire of one voxel still shows
_MAX_FRAMES = 120
_WINDOW_PERCENTILES = (2.0, 99.8)
_GEOMETRY = ("spacing_mm", "origin_mm", "direction", "shape")


def viewer_data(case: CaseFiles) -> dict[str, Any] | None:
    """The JSON of the viewer; None where no frame has a curve or a picture."""
    rows = case.errors.set_index("frame")
    numbers = [case.frames[place] for place in thinned(len(case.frames), _MAX_FRAMES)]
    if not numbers:
        return None
    shrink = _shrink(case.read_frame(numbers[0]), len(numbers))
    frames = [_frame(case.read_frame(n), rows.loc[n] if n in rows.index else {}, shrink) for n in numbers]
    if not any(frame["curves"] or frame["pictures"] for frame in frames):
        return None
    worst = [frame["p95_mm"] if frame["status"] == "ok" else None for frame in frames]
    start = max(range(len(frames)), key=lambda i: (worst[i] is not None, worst[i] or 0.0, i))
    errors = [e for frame in frames for e in frame["error_mm"] if e is not None]
    top = float(np.percentile(errors, 99)) if errors else 0.0
    return {
        "frames": frames,
        "start": start,
        "top_mm": _round_up(max(top, 0.05)),
        "scan": None if case.scan is None else _scan(case.scan),
        "lumen": _lumen(case),
        "left_out": len(case.frames) - len(numbers),
    }


def decimate(points_mm: Array, corners: Index, max_triangles: int = _MAX_TRIANGLES) -> tuple[Array, Index]:
    """Merge vertices (n, 3) of triangles (t, 3) on ever coarser lattices until few enough are left; for looking."""
    vertices, triangles = points_mm, corners
    size = float(np.ptp(vertices, axis=0).max()) / 400 if len(vertices) else 1.0
    while len(triangles) > max_triangles:
        keys = np.floor(points_mm / size).astype(np.int64)
        _, inverse, counts = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
        vertices = np.zeros((len(counts), 3))
        np.add.at(vertices, inverse.ravel(), points_mm)
        vertices /= counts[:, None]
        merged = inverse.ravel()[corners]
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


def _few(values: Array) -> Array:
    return values[thinned(len(values), _MAX_POINTS)]


def _flat(values: Array) -> list[float | None]:
    """Numbers in a row, to a micrometre."""
    return [_number(v) for v in np.asarray(values, dtype=float).ravel()]


def _number(value: Any) -> float | None:
    number = np.nan if value is None else float(value)
    return round(float(number), 3) + 0.0 if np.isfinite(number) else None


def _round_up(value: float) -> float:
    """The next of 1, 2 and 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step * power for step in (1, 2, 5, 10) if step * power >= value * (1 - 1e-9)))


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


def _shrink(frame: FrameArrays, count: int) -> float:
    """The scale of all pictures at which those of ``count`` frames like this one stay within the page's budget."""
    scale = 1.0
    while scale > 0.2 and count * sum(len(_jpeg(p, scale)) for p in frame.mips.values()) > _PICTURES_BYTES:
        scale *= 0.8
    return scale


def _jpeg(picture: NDArray[np.uint8], scale: float) -> str:
    low, high = np.percentile(picture, _WINDOW_PERCENTILES)
    stretched = np.clip((picture - low) * (255.0 / max(high - low, 1.0)), 0, 255).astype(np.uint8)
    image = _picture(stretched)
    size: Sequence[int] = [max(1, round(scale * n)) for n in image.size]
    return _uri(image if scale == 1.0 else image.resize((size[0], size[1])), "jpeg", quality=_QUALITY)


def _picture(values: NDArray[np.uint8]) -> Image.Image:
    """An array (across, up) as a picture whose first row is at the top: up is turned."""
    return Image.fromarray(np.ascontiguousarray(values.T[::-1]))


def _uri(image: Image.Image, kind: str, **options: Any) -> str:
    buffer = io.BytesIO()
    image.save(buffer, format=kind, **options)
    return f"data:image/{kind};base64,{base64.b64encode(buffer.getvalue()).decode('ascii')}"
