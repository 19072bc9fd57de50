"""Curves that are not all there, or say two things: what a reader makes of them is a wire, but not the one meant."""

from __future__ import annotations

import base64
import json
import struct
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest

from pipeline.load import LoadError, Source
from pipeline.load.curves import read_curve, read_truth
from pipeline.load.lumens import read_markups_branches, read_swc
from pipeline.load.surfaces import read_stl
from pipeline.load.vtk import read_vtk_points
from pipeline.load.wires import read_wires

POINTS = np.column_stack([np.zeros(6), np.zeros(6), np.arange(6.0)])
WORDS = " ".join(f"{value:g}" for value in POINTS.ravel())
LINES_5, CORNERS_5 = "LINES 2 6\nOFFSETS vtktypeint64", "CONNECTIVITY vtktypeint64\n0 1 2 3 4 5"
HEAD = "# vtk DataFile Version 3.0\nwire\nASCII\nDATASET POLYDATA\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (f"POINTS 9 double\n{WORDS}\n", "got 18 numbers where its head says 27"),
        ("POINTS -1 double\n\n", "where its head says -3"),
        (f"POINTS 99999999999999 double\n{WORDS}\n", "got 18 numbers"),
        (f"POINTS 6 double\n{WORDS}\nLINES 999999999 7\n6 0 1 2 3 4 5\n", "got 1 lines where its head says 999999999"),
        (f"POINTS 6 double\n{WORDS.replace('5', '1_5')}\n", "something else than numbers"),
        (f"POINTS 3 double\n{WORDS}\n", "got more numbers where its head says 9"),
        (f"POINTS 6 double\n{WORDS}\nPOINTS 6 double\n{WORDS}\n", "got two of POINTS"),
        (f"POINTS 9999999999999999999 double\n{WORDS}\n", "got 18 numbers"),
        (f"POINTS 6 double\n{WORDS}\nLINES 1 7\n9 0 1 2 3 4 5\n", "got 6 points of line 0 where its head says 9"),
        (f"POINTS 6 double\n{WORDS}\nLINES 1 7\n2 0 1 3 3 4 5\n", "got 2 lines where its head says 1"),
        (f"POINTS 6 double\n{WORDS}\nLINES 999999999 2\n-1 0\n", "got 1 points of line 0 where its head says -1"),
        (f"POINTS 6 double\n{WORDS}\nLINES 1 7\n6 0 1.7 2 3 4 5\n", "something else than numbers"),
        (f"POINTS 6 double\n{WORDS}\n{LINES_5}\n2 6\n{CORNERS_5}\n", "got OFFSETS from 2 on"),
    ],
)
def test_a_legacy_file_holds_what_its_head_says(tmp_path: Path, text: str, said: str) -> None:
    """One that was cut short at the end of a line was scored, ok."""
    path = tmp_path / "wire.vtk"
    path.write_text(HEAD + text, encoding="utf-8")
    with pytest.raises(LoadError, match=said):
        read_vtk_points(path)


@pytest.mark.parametrize(
    "after",
    [
        "",
        f"\nMETADATA\nINFORMATION 0\n\n{LINES_5}\n0 6\n{CORNERS_5}\n",
        "VERTICES 1 2\n1 0\nLINES 1 7\n6 0 1 2 3 4 5\n",
    ],
)
@pytest.mark.parametrize("binary", [False, True])
def test_a_legacy_file_that_is_whole_is_read(tmp_path: Path, after: str, binary: bool) -> None:
    path = tmp_path / "wire.vtk"
    if binary:
        head = HEAD.replace("ASCII", "BINARY").encode() + b"POINTS 6 double\n" + POINTS.astype(">f8").tobytes()
        path.write_bytes(head + b"\nLINES 1 7\n" + np.array([6, *range(6)], ">i4").tobytes() + b"\n")
    else:
        path.write_text(f"{HEAD}POINTS 6 double\n{WORDS}\n{after}", encoding="utf-8")
    np.testing.assert_array_equal(read_vtk_points(path), POINTS)


@pytest.mark.parametrize(("kind", "stored"), [("vtktypeint64", ">i8"), ("vtkIdType", ">i4")])
def test_indices_of_a_binary_legacy_file_are_as_long_as_vtk_writes_them(tmp_path: Path, kind: str, stored: str) -> None:
    """Those called vtkIdType were read as 8 bytes each; VTK has 8 in memory, and writes 4."""
    path = tmp_path / "wire.vtk"
    ends, corners = (np.array(values, stored).tobytes() for values in ([0, 6], range(6)))
    head = HEAD.replace("ASCII", "BINARY").encode() + b"POINTS 6 double\n" + POINTS.astype(">f8").tobytes()
    lines = f"\nLINES 2 6\nOFFSETS {kind}\n".encode() + ends + f"\nCONNECTIVITY {kind}\n".encode() + corners + b"\n"
    path.write_bytes(head + lines)
    np.testing.assert_array_equal(read_vtk_points(path), POINTS)


def vtp(points: str, *, count: int = 6, form: str = "ascii", compressor: str = "") -> str:
    """A .vtp file of points alone."""
    data = f'<DataArray type="Float64" NumberOfComponents="3" format="{form}">{points}</DataArray>'
    piece = f'<Piece NumberOfPoints="{count}" NumberOfLines="0"><Points>{data}</Points></Piece>'
    head = f'<VTKFile type="PolyData" byte_order="LittleEndian" header_type="UInt32"{compressor}>'
    return f"{head}<PolyData>{piece}</PolyData></VTKFile>"


def packed(cut: int) -> str:
    """The points in one block of zlib, short of so many bytes."""
    block = zlib.compress(POINTS.tobytes())[: -cut or None]
    head = struct.pack("<4I", 1, POINTS.nbytes, 0, len(block))
    return (base64.b64encode(head) + base64.b64encode(block)).decode()


def coded(said: int) -> str:
    """The points in base64, whose length is said to be so many bytes."""
    return base64.b64encode(struct.pack("<I", said) + POINTS.tobytes()).decode()


def lined(corners: str) -> str:
    """The points and one line through all of them."""
    arrays = (("connectivity", corners), ("offsets", "6"))
    data = "".join(f'<DataArray type="UInt8" Name="{name}" format="ascii">{text}</DataArray>' for name, text in arrays)
    return vtp(WORDS).replace('Lines="0"', 'Lines="1"').replace("</Piece>", f"<Lines>{data}</Lines></Piece>")


ZLIB = ' compressor="vtkZLibDataCompressor"'
TWICE = vtp(WORDS).replace("</Piece>", "</Piece>" + vtp(WORDS).partition("<PolyData>")[2].partition("</PolyData>")[0])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (vtp(WORDS), ""),
        (vtp(coded(144), form="binary"), ""),
        (vtp(packed(0), form="binary", compressor=ZLIB), ""),
        (vtp(WORDS, count=9), "got 6 Points where NumberOfPoints says 9"),
        (vtp(coded(240), form="binary", count=10), "got 144 bytes of an array that says 240"),
        (vtp(packed(4), form="binary", compressor=ZLIB), "bytes of an array, packed, without their end"),
        (TWICE, "got 2 pieces with points"),
        (vtp(WORDS.replace("5", "1_5")), "contradicts its format"),
        (vtp(WORDS).replace('Lines="0"', 'Lines="1"'), "got 0 Lines where NumberOfLines says 1"),
        (vtp(WORDS).replace('Components="3"', 'Components="2"'), "got Points of 2 numbers each"),
        (lined("0 1 2 3 4 5"), ""),
        (lined("0 1.9 2 3 4 5"), "got 1.9 in an array of UInt8"),
        (lined("256 1 2 3 4 5"), "got 256 in an array of UInt8; expected whole numbers from 0 to 255"),
    ],
)
def test_a_polydata_file_holds_what_it_says(tmp_path: Path, text: str, said: str) -> None:
    """Counts, lengths and further pieces were not looked at."""
    path = tmp_path / "wire.vtp"
    path.write_text(text, encoding="utf-8")
    if said:
        with pytest.raises(LoadError, match=said):
            read_curve(path)
    else:
        np.testing.assert_array_equal(read_curve(path).points_mm, POINTS)


@pytest.mark.parametrize(
    ("positions", "status", "said"),
    [
        (POINTS.reshape(3, 6).tolist(), "defined", "not three numbers"),
        (POINTS.reshape(9, 2).tolist(), "defined", "not three numbers"),
        ([[str(value) for value in point] for point in POINTS.tolist()], "defined", "not three numbers"),
        ([[True, 0.5, 1], [0, 0, 5.5]], "defined", "not three numbers"),
        (POINTS.tolist(), "undefined", "6 control points that are not placed, the first is point 0"),
    ],
)
def test_control_points_are_placed_and_have_three_numbers(
    tmp_path: Path, positions: list[object], status: str, said: str
) -> None:
    """Six numbers in each were two points, and what was never placed lay at 0, 0, 0."""
    points = [{"position": position, "positionStatus": status} for position in positions]
    path = tmp_path / "wire.mrk.json"
    path.write_text(json.dumps({"markups": [{"type": "Curve", "controlPoints": points}]}), encoding="utf-8")
    with pytest.raises(LoadError, match=said):
        read_curve(path)


@pytest.mark.parametrize(
    ("head", "row", "said"),
    [
        ("# space: RAS\n# space: LPS\nx,y,z\n", "0,0,5", "got LPS and RAS in the comments of its table"),
        ("# unit: m\nx_mm,y_mm,z_mm\n", "0,0,5", "got m and mm in the comments of its table, or its columns"),
        ("# unit: mm\nx_mm,y_mm,z_mm\n", "0,0,5", ""),
        ("# unit: millimeter\nx_mm,y_mm,z_mm\n", "0,0,5", ""),
        ("# space: LPS\n# coordinateSystem: 1\nx,y,z\n", "0,0,5", ""),
        ("x_mm,y_mm,z_mm\n", "0,0,1_2.5", "'1_2.5' is no number"),
        ("x_mm,y_mm,z_mm\n", "0,0,\N{FULLWIDTH DIGIT FIVE}", "is no number"),
    ],
)
def test_a_table_says_one_thing_in_plain_digits(tmp_path: Path, head: str, row: str, said: str) -> None:
    """Of two spaces the first was taken, 8.8 mm off."""
    path = tmp_path / "wire.csv"
    path.write_text(f"{head}0,0,0\n0,0,1\n{row}\n", encoding="utf-8")
    if said:
        with pytest.raises(LoadError, match=said):
            read_curve(path)
    else:
        assert len(read_curve(path).points_mm) == 3


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            '{"frames": [{"points_mm": [["0", "0", "0"], ["0", "0", "5"]]}]}',
            "frame 0 holds something else than numbers",
        ),
        ('{"frames": [{"points_mm": [[true, false, true], [false, false, false]]}]}', "something else than numbers"),
        ('{"frames": [{"points_mm": [[true, 0.5, 1], [0, 0, 5.5]]}]}', "something else than numbers"),
        ('{"frames": [{"points_mm": [1, 2, 3]}]}', "expected 1 of shape"),
        ('{"frames": [], "frames": [{"points_mm": [[0, 0, 0], [0, 0, 5]]}]}', "two values of the key 'frames'"),
    ],
)
def test_a_truth_is_of_numbers_and_stands_once(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "truth.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(LoadError, match=said):
        read_truth(path, 1)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.swc", "1 1 0 0 0 1 -1\n2 1 0 0 1_0 1 1\n", "a line that is not seven numbers"),
        ("a.swc", "1 1 0 0 0 1 -1\n2 1 0 0 3 1 1\n2 1 0 0 6 1 2\n", "got node 2 twice"),
        ("a.swc", "1 1 0 0 0 1 -1\n2 1 0 0 3 1 1\n3 1 0 0 6 1 99\n", "the parent 99, which is none of the nodes"),
        ("a.swc", "1 1 0 0 0 1 -1\n2 1 0 0 3 1 1\n3 1 0 0 6 1 3\n", "node 3 among its own ancestors"),
        ("a.swc", "1 1 0 0 0 1 3\n2 1 0 0 3 1 1\n3 1 0 0 6 1 2\n", "node 1 among its own ancestors"),
        ("a.swc", "1 1 0 0 0 1 -1\n2 1 0 0 3 1 1\n3 1 0 0 6 1 1.9\n", "the parent 1.9, which is none"),
        ("a.stl", "solid\nvertex 0 0 0\nvertex 1_0 0 0\nvertex 0 1 0\n", "a vertex that is not three numbers"),
        ("a.mrk.json", "[1, true]", "contradicts its format"),
    ],
)
def test_a_lumen_is_of_plain_digits(tmp_path: Path, name: str, text: str, said: str) -> None:
    """1_0 was 10, and true a radius of 1 mm; a vessel whose parent is missing was cut off there."""
    path = tmp_path / name
    if name.endswith(".json"):
        radii = {"name": "Radius", "controlPointValues": json.loads(text)}
        points = [{"position": [0, 0, 0]}, {"position": [0, 0, 5]}]
        text = json.dumps({"markups": [{"controlPoints": points, "measurements": [radii]}]})
    path.write_text(text, encoding="utf-8")
    read = {".swc": read_swc, ".stl": read_stl, ".json": read_markups_branches}[path.suffix]
    with pytest.raises(LoadError, match=said):
        read(path)


@pytest.mark.parametrize("place", ["frames", "frames/0", "frames/0/simulated_mm"])
@pytest.mark.parametrize("soft", [False, True])
def test_wires_of_another_file_are_refused(tmp_path: Path, place: str, soft: bool) -> None:
    """A link into another file was followed, whose changes nobody noticed: a score was kept that was of older wires."""
    for name in ("all.h5", "other.h5"):
        with h5py.File(tmp_path / name, "w") as file:
            file["frames/0/simulated_mm"] = POINTS
    with h5py.File(tmp_path / "all.h5", "a") as file:
        del file[place]
        file["away" if soft else place] = h5py.ExternalLink("other.h5", place)
        if soft:
            file[place] = h5py.SoftLink("/away")
    with pytest.raises(LoadError, match=r"all\.h5: a link into another file; allowed: data in this file"):
        read_wires([Source(tmp_path / "all.h5")], 1)


def test_a_few_bytes_are_no_wire_of_gigabytes(tmp_path: Path) -> None:
    """8 MB of packed zeros took 14 GB."""
    with h5py.File(tmp_path / "all.h5", "w") as file:
        file.create_dataset("frames/0/simulated_mm", (2_000_000, 3), "f8", chunks=(100_000, 3), compression="gzip")
    with pytest.raises(LoadError, match=r"/frames/0/simulated_mm: 2000000 points; allowed: 1000000"):
        read_wires([Source(tmp_path / "all.h5")], 1)


@pytest.mark.parametrize("what", ["", "unwritten", "twice", "texts", "flags"])
def test_wires_in_hdf5_are_written_and_of_numbers(tmp_path: Path, what: str) -> None:
    """Points that were never written lay at 0, 0, 0."""
    path = tmp_path / "all.h5"
    with h5py.File(path, "w") as file:
        data = file.create_dataset("frames/0/simulated_mm", (6, 3), "f8", chunks=(2, 3))
        rows = 4 if what == "unwritten" else 6
        data[:rows] = POINTS[:rows]
        if what == "twice":
            file["frames/00/simulated_mm"] = POINTS + 1
        if what in ("texts", "flags"):
            del file["frames/0/simulated_mm"]
            file["frames/0/simulated_mm"] = POINTS.astype("S3" if what == "texts" else bool)
    if what:
        said = {"unwritten": "2 of 3 chunks were ever written", "twice": "got 2 groups of 1 numbers"}
        with pytest.raises(LoadError, match=said.get(what, "another layout")):
            read_wires([Source(path)], 1)
    else:
        np.testing.assert_array_equal(read_wires([Source(path)], 1)[0].points_mm, POINTS)
