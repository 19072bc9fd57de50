"""The curve of a legacy .vtk file (ASCII or binary, versions 2 to 5.1), as ParaView and Slicer write."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.load.chain import one_chain
from pipeline.load.geometry import refused
from pipeline.load.guard import read_bytes
from pipeline.load.outside import to_number
from pipeline.load.surfaces import split_cells, to_lps
from pipeline.model import Array

_TYPES = {"float": ">f4", "double": ">f8", "int": ">i4", "long": ">i8", "vtktypeint64": ">i8", "vtkIdType": ">i8"}


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
        end = self.raw.find(b"\n", at + 1)
        return self.raw[at + len(mark) : end].decode("latin-1").split(), end + 1

    def array(self, start: int, count: int, kind: str) -> NDArray[np.float64]:
        """``count`` numbers from byte ``start`` on; kind : their VTK type, which matters in binary files.

        LoadError where there are fewer, as in a file that was cut short.
        """
        if self.binary:
            there = (len(self.raw) - start) // np.dtype(_TYPES[kind]).itemsize
        else:
            words = self.raw[start:].split(None, count)[:count] if count > 0 else []
            there = len(words)
        if not 0 <= count <= there:
            got = f"{there} numbers where its head says {count}"
            raise refused(self.path, got, "as many", "copy the file again, or export the wire as .csv")
        return np.frombuffer(self.raw, _TYPES[kind], count, start).astype(np.float64) if self.binary else _plain(words)


def _plain(words: list[bytes]) -> NDArray[np.float64]:
    return np.array([to_number(word.decode("ascii")) for word in words], dtype=np.float64)


def read_vtk_points(path: Path) -> Array:
    """Points (n, 3) of the one curve, LPS where the file states its space; all in order where it has no lines."""
    file = _Legacy(path)
    head, start = file.after("POINTS ")
    try:
        points = file.array(start, 3 * int(head[0]), head[1]).reshape(-1, 3)
        cells = _lines(file, len(points))
    except (IndexError, KeyError, ValueError):
        got = "something else than numbers in POINTS or LINES"
        raise refused(path, got, "a polyline", "export the wire as .csv or .vtp") from None
    return to_lps(file.raw, one_chain(path, points, cells) if cells else points)


def _lines(file: _Legacy, count: int) -> list[NDArray[np.int64]]:
    """The points of every line by their numbers. count : of points."""
    head, start = file.after("LINES ")
    if not head:
        return []
    kind, place = file.after("OFFSETS ")
    if kind:  # since version 5.1: where each line begins, and all their points
        ends = file.array(place, int(head[0]), kind[0]).astype(np.int64)[1:]
        kind, place = file.after("CONNECTIVITY ")
        corners = file.array(place, int(head[1]), kind[0]).astype(np.int64)
        return split_cells(file.path, "LINES", corners, ends, count)
    rest, cells = file.array(start, int(head[1]), "int").astype(np.int64), list[NDArray[np.int64]]()
    for _ in range(int(head[0])):
        if not len(rest):
            got = f"{len(cells)} lines where its head says {head[0]}"
            raise refused(file.path, got, "as many", "copy the file again, or export the wire as .csv")
        cells.append(rest[1 : rest[0] + 1])
        rest = rest[rest[0] + 1 :]
    corners = np.concatenate([np.zeros(0, np.int64), *cells])
    return split_cells(file.path, "LINES", corners, np.cumsum([*map(len, cells)]), count)
