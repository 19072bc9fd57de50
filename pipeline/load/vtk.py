"""The curve of a legacy .vtk file (ASCII or binary, versions 2 to 5.1), as ParaView and Slicer write."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.load.chain import one_chain
from pipeline.load.geometry import LoadError, refused
from pipeline.load.guard import read_bytes
from pipeline.load.outside import to_numbers, to_whole
from pipeline.load.surfaces import split_cells, to_lps
from pipeline.model import Array

# VTK writes its own indices, of 8 bytes in memory, as int
_TYPES = {"float": ">f4", "double": ">f8", "int": ">i4", "long": ">i8", "vtktypeint64": ">i8", "vtkIdType": ">i4"}


class _Legacy:
    """A file read word by word; arrays follow their head in text or, big endian, in bytes."""

    def __init__(self, path: Path) -> None:
        self.path, self.raw = path, read_bytes(path)
        lines = self.raw.split(b"\n", 3)
        if len(lines) < 4 or not lines[0].startswith(b"# vtk DataFile"):
            raise refused(path, "no '# vtk DataFile' on top", "a legacy .vtk file", "export the wire as .csv or .vtp")
        self.binary = lines[2].strip().upper() == b"BINARY"

    def after(self, word: str) -> tuple[list[str], int]:
        """The rest of the line that begins with a word, and where the next one starts; empty where there is none."""
        mark = b"\n" + word.encode()
        at = self.raw.find(mark)
        if at < 0:
            return [], -1
        if not self.binary and self.raw.find(mark, at + 1) >= 0:  # bytes of numbers may look like any word
            raise refused(self.path, f"two of {word.strip()}", "one curve", "export the wire alone")
        end = self.raw.find(b"\n", at + 1)
        return self.raw[at + len(mark) : end].decode("latin-1").split(), end + 1

    def array(self, start: int, count: int, kind: str) -> NDArray[np.float64]:
        """``count`` numbers from byte ``start`` on; kind : their VTK type, which matters in binary files.

        LoadError where there are fewer, as in a file that was cut short, or more: the next word is one of VTK's.
        """
        most = min(max(count, 0), len(self.raw))
        if self.binary:
            size = np.dtype(_TYPES[kind]).itemsize
            there, words = (len(self.raw) - start) // size, []
            rest = self.raw[start + most * size :].lstrip()
        else:
            words = self.raw[start:].split(None, most)
            there, rest = len(words[:most]), b"".join(words[most:])
        if not 0 <= count <= there:
            raise _other_count(self.path, f"{there} numbers", count)
        if rest and not rest[:1].isalpha():
            raise _other_count(self.path, "more numbers", count)
        if self.binary:
            return np.frombuffer(self.raw, _TYPES[kind], count, start).astype(np.float64)
        return to_numbers(words[:count])

    def whole(self, start: int, count: int, kind: str) -> NDArray[np.int64]:
        """``array`` of whole numbers; ValueError for others."""
        found = self.array(start, count, kind)
        if not np.array_equal(found, np.rint(found)):
            raise ValueError("decimals")
        return found.astype(np.int64)


def _other_count(path: Path, there: str, said: int) -> LoadError:
    """A file that holds fewer or more than its head says."""
    got = f"{there} where its head says {said}"
    return refused(path, got, "as many", "copy the file again, or export the wire as .csv")


def read_vtk_points(path: Path) -> Array:
    """Points (n, 3) of the one curve, LPS where the file states its space; all in order where it has no lines."""
    file = _Legacy(path)
    head, start = file.after("POINTS ")
    try:
        points = file.array(start, 3 * to_whole(head[0]), head[1]).reshape(-1, 3)
        cells = _lines(file, len(points))
    except (IndexError, KeyError, ValueError):
        got = "something else than numbers in POINTS or LINES"
        raise refused(path, got, "a polyline", "export the wire as .csv or .vtp") from None
    return to_lps(path, file.raw, one_chain(path, points, cells) if cells else points)


def _lines(file: _Legacy, count: int) -> list[NDArray[np.int64]]:
    """The points of every line by their numbers. count : of points."""
    head, start = file.after("LINES ")
    if not head:
        return []
    kind, place = file.after("OFFSETS ")
    if kind:  # since version 5.1: where each line begins, and all their points
        bounds = file.whole(place, to_whole(head[0]), kind[0])
        kind, place = file.after("CONNECTIVITY ")
        corners = file.whole(place, to_whole(head[1]), kind[0])
        if len(bounds) and bounds[0] != 0:
            got = f"OFFSETS from {bounds[0]} on"
            raise refused(file.path, got, "from 0 on", "export the wire as .csv or .vtp")
        return split_cells(file.path, "LINES", corners, bounds[1:], count)
    rest, cells = file.whole(start, to_whole(head[1]), "int"), list[NDArray[np.int64]]()
    while len(rest):
        if not 0 <= rest[0] < len(rest):
            raise _other_count(file.path, f"{len(rest) - 1} points of line {len(cells)}", int(rest[0]))
        cells.append(rest[1 : rest[0] + 1])
        rest = rest[rest[0] + 1 :]
    if len(cells) != to_whole(head[0]):
        raise _other_count(file.path, f"{len(cells)} lines", to_whole(head[0]))
    corners = np.concatenate([np.zeros(0, np.int64), *cells])
    return split_cells(file.path, "LINES", corners, np.cumsum([*map(len, cells)]), count)
