"""One curve from lines that a file has in pieces: a file's first line alone was taken for the wire."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pipeline.load.chain import one_chain
from pipeline.load.curves import read_curve, read_markups_curve
from pipeline.load.geometry import LoadError
from pipeline.load.vtk import read_vtk_points

WIRE = np.cumsum(np.linspace([0.1, 0.0, 1.0], [0.6, 0.3, 0.8], 12), axis=0)
HERE = Path("wire.vtp")


def cells(*lines: range | list[int]) -> list[np.ndarray]:
    return [np.array(line, np.int64) for line in lines]


@pytest.mark.parametrize(
    "lines",
    [
        cells(range(12)),
        cells(*([n, n + 1] for n in range(11))),
        cells([0, 1, 2, 3], [7, 8, 9, 10, 11], [3, 4, 5, 6, 7]),
        cells([4, 5, 6], [11, 10, 9, 8, 7, 6], [4, 3, 2, 1, 0]),
        cells([5], range(7), range(6, 12)),
    ],
    ids=["whole", "segments", "pieces", "ends that meet", "a point beside"],
)
def test_pieces_are_joined(lines: list[np.ndarray]) -> None:
    np.testing.assert_array_equal(one_chain(HERE, WIRE, lines), WIRE)


def test_direction_is_that_of_the_first_piece() -> None:
    backwards = cells([6, 5, 4, 3, 2, 1, 0], [11, 10, 9, 8, 7, 6])
    np.testing.assert_array_equal(one_chain(HERE, WIRE, backwards), WIRE[::-1])


def test_points_in_one_place_are_one() -> None:
    """As exported by programs that give each segment points of its own."""
    doubled = np.repeat(WIRE, 2, axis=0)[1:-1]
    pairs = cells(*([2 * n, 2 * n + 1] for n in range(11)))
    np.testing.assert_array_equal(one_chain(HERE, doubled, pairs), WIRE)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (cells(range(5), range(5, 12)), "4 free ends"),
        (cells(range(10), [4, 11]), "3 free ends"),
        (cells([0, 1, 2], [2, 3, 0]), "0 free ends"),
        (cells([0, 1, 2], [4, 5, 6, 4]), "a ring beside a curve"),
        (cells([1], [2]), "0 free ends"),
    ],
    ids=["two curves", "a branch", "a ring", "a ring beside", "points"],
)
def test_what_is_no_one_curve_is_refused(lines: list[np.ndarray], said: str) -> None:
    with pytest.raises(LoadError, match=said):
        one_chain(HERE, WIRE, lines)


def vtp(path: Path, lines: list[np.ndarray]) -> None:
    def array(values: np.ndarray, how: str) -> str:
        return f'<DataArray format="ascii" {how}>{" ".join(map(str, values.ravel()))}</DataArray>'

    text = '<VTKFile type="PolyData" version="0.1"><PolyData><Piece><Points>'
    text += array(WIRE, 'type="Float64" NumberOfComponents="3"') + "</Points><Lines>"
    text += array(np.concatenate(lines), 'type="Int64" Name="connectivity"')
    text += array(np.cumsum([len(line) for line in lines]), 'type="Int64" Name="offsets"')
    path.write_text(text + "</Lines></Piece></PolyData></VTKFile>", encoding="utf-8")


def vtk_3(path: Path, lines: list[np.ndarray]) -> None:
    text = f"# vtk DataFile Version 3.0\nw\nASCII\nDATASET POLYDATA\nPOINTS 12 double\n{_words(WIRE)}\n"
    text += f"LINES {len(lines)} {sum(len(line) + 1 for line in lines)}\n"
    path.write_text(text + "\n".join(f"{len(line)} {_words(line)}" for line in lines), encoding="utf-8")


def vtk_5(path: Path, lines: list[np.ndarray]) -> None:
    ends = np.cumsum([0, *map(len, lines)])
    text = f"# vtk DataFile Version 5.1\nw\nASCII\nDATASET POLYDATA\nPOINTS 12 double\n{_words(WIRE)}\n"
    text += f"LINES {len(ends)} {ends[-1]}\nOFFSETS vtktypeint64\n{_words(ends)}\n"
    text += f"CONNECTIVITY vtktypeint64\n{_words(np.concatenate(lines))}\n"
    path.write_text(text, encoding="utf-8")


def _words(values: np.ndarray) -> str:
    return " ".join(map(str, values.ravel()))


@pytest.mark.parametrize(("name", "write"), [("w.vtp", vtp), ("3.vtk", vtk_3), ("5.vtk", vtk_5)])
def test_every_kind_of_file_is_read_whole(tmp_path: Path, name: str, write: Callable[..., None]) -> None:
    read = read_vtk_points if name.endswith(".vtk") else lambda path: read_curve(path).points_mm
    write(tmp_path / name, cells(*([n, n + 1] for n in range(11))))
    np.testing.assert_allclose(read(tmp_path / name), WIRE, rtol=1e-12, atol=0.0)
    write(tmp_path / name, cells(range(5), range(5, 12)))
    with pytest.raises(LoadError, match=r"2 lines with 4 free ends.*export the wire alone"):
        read(tmp_path / name)


@pytest.mark.parametrize("write", [vtk_3, vtk_5])
def test_a_line_of_points_that_are_not_there(tmp_path: Path, write: Callable[..., None]) -> None:
    write(tmp_path / "w.vtk", cells([0, 1, 12]))
    with pytest.raises(LoadError, match="not among its 12"):
        read_vtk_points(tmp_path / "w.vtk")


def test_of_several_markups_the_curve_is_read(tmp_path: Path) -> None:
    def markup(kind: str, points: np.ndarray) -> str:
        places = ", ".join(f'{{"position": {p.tolist()}}}' for p in points)
        return f'{{"type": "{kind}", "controlPoints": [{places}]}}'

    path, curve, other = tmp_path / "w.mrk.json", markup("Curve", WIRE), markup("Fiducial", WIRE[:2])
    path.write_text(f'{{"markups": [{other}, {curve}]}}', encoding="utf-8")
    np.testing.assert_allclose(read_markups_curve(path), WIRE, rtol=1e-12, atol=0.0)
    path.write_text(f'{{"markups": [{curve}, {curve}]}}', encoding="utf-8")
    with pytest.raises(LoadError, match="2 curves with control points"):
        read_markups_curve(path)
