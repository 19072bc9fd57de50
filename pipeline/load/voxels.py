"""Voxels behind a parsed header: where they lie, and a box of them read without any library that could be misled.

Of unpacked data only the box's rows are read; packed data are unpacked up to the end of the box. Memory holds the box
and one plane.
"""

import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.load.geometry import Box, Header, LoadError, Source, unusable
from pipeline.load.guard import ends_as_bzip2, require_room, size_of, skip, told_bytes, unpacked
from pipeline.load.outside import misfits, to_numbers

AXES, LONGEST_AXIS = (3, 4), 65535
"""Axes of a scan (the fourth counts volumes), and voxels along one at most."""


Placed = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""Spacing (3,), origin (3,) and direction (3, 3) in LPS mm."""


Names = dict[str, list[tuple[int, int]]]
"""Layer and value of the labels of each name: 3D Slicer lets several have one."""


@dataclass(frozen=True, eq=False)
class Head:
    """What a header says, in LPS mm.

    parts : the files that hold the voxels, in order and of equal share, each with the byte where its data begin.
    channels : values a voxel (fastest in memory).     items : volumes (slowest).     names : label values by name.
    packed_bytes : that the header announces, 0 where it does not.
    before : bytes, once unpacked, before the first voxel.     slope, intercept : grey = slope * stored + intercept.
    """

    path: Path
    shape: tuple[int, int, int]
    kind: np.dtype[Any]
    parts: tuple[tuple[Path, int], ...]
    spacing_mm: NDArray[np.float64]
    origin_mm: NDArray[np.float64]
    direction: NDArray[np.float64]
    packing: str = ""
    packed_bytes: int = 0
    before: int = 0
    items: int = 1
    channels: int = 1
    slope: float = 1.0
    intercept: float = 0.0
    assumed: tuple[str, ...] = ()
    names: Names = field(default_factory=dict)

    @property
    def plane_bytes(self) -> int:
        """Bytes of one plane of constant z."""
        return self.shape[0] * self.shape[1] * self.channels * self.kind.itemsize

    @property
    def planes(self) -> int:
        """Planes in all volumes."""
        return self.shape[2] * self.items

    def header(self, source: Source) -> Header:
        """The geometry and type alone, of the scan that a manifest names so."""
        placed, kind = (self.spacing_mm, self.origin_mm, self.direction), str(self.kind.newbyteorder("="))
        return Header(source, self.shape, *placed, kind, self.items, self.assumed)


def axes_of(path: Path, sizes: list[int]) -> tuple[tuple[int, int, int], int]:
    """Shape of a volume and number of volumes from the axes' lengths."""
    while len(sizes) > AXES[0] and sizes[-1] == 1:
        sizes = sizes[:-1]
    if len(sizes) not in AXES or min(sizes) < 1 or max(sizes) > LONGEST_AXIS:
        why = f"got {len(sizes)} axes of {sizes[:8]} voxels; allowed: a 3-D grey-value volume, or a 4-D file that is "
        raise unusable(path, f"{why}a sequence of them, 1 to {LONGEST_AXIS} voxels an axis")
    return (sizes[0], sizes[1], sizes[2]), sizes[3] if len(sizes) == 4 else 1


def require_data(head: Head, most_gib: float, *, whole: bool = True) -> Head:
    """The head itself; LoadError where its files cannot hold the voxels that it describes.

    whole : also refuse unpacked data that are cut short. They pass where only a header is asked for: a damaged frame
    then costs that frame when it is read, not the study.
    """
    count = len(head.parts)
    if count == 0 or head.planes % count:
        raise unusable(head.path, f"{head.planes} planes in {count} data files; allowed: the same number in each file")
    need = head.planes // count * head.plane_bytes
    require_room(head.path, head.plane_bytes * head.shape[2], 0, "", most_gib)
    for path, offset in head.parts:
        there = size_of(path) - offset
        if there < 0:
            why = f"the header lets its voxels begin at byte {offset}, the file has {size_of(path)} bytes"
            raise unusable(
                path, f"{why}; correct the header (byte skip, HeaderSize, vox_offset), or copy the file again"
            )
        require_room(path, need, there, head.packing, most_gib)
        if head.packing in ("deflate", "bzip2") and there < 8:
            raise unusable(path, "no voxels after the header; the file is cut short: copy it again")
        if head.packing == "" and (there > need or (whole and there < need)):
            kind = "is cut short" if there < need else "holds more than its header says"
            why = f"the file {kind}: {there} bytes of voxels, the header asks for {need}"
            raise unusable(path, f"{why} ({list(head.shape)} voxels of {head.kind}). Copy the file again.")
    said, there = head.packed_bytes, sum(size_of(path) - offset for path, offset in head.parts)
    if head.packing and said and (there > said or (whole and there < said)):
        kind = "they end too early" if there < said else "the header is not its own"
        why = f"CompressedDataSize = {said}, and {there} bytes follow to unpack: {kind}; allowed: as many"
        raise unusable(head.path, f"{why}; write or copy the file again")
    return head


def read_box(head: Head, item: int, box: Box, channel: int = 0) -> NDArray[Any]:
    """Grey values of a box of one volume, indexed x, y, z (x fastest in memory)."""
    try:
        stored = _text(head, item, box, channel) if head.packing == "ascii" else _stored(head, item, box, channel)
    except (EOFError, zlib.error, OSError, ValueError) as error:
        what = "they end too early" if isinstance(error, EOFError) else "the packed data are damaged"
        why = f"the voxels cannot be read: {what}. The file may be cut short; copy it again."
        raise unusable(head.path, why) from None
    return scaled(stored, head.slope, head.intercept)


def _stored(head: Head, item: int, box: Box, channel: int) -> NDArray[Any]:
    (x0, y0, z0), (x1, y1, z1) = box
    (nx, ny, nz), channels, packed = head.shape, head.channels, head.packing != ""
    out = np.empty((z1 - z0, y1 - y0, x1 - x0), head.kind.newbyteorder("="))
    rows = np.empty((y1 - y0, nx, channels), head.kind)
    row_bytes, share = nx * channels * head.kind.itemsize, head.planes // len(head.parts)
    number, file, at = -1, None, 0
    try:
        for z in range(z0, z1):
            part, plane = divmod(item * nz + z, share)
            if file is None or part != number:
                if file is not None:
                    file.close()
                number, file, at = part, unpacked(head.parts[part][0], head.packing, head.parts[part][1]), 0
            place = head.before + (plane * ny + y0) * row_bytes
            skip(file, place - at, packed=packed)
            _fill(file, rows)
            at = place + rows.nbytes
            out[z - z0] = rows[:, x0:x1, channel]
        if file is not None and packed:
            _require_end(file, head, number, at)
    finally:
        if file is not None:
            file.close()
    return out.T


def _require_end(file: IO[bytes], head: Head, part: int, at: int) -> None:
    """LoadError where a packed file, of which ``at`` bytes are read, holds more than the header says.

    Where a crop ends before the file, the rest is unpacked only if nothing else tells: a header that counts packed
    bytes (``require_data``), or the length with which a gzip member ends (RFC 1952). bzip2 tells no length: it is
    believed where the file ends with a stream.
    """
    if head.packing == "bzip2" and not ends_as_bzip2(head.parts[part][0]):
        why = "it does not end with its bzip2 data: other bytes follow, or the end is missing"
        raise unusable(head.path, f"{why}; copy the file again")
    whole = head.before + head.planes // len(head.parts) * head.plane_bytes
    if at < whole:
        if head.packing == "bzip2" or head.packed_bytes or told_bytes(*head.parts[part]) == whole % 2**32:
            return
        skip(file, whole - at, packed=True)
    if file.read(1):
        raise unusable(head.path, "its data unpack to more than the header says; copy the file again")


def _fill(file: IO[bytes], rows: NDArray[Any]) -> None:
    """Fill an array with a file's next bytes, in as many reads as that takes; EOFError where they end too early."""
    view, done = rows.data.cast("B"), 0
    while done < rows.nbytes:
        step = file.readinto(view[done:])  # type: ignore[attr-defined]
        if not step:
            raise EOFError
        done += step


def _text(head: Head, item: int, box: Box, channel: int) -> NDArray[Any]:
    """A box of voxels that are written out as text; the whole file is read. LoadError where one is not of its type."""
    count = int(np.prod(head.shape)) * head.items * head.channels
    with unpacked(head.parts[0][0], "", head.parts[0][1]) as file:
        words = file.read().split()
    if len(words) != count:
        raise unusable(head.path, f"{len(words)} numbers are written out, the header asks for {count}; copy it again")
    kind = head.kind.newbyteorder("=")
    try:
        values = to_numbers(words)
    except ValueError:
        raise unusable(
            head.path, "voxels that are no numbers are written out; allowed: numbers; save it again"
        ) from None
    bad, allowed = misfits(values, kind)
    if bad.any():
        raise unusable(head.path, f"voxels of {values[bad][0]:g} are written out; allowed: {allowed}; save it again")
    values = values.astype(kind)
    volume = values.reshape(head.items, *head.shape[::-1], head.channels)[item, ..., channel].T
    return volume[tuple(slice(a, b) for a, b in zip(*box, strict=True))]


def scaled(stored: NDArray[Any], slope: float, intercept: float) -> NDArray[Any]:
    """Grey values from stored ones; whole numbers stay whole where slope and intercept are."""
    if (slope, intercept) == (1.0, 0.0):
        return stored
    if not (np.isfinite(slope) and np.isfinite(intercept) and slope != 0.0):
        raise LoadError(f"slope {slope:g} and intercept {intercept:g} of the grey values; allowed: finite, slope not 0")
    whole = stored.dtype.kind in "iu" and stored.dtype.itemsize <= 2
    if not (whole and slope == int(slope) and intercept == int(intercept) and abs(slope) < 2**15 > abs(intercept)):
        kind = np.dtype(np.float32 if stored.dtype.itemsize <= 4 else np.float64)
        return np.asarray(stored.astype(kind, order="K") * kind.type(slope) + kind.type(intercept), kind)
    grey = stored.astype(np.int32, order="K") * np.int32(slope) + np.int32(intercept)
    return grey.astype(np.int16) if grey.min() >= -(2**15) and grey.max() < 2**15 else grey


def plain(values: NDArray[Any], what: object) -> NDArray[Any]:
    """Values of a type that every stage takes: native order, no 2-byte floats, 8-byte integers or truth values.

    ``uint16`` beyond 32767 becomes ``int32``: what stages subtract from each other are signed two-byte numbers.
    """
    kind, size = values.dtype.kind, values.dtype.itemsize
    if kind not in "iufb" or size > 8:
        raise unusable(what, f"voxels of type {values.dtype}; allowed: whole or decimal numbers up to 8 bytes each")
    wide = np.dtype("=u1") if kind == "b" else values.dtype.newbyteorder("=")
    if (kind, size) == ("f", 2):
        wide = np.dtype("=f4")
    if kind in "iu" and (size == 8 or (kind, size) == ("u", 4)):
        low, high = int(values.min(initial=0)), int(values.max(initial=0))
        wide = np.dtype("=i4" if low >= -(2**31) and high < 2**31 else "=f8")
    if (kind, size) == ("u", 2) and int(values.max(initial=0)) >= 2**15:
        wide = np.dtype("=i4")
    return values if values.dtype == wide else values.astype(wide, order="K")
