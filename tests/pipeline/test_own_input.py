"""Own lumens and curves: each kind of file against the analytic shape it was written from."""

from __future__ import annotations

import json
import os
import re
import struct
import tracemalloc
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
import SimpleITK as sitk
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation
from skimage.measure import marching_cubes

from pipeline.load import LoadError
from pipeline.load.curves import read_curve, read_truth
from pipeline.load.geometry import Mask, Source
from pipeline.load.lumens import read_lumen
from pipeline.load.masks import mask_header
from pipeline.load.views import read_views
from pipeline.load.wires import read_wires
from pipeline.model import Branches, Shapes
from pipeline.segment.config import SegmentConfig
from pipeline.segment.given import given_lumen
from pipeline.status import InputError
from pipeline.study.manifest import read_manifest
from pipeline.study.own_lumen import lumen_problems
from pipeline.study.parameters import read_parameters
from pipeline.study.settings import SettingsError, parse_assignment, read_settings
from reports.export import write_markups_curve, write_polyline_vtp, write_surface_vtp
from reports.records import read_json
from reports.texts import UnreadableError, read_bytes
from reports.tolerance import load_tolerance
from tests.fuzz.inputs import markups, stl, tetrahedra, vtp

RADIUS, LENGTH = 1.5, 12.0
START = np.array([3.0, -2.0, 1.0])


def lumen_in(path):
    config = SegmentConfig()
    return given_lumen(read_lumen(path, config.least_voxels), config)


def true_distance(points):
    """A capsule along x."""
    local = points - START
    along = np.clip(local[..., 0], 0, LENGTH)
    foot = np.stack([along, 0 * along, 0 * along], axis=-1)
    return np.linalg.norm(local - foot, axis=-1) - RADIUS


def errors(lumen, within=1.0):
    """Errors (mm) of the distance near the wall."""
    index = np.argwhere(np.abs(lumen.distance.values) < within)
    return lumen.distance.values[tuple(index.T)] - true_distance(lumen.distance.to_mm(index))


def capsule(voxel=0.25):
    """Signed distance on a lattice, its voxel size and origin."""
    origin = START - RADIUS - 1.0
    shape = np.ceil((np.array([LENGTH, 0, 0]) + 2 * RADIUS + 2.0) / voxel).astype(int)
    index = np.stack(np.meshgrid(*[np.arange(n) for n in shape], indexing="ij"), axis=-1)
    return true_distance(index * voxel + origin), voxel, origin


def surface():
    distance, voxel, origin = capsule()
    vertices, triangles, _, _ = marching_cubes(distance, 0.0)
    return vertices * voxel + origin, triangles


def test_centreline_with_radius(tmp_path):
    rows = ["# a comment", f"1 0 {START[0]} {START[1]} {START[2]} {RADIUS} -1"]
    rows += [f"{n + 2} 0 {START[0] + LENGTH * (n + 1) / 3} {START[1]} {START[2]} {RADIUS} {n + 1}" for n in range(3)]
    (tmp_path / "tree.swc").write_text("\n".join(rows), encoding="utf-8")
    assert np.abs(errors(lumen_in(tmp_path / "tree.swc"))).max() < 1e-5
    points = [{"position": list((START + np.array([LENGTH * t, 0, 0])) * [-1, -1, 1])} for t in (0, 0.5, 1)]
    measure = [{"name": "Radius", "controlPointValues": [RADIUS] * 3}]
    markup = {"markups": [{"coordinateSystem": "RAS", "controlPoints": points, "measurements": measure}]}
    (tmp_path / "tree.mrk.json").write_text(json.dumps(markup), encoding="utf-8")
    assert np.abs(errors(lumen_in(tmp_path / "tree.mrk.json"))).max() < 1e-5


def write_binary_stl(path, vertices, triangles):
    with path.open("wb") as file:
        file.write(b"\0" * 80 + struct.pack("<I", len(triangles)))
        for t in triangles:
            file.write(struct.pack("<12fH", 0, 0, 0, *vertices[t].ravel(), 0))


@pytest.mark.parametrize("kind", ["stl", "ascii.stl", "vtp"])
def test_closed_surface(tmp_path, kind):
    vertices, triangles = surface()
    path = tmp_path / f"lumen.{kind}"
    if kind == "stl":
        write_binary_stl(path, vertices, triangles)
    elif kind == "vtp":
        write_surface_vtp(path, vertices, triangles)
    else:
        corners = "\n".join(f"vertex {p[0]} {p[1]} {p[2]}" for t in triangles for p in vertices[t])
        path.write_text(f"solid lumen\n{corners}\nendsolid", encoding="utf-8")
    error = errors(lumen_in(path))
    assert np.sqrt(np.mean(error**2)) < 0.02
    assert np.abs(error).max() < 0.15


def test_an_open_surface_is_refused(tmp_path):
    vertices, triangles = surface()
    write_binary_stl(tmp_path / "open.stl", vertices, triangles[:-20])
    with pytest.raises(LoadError, match="open edges"):
        lumen_in(tmp_path / "open.stl")


def test_label_map(tmp_path):
    distance, voxel, origin = capsule()
    image = sitk.GetImageFromArray((distance < 0).astype(np.uint8).T)
    image.SetSpacing([voxel] * 3)
    image.SetOrigin(origin.tolist())
    sitk.WriteImage(image, str(tmp_path / "label.nrrd"))
    error = errors(lumen_in(tmp_path / "label.nrrd"), within=0.3)
    assert np.sqrt(np.mean(error**2)) < 0.25 * voxel


def labels(path, values, voxel, origin):
    image = sitk.GetImageFromArray(values.T)
    image.SetSpacing([voxel] * 3)
    image.SetOrigin(origin.tolist())
    sitk.WriteImage(image, str(path))


def mask(path, **which):
    config = SegmentConfig()
    return given_lumen(read_lumen(Mask(path, **which), config.least_voxels), config)


def test_one_label_of_several_by_number(tmp_path):
    """As nnU-Net and TotalSegmentator write them."""
    distance, voxel, origin = capsule()
    values = np.where(distance < 0, 2, 0).astype(np.uint8)
    values[distance > 0.7] = 1
    values[:3] = 3
    labels(tmp_path / "seg.nii.gz", values, voxel, origin)
    error = errors(mask(tmp_path / "seg.nii.gz", label=2), within=0.3)
    assert np.sqrt(np.mean(error**2)) < 0.25 * voxel
    with pytest.raises(LoadError, match=r"4 different values, 0, 1, 2, 3.*name one"):
        mask(tmp_path / "seg.nii.gz")
    with pytest.raises(LoadError, match="no voxel of label 7; expected one of its values, 0, 1, 2, 3"):
        mask(tmp_path / "seg.nii.gz", label=7)
    with pytest.raises(LoadError, match="no label named 'artery'"):
        mask(tmp_path / "seg.nii.gz", label="artery")


@pytest.mark.parametrize(("label", "said"), [(300, "label 300; expected 0 to 255"), ("vein", "no label named 'vein'")])
def test_a_label_that_a_file_cannot_have_is_seen_in_its_header(tmp_path, label, said):
    """`check` found nothing: it was the case that failed."""
    labels(tmp_path / "seg.nrrd", np.zeros((4, 4, 4), np.uint8), 0.3, np.zeros(3))
    with pytest.raises(LoadError, match=said):
        mask_header(Mask(tmp_path / "seg.nrrd", label=label))


def test_a_label_map_that_cannot_be_used_is_seen_before_a_run(tmp_path, monkeypatch):
    """`check` found nothing, and the run computed every other case before this one failed."""
    distance, voxel, origin = capsule()
    entry, path = origin + voxel * np.argwhere(distance == distance.min())[0], tmp_path / "lumen.nrrd"

    def problems(values):
        labels(path, values.astype(np.uint8), voxel, origin)
        case = Mock(entry_mm=tuple(entry.tolist()), entry_sigma_mm=None)
        return list(lumen_problems(case, Mask(path), SegmentConfig().least_voxels))

    assert problems(distance < 0) == []
    (several,) = problems(np.where(distance < 0, 2, 0) + (distance > 0.7))
    assert "got 3 different values, 0, 1, 2" in several
    (inverted,) = problems(distance > 0.7)
    assert "has no voxel of the lumen within 1.5 mm, which spans" in inverted
    monkeypatch.setattr("pipeline.study.own_lumen.read_lumen", None)
    case = Mock(entry_mm=tuple(entry.tolist()), entry_sigma_mm=None)
    again = lumen_problems(case, Mask(path), SegmentConfig().least_voxels)
    assert list(again) == [inverted], "`score` of a simulator more read every lumen once more"


@pytest.mark.parametrize("top", [1.0, 255.0])
def test_a_probability_has_its_wall_at_a_half(tmp_path, top):
    """0 to 255 was taken as everything but 0: nearly twice the lumen."""
    distance, voxel, origin = capsule()
    share = top / (1 + np.exp(distance / 0.15))
    kind = np.float32 if top == 1.0 else np.uint8
    labels(tmp_path / "p.nrrd", share.astype(kind), voxel, origin)
    error = errors(mask(tmp_path / "p.nrrd"), within=0.3)
    assert np.sqrt(np.mean(error**2)) < 0.15 * voxel
    wider = errors(mask(tmp_path / "p.nrrd", level=0.2), within=0.3)
    assert np.median(wider) < -0.1


@pytest.mark.parametrize("kind", [np.float32, np.uint8])
def test_percent_are_no_probability_of_255(tmp_path, kind):
    """With a level of 0.3 the wall lay at 76.5 per cent, ok."""
    distance, voxel, origin = capsule()
    labels(tmp_path / "p.nrrd", np.round(100 / (1 + np.exp(distance / 0.15))).astype(kind), voxel, origin)
    with pytest.raises(LoadError, match="values from 0 to 100; expected 0 to 1, or 0 to 255; name a label, or rescale"):
        mask(tmp_path / "p.nrrd", level=0.3)


def test_layers_and_names_of_a_segmentation(tmp_path):
    """3D Slicer puts segments that overlap into layers, which stand beside each other voxel by voxel."""
    distance, voxel, origin = capsule()
    first, second = (distance < -0.6).astype(np.uint8), np.where(distance < 0, 5, 0).astype(np.uint8)
    both = np.stack([first, second]).astype(np.uint8)
    head = "NRRD0004\ntype: uint8\ndimension: 4\nspace: left-posterior-superior\n"
    head += f"sizes: 2 {' '.join(map(str, distance.shape))}\nkinds: list domain domain domain\nencoding: raw\n"
    head += f"space directions: none ({voxel},0,0) (0,{voxel},0) (0,0,{voxel})\n"
    head += f"space origin: ({','.join(map(str, origin))})\n"
    for k, (name, value) in enumerate((("core", 1), ("artery", 5))):
        head += f"Segment{k}_Name:={name}\nSegment{k}_Layer:={k}\nSegment{k}_LabelValue:={value}\n"
    (tmp_path / "s.seg.nrrd").write_bytes(head.encode() + b"\n" + both.tobytes(order="F"))
    for which in ("artery", 5):
        error = errors(mask(tmp_path / "s.seg.nrrd", label=which), within=0.3)
        assert np.sqrt(np.mean(error**2)) < 0.25 * voxel
    with pytest.raises(LoadError, match=r"2 layers.*one of artery, core"):
        mask(tmp_path / "s.seg.nrrd")
    with pytest.raises(LoadError, match="did you mean 'artery'"):
        mask(tmp_path / "s.seg.nrrd", label="atery")
    written = " ".join(map(str, both.ravel(order="F"))).encode()
    (tmp_path / "u.seg.nrrd").write_bytes(head.replace(": raw", ": ascii").encode() + b"\n" + written)
    both_artery = head.replace("Name:=core", "Name:=artery")
    (tmp_path / "t.seg.nrrd").write_bytes(both_artery.encode() + b"\n" + both.tobytes(order="F"))
    with pytest.raises(LoadError, match="labels 1 and 5, all named 'artery'"):
        mask(tmp_path / "t.seg.nrrd", label="artery")
    by_number, *others = (mask(tmp_path / f"{name}.seg.nrrd", label=5).distance.values for name in "stu")
    for values in others:
        np.testing.assert_array_equal(values, by_number)


def test_a_centreline_of_vmtk(tmp_path):
    points = START + np.array([[LENGTH * k / 4, 0, 0] for k in range(5)])
    radius = (
        f'<PointData><DataArray type="Float64" Name="MaximumInscribedSphereRadius" format="ascii">{f"{RADIUS} " * 5}'
    )
    text = vtp(points, lines=range(5)).decode().replace("<Points>", f"{radius}</DataArray></PointData><Points>")
    (tmp_path / "c.vtp").write_text(text, encoding="utf-8")
    assert np.abs(errors(lumen_in(tmp_path / "c.vtp"))).max() < 1e-5
    (tmp_path / "c.vtp").write_text(text.replace(f"{RADIUS} ", "-1 ", 1), encoding="utf-8")
    with pytest.raises(LoadError, match="one finite radius above 0 for each point"):
        lumen_in(tmp_path / "c.vtp")


def test_a_curve_says_its_unit(tmp_path):
    """.mrk.json in metres was read as mm."""
    points = np.array([[0.0, 0, 0], [0, 0, 0.01], [0, 0, 0.03]])
    (tmp_path / "a.mrk.json").write_bytes(markups(points, coordinateUnits="m"))
    np.testing.assert_allclose(read_curve(tmp_path / "a.mrk.json").points_mm, 1000 * points)


@pytest.mark.parametrize(
    ("factor", "said"), [(0.001, "is it in metres"), (1000.0, "another unit than mm"), (1e9, "another unit than mm")]
)
def test_a_surface_in_another_unit_is_refused(tmp_path, factor, said):
    points, faces = tetrahedra(1, 9.0)
    (tmp_path / "a.stl").write_bytes(stl(points * factor, faces))
    with pytest.raises(LoadError, match=said):
        lumen_in(tmp_path / "a.stl")


def test_a_surface_of_thousands_of_shells_is_refused(tmp_path):
    """It was a hang."""
    points, faces = tetrahedra(5000, 20.0, 0.001)
    (tmp_path / "a.stl").write_bytes(stl(points, faces))
    with pytest.raises(LoadError, match="remove what covers itself"):
        lumen_in(tmp_path / "a.stl")


def test_a_lumen_that_fills_its_box_is_refused(tmp_path):
    """A radius of 50 mm: finding its branches took more than 14 GB."""
    (tmp_path / "a.swc").write_text("1 1 0 0 0 50 -1\n2 1 0 0 90 50 1\n", encoding="utf-8")
    with pytest.raises(LoadError, match=r"a lumen of 707 ml; expected .* are its radii diameters"):
        lumen_in(tmp_path / "a.swc")


def test_curves_come_back_as_they_were_written(tmp_path):
    points = np.cumsum(np.random.default_rng(0).normal(size=(20, 3)), axis=0)
    write_polyline_vtp(tmp_path / "a.vtp", points)
    write_markups_curve(tmp_path / "a.mrk.json", points, "wire")
    lines = [",".join(map(str, p)) for p in points]
    (tmp_path / "a.csv").write_text("\n".join(["x_mm,y_mm,z_mm", *lines]), encoding="utf-8")
    (tmp_path / "bare.csv").write_text("\n".join(lines), encoding="utf-8")
    of_paraview = ['"Radius","Points:0","Points:1","Points:2"', *(f"0.2,{line}" for line in lines)]
    (tmp_path / "of_paraview.csv").write_text("\n".join(of_paraview), encoding="utf-8")
    for name in ("a.vtp", "a.mrk.json", "a.csv", "bare.csv", "of_paraview.csv"):
        np.testing.assert_allclose(read_curve(tmp_path / name).points_mm, points, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize(
    ("said", "turned", "factor"),
    [("# space: RAS", -1, 1), ("# space: LPS\n# unit: m", 1, 1000), ("# unit: cm\n# space: RAS", -1, 10)],
)
def test_a_table_says_its_space_and_unit(tmp_path, said, turned, factor):
    """As wires of other simulators do: a traced curve in RAS was taken for LPS, 20 mm beside the vessel."""
    points = np.array([[1.0, 2, 3], [4, 5, 6], [7, 8, 10]])
    lines = [",".join(map(str, p)) for p in points]
    (tmp_path / "a.csv").write_text("\n".join([said, "x,y,z", *lines]), encoding="utf-8")
    np.testing.assert_allclose(read_curve(tmp_path / "a.csv").points_mm, points * factor * [turned, turned, 1])


@pytest.mark.parametrize(
    ("unit", "factor"),
    [
        ("in", 25.4),
        ("Micrometre", 1e-3),
        ("micrometers", 1e-3),
        ("centimeters", 10.0),
        ("millimetres", 1.0),
        ("in mm", 1.0),
    ],
)
def test_units_are_known_by_their_usual_spellings(tmp_path: Path, unit: str, factor: float) -> None:
    """Of these "in" and most with -metre were refused; "in mm" is no inch."""
    (tmp_path / "a.csv").write_text(f"# space: LPS\n# unit: {unit}\nx,y,z\n1,2,3\n4,5,6\n", encoding="utf-8")
    (read,) = read_wires([Source(tmp_path / "a.csv")], 1)
    assert read.problem == ""
    np.testing.assert_allclose(read.points_mm, factor * np.array([[1, 2, 3], [4, 5, 6]]))


BOM = "\N{ZERO WIDTH NO-BREAK SPACE}"
LONG = "# made by a program that says much of itself\n" * 200


@pytest.mark.parametrize(
    "text",
    [
        f"{BOM}# space: RAS\nx_mm,y_mm,z_mm\n{{}}",
        '"# space: RAS"\nx_mm,y_mm,z_mm\n{}',
        f"{LONG}# space: RAS\nx_mm,y_mm,z_mm\n{{}}",
        "x_mm,y_mm,z_mm\n{}\n# space: RAS\n",
        "# coordinate system: RAS\nx_mm,y_mm,z_mm\n{}",
        "# space = right-anterior-superior\nx_mm,y_mm,z_mm\n{}",
        '"# space: RAS, as of 3D Slicer"\n"x_mm","y_mm","z_mm"\n{}',
        "# free space: 1.5 mm\n# space: RAS\nx_mm,y_mm,z_mm\n{}",
    ],
)
def test_a_stated_ras_is_seen_wherever_and_however_it_stands(tmp_path: Path, text: str) -> None:
    """It was dropped without a word, and the wire scored as LPS."""
    (tmp_path / "a.csv").write_text(text.format("1,2,3\n4,5,6\n7,8,10"), encoding="utf-8")
    turned = [[-1.0, -2, 3], [-4, -5, 6], [-7, -8, 10]]
    np.testing.assert_allclose(read_curve(tmp_path / "a.csv").points_mm, turned)
    (read,) = read_wires([Source(tmp_path / "a.csv")], 1)
    np.testing.assert_allclose(read.points_mm, turned)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("# RAS", "a line speaks of RAS"),
        ("# frame: RAS mm", "write it so"),
        ("# axes go to right, anterior, superior (right-anterior)", "a line speaks of RAS"),
        ("# space: LAS", "got space LAS; expected LPS or RAS"),
        ("# space: RAS\n# coordinate system = LPS", "got LPS and RAS in the comments"),
    ],
)
def test_what_speaks_of_ras_and_does_not_state_it_is_refused(tmp_path: Path, line: str, said: str) -> None:
    for text in (f"{line}\nx_mm,y_mm,z_mm\n1,2,3\n4,5,6\n", f"x_mm,y_mm,z_mm\n1,2,3\n4,5,6\n{line}\n"):
        (tmp_path / "a.csv").write_text(text, encoding="utf-8")
        with pytest.raises(LoadError, match=said):
            read_curve(tmp_path / "a.csv")
        with pytest.raises(LoadError, match=said):
            read_wires([Source(tmp_path / "a.csv")], 1)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("# units are metres", "a line speaks of a unit"),
        ("# in cm", "a line speaks of a unit"),
        ("# inches", "a line speaks of a unit"),
        ("#  m ", "a line speaks of a unit"),
        ("# points of the wire [cm]", "a line speaks of a unit"),
        ("# the wire (phantom m)", ""),
        ("# values are in mm", ""),
        ("# made in mania", ""),
        ("# voxel indices", "a line that speaks of voxels"),
        ("# counted in voxels", "a line that speaks of voxels"),
        ("# voxel size 0.4 mm", ""),
        ("# points in pixel space", "a line that speaks of voxels"),
        ("# in voxels of 0.3 mm", "a line that speaks of voxels"),
        ("# in voxels, radius in mm", "a line that speaks of voxels"),
        ("# lengths are in m.", "a line speaks of a unit"),
        ("# lengths are in \u00b5m", "a line speaks of a unit"),
        ("# coordinates in mm (LPS), resampled from ijk", ""),
        ("# LPS, from voxel indices", ""),
        ("# created in voxel mode", ""),
        ("# smoothed in pixel space before export", ""),
        ("# root is m1", ""),
        ("# the artery is m. cerebri media, in mm", ""),
    ],
)
def test_a_table_without_units_that_speaks_of_some_is_refused(tmp_path: Path, line: str, said: str) -> None:
    """Metres and voxels were taken for LPS mm; columns x_mm, y_mm, z_mm say what they are."""
    (tmp_path / "a.csv").write_text(f"{line}\nx,y,z\n1,2,3\n4,5,6\n", encoding="utf-8")
    with pytest.raises(LoadError, match=said) if said else nullcontext():
        read_curve(tmp_path / "a.csv")
    (tmp_path / "b.csv").write_text(f"{line}\nx_mm,y_mm,z_mm\n1,2,3\n4,5,6\n", encoding="utf-8")
    assert len(read_curve(tmp_path / "b.csv").points_mm) == 2


@pytest.mark.parametrize("name", ["frame", "wire_id", "Frame_Index"])
def test_a_table_of_several_wires_is_refused(tmp_path: Path, name: str) -> None:
    """Its points were taken for one wire, which went back to the entry with every frame."""
    rows = [(frame, x) for frame in (3, 4) for x in range(3)]
    (tmp_path / "a.csv").write_text(f"{name},x,y,z\n" + "".join(f"{f},{x},0,0\n" for f, x in rows), encoding="utf-8")
    with pytest.raises(LoadError, match=rf"got 2 wires, by its column {name.lower()} \(3, 4\); expected the points"):
        read_curve(tmp_path / "a.csv")
    # one frame, and numbers of points
    for each in ([7] * 6, range(6)):
        text = "".join(f"{f},{x},0,0\n" for f, x in zip(each, range(6), strict=True))
        (tmp_path / "b.csv").write_text(f"{name},x,y,z\n{text}", encoding="utf-8")
        assert len(read_curve(tmp_path / "b.csv").points_mm) == 6


@pytest.mark.parametrize(
    ("comment", "factors"), [("# space: RAS", (-1, -1, 1, 1)), ("# unit: cm", (10, 10, 10, 10)), ("# of a liver", 1)]
)
def test_a_tree_says_its_space_and_unit(tmp_path: Path, comment: str, factors: ArrayLike) -> None:
    """A vessel in RAS was read as LPS, and frames were ok in its mirror image."""
    (tmp_path / "a.swc").write_text(f"{comment}\n3 1 1 2 3 0.5 -1\n1 1 4 5 6 0.4 3\n", encoding="utf-8")
    lumen = read_lumen(tmp_path / "a.swc", 1)
    assert isinstance(lumen, Branches)
    found = [*lumen.start_mm[0], lumen.start_radius_mm[0]], [*lumen.end_mm[0], lumen.end_radius_mm[0]]
    np.testing.assert_allclose(found, np.array([[1, 2, 3, 0.5], [4, 5, 6, 0.4]]) * factors)


def test_a_root_whose_parent_is_0_is_a_root(tmp_path: Path) -> None:
    """Where nodes are counted from 1; it was refused as a node that is missing."""
    (tmp_path / "a.swc").write_text("1 2 0 0 0 1 0\n2 2 0 0 9 1 1\n", encoding="utf-8")
    lumen = read_lumen(tmp_path / "a.swc", 1)
    assert isinstance(lumen, Branches)
    np.testing.assert_allclose([lumen.start_mm[0], lumen.end_mm[0]], [[0, 0, 0], [0, 0, 9]])


@pytest.mark.parametrize(("stated", "of_radii", "factor"), [("cm", "cm", 10), ("cm", "", 10), ("mm", "cm", 1)])
def test_radii_are_in_the_unit_that_is_stated(tmp_path: Path, stated: str, of_radii: str, factor: float) -> None:
    """Positions in cm were scaled and radii left as they were."""
    points = [{"position": [0, 0, z]} for z in (0, 5)]
    radii = {"name": "Radius", "units": of_radii, "controlPointValues": [0.2, 0.3]}
    markup = {"type": "Curve", "coordinateUnits": stated, "controlPoints": points, "measurements": [radii]}
    (tmp_path / "a.mrk.json").write_text(json.dumps({"markups": [markup]}), encoding="utf-8")
    lumen = read_lumen(tmp_path / "a.mrk.json", 1)
    assert isinstance(lumen, Branches)
    assert (lumen.end_mm[0, 2], lumen.end_radius_mm[0]) == (5 * factor, 3.0)


@pytest.mark.parametrize("kind", ["ClosedCurve", "Plane", "Angle", "ROI"])
def test_a_markup_that_is_no_open_curve_is_no_wire(tmp_path: Path, kind: str) -> None:
    points = [{"position": [0, 0, z]} for z in range(4)]
    (tmp_path / "a.mrk.json").write_text(json.dumps({"markups": [{"type": kind, "controlPoints": points}]}))
    with pytest.raises(LoadError, match=f"a markup of type '{kind}'"):
        read_curve(tmp_path / "a.mrk.json")


def test_a_small_file_takes_no_memory_for_the_longest(tmp_path: Path) -> None:
    """Of a file of three bytes 256 MiB were asked for, a MemoryError under a limit of memory."""
    (tmp_path / "a").write_bytes(b"abc")
    tracemalloc.start()
    assert read_bytes(tmp_path / "a", 2**26) == b"abc"
    assert tracemalloc.get_traced_memory()[1] < 2**20
    tracemalloc.stop()


def test_one_table_of_all_frames_is_told_how_to_be_split(tmp_path: Path) -> None:
    """ "got 1 files, all.csv to all.csv, for 6 frames"."""
    with pytest.raises(LoadError, match=r"one table, all\.csv, for 6 frames: .* into wire_000\.csv to wire_005\.csv"):
        read_wires([Source(tmp_path / "all.csv")], 6)


@pytest.mark.parametrize("unit", ["m", "cm"])
def test_columns_in_metres_are_not_to_be_renamed_to_mm(tmp_path: Path, unit: str) -> None:
    text = f"x_{unit},y_{unit},z_{unit}\n1,2,3\n4,5,6\n"
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    with pytest.raises(LoadError, match=f"columns in {unit}; expected x, y, z; .* '# unit: {unit}' above") as told:
        read_curve(tmp_path / "a.csv")
    assert "_mm" not in str(told.value)


@pytest.mark.parametrize("head", [f"{BOM}x_mm,y_mm,z_mm", '"x_mm","y_mm","z_mm"'])
def test_names_of_columns_say_lps_and_mm_as_excel_writes_them(tmp_path: Path, head: str) -> None:
    """Both were refused as wires of which nobody says the space."""
    (tmp_path / "a.csv").write_text(f"{head}\r\n1,2,3\r\n4,5,6\r\n", encoding="utf-8")
    (read,) = read_wires([Source(tmp_path / "a.csv")], 1)
    assert (read.problem, read.unit) == ("", "mm")
    np.testing.assert_allclose(read.points_mm, [[1, 2, 3], [4, 5, 6]])


@pytest.mark.parametrize(
    "text",
    [
        "",
        "x_mm,y_mm,z_mm\n1,2,3",
        "x_mm,y_mm,z_mm,x_mm\n1,2,3,4\n5,6,7,8",
        "a,b\n1,2",
        "1,2,nan\n3,4,5",
        "# unit: foot\nx,y,z\n1,2,3\n4,5,6",
    ],
)
def test_a_curve_that_is_none_is_refused(tmp_path, text):
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    with pytest.raises(LoadError, match=r"expected|allowed"):
        read_curve(tmp_path / "a.csv")


def test_ascii_and_compressed_vtp(tmp_path):
    import base64
    import zlib

    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 2, 0]])
    cells = "<Lines><DataArray type='Int64' Name='connectivity' format='ascii'>0 1 2</DataArray>"
    cells += "<DataArray type='Int64' Name='offsets' format='ascii'>3</DataArray></Lines>"
    ascii_points = f"format='ascii'>{' '.join(map(str, points.ravel()))}"
    raw = points.astype("<f4").tobytes()
    squeezed = zlib.compress(raw)
    header = struct.pack("<4I", 1, len(raw), 0, len(squeezed))
    packed = f"format='binary'>{(base64.b64encode(header) + base64.b64encode(squeezed)).decode()}"
    for name, kind, body, extra in (
        ("a.vtp", "Float64", ascii_points, ""),
        ("z.vtp", "Float32", packed, "compressor='vtkZLibDataCompressor' header_type='UInt32'"),
    ):
        text = f"<VTKFile type='PolyData' byte_order='LittleEndian' {extra}><PolyData><Piece><Points>"
        text += f"<DataArray type='{kind}' Name='p' NumberOfComponents='3' {body}</DataArray></Points>{cells}"
        (tmp_path / name).write_text(text + "</Piece></PolyData></VTKFile>", encoding="utf-8")
        np.testing.assert_allclose(read_curve(tmp_path / name).points_mm, points)


def test_the_distance_to_a_surface_of_large_triangles_is_that_to_the_solid_it_encloses():
    """A brick of twelve triangles, turned: its distance is known, and every triangle of it is many voxels wide."""
    half, turn = np.array([3.0, 2.0, 4.0]), Rotation.from_rotvec([0.3, -0.5, 0.2]).as_matrix()
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    found = given_lumen(Shapes(corners @ turn.T + 7.0, triangles), SegmentConfig()).distance
    index = np.stack(np.meshgrid(*(np.arange(n) for n in found.shape), indexing="ij"), axis=-1)
    away = np.abs((index * found.spacing_mm + found.origin_mm - 7.0) @ turn) - half
    exact = np.linalg.norm(np.maximum(away, 0.0), axis=-1) + np.minimum(away.max(axis=-1), 0.0)
    near = np.abs(exact) < 1.5
    # a spline of the distance rounds the edges, a tenth of a voxel here; a triangle that is missed leaves voxels
    np.testing.assert_allclose(found.values[near], exact[near], rtol=0.0, atol=0.05)


READERS: dict[str, Callable[[Path], object]] = {
    "manifest": read_manifest, "parameters": read_parameters, "settings": read_settings, "tolerance": load_tolerance,
    "projections": lambda path: read_views(path, None), "truth": lambda path: read_truth(path, None),
    "record": read_json,
}  # fmt: skip
DAMAGED = {
    "pipe": "this is a pipe (FIFO)", "folder": "this is a folder", "empty": "the file is empty",
    "not UTF-8": "not UTF-8 text", "deep": "more than 50 deep", "less deep": "more than 50 deep",
    "5,000 digits": "of more than 300 digits", "400 digits": "of more than 300 digits", "neither": "",
}  # fmt: skip


@pytest.mark.parametrize("what", READERS)
@pytest.mark.parametrize("how", DAMAGED)
def test_a_small_text_may_be_anything(tmp_path, what, how):
    """They blocked on a pipe, and ended in errors of Python's own or in its words alone."""
    path, json_too = tmp_path / "file", what in ("projections", "truth", "record")
    nested = {"deep": 50_000, "less deep": 200}.get(how, 0)
    number = "9" * {"5,000 digits": 5000, "400 digits": 400}.get(how, 1)
    value = "[" * nested + number + "]" * nested
    text = (f'{{"frames": {value}}}' if json_too else f"schema = {value}").encode()
    if how == "pipe":
        os.mkfifo(path)
    elif how == "folder":
        path.mkdir()
    else:
        path.write_bytes({"empty": b"", "not UTF-8": b"\xff", "neither": b"[[["}.get(how, text))
    with pytest.raises((LoadError, InputError, UnreadableError)) as caught:
        READERS[what](path)
    assert str(caught.value).startswith(f"{path}")
    assert DAMAGED[how] in str(caught.value)
    assert not re.search(r"Error|codec|set_int|Expecting|\(char", str(caught.value))


@pytest.mark.parametrize("value", ["[" * 50_000 + "]" * 50_000, "9" * 5000], ids=["deep", "long"])
def test_a_setting_on_the_command_line_may_be_anything(value):
    with pytest.raises(SettingsError, match=r"budget\.seed: (lists or tables|a whole number of) more than"):
        parse_assignment(f"budget.seed={value}")


@pytest.mark.parametrize("ending", [".csv", ".vtk", ".vtp", ".mrk.json"])
def test_wires_that_are_pipes_are_called_so(tmp_path, ending):
    """They were empty, or not there; that of a .vtk blocked."""
    os.mkfifo(tmp_path / f"f{ending}")
    (found,) = read_wires([Source(tmp_path / f"f{ending}")], 1, "LPS", "mm")
    assert "this is a pipe (FIFO)" in found.problem
