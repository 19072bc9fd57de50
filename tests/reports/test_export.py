"""Files for other programs, read back: LPS mm, axis order, geometry, NaN."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from reports import export
from tests.reports.reading import read_markups_curve, read_segmentation_nrrd, read_vtp

COORDINATES = st.floats(-1e3, 1e3)
CURVES = hnp.arrays(np.float64, st.tuples(st.integers(2, 12), st.just(3)), elements=COORDINATES)
# a right-handed turn that is no permutation: swapped or transposed axes cannot hide in it
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


@settings(max_examples=30, deadline=None)
@given(points=CURVES)
def test_curves_read_back(tmp_path_factory: pytest.TempPathFactory, points: np.ndarray) -> None:
    folder = tmp_path_factory.mktemp("curve")
    export.write_markups_curve(folder / "w.mrk.json", points, "wire")
    np.testing.assert_allclose(read_markups_curve(folder / "w.mrk.json"), points, atol=1e-6)
    export.write_polyline_vtp(folder / "w.vtp", points, {"error_mm": points[:, 0], "force_N": points})
    back = read_vtp(folder / "w.vtp")
    np.testing.assert_array_equal(back.points_mm, points)
    np.testing.assert_array_equal(back.lines[0], np.arange(len(points)))
    np.testing.assert_array_equal(back.point_arrays["error_mm"], points[:, 0])
    np.testing.assert_array_equal(back.point_arrays["force_N"], points)


def test_markups_say_lps_mm_and_defined(tmp_path: Path) -> None:
    export.write_markups_curve(tmp_path / "w.mrk.json", np.eye(3), "wire")
    markup = json.loads((tmp_path / "w.mrk.json").read_text(encoding="utf-8"))["markups"][0]
    assert (markup["type"], markup["coordinateSystem"], markup["coordinateUnits"]) == ("Curve", "LPS", "mm")
    assert {p["positionStatus"] for p in markup["controlPoints"]} == {"defined"}


def test_ras_markups_are_turned(tmp_path: Path) -> None:
    path = tmp_path / "w.mrk.json"
    export.write_markups_curve(path, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], "wire")
    path.write_text(path.read_text(encoding="utf-8").replace('"LPS"', '"RAS"'))
    np.testing.assert_array_equal(read_markups_curve(path), [[-1, -2, 3], [-4, -5, 6]])


def test_markups_of_another_kind_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "w.mrk.json"
    export.write_markups_curve(path, np.eye(3), "wire")
    path.write_text(path.read_text(encoding="utf-8").replace('"Curve"', '"Fiducial"'))
    with pytest.raises(ValueError, match="Fiducial"):
        read_markups_curve(path)


def test_curves_written_by_slicer_are_read() -> None:
    data = os.environ.get("WIREVAL_DATA")
    if not data:
        pytest.skip("WIREVAL_DATA is not set: no curve written by Slicer to read")
    path = sorted(Path(data).glob("aorta_to_cranial/**/*.mrk.json"))[0]
    points = read_markups_curve(path)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert len(points) > 10
    assert 0 < np.median(steps) < 20


def test_nan_survives_in_vtp_and_is_refused_elsewhere(tmp_path: Path) -> None:
    values = [0.5, np.nan, 1.0]
    export.write_polyline_vtp(tmp_path / "w.vtp", np.eye(3), {"error_mm": values})
    np.testing.assert_array_equal(read_vtp(tmp_path / "w.vtp").point_arrays["error_mm"], values)
    with pytest.raises(ValueError, match="finite"):
        export.write_polyline_vtp(tmp_path / "x.vtp", [[0, 0, np.nan]])
    with pytest.raises(ValueError, match="finite"):
        export.write_markups_curve(tmp_path / "x.mrk.json", [[0, 0, np.nan]], "wire")
    with pytest.raises(ValueError, match=r"\(3,\) or \(3, 3\)"):
        export.write_polyline_vtp(tmp_path / "x.vtp", np.eye(3), {"error_mm": [1.0]})
    assert [p.name for p in tmp_path.iterdir()] == ["w.vtp"]


def test_surfaces_read_back(tmp_path: Path) -> None:
    vertices = np.vstack([np.zeros(3), np.eye(3)])
    triangles = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    export.write_surface_vtp(tmp_path / "s.vtp", vertices, triangles)
    back = read_vtp(tmp_path / "s.vtp")
    np.testing.assert_array_equal(back.points_mm, vertices)
    np.testing.assert_array_equal(back.triangles, triangles)
    assert back.lines == ()
    for found, written in zip(export.read_surface_vtp(tmp_path / "s.vtp"), (vertices, triangles), strict=True):
        np.testing.assert_array_equal(found, written)
    with pytest.raises(ValueError, match="indices"):
        export.write_surface_vtp(tmp_path / "t.vtp", vertices, triangles + 1)


def test_empty_curves_are_files_too(tmp_path: Path) -> None:
    export.write_polyline_vtp(tmp_path / "w.vtp", np.zeros((0, 3)))
    export.write_surface_vtp(tmp_path / "s.vtp", np.zeros((0, 3)), np.zeros((0, 3), int))
    assert read_vtp(tmp_path / "w.vtp").lines == ()
    assert read_vtp(tmp_path / "s.vtp").triangles.shape == (0, 3)


def test_segmentations_keep_axes_and_geometry(tmp_path: Path) -> None:
    values = np.zeros((4, 5, 6), np.uint8)
    values[1, 2, 3] = 1
    values[3, 0, 5] = 2
    path = tmp_path / "lumen.seg.nrrd"
    spacing, origin = [0.3, 0.4, 0.5], [-10.0, 20.0, 7.5]
    export.write_segmentation_nrrd(path, values, spacing, origin, TURN, segments=("lumen", "aneurysm sac"))
    back = read_segmentation_nrrd(path)
    np.testing.assert_array_equal(back.values, values)
    np.testing.assert_allclose(back.direction, TURN, atol=1e-12)
    assert back.segments == ("lumen", "aneurysm sac")
    # the independent witness: ITK's own index -> LPS point of the voxel that is set
    image = sitk.ReadImage(str(path))
    assert image[1, 2, 3] == 1
    expected = np.array(origin) + TURN @ (np.array(spacing) * [1, 2, 3])
    np.testing.assert_allclose(image.TransformIndexToPhysicalPoint((1, 2, 3)), expected, atol=1e-9)
    header = path.read_bytes()[:4000]
    assert b"left-posterior-superior" in header
    assert b"Segment0_Name:=lumen" in header
    assert b"Segment1_LabelValue:=2" in header


def test_a_segmentation_under_another_name_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"\.seg\.nrrd"):
        export.write_segmentation_nrrd(tmp_path / "l.nrrd", np.zeros((2, 2, 2)), [1] * 3, [0] * 3, np.eye(3))
