"""Where every frame of an enhanced multi-frame DICOM file lies (CT, MR, XA and others since DICOM supplement 49).

GDCM takes spacing and direction from the first frames alone: with a frame missing it says 1 mm, it hides a tilt, and
turns a stack written downwards into one with the wrong direction. So the functional groups are read here.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

SHARED, PER_FRAME, PIXELS = (0x5200, 0x9229), (0x5200, 0x9230), (0x7FE0, 0x0010)
POSITION, ORIENTATION, PIXEL_SPACING = (0x0020, 0x0032), (0x0020, 0x0037), (0x0028, 0x0030)
ITEM, ITEM_END, SEQUENCE_END = (0xFFFE, 0xE000), (0xFFFE, 0xE00D), (0xFFFE, 0xE0DD)
IMPLICIT_LITTLE = b"1.2.840.10008.1.2"
LONG = {b"OB", b"OD", b"OF", b"OL", b"OV", b"OW", b"SQ", b"SV", b"UC", b"UN", b"UR", b"UT", b"UV"}
"""Value representations whose length takes four bytes after two empty ones."""
UNKNOWN = 0xFFFFFFFF
Tag = tuple[int, int]


@dataclass(frozen=True, eq=False)
class Frames:
    """positions (n, 3) mm and orientation (6,) of the frames in the file's order, pixel_mm (2,): row, column."""

    positions: NDArray[np.float64]
    orientations: NDArray[np.float64]
    pixels_mm: NDArray[np.float64]


class _Reader:
    """Elements of a little-endian data set held in memory."""

    def __init__(self, data: bytes, at: int, implicit: bool) -> None:
        self.data, self.at, self.implicit = data, at, implicit

    def element(self) -> tuple[Tag, bytes, int]:
        """Tag, value representation and length of the next element; stands at its value afterwards."""
        group, number = struct.unpack_from("<HH", self.data, self.at)
        tag, kind = (group, number), self.data[self.at + 4 : self.at + 6]
        if self.implicit or group == 0xFFFE:
            self.at += 8
            return tag, b"", struct.unpack_from("<I", self.data, self.at - 4)[0]
        if kind in LONG:
            self.at += 12
            return tag, kind, struct.unpack_from("<I", self.data, self.at - 4)[0]
        self.at += 8
        return tag, kind, struct.unpack_from("<H", self.data, self.at - 2)[0]

    def items(self, length: int) -> Iterator[dict[Tag, Any]]:
        """The items of a sequence whose value begins here."""
        end = len(self.data) if length == UNKNOWN else self.at + length
        while self.at < end:
            tag, _, size = self.element()
            if tag == SEQUENCE_END:
                return
            yield self.dataset(len(self.data) if size == UNKNOWN else self.at + size)

    def dataset(self, end: int) -> dict[Tag, Any]:
        """Elements up to ``end``, the pixels, or the end of an item; a sequence is a list of such."""
        out: dict[Tag, Any] = {}
        while self.at < end:
            tag, kind, length = self.element()
            if tag in (ITEM_END, PIXELS):
                break
            if kind == b"SQ" or length == UNKNOWN or (self.implicit and self._holds_item(length)):
                out[tag] = list(self.items(length))
            else:
                out[tag] = self.data[self.at : self.at + length]
                self.at += length
        return out

    def _holds_item(self, length: int) -> bool:
        """Without a value representation a sequence is known by the item that it begins with."""
        return length >= 8 and self.data[self.at : self.at + 4] == b"\xfe\xff\x00\xe0"


def _find(node: Any, tag: Tag) -> NDArray[np.float64] | None:
    """The numbers under a tag, anywhere in nested sequences."""
    for key, value in node.items():
        if key == tag and isinstance(value, bytes):
            return np.array([float(v) for v in value.decode("latin-1").split("\\")])
        for inner in value if isinstance(value, list) else ():
            found = _find(inner, tag)
            if found is not None:
                return found
    return None


def frames_of(path: Path) -> Frames | None:
    """Where the frames lie, or None for a file that is no enhanced multi-frame DICOM (or is deflated, big-endian)."""
    with path.open("rb") as file:
        if file.read(132)[128:] != b"DICM":
            return None
        data = file.read()
    try:
        meta = _Reader(data, 0, False)
        syntax = b""
        while data[meta.at : meta.at + 2] == b"\x02\x00":
            tag, _, length = meta.element()
            syntax = data[meta.at : meta.at + length] if tag == (2, 0x10) else syntax
            meta.at += length
        implicit = syntax.rstrip(b"\0 ") == IMPLICIT_LITTLE
        top = _Reader(data, meta.at, implicit).dataset(len(data))
        common, frames = {SHARED: top.get(SHARED, [])}, top[PER_FRAME]
        found = [
            [_first(_find(frame, tag), _find(common, tag)) for frame in frames]
            for tag in (POSITION, ORIENTATION, PIXEL_SPACING)
        ]
        places, axes, pixels = (np.array(values, float) for values in found)
    except (KeyError, ValueError, TypeError, struct.error):
        return None
    good = places.shape[1:] == (3,) and axes.shape[1:] == (6,) and pixels.shape[1:] == (2,)
    return Frames(places, axes, pixels) if good else None


def _first(own: Any, shared: Any) -> Any:
    return shared if own is None else own
