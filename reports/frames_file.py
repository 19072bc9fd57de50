"""frames.h5: the curves of every frame and the scan's projections, written and read in one place.

    /scan                attributes spacing_mm (3), origin_mm (3), direction (3, 3), shape (3): the vessel's crop
    /scan/lumen_mip_A    optional uint8, projection of the lumen's mask along array axis A
    /frames/NNN          attributes: scalars such as status;   datasets: the fields of ``Frame`` that are not None
    /frames/NNN/mip_A    optional uint8, maximum-intensity projection along array axis A: (y, z), (x, z), (x, y)

Curves are LPS mm, arrays indexed x, y, z; NNN is the zero-based frame index, zero-padded.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from reports.atomic import replacing

Array = NDArray[np.float64]
Pictures = Mapping[int, NDArray[np.uint8]]


@dataclass(frozen=True, eq=False)
class Scan:
    """Geometry of the vessel's crop in LPS mm, and the lumen's projections by array axis."""

    spacing_mm: Array
    origin_mm: Array
    direction: Array
    shape: tuple[int, int, int]
    lumen_mips: Pictures = field(default_factory=dict)

    def to_index(self, points_mm: Array) -> Array:
        """Continuous voxel indices (n, 3) of LPS points (n, 3)."""
        return np.asarray((points_mm - self.origin_mm) @ self.direction / self.spacing_mm)


@dataclass(frozen=True, eq=False)
class Frame:
    """Arrays of one frame; what does not apply is None.

    traced_mm (n, 3), simulated_mm (k, 3), truth_mm (t, 3): LPS mm, entry to tip.     trace_sigma_mm (n,).
    trace_flags (n,): 1 bridged, streaky or in contact, 2 nearly parallel to the plane of rotation, 3 both, 0 neither.
    error_mm and arc_mm: one value per compared arc sample.     contact_force_N: (k,) or (k, 3) at the joints.
    """

    frame: int
    traced_mm: Array | None = None
    simulated_mm: Array | None = None
    error_mm: Array | None = None
    arc_mm: Array | None = None
    contact_force_N: Array | None = None
    truth_mm: Array | None = None
    trace_sigma_mm: Array | None = None
    mips: Pictures = field(default_factory=dict)
    trace_flags: Array | None = None


_ARRAYS = tuple(f.name for f in fields(Frame) if f.name not in ("frame", "mips"))


def write_frames(path: Path, scan: Scan | None, frames: Iterable[Frame]) -> None:
    """Write frames.h5; ``frames`` may be a generator, so that one frame is held at a time."""
    with replacing(path) as temporary, h5py.File(temporary, "w") as file:
        group = file.create_group("frames")
        if scan is not None:
            _write_scan(file.create_group("scan"), scan)
        for frame in frames:
            _write_frame(group.create_group(f"{frame.frame:03d}"), frame)


def read_scan(path: Path) -> Scan | None:
    """The crop's geometry, or None where the file has none."""
    with h5py.File(path, "r") as file:
        if "scan" not in file or "spacing_mm" not in file["scan"].attrs:
            return None
        group = file["scan"]
        nx, ny, nz = (int(n) for n in group.attrs["shape"])
        geometry = [np.array(group.attrs[key], float) for key in ("spacing_mm", "origin_mm", "direction")]
        return Scan(
            geometry[0], geometry[1], geometry[2].reshape(3, 3), (nx, ny, nz), _pictures(group, "lumen_mip")
        )


def frame_numbers(path: Path) -> tuple[int, ...]:
    """Indices of the frames in the file, ascending."""
    with h5py.File(path, "r") as file:
        return tuple(sorted(int(name) for name in file.get("frames", ())))


def read_frame(path: Path, frame: int) -> Frame:
    """Arrays of one frame. Raises KeyError where the file does not have it."""
    with h5py.File(path, "r") as file:
        names = {int(name): name for name in file["frames"]}
        group = file["frames"][names[frame]]
        arrays = {name: np.array(group[name], float) for name in _ARRAYS if name in group}
        return Frame(frame, mips=_pictures(group, "mip"), **arrays)


def _write_scan(group: Any, scan: Scan) -> None:
    for key in ("spacing_mm", "origin_mm", "direction", "shape"):
        group.attrs[key] = np.asarray(getattr(scan, key))
    _write_pictures(group, "lumen_mip", scan.lumen_mips)


def _write_frame(group: Any, frame: Frame) -> None:
    for name in _ARRAYS:
        values = getattr(frame, name)
        if values is not None:
            group.create_dataset(name, data=np.asarray(values, dtype=np.float64))
    _write_pictures(group, "mip", frame.mips)


def _write_pictures(group: Any, prefix: str, pictures: Pictures) -> None:
    for axis, picture in pictures.items():
        # one fast pass of gzip: a projection is mostly dark, so it halves
        group.create_dataset(f"{prefix}_{axis}", data=picture, compression="gzip", compression_opts=1)


def _pictures(group: Any, prefix: str) -> Pictures:
    return {axis: np.array(group[f"{prefix}_{axis}"]) for axis in range(3) if f"{prefix}_{axis}" in group}
