"""Files for other programs, read back: LPS mm, axis order, geometry, NaN."""

from __future__ import annotations

import json
import os
import xml.etree.ElementTree as ET
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
    np.testing.assert_allclose(read_markups_curve(folder / "w.mrk.json"), points, rtol=0.0, atol=1e-6)
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
    np.testing.assert_allclose(back.direction, TURN, rtol=0.0, atol=1e-12)
    assert back.segments == ("lumen", "aneurysm sac")
    # the independent witness: ITK's own index -> LPS point of the voxel that is set
    image = sitk.ReadImage(str(path))
    assert image[1, 2, 3] == 1
    expected = np.array(origin) + TURN @ (np.array(spacing) * [1, 2, 3])
    np.testing.assert_allclose(image.TransformIndexToPhysicalPoint((1, 2, 3)), expected, rtol=0.0, atol=1e-9)
    header = path.read_bytes()[:4000]
    assert b"left-posterior-superior" in header
    assert b"Segment0_Name:=lumen" in header
    assert b"Segment1_LabelValue:=2" in header


def test_a_segmentation_under_another_name_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"\.seg\.nrrd"):
        export.write_segmentation_nrrd(tmp_path / "l.nrrd", np.zeros((2, 2, 2)), [1] * 3, [0] * 3, np.eye(3))


def _quad(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    folder.mkdir(exist_ok=True)
    return np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def test_stl_reads_back_and_says_lps(tmp_path: Path) -> None:
    vertices, triangles = _quad(tmp_path)
    export.write_surface_stl(tmp_path / "s.stl", vertices, triangles)
    content = (tmp_path / "s.stl").read_bytes()
    assert b"SPACE=LPS" in content[:80]
    assert not content.startswith(b"solid")  # the mark of the text form
    kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])
    back = np.frombuffer(content[84:], kind)
    assert len(back) == int.from_bytes(content[80:84], "little") == 4
    np.testing.assert_allclose(back["corners"], vertices[triangles])
    np.testing.assert_allclose(np.linalg.norm(back["normal"], axis=1), 1.0, rtol=1e-6)
    centre = vertices.mean(axis=0)
    assert np.all(np.einsum("ij,ij->i", back["normal"], back["corners"].mean(axis=1) - centre) > 0)


def test_vtp_says_lps_where_slicer_looks(tmp_path: Path) -> None:
    """A text array SPACE in the field data, vtkMRMLModelStorageNode::GetCoordinateSystemFromFieldData."""
    export.write_polyline_vtp(tmp_path / "w.vtp", np.eye(3))
    array = ET.parse(tmp_path / "w.vtp").find("./PolyData/FieldData/Array[@Name='SPACE']")
    assert array is not None
    assert bytes(int(code) for code in (array.text or "").split()) == b"LPS\0"


def test_markups_keep_to_the_published_schema(tmp_path: Path) -> None:
    """What these files use of Slicer's markups-schema-v1.0.3.json: types, lengths, ranges, choices."""
    measured = {"rms distance to the traced wire": 0.25, "unknown": float("nan")}
    export.write_markups_curve(tmp_path / "w.mrk.json", np.eye(3), "wire", "#D55E00", measured)
    markup = json.loads((tmp_path / "w.mrk.json").read_text(encoding="utf-8"))["markups"][0]
    assert markup["type"] in ("Fiducial", "Line", "Angle", "Curve", "ClosedCurve", "Plane", "ROI")
    assert markup["coordinateSystem"] in ("LPS", "RAS")
    assert markup["coordinateUnits"] in ("mm", "um")
    assert all(isinstance(markup[key], str) for key in ("name", "labelFormat"))
    for point in markup["controlPoints"]:
        assert len(point["position"]) == 3
        assert len(point["orientation"]) == 9
        assert all(isinstance(point[key], bool) for key in ("selected", "locked", "visibility"))
        assert point["positionStatus"] in ("undefined", "preview", "defined")
    for key in ("color", "selectedColor"):
        assert markup["display"][key] == pytest.approx([0xD5 / 255, 0x5E / 255, 0.0])
    shown = {m["name"]: (m["value"], m["units"], m["enabled"]) for m in markup["measurements"]}
    assert shown == {
        "length": (pytest.approx(2 * np.sqrt(2)), "mm", True),
        "rms distance to the traced wire": (0.25, "mm", True),
    }


def _view(folder: Path) -> Path:
    vertices, triangles = _quad(folder)
    export.write_surface_vtp(folder / "lumen.vtp", vertices, triangles)
    export.write_segmentation_nrrd(folder / "lumen.seg.nrrd", np.ones((2, 2, 2)), [1] * 3, [0] * 3, np.eye(3))
    for frame in (0, 2, 10):
        for kind in ("traced", "simulated"):
            export.write_polyline_vtp(folder / f"wire_{kind}_{frame:03d}.vtp", np.eye(3), {"arc_mm": [0, 1, 2]})
            export.write_markups_curve(folder / f"wire_{kind}_{frame:03d}.mrk.json", np.eye(3), kind)
    return folder


def test_a_collection_has_every_frame_as_time(tmp_path: Path) -> None:
    path = export.write_collection(_view(tmp_path), "wire_traced")
    assert path is not None
    sets = ET.parse(path).findall("./Collection/DataSet")
    assert [(s.get("timestep"), s.get("file")) for s in sets] == [
        (str(frame), f"wire_traced_{frame:03d}.vtp") for frame in (0, 2, 10)
    ]
    assert export.write_collection(tmp_path, "wire_true") is None
    assert not (tmp_path / "wire_true.pvd").exists()


def test_the_scene_opens_everything_with_names_and_colours(tmp_path: Path) -> None:
    path = export.write_scene(_view(tmp_path), shown=2)
    assert path is not None
    nodes = {node.get("id"): node for node in ET.parse(path).getroot()}
    assert len(nodes) == 3 * 14  # a thing, its display, its storage; no identifier twice
    files, seen = set(), set()
    for identifier, node in nodes.items():
        assert identifier is not None
        assert identifier.startswith(f"vtkMRML{node.tag}Node")
        if "references" in node.attrib:
            found = dict(part.split(":") for part in node.attrib["references"].strip(";").split(";"))
            display, storage = nodes[found["display"]], nodes[found["storage"]]
            files.add(storage.attrib["fileName"])
            if display.attrib["visibility"] == "true":
                seen.add(node.attrib["name"])
            if "traced" in node.attrib["name"]:
                assert display.attrib["color"] == "0.8353 0.3686 0.0000"
    assert files == {p.name for p in tmp_path.iterdir()} - {"scene.mrml"}
    assert seen == {"lumen", "lumen, segmented", "traced 002", "simulated 002"}
    assert export.write_scene(tmp_path / "nothing", 0) is None


def test_wires_of_frames_that_are_not_ok_are_called_so(tmp_path: Path) -> None:
    """They stood among the others, in the same colours and with plain names."""
    path = export.write_scene(_view(tmp_path), shown=2, statuses={2: "trace_low_contrast"})
    assert path is not None
    names = {node.get("name") for node in ET.parse(path).getroot()}
    assert names >= {"traced 000", "traced 002 (frame not ok: trace_low_contrast)", "traced 010, curve"}
    assert "simulated 002 (frame not ok: trace_low_contrast), curve" in names
    assert export.wire_name("traced", 3, "max_iterations") == "traced 003 (frame not ok: max_iterations)", "was refused"
    assert export.wire_name("true", 2, "trace_low_contrast") == "true 002"
    assert export.wire_name("simulated", 1, "roll_fitted") == "simulated 001"


def test_the_scene_shows_the_scans_behind_the_wires(tmp_path: Path) -> None:
    """Lumen and wires alone were opened, over nothing."""
    scans = {"reference": Path("elsewhere/reference.mha"), "frame 2": Path("/scans/frame_002.nii.gz")}
    path = export.write_scene(_view(tmp_path), 2, scans, "frames 0 and 1 are opened by hand")
    assert path is not None
    root = ET.parse(path).getroot()
    nodes = {node.get("id"): node for node in root}
    assert len(nodes) == len(root)
    found = {}
    for node in root.iter("Volume"):
        assert str(node.get("id")).startswith("vtkMRMLScalarVolumeNode")
        parts = dict(part.split(":") for part in node.attrib["references"].strip(";").split(";"))
        assert nodes[parts["display"]].tag == "VolumeDisplay"
        found[node.attrib["name"]] = nodes[parts["storage"]].attrib["fileName"]
    assert found == {"reference": str(Path("elsewhere/reference.mha").absolute()), "frame 2": "/scans/frame_002.nii.gz"}
    behind = {node.attrib["references"] for node in root.iter("SliceComposite")}
    assert behind == {f"backgroundVolume:{list(root.iter('Volume'))[-1].get('id')};"}, "the scan that shows a wire"
    assert [node.get("text") for node in root.iter("Text")] == ["frames 0 and 1 are opened by hand"]


def test_vtk_reads_what_is_written(tmp_path: Path) -> None:
    vtk = pytest.importorskip("vtk", reason="vtk is not installed: no second reader of .vtp and .stl")
    vertices, triangles = _quad(tmp_path)
    export.write_surface_vtp(tmp_path / "s.vtp", vertices, triangles)
    export.write_surface_stl(tmp_path / "s.stl", vertices, triangles)
    export.write_polyline_vtp(tmp_path / "w.vtp", np.eye(3), {"error_mm": [0.5, np.nan, 1.0]})
    for name, kind in (("s.vtp", vtk.vtkXMLPolyDataReader), ("s.stl", vtk.vtkSTLReader)):
        reader = kind()
        reader.SetFileName(str(tmp_path / name))
        reader.Update()
        edges = vtk.vtkFeatureEdges()
        edges.SetInputData(reader.GetOutput())
        edges.FeatureEdgesOff()
        edges.ManifoldEdgesOff()
        edges.Update()
        assert (reader.GetOutput().GetNumberOfPolys(), edges.GetOutput().GetNumberOfCells()) == (4, 0)
    reader = vtk.vtkXMLPolyDataReader()
    reader.SetFileName(str(tmp_path / "w.vtp"))
    reader.Update()
    assert reader.GetOutput().GetFieldData().GetAbstractArray("SPACE").GetValue(0) == "LPS"
    assert reader.GetOutput().GetPointData().GetArray("error_mm").GetValue(2) == 1.0
