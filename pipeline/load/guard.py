"""What every reader asks before it opens a file: is it a regular file, how long may it be, and how much may it unpack.

A FIFO blocks, a device never ends, a bomb of 3 MB unpacks to 10 GB: each is refused by name before a byte is read.
"""

import bz2
import io
import json
import os
import stat
import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, BinaryIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.load.geometry import LoadError, unusable

GIB = 2**30
TEXT_BYTES, SURFACE_BYTES = 64 * 2**20, 256 * 2**20
"""Longest text (a curve, markups, a tree) and longest surface file: 5 million triangles."""
DEFLATED = 1032
"""Most bytes that deflate can pack into one: a header that asks for more was not written with these data."""
LIKELY, LARGE = 250, GIB
"""More than LARGE bytes that were packed to less than 1/LIKELY hold nothing but one value: no scan, a bomb."""
KINDS = {
    stat.S_ISDIR: "a folder", stat.S_ISFIFO: "a pipe (FIFO)", stat.S_ISSOCK: "a socket", stat.S_ISCHR: "a device",
    stat.S_ISBLK: "a device",
}  # fmt: skip
SYSTEM = ("/proc", "/sys", "/dev")


def status_of(path: Path) -> os.stat_result | None:
    """What the system says of a path, or None where nothing is there; LoadError for a name that cannot be one."""
    try:
        str(path).encode()
        return path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except UnicodeError:
        raise unusable(ascii(str(path)), "the name is not UTF-8; allowed: names in UTF-8; rename the file") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else "the name holds a zero byte"
        name = str(path) if len(str(path)) < 300 else f"{str(path)[:120]}... ({len(str(path))} characters)"
        raise unusable(name, f"cannot be opened ({reason}); allowed: a file that can be read; check the path") from None


def is_folder(path: Path) -> bool:
    """Whether a folder that can be listed is there."""
    found = status_of(path)
    return found is not None and stat.S_ISDIR(found.st_mode)


def size_of(path: Path, most: float = float("inf")) -> int:
    """Bytes of a regular file of at most ``most``; LoadError for anything else."""
    found = status_of(path)
    if found is None:
        why = "no such file or folder; check the path in the manifest (relative to the manifest itself)"
        raise unusable(path, why)
    kind = next((name for test, name in KINDS.items() if test(found.st_mode)), "")
    if not kind and str(path.resolve()).startswith(SYSTEM):
        kind = "a file of the system"
    if kind:
        raise unusable(path, f"this is {kind}; allowed: a regular file; name the file itself")
    if found.st_size == 0:
        raise unusable(path, "the file is empty (0 bytes); expected content; copy it again")
    if found.st_size > most:
        size, limit = found.st_size / 2**20, most / 2**20
        raise unusable(path, f"{size:.0f} MiB; allowed: {limit:.0f} MiB for a file of this kind; make it smaller")
    return found.st_size


def opened(path: Path) -> BinaryIO:
    """A regular file, open for reading."""
    size_of(path)
    try:
        return path.open("rb")
    except OSError as error:
        raise unusable(path, f"cannot be opened ({error.strerror}); check its permissions") from None


def read_bytes(path: Path, most: int = SURFACE_BYTES) -> bytes:
    """A whole regular file of at most ``most`` bytes."""
    size_of(path, most)
    with opened(path) as file:
        return file.read(most + 1)[:most]


def read_text(path: Path, most: int = TEXT_BYTES) -> str:
    """A whole text in UTF-8."""
    try:
        return read_bytes(path, most).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        why = f"not UTF-8 text (byte {error.start}); allowed: a text file in UTF-8; save it again"
        raise unusable(path, why) from None


def read_json(path: Path, what: str) -> Any:
    """The content of a JSON file; what : it should be, in words."""
    try:
        return json.loads(read_text(path))
    except (ValueError, RecursionError):
        raise unusable(path, f"no JSON; expected {what}; write it again") from None


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
            if self.unpack.eof:  # what follows a whole member is another one, or padding
                packed = packed.lstrip(b"\0")
                self.unpack = zlib.decompressobj(47) if packed else self.unpack
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


def unpacked(path: Path, packing: str, offset: int) -> IO[bytes]:
    """The data of a file from ``offset`` on, unpacked as they are read; packing : "", "deflate" or "bzip2"."""
    file = opened(path)
    file.seek(offset)
    if packing == "deflate":
        return io.BufferedReader(Deflated(file), 1 << 18)
    return bz2.BZ2File(file) if packing == "bzip2" else file


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
        why = f"the header asks for {need / GIB:.1f} GiB; allowed: {most_gib:g} GiB a volume (load.most_gib)"
        raise unusable(what, f"{why}. Crop the scan, or raise the setting.")
    if packing in ("", "ascii"):
        return
    if packing == "deflate" and need > DEFLATED * there:
        why = f"the header asks for {need} bytes, which {there} packed ones cannot hold"
        raise unusable(what, f"{why}; the file is cut short or its header is not its own: copy it again")
    if need > max(LARGE, LIKELY * there):
        why = f"{there} bytes that unpack to {need / GIB:.1f} GiB; allowed beyond 1 GiB: {LIKELY} times"
        raise unusable(what, f"{why}. If this is meant, store it unpacked.")


LARGEST_MM = 1e4
"""Whatever a user brings lies within 10 m of the origin: beyond, a unit is wrong."""


def reachable(what: object, points: ArrayLike, name: str = "points") -> NDArray[np.float64]:
    """Coordinates (any shape) in mm; LoadError where they are not finite, or beyond anything that lies in a scanner."""
    values = np.asarray(points, float)
    if not np.all(np.isfinite(values)):
        raise unusable(what, f"{name} that are NaN or infinite; expected finite numbers in mm; correct the file")
    far = float(np.abs(values).max(initial=0.0))
    if far > LARGEST_MM:
        why = f"{name} up to {far:.3g} mm from the origin; expected {LARGEST_MM:g} mm at most"
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
