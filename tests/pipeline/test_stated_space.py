"""What a curve's file says of its space is what its points are turned by; rows wider than their names are refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.load.curves import read_curve
from pipeline.load.geometry import LoadError, Source
from pipeline.load.wires import read_wires

POINTS = np.array([[0.0, 1.0, 2.0], [0.5, 1.0, 4.0], [1.5, 2.0, 9.0]])


def polyline(path: Path, title: str) -> Path:
    rows = "\n".join(" ".join(map(str, point)) for point in POINTS)
    head = f"# vtk DataFile Version 3.0\n{title}\nASCII\nDATASET POLYDATA\nPOINTS 3 double"
    path.write_text(f"{head}\n{rows}\nLINES 1 4\n3 0 1 2\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("title", "turned"),
    [
        ("SPACE=RAS", True),
        ("space = ras", True),
        ("Space: right-anterior-superior", True),
        ("SPACE=LPS", False),
        ("a wire", False),
    ],
)
def test_a_space_that_is_understood_turns_the_points(tmp_path: Path, title: str, turned: bool) -> None:
    """A title of "space = ras" passed for a statement, and its points for LPS."""
    said = "" if "=" in title or ":" in title else "LPS"
    (wire,) = read_wires([Source(polyline(tmp_path / "wire_0.vtk", title))], 1, said, "mm")
    np.testing.assert_allclose(wire.points_mm, POINTS * ([-1.0, -1.0, 1.0] if turned else 1.0), rtol=0.0, atol=0.0)


def test_another_space_is_refused(tmp_path: Path) -> None:
    (wire,) = read_wires([Source(polyline(tmp_path / "wire_0.vtk", "SPACE=LAS"))], 1, "", "mm")
    assert "space LAS" in wire.problem


@pytest.mark.parametrize("head", ["x_mm;y_mm;z_mm", "x_mm;y_mm;z_mm;force, N", "# of a wire; in mm\nx;y;z", "0;0;0"])
def test_a_spreadsheet_with_decimal_commas_parts_cells_by_semicolons(tmp_path: Path, head: str) -> None:
    path = tmp_path / "wire.csv"
    more = ";0,1" * head.count("force")
    path.write_text(f"{head}\n1,5;2,5;3{more}\n1,5;-2,5;1.25{more}\n", encoding="utf-8")
    np.testing.assert_array_equal(read_curve(path).points_mm[-2:], [[1.5, 2.5, 3.0], [1.5, -2.5, 1.25]])
    path.write_text(f"{head}\n1.234,5;2;3{more}\n", encoding="utf-8")
    with pytest.raises(LoadError, match=r"1\.234\.5"):
        read_curve(path)


@pytest.mark.parametrize("said", ["space: ijk", "space: voxel", "coordinate system = patient", "coordinates: LAS"])
def test_a_space_that_is_none_is_not_taken_for_lps(tmp_path: Path, said: str) -> None:
    path = tmp_path / "wire.csv"
    path.write_text(f"# {said}\nx_mm,y_mm,z_mm\n0,0,0\n0,0,5\n", encoding="utf-8")
    with pytest.raises(LoadError, match=f"space {said.split()[-1]}; expected LPS or RAS"):
        read_curve(path)


@pytest.mark.parametrize("said", ["coordinates: x, y, z", "orientation: LPS", "a spaceship: fast", "space: LPS"])
def test_what_says_nothing_of_the_space_is_no_space(tmp_path: Path, said: str) -> None:
    path = tmp_path / "wire.csv"
    path.write_text(f"# {said}\nx_mm,y_mm,z_mm\n0,0,0\n0,0,5\n", encoding="utf-8")
    assert len(read_curve(path).points_mm) == 2


def test_a_unit_in_a_cell_of_its_own_is_a_unit(tmp_path: Path) -> None:
    """Metres passed for mm."""
    path = tmp_path / "wire.csv"
    path.write_text("# unit,m\nx,y,z\n0,0,0\n0,0,0.05\n", encoding="utf-8")
    np.testing.assert_allclose(read_curve(path).points_mm[-1], [0.0, 0.0, 50.0], rtol=1e-12)


@pytest.mark.parametrize("head", ["x_mm,y_mm,z_mm\n", "0,0,0\n"])
def test_decimal_commas_are_no_columns(tmp_path: Path, head: str) -> None:
    """Points at 1.5, 2.5, 3.1 were read as 1, 5, 2."""
    path = tmp_path / "wire.csv"
    path.write_text(f"{head}1,5,2,5,3,1\n1,5,2,5,9,1\n", encoding="utf-8")
    with pytest.raises(LoadError, match="6 values in row 1 below 3 columns"):
        read_curve(path)
    path.write_text("x_mm,y_mm,z_mm\n1,5,2,\n1,5,9,\n", encoding="utf-8")
    assert len(read_curve(path).points_mm) == 2
