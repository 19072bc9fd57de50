"""frames.h5: the curves of every frame and the scan's projections, written and read in one place.

    /scan                attributes spacing_mm (3), origin_mm (3), direction (3, 3), shape (3): the vessel's crop
    /scan/lumen_mip_A    optional uint8, projection of the lumen's mask along array axis A
    /scan/entry_slab_A   optional uint8, where no lumen was found (the crop is the whole scan then): its maxima near the
                         entry along array axis A
    /frames/NNN          datasets of a frame, see below; attribute ``status``, as in errors.csv: curves of a frame that
                         is not ok are kept to look at, and count in no score
    /frames/NNN/mip_A    optional uint8, maximum-intensity projection along array axis A: (y, z), (x, z), (x, y)
    /frames/NNN/straightened    optional uint8, the scan along the traced wire: planes across it, ``along_mm`` apart,
                         of samples ``across_mm`` apart, the wire in their middle; ``normal``: their first axis

The file has the attributes of ``ATTRIBUTES``, each dataset the attribute ``unit``: ``mm``, ``mm^2``, ``N``, or ``1``
for flags and grey values. Curves are LPS mm, arrays indexed x, y, z; NNN is the zero-based frame index, zero-padded.
"""

import io
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from reports.atomic import write_bytes

Array = NDArray[np.float64]
Pictures = Mapping[int, NDArray[np.uint8]]


@dataclass(frozen=True, eq=False, repr=False)
class ScanCrop:
    """Geometry of the vessel's crop in LPS mm, and by array axis projections of the lumen, or of slabs at the entry."""

    spacing_mm: Array
    origin_mm: Array
    direction: Array
    shape: tuple[int, int, int]
    lumen_mips: Pictures = field(default_factory=dict)
    entry_slabs: Pictures = field(default_factory=dict)

    def __repr__(self) -> str:
        """What a prompt shows: not the pictures."""
        spacing = " x ".join(f"{edge:.4g}" for edge in self.spacing_mm)
        return f"ScanCrop({self.shape}, voxels of {spacing} mm, origin {np.round(self.origin_mm, 3).tolist()})"

    def to_index(self, points_mm: Array) -> Array:
        """Continuous voxel indices (n, 3) of LPS points (n, 3)."""
        return np.asarray((points_mm - self.origin_mm) @ self.direction / self.spacing_mm)


class Straightened(NamedTuple):
    """A scan along a wire: k planes (k, m, m) across it, how far apart these are, and the samples in them, mm.

    normal : (3,) the first axis of the planes, see above.
    """

    values: NDArray[np.uint8]
    along_mm: float
    across_mm: float
    normal: Array


@dataclass(frozen=True, eq=False, repr=False)
class FrameArrays:
    """Arrays of one frame; what does not apply is None.

    status : as in errors.csv. Curves of a frame that is not ok are kept to look at and count in no score; empty where
    an older version wrote the file.

    traced_mm (n, 3), simulated_mm (k, 3), truth_mm (t, 3) : LPS mm, from the entry to the tip. The trace may begin some
    tenths of a mm before or beyond the clamp's plane, from which insertion_mm counts: its own length is another.
    trace_sigma_mm (n,) : standard deviation of the traced points.     trace_flags (n,) : 1 where a gap is bridged, the
    scan is streaky or strands are in contact, 2 where the wire is nearly parallel to the plane of rotation, 3 both, 0
    neither.
    seen_in_view_mm (n, 2), simulated_in_view_mm (k, 2) : the real and the simulated wire in an X-ray projection, mm
    from the isocentre in the plane through it.
    error_mm, arc_mm : one value for each compared sample of the arc.     contact_force_N : (k,) or (k, 3) at the
    joints.
    median_mm (n, 3), covariance_mm2 (n, 3, 3) : of the ensemble's wires, at samples like those.
    mips : a dict of pictures by array axis 0, 1, 2: the scan's maxima along it, uint8, in the box of the case's
    ``scan``.     straightened : the scan along the traced wire, a named tuple: ``values`` (k, m, m) uint8, k planes
    across it, which is in their middle, ``along_mm`` apart, of samples ``across_mm`` apart; ``normal`` (3,), their
    first axis, LPS.
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
    seen_in_view_mm: Array | None = None
    simulated_in_view_mm: Array | None = None
    median_mm: Array | None = None
    covariance_mm2: Array | None = None
    straightened: Straightened | None = None
    status: str = ""

    def __repr__(self) -> str:
        """What a prompt shows: which arrays there are, and of what shape."""
        shapes = [f", {name} {one.shape}" for name in _ARRAYS if (one := getattr(self, name)) is not None]
        return f"FrameArrays(frame {self.frame}{f', {self.status}' * bool(self.status)}{''.join(shapes)})"

    @property
    def curves(self) -> dict[str, Array]:
        """The wires that the frame has, in the order of drawing: the later lie over the earlier."""
        wires = {"traced": self.traced_mm, "true": self.truth_mm, "simulated": self.simulated_mm}
        return {name: points for name, points in wires.items() if points is not None and len(points)}


ATTRIBUTES = {"schema": 1, "length_unit": "mm", "force_unit": "N", "coordinates": "LPS"}
"""What stands at the root of the file: positive x to the patient's left, y to the back, z to the head."""
_PACKED: dict[str, Any] = {"compression": "gzip", "compression_opts": 1}
"""One fast pass of gzip: a projection is mostly dark, so it halves."""
_OF_PLANES = ("along_mm", "across_mm", "normal")
_GEOMETRY = ("spacing_mm", "origin_mm", "direction", "shape")
_ARRAYS = tuple(f.name for f in fields(FrameArrays) if f.name not in ("frame", "mips", "straightened", "status"))


def write_frames(path: Path, scan: ScanCrop | None, frames: Iterable[FrameArrays]) -> None:
    """Write frames.h5; ``frames`` may be a generator, so that one frame is held at a time."""
    whole = io.BytesIO()  # a few MB; HDF5 on a full disk leaves a file that it can neither write nor close
    with h5py.File(whole, "w") as file:
        file.attrs.update(ATTRIBUTES)
        everything = file.create_group("frames")
        if scan is not None:
            group = file.create_group("scan")
            for key in _GEOMETRY:
                group.attrs[key] = np.asarray(getattr(scan, key))
            _write_pictures(group, "lumen_mip", scan.lumen_mips)
            _write_pictures(group, "entry_slab", scan.entry_slabs)
        for frame in frames:
            group = everything.create_group(f"{frame.frame:03d}")
            group.attrs["status"] = frame.status
            for name in _ARRAYS:
                if getattr(frame, name) is not None:
                    values = group.create_dataset(name, data=np.asarray(getattr(frame, name), dtype=np.float64))
                    values.attrs["unit"] = _unit_of(name)
            _write_pictures(group, "mip", frame.mips)
            if frame.straightened is not None:
                planes = _packed(group, "straightened", frame.straightened.values)
                planes.attrs.update(dict(zip(_OF_PLANES, frame.straightened[1:], strict=True)))
    write_bytes(path, whole.getvalue())


def read_scan(path: Path) -> ScanCrop | None:
    """The crop's geometry, or None where the file has none."""
    with h5py.File(path, "r") as file:
        if "scan" not in file or "spacing_mm" not in file["scan"].attrs:
            return None
        group = file["scan"]
        spacing, origin, direction, shape = (np.array(group.attrs[key], float) for key in _GEOMETRY)
        nx, ny, nz = (int(n) for n in shape)
        pictures = (_read_pictures(group, name) for name in ("lumen_mip", "entry_slab"))
        return ScanCrop(spacing, origin, direction.reshape(3, 3), (nx, ny, nz), *pictures)


def frame_numbers(path: Path) -> tuple[int, ...]:
    """Indices of the frames in the file, ascending."""
    with h5py.File(path, "r") as file:
        return tuple(sorted(int(name) for name in file.get("frames", ())))


def read_frame(path: Path, frame: int) -> FrameArrays:
    """Arrays of one frame. Raises KeyError where the file does not have it."""
    with h5py.File(path, "r") as file:
        names = {int(name): name for name in file["frames"]}
        group = file["frames"][names[frame]]
        arrays = {name: np.array(group[name], float) for name in _ARRAYS if name in group}
        pictures, straight = _read_pictures(group, "mip"), _read_straightened(group)
        status = str(group.attrs.get("status", ""))
        return FrameArrays(frame, mips=pictures, straightened=straight, status=status, **arrays)


def read_arrays(path: Path, *names: str) -> dict[int, dict[str, Array]]:
    """Some fields of ``FrameArrays`` of every frame, as far as it has them."""
    with h5py.File(path, "r") as file:
        return {
            int(number): {name: np.array(group[name], float) for name in names if name in group}
            for number, group in file.get("frames", {}).items()
        }


def _unit_of(name: str) -> str:
    """The unit of a dataset, which its name ends in; grey values and flags have none."""
    return {"mm": "mm", "mm2": "mm^2", "N": "N"}.get(name.rpartition("_")[2], "1")


def _read_straightened(group: Any) -> Straightened | None:
    if "straightened" not in group:
        return None
    planes = group["straightened"]
    along, across, normal = (planes.attrs[name] for name in _OF_PLANES)
    return Straightened(np.array(planes), float(along), float(across), np.array(normal, float))


def _write_pictures(group: Any, prefix: str, pictures: Pictures) -> None:
    for axis, picture in pictures.items():
        _packed(group, f"{prefix}_{axis}", picture)


def _packed(group: h5py.Group, name: str, values: NDArray[np.uint8]) -> h5py.Dataset:
    """A packed dataset in the file. Left to HDF5, its bytes go there whenever the garbage collector comes by."""
    dataset = group.create_dataset(name, data=values, **_PACKED)
    dataset.attrs["unit"] = _unit_of(name)
    dataset.flush()
    return dataset


def _read_pictures(group: Any, prefix: str) -> Pictures:
    return {axis: np.array(group[f"{prefix}_{axis}"]) for axis in range(3) if f"{prefix}_{axis}" in group}
