"""DICOM files as planes: where each lies, how its grey values are stored, read by pydicom without touching a pixel.

Of an enhanced multi-frame file (CT, MR, XA and others since DICOM supplement 49) every frame's own functional groups
are read. A file of several frames without them is a run of projections or a film, never a volume.
"""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.load.geometry import LoadError, unusable
from pipeline.load.guard import opened, size_of, told

SUFFIXES = {".dcm", ".ima"}
DEFLATED = b"1.2.840.10008.1.2.1.99"
BIG_ENDIAN = "1.2.840.10008.1.2.2"
PHYSICAL = ("CT", "PT")
"""Modalities whose rescaled values have a unit: there MONOCHROME1 says how to print, not what was measured."""
PLACE = (("ImagePositionPatient", 3), ("ImageOrientationPatient", 6), ("PixelSpacing", 2))
UNIT = 0.01
"""How far an orientation vector may be off the length 1: so much do two decimals explain (0.71, 0.71)."""
DEFER = 4096
"""Longer values (the pixels) are passed over; where they lie is kept."""


@dataclass(frozen=True)
class Pixels:
    """How a file stores its grey values.

    offset : byte of the first frame's pixels, -1 where they are packed.     kind : as stored.     bits, high : bits
    that count, and the highest of them.     inverted : white is low (MONOCHROME1).
    """

    rows: int
    columns: int
    offset: int
    kind: str
    bits: int
    high: int
    inverted: bool

    @property
    def frame_bytes(self) -> int:
        """Bytes of one plane."""
        return self.rows * self.columns * np.dtype(self.kind).itemsize


@dataclass(frozen=True, eq=False)
class Plane:
    """One slice: frame of path, position (3,) and orientation (6,) in LPS mm, pixel (2,) mm along x and y."""

    path: Path
    frame: int
    position: NDArray[np.float64]
    orientation: NDArray[np.float64]
    pixel_mm: NDArray[np.float64]
    pixels: Pixels
    slope: float
    intercept: float
    several: bool


def is_dicom(path: Path) -> bool:
    """By its mark, or by its suffix: files of old scanners have no mark."""
    with opened(path) as file:
        return file.read(132)[128:] == b"DICM" or path.suffix.lower() in SUFFIXES


def is_multiframe(path: Path) -> bool:
    """Whether a DICOM file is an enhanced one, with frames that have positions."""
    try:
        return "PerFrameFunctionalGroupsSequence" in dataset(path)
    except LoadError:
        return False


def dataset(path: Path) -> Any:
    """The elements of a file, its pixels passed over; LoadError for what is no DICOM."""
    import pydicom  # a third of a second, for those who have DICOM

    size_of(path)
    with opened(path) as file:
        start = file.read(4096)
    if DEFLATED in start:
        raise unusable(path, "a deflated DICOM file; allowed: any other transfer syntax; export it again")
    pydicom.config.settings.reading_validation_mode = pydicom.config.IGNORE
    # numbers of half a length are bytes, which are no number here; else an error of pydicom's own, where they are used
    pydicom.config.convert_wrong_length_to_UN = True
    with told(path), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what matters of a file is judged below, in sentences of this package
        return pydicom.dcmread(path, defer_size=DEFER, force=path.suffix.lower() in SUFFIXES)


def is_image(data: Any) -> bool | None:
    """Whether a file holds an image; None where it holds nothing that can be told (cut short, no DICOM at all)."""
    with told("a DICOM file"):
        kind = data.get("SOPClassUID")
        if "Rows" in data or "PerFrameFunctionalGroupsSequence" in data:
            return True
        if not kind:
            return None
        return None if "Image Storage" in kind.name or kind.is_private else False


def planes_of(path: Path, data: Any) -> list[Plane]:
    """The planes of a file; LoadError where a plane has no place in space, or its pixels cannot be there."""
    with told(path), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        count = int(data.get("NumberOfFrames") or 1)
        pixels = _pixels(path, data, max(count, 1))
        groups = data.get("PerFrameFunctionalGroupsSequence")
        common = list(data.get("SharedFunctionalGroupsSequence") or ())
        if groups is None and count > 1:
            kind = f"{count} frames without positions ({data.get('Modality', '?')})"
            why = f"{kind}: a run of projections or a film, no volume"
            allowed = "slices, or an enhanced file whose frames have positions"
            raise unusable(path, f"{why}; allowed: {allowed}. Name the reconstruction, not the run.")
        if groups is not None and len(groups) != count:
            found = f"the file holds {count} frames and positions of {len(groups)}"
            raise unusable(path, f"{found}; allowed: one for each. Export the series again.")
        each = [[group, *common, data] for group in groups] if groups is not None else [[data]]
        return [_plane(path, k, found, pixels, several=groups is not None) for k, found in enumerate(each)]


def _plane(path: Path, frame: int, groups: list[Any], pixels: Pixels, *, several: bool) -> Plane:
    position, orientation, spacing = (_numbers(path, groups, name, count) for name, count in PLACE)
    if off_unit(orientation) and not _rounded(orientation, _first("ImageOrientationPatient", groups)):
        lengths = np.linalg.norm(orientation.reshape(2, 3), axis=1).round(3).tolist()
        why = f"ImageOrientationPatient {orientation.tolist()} has vectors of the lengths {lengths}"
        allowed = f"unit vectors (to {UNIT:g}, or as rounding to the decimals that are written explains)"
        raise unusable(path, f"{why}; allowed: {allowed}. Export the series again, or divide by the lengths.")
    slope, intercept = (_numbers(path, groups, name, 1, default) for name, default in RESCALE)
    rescale = float(slope[0]), float(intercept[0])
    return Plane(path, frame, position, orientation, spacing[::-1], pixels, *rescale, several)


def off_unit(orientation: NDArray[np.float64]) -> bool:
    """Whether the vectors (6,) of an orientation are off the length 1 by more than UNIT."""
    return bool(np.abs(np.linalg.norm(orientation.reshape(2, 3), axis=1) - 1.0).max() > UNIT)


def _rounded(orientation: NDArray[np.float64], written: Any) -> bool:
    """Whether there are unit vectors that are ``written`` so with these decimals: 0.7, 0.7, 0 has the length 0.99.

    Whole numbers are no directions: 1, 1, 0 would be known to 30 degrees.
    """
    places = min(int(Decimal(str(number)).as_tuple().exponent) for number in written)
    size, half = np.abs(orientation.reshape(2, 3)), 0.5 * 10.0**places
    least, most = (np.linalg.norm(np.maximum(size + off, 0.0), axis=1) for off in (-half, half))
    return places < 0 and bool(np.all((least <= 1.0) & (most >= 1.0)))


RESCALE = (("RescaleSlope", 1.0), ("RescaleIntercept", 0.0))


def _first(keyword: str, groups: list[Any]) -> Any:
    """The value of an element in the first group that has it, however deep; None where none has."""
    for group in groups:
        if keyword in group:
            return group[keyword].value
        for element in _inner(group):
            if element.keyword == keyword:
                return element.value
    return None


def _inner(group: Any) -> Iterator[Any]:
    """The elements within a group's sequences; a file's own top level is not searched again for every frame."""
    return iter(()) if "SOPClassUID" in group else group.iterall()


def _numbers(path: Path, groups: list[Any], name: str, count: int, missing: float | None = None) -> NDArray[np.float64]:
    """``count`` finite numbers of an element."""
    value = _first(name, groups)
    if value is None and missing is not None:
        return np.full(count, missing)
    try:
        found = np.array(value, float).reshape(-1)
    except (ValueError, TypeError, OverflowError):
        found = np.zeros(0)
    if len(found) != count or not np.all(np.isfinite(found)):
        text = "nothing" if value is None else repr(str(value)[:80])
        why = f"DICOM element {name} holds {text}, expected {count} finite numbers; this slice has no position"
        raise unusable(path, f"{why} in space. Export the series again.")
    return found


def _pixels(path: Path, data: Any, frames: int) -> Pixels:
    """How the grey values are stored; LoadError where they are colours, or not there."""
    rows, columns, bits = (int(data.get(name) or 0) for name in ("Rows", "Columns", "BitsAllocated"))
    samples, meaning = int(data.get("SamplesPerPixel") or 1), str(data.get("PhotometricInterpretation", "MONOCHROME2"))
    element = data.get_item("PixelData", keep_deferred=True) if "PixelData" in data else None
    if samples != 1 or not meaning.startswith("MONOCHROME"):
        raise unusable(path, f"{samples} values a pixel, {meaning}; allowed: grey values (MONOCHROME1 or 2)")
    if element is None or bits not in (8, 16, 32) or rows < 1 or columns < 1:
        found = f"{rows} x {columns} pixels of {bits} bits, {'no ' if element is None else ''}pixel data"
        raise unusable(path, f"{found}; allowed: an image of 8, 16 or 32 bits; take it out of the folder")
    syntax = str(getattr(data, "file_meta", {}).get("TransferSyntaxUID", "") or "")
    _require_plain_greys(path, data, bytes_in_words=bits == 8 and syntax == BIG_ENDIAN and element.VR == "OW")
    signed = int(data.get("PixelRepresentation") or 0) == 1
    kind = (">" if syntax == BIG_ENDIAN else "<") + ("i" if signed else "u") + str(bits // 8)
    stored = int(data.get("BitsStored") or bits)
    high = int(data.get("HighBit") if data.get("HighBit") is not None else stored - 1)
    if not 1 <= stored <= bits or not stored - 1 <= high < bits:
        raise unusable(path, f"{stored} bits stored up to bit {high} of {bits}; correct the header")
    inverted = meaning == "MONOCHROME1" and str(data.get("Modality", "")) not in PHYSICAL
    packed = element.length == 0xFFFFFFFF
    offset = -1 if packed else int(getattr(element, "value_tell", 0) or element.file_tell)
    pixels = Pixels(rows, columns, offset, kind, stored, high, inverted)
    there = min(int(element.length), size_of(path) - offset)
    if not packed and there < frames * pixels.frame_bytes:
        why = f"is cut short: {there} bytes of pixels, {frames * pixels.frame_bytes} are stated"
        raise unusable(path, f"cannot read it: the file {why}. Check that the file is complete: copy it again.")
    return pixels


def _require_plain_greys(path: Path, data: Any, *, bytes_in_words: bool) -> None:
    """LoadError where greys are more than a slope and an intercept of what is stored, or neighbours are exchanged."""
    if data.get("ModalityLUTSequence"):
        why = "ModalityLUTSequence holds a table of greys for stored values; allowed: RescaleSlope and RescaleIntercept"
        raise unusable(path, f"{why}. Export the series again with the modality LUT applied.")
    if bytes_in_words:
        why = "PixelData of 8 bits as words (OW) in explicit big endian, where each word exchanges two pixels"
        raise unusable(path, f"{why}; allowed: bytes (OB), or explicit little endian. Export the series again.")


def grey(plane: Plane, stored: NDArray[Any]) -> NDArray[Any]:
    """Stored values reduced to the bits that count, and turned round where white is low."""
    p = plane.pixels
    width = 8 * stored.dtype.itemsize
    if p.bits < width:
        wide = stored.astype(np.int64) >> (p.high + 1 - p.bits)
        wide &= (1 << p.bits) - 1
        if stored.dtype.kind == "i":
            sign = 1 << (p.bits - 1)
            wide = (wide ^ sign) - sign
        stored = wide.astype(stored.dtype)
    if p.inverted:
        top = -1 if stored.dtype.kind == "i" else (1 << p.bits) - 1
        stored = (top - stored.astype(np.int64)).astype(stored.dtype)
    return stored
