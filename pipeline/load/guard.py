"""What every reader asks before it opens a file: is it a regular file, how long may it be, and how much may it unpack.

A FIFO blocks, a device never ends, a bomb of 3 MB unpacks to 10 GB: each is refused by name before a byte is read.
"""

import bz2
import io
import os
import stat
import struct
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import IO, BinaryIO, ParamSpec, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.load.geometry import FARTHEST_MM, LoadError, unusable
from reports import texts

GIB = 2**30
SURFACE_BYTES = 256 * 2**20
"""Longest surface file: 5 million triangles."""
DEFLATED = 1032
"""Most bytes that deflate can pack into one: a header that asks for more was not written with these data."""
LIKELY, LARGE = 250, GIB
"""More than LARGE bytes that were packed to less than 1/LIKELY hold nothing but one value: no scan, a bomb."""
P = ParamSpec("P")
T = TypeVar("T")


def _of_a_scan(read: Callable[P, T]) -> Callable[P, T]:
    """The reader of any file, which raises LoadError where it refuses one."""

    @wraps(read)
    def reading(*args: P.args, **named: P.kwargs) -> T:
        try:
            return read(*args, **named)
        except texts.UnreadableError as error:
            raise LoadError(str(error)) from None

    return reading


status_of, size_of, opened = _of_a_scan(texts.status_of), _of_a_scan(texts.size_of), _of_a_scan(texts.opened)
read_text, read_json, read_toml = _of_a_scan(texts.read_text), _of_a_scan(texts.read_json), _of_a_scan(texts.read_toml)


def is_folder(path: Path) -> bool:
    """Whether a folder that can be listed is there."""
    found = status_of(path)
    return found is not None and stat.S_ISDIR(found.st_mode)


@_of_a_scan
def read_bytes(path: Path, most: int = SURFACE_BYTES) -> bytes:
    """A whole regular file of at most ``most`` bytes."""
    return texts.read_bytes(path, most)


class Deflated(io.RawIOBase):
    """A file of zlib or gzip data (several members, too) as the bytes that it unpacks to, never more than asked for."""

    def __init__(self, file: BinaryIO) -> None:
        self.file, self.unpack, self.left = file, zlib.decompressobj(47), b""

    def readable(self) -> bool:
        """It can be read."""
        return True

    def readinto(self, buffer: "memoryview | bytearray") -> int:  # type: ignore[override]
        """Fill as much of the buffer as one step unpacks; 0 at the end."""
        while True:
            packed = self.left or self.file.read(1 << 18)
            if self.unpack.eof and packed:  # what follows a whole member is another one, or padding
                self.left = packed.lstrip(b"\0")
                if not self.left:
                    continue
                packed, self.unpack = self.left, zlib.decompressobj(47)
            if not packed:
                if not self.unpack.eof:
                    raise EOFError("the packed data end too early")
                return 0
            data = self.unpack.decompress(packed, len(buffer))
            self.left = self.unpack.unconsumed_tail or self.unpack.unused_data
            if data:
                buffer[: len(data)] = data
                return len(data)

    def close(self) -> None:
        """Close the file, too."""
        self.file.close()
        super().close()


class Bunzipped(bz2.BZ2File):
    """A file of bzip2 data as what it unpacks to; closing it closes that file, too, which BZ2File leaves open."""

    def __init__(self, file: BinaryIO) -> None:
        self.file = file
        super().__init__(file)

    def close(self) -> None:
        """Close the file, too."""
        super().close()
        self.file.close()


GZIP = b"\x1f\x8b\x08"
"""How a gzip member begins (RFC 1952)."""


def unpacked(path: Path, packing: str, offset: int) -> IO[bytes]:
    """The data of a file from ``offset`` on, unpacked as they are read; packing : "", "deflate" or "bzip2"."""
    file = opened(path)
    file.seek(offset)
    if packing == "deflate":
        return io.BufferedReader(Deflated(file), 1 << 18)
    return Bunzipped(file) if packing == "bzip2" else file


def told_bytes(path: Path, offset: int) -> int | None:
    """What a gzip file from ``offset`` on says that it unpacks to, modulo 2^32; None where a second member may follow.

    That length is the last member's: a scan with another of its size behind it would pass.
    """
    with opened(path) as file:
        file.seek(offset + len(GZIP))
        before = last = b""
        while block := file.read(1 << 20):
            if GZIP in before + block:
                return None
            before, last = block[1 - len(GZIP) :], (last + block)[-4:]
    return int.from_bytes(last, "little")


BZIP2_END = 0x177245385090
"""The 48 bits after the last block of a bzip2 stream: 32 of a checksum follow, and bits up to a whole byte."""


def ends_as_bzip2(path: Path) -> bool:
    """Whether a file ends with its bzip2 stream: Python's reader passes over what follows one."""
    with opened(path) as file:
        file.seek(max(size_of(path) - 11, 0))
        bits = int.from_bytes(file.read(), "big") >> 32
    return any(bits >> spare & (2**48 - 1) == BZIP2_END for spare in range(8))


def skip(file: IO[bytes], count: int, *, packed: bool) -> None:
    """Skip ``count`` bytes; packed : they can only be read, not jumped over."""
    if not packed:
        file.seek(count, os.SEEK_CUR)
        return
    while count > 0:
        step = len(file.read(min(count, 1 << 20)))
        if step == 0:
            raise EOFError("the packed data end too early")
        count -= step


def require_room(what: object, need: int, there: int, packing: str, most_gib: float) -> None:
    """LoadError where ``need`` bytes are more than ``most_gib``, or cannot come from ``there`` packed bytes on disk."""
    if need > most_gib * GIB:
        asked = f"{need / GIB:{'.3g' if need < GIB else '.1f'}} GiB"
        why = f"the header asks for {asked}; allowed: {most_gib:g} GiB a volume (load.most_gib)"
        raise unusable(what, f"{why}. Crop the scan, or raise the setting.")
    if packing in ("", "ascii"):
        return
    if packing == "deflate" and need > DEFLATED * there:
        why = f"the header asks for {need} bytes, which {there} packed ones cannot hold"
        raise unusable(what, f"{why}; the file is cut short or its header is not its own: copy it again")
    if need > max(LARGE, LIKELY * there):
        why = f"{there} bytes that unpack to {need / GIB:.1f} GiB; allowed beyond 1 GiB: {LIKELY} times"
        raise unusable(what, f"{why}. If this is meant, store it unpacked.")


def reachable(what: object, points: ArrayLike, name: str = "points") -> NDArray[np.float64]:
    """Coordinates (any shape) in mm; LoadError where they are not finite, or beyond anything that lies in a scanner."""
    values = np.asarray(points, float)
    if not np.all(np.isfinite(values)):
        raise unusable(what, f"{name} that are NaN or infinite; expected finite numbers in mm; correct the file")
    far = float(np.abs(values).max(initial=0.0))
    if far > FARTHEST_MM:
        why = f"{name} up to {far:.3g} mm from the origin; expected {FARTHEST_MM:g} mm at most"
        raise unusable(what, f"{why}; are they in another unit than mm?")
    return values


@contextmanager
def told(what: object) -> Iterator[None]:
    """Turn what a library raises over a file into a sentence about the file."""
    try:
        yield
    except LoadError:
        raise
    except MemoryError:
        raise unusable(what, "does not fit into memory; crop the scan, or run fewer cases at once (-j)") from None
    except OSError as error:
        reason = error.strerror or "a library of its format refuses it"
        raise unusable(what, f"cannot be read ({reason}). Check that the file is complete: copy it again.") from None
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, EOFError, RuntimeError, OverflowError,
            NotImplementedError, struct.error, zlib.error):  # fmt: skip
        why = "cannot be read: its content contradicts its format"
        raise unusable(what, f"{why}. Check that the file is complete: write or copy it again.") from None
