"""The first polyline of a legacy .vtk file (ASCII or binary, versions 2 to 5.1), as ParaView and Slicer write."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.load.geometry import refused
from pipeline.load.surfaces import to_lps
from pipeline.model import Array

_TYPES = {"float": ">f4", "double": ">f8", "int": ">i4", "long": ">i8", "vtktypeint64": ">i8", "vtkIdType": ">i8"}


class _Legacy:
    """A file read word by word; arrays follow their head in text or, big endian, in bytes."""

    def __init__(self, path: Path) -> None:
        self.path, self.raw = path, path.read_bytes()
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
        """``count`` numbers from byte ``start`` on; kind : their VTK type, which matters in binary files."""
        if self.binary:
            return np.frombuffer(self.raw, _TYPES[kind], count, start).astype(np.float64)
        words = self.raw[start:].split(None, count)[:count]
        return np.array(words, dtype=np.float64)


def read_vtk_points(path: Path) -> Array:
    """Points (n, 3) of the first line, LPS where the file states its space; all in order where it has no lines."""
    file = _Legacy(path)
    head, start = file.after("POINTS ")
    try:
        points = file.array(start, 3 * int(head[0]), head[1]).reshape(-1, 3)
        order = _first_line(file, len(points))
        points = points[order]
    except (IndexError, KeyError, ValueError) as error:
        raise refused(path, f"{error!r} in POINTS or LINES", "a polyline", "export the wire as .csv or .vtp") from None
    return to_lps(file.raw, points)


def _first_line(file: _Legacy, count: int) -> NDArray[np.int64]:
    """The points of the first line by their numbers."""
    head, start = file.after("LINES ")
    if not head:
        return np.arange(count)
    kind, place = file.after("OFFSETS ")
    if kind:  # since version 5.1: where each line begins, and all their points
        ends = file.array(place, 2, kind[0]).astype(int)
        kind, place = file.after("CONNECTIVITY ")
        return file.array(place, ends[1], kind[0]).astype(np.int64)
    length = int(file.array(start, 1, "int")[0])
    return file.array(start, length + 1, "int")[1:].astype(np.int64)
