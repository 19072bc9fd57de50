"""The scans of one case: headers first, then one crop at a time; never more than one frame is held."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.motion import Motion
from pipeline.load import Box, Header, Source, load, read_header, require_same_geometry
from pipeline.load.config import LoadConfig
from pipeline.model import Lumen, Volume
from pipeline.study.manifest import Case


@dataclass(frozen=True, eq=False)
class Scans:
    """Headers of a case's scans; all share one geometry."""

    reference: Header | None
    frames: tuple[Header, ...]

    @property
    def first(self) -> Header | None:
        """The scan that the lumen comes from: the wire-free one, else the frame with the least wire in it."""
        return self.reference or (self.frames[0] if self.frames else None)

    @property
    def assumed(self) -> tuple[str, ...]:
        """What the files lacked, each said once."""
        headers = [h for h in (self.reference, *self.frames) if h is not None]
        return tuple(dict.fromkeys(text for h in headers for text in h.assumed))


def _expanded(header: Header) -> list[Header]:
    """A sequence in one file as one header per volume."""
    if header.item_count == 1:
        return [header]
    source = header.source
    return [
        replace(header, source=Source(source.path, source.dataset, item), item_count=1)
        for item in range(header.item_count)
    ]


def read_headers(case: Case, config: LoadConfig) -> Scans:
    """Headers of all scans; raises LoadError where one is unusable or its geometry differs."""
    reference = read_header(case.reference, config, case.spacing_mm) if case.reference else None
    frames: list[Header] = []
    for source in case.frames:
        frames += _expanded(read_header(source, config, case.spacing_mm))
    scans = Scans(reference, tuple(frames))
    for header in frames:
        if scans.first is not None:
            require_same_geometry(scans.first, header)
    return scans


def lumen_box(header: Header, lumen: Lumen, motion: Motion | None = None) -> Box:
    """The voxels of a scan that the lumen's box covers, moved with the phantom where it moved."""
    grid = lumen.distance
    ends = np.stack(np.meshgrid(*[(0, n - 1) for n in grid.shape], indexing="ij"), -1).reshape(-1, 3)
    points = grid.to_mm(ends)
    corners = header.grid.to_index(points if motion is None else motion.moved(points))
    low = np.clip(np.floor(corners.min(axis=0) + 1e-6), 0, np.array(header.shape) - 1).astype(int)
    high = np.clip(np.ceil(corners.max(axis=0) - 1e-6) + 1, low + 1, header.shape).astype(int)
    return (int(low[0]), int(low[1]), int(low[2])), (int(high[0]), int(high[1]), int(high[2]))


def load_crop(header: Header, box: Box, config: LoadConfig) -> Volume:
    """The voxels of one box of one scan."""
    return load(header, box, config)


def load_counters(header: Header, box: Box) -> dict[str, float]:
    """What reading that box counts: voxels of the scan, read, and left alone."""
    total, read = float(np.prod(header.shape)), float(np.prod(np.subtract(box[1], box[0])))
    return {"voxels_total": total, "voxels_read": read, "voxels_skipped": total - read}


def projections(volume: Volume, window: tuple[float, float]) -> tuple[NDArray[np.uint8], ...]:
    """Maximum-intensity projections along the three array axes, 8 bit within the grey-value ``window``."""
    low, high = window
    scale = 255.0 / max(high - low, 1e-9)

    def project(axis: int) -> NDArray[np.uint8]:
        peak = volume.values.max(axis=axis).astype(np.float32)
        return np.asarray(np.clip((peak - low) * scale, 0, 255), dtype=np.uint8)

    return project(0), project(1), project(2)


def grey_window(volume: Volume) -> tuple[float, float]:
    """Grey values from the darkest projection pixels to the wire's: 1st and 99.9th percentile of a projection."""
    peak = volume.values.max(axis=2)
    low, high = np.percentile(peak, (1.0, 99.9))
    return float(low), float(high)


def voxels(headers: Sequence[Header]) -> dict[str, Any]:
    """Geometry of the study for result.json."""
    if not headers:
        return {}
    h = headers[0]
    return {
        "shape": list(h.shape),
        "spacing_mm": h.spacing_mm.tolist(),
        "origin_mm": h.origin_mm.tolist(),
        "direction": h.direction.tolist(),
        "pixel_type": h.pixel_type,
    }
