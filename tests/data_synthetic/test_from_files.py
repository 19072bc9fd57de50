"""Anatomies and backgrounds from files: small ones written here, real ones where the data is."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

from data_synthetic.anatomy import shapes
from data_synthetic.anatomy.centrelines import Tree, read_tree
from data_synthetic.anatomy.from_tree import smooth_tube, way_through, widest_path
from data_synthetic.anatomy.iso_wall import iso_wall
from data_synthetic.anatomy.tubes import Anatomy, ball
from data_synthetic.anatomy.vessel_in_scan import find_vessel, find_way
from data_synthetic.catalogue import background_scene, build, from_anatomy
from data_synthetic.catalogue.scene import name_after
from data_synthetic.geometry import ScanGrid, arc_lengths, at_arc, voxels_near
from data_synthetic.scanner.coverage import lumen_coverage
from data_synthetic.write import alone, earlier_files
from data_synthetic.write.volumes import to_image
from tests.data_synthetic.grids import centred_grid

Z = np.linspace(0.0, 45.0, 25)
TRUNK = np.column_stack([3 * np.sin(Z / 15), 0.02 * Z**2, Z])


def test_voxels_near_points_are_those_within_their_radii() -> None:
    """Up to the grid's faces, which balls may reach beyond, and with voxels that are no cubes."""
    grid = ScanGrid((9, 8, 7), np.array([0.5, 0.7, 1.1]), np.zeros(3), np.eye(3))
    points, radii = np.array([[0.2, 0.3, 6.1], [4.0, 7.0, 3.0]]), np.array([1.6, 1.2])
    every = np.argwhere(np.ones(grid.shape, bool))
    away = np.linalg.norm((every[:, None] - points) * grid.spacing_mm, axis=-1)
    np.testing.assert_array_equal(voxels_near(points, radii, grid), every[(away <= radii).any(axis=1)])


def write_swc(path: Path, jitter: float = 0.0) -> None:
    """A trunk with one branch, its points jittered as tracings are; one edge too long to be real."""
    rng = np.random.default_rng(0)
    points = TRUNK + rng.normal(0, jitter, TRUNK.shape)
    branch = TRUNK[12] + np.linspace(1.5, 15, 10)[:, None] * [1.0, 0.0, 0.3]
    lines = ["# made here"]
    lines += [f"{i + 1} 3 {p[0]} {p[1]} {p[2]} 1.6 {i or -1}" for i, p in enumerate(points)]
    lines += [f"{i + 26} 3 {p[0]} {p[1]} {p[2]} 0.9 {13 if i == 0 else i + 25}" for i, p in enumerate(branch)]
    lines.append("36 3 80 0 0 1.0 25")
    path.write_text("\n".join(lines), encoding="utf-8")


def write_curve(path: Path, system: str = "LPS", radii: bool = True) -> None:
    sign = [-1, -1, 1] if system == "RAS" else [1, 1, 1]
    points = [{"position": (p * sign).tolist()} for p in TRUNK]
    measured = [{"name": "Radius", "controlPointValues": [1.5] * len(TRUNK)}] if radii else []
    markup = {"coordinateSystem": system, "controlPoints": points, "measurements": measured}
    path.write_text(json.dumps({"markups": [markup]}), encoding="utf-8")


def test_swc_becomes_a_smooth_way_with_its_branch(tmp_path: Path) -> None:
    write_swc(tmp_path / "tree.swc", jitter=0.15)
    way = way_through(read_tree(tmp_path / "tree.swc"))
    tube = way.tubes[0]
    away = [np.min(np.linalg.norm(TRUNK - p, axis=1)) for p in tube.points_mm[20:-20:10]]
    assert np.median(away) < 1.0  # TRUNK's own points are 1.9 mm apart
    assert len(way.tubes) == 2
    assert 55 < tube.length_mm < 70  # the long edge was cut
    assert way.distance([TRUNK[12] + [8.0, 0.0, 2.4]])[0] < 0  # within the branch


@pytest.mark.parametrize("system", ["LPS", "RAS"])
def test_slicer_curves_are_read_in_lps(tmp_path: Path, system: str) -> None:
    write_curve(tmp_path / "a.mrk.json", system)
    tree = read_tree(tmp_path / "a.mrk.json")
    np.testing.assert_allclose(tree.points_mm, TRUNK, rtol=0.0, atol=1e-9)


def test_bad_anatomies_are_refused_by_name(tmp_path: Path) -> None:
    write_curve(tmp_path / "a.mrk.json", radii=False)
    with pytest.raises(ValueError, match="no Radius measurement"):
        read_tree(tmp_path / "a.mrk.json")
    with pytest.raises(ValueError, match=r"allowed: \.swc"):
        read_tree(tmp_path / "a.stl")
    (tmp_path / "b.swc").write_text("1 2 3\n", encoding="utf-8")
    with pytest.raises(ValueError, match="7"):
        read_tree(tmp_path / "b.swc")


@pytest.mark.parametrize(
    "text",
    [
        "", "[1]", '{"markups": [{"controlPoints": 5}]}', '{"a":' * 50_000 + "1" + "}" * 50_000, '{"markups": 5}',
        '{"markups": [{"controlPoints": [{"position": [1, 2]}]}]}', f'{{"markups": {"9" * 5000}}}',
        f'{{"markups": [{{"controlPoints": [{{"position": [1, 2, 1{"0" * 400}]}}]}}]}}',
        '{"markups": [{"controlPoints": [{"position": [1, 2, 3]}], "measurements": [5]}]}',
    ],
    ids=range(9),
)  # fmt: skip
def test_markups_that_are_none_are_refused(tmp_path: Path, text: str) -> None:
    """Errors of Python's own, or its words alone."""
    (tmp_path / "a.mrk.json").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=r"a\.mrk\.json: cannot be read; allowed: a 3D Slicer markups file"):
        read_tree(tmp_path / "a.mrk.json")


def test_an_earlier_study_may_be_anything(tmp_path: Path) -> None:
    (tmp_path / "manifest.toml").write_text("case = [{}]", encoding="utf-8")
    (tmp_path / "truth.json").write_text("[" * 50_000, encoding="utf-8")
    assert earlier_files(tmp_path) == []
    (tmp_path / "manifest.toml").unlink()
    os.mkfifo(tmp_path / "manifest.toml")
    assert earlier_files(tmp_path) == []
    assert len(alone(tmp_path)) == 1


@pytest.mark.parametrize("text", ["1 0 x 0 0 1 -1", "1 0 nan 0 0 1 -1"])
def test_trees_that_are_none_are_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.swc").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=r"a\.swc: (cannot be read; allowed|got numbers that are not finite)"):
        read_tree(tmp_path / "a.swc")


def test_smoothing_keeps_ends_and_never_folds() -> None:
    rng = np.random.default_rng(1)
    points = np.cumsum(rng.normal([0, 0, 1.5], 1.0, (20, 3)), axis=0)
    tube = smooth_tube("t", points, np.full(20, 1.2))
    np.testing.assert_allclose(tube.points_mm[[0, -1]], points[[0, -1]], rtol=0.0, atol=1e-9)
    bend = np.linalg.norm(np.gradient(tube.tangents, tube.step_mm, axis=0), axis=1)
    assert np.max(bend * tube.radii_mm) < 1.0


@pytest.mark.parametrize(("jitter_mm", "least", "most"), [(0.0, 0.0, 0.05), (0.3, 0.2, 2.0)])
def test_a_smooth_centreline_is_painted_where_the_file_has_it(jitter_mm: float, least: float, most: float) -> None:
    """A bend of 12 mm radius was cut by 0.15 to 0.19 mm: a lumen given as the very file lay off the vessel by that."""
    turn = np.linspace(0.0, 2.0, 25)
    points = 12.0 * np.column_stack([1.0 - np.cos(turn), np.zeros(len(turn)), np.sin(turn)])
    points += np.random.default_rng(0).normal(0.0, jitter_mm, points.shape)
    edges = np.column_stack([np.arange(24), np.arange(1, 25)])
    way = way_through(Tree(points, np.full(25, 1.4), edges)).tubes[0].points_mm
    arc = arc_lengths(points)
    in_file = cKDTree(at_arc(np.linspace(0.0, arc[-1], 999), arc, points))
    assert least < np.max(in_file.query(way)[0]) < most


@pytest.mark.slow
def test_scene_from_a_tree_builds(tmp_path: Path) -> None:
    write_swc(tmp_path / "tree.swc")
    study = build(from_anatomy(tmp_path / "tree.swc"), frames=2, size=40, truth_step_mm=0.8)
    assert study.truth[-1].depth_mm > 20
    assert study.quality["largest_residual_N"] < 1e-7


def test_iso_wall_of_a_ball_is_its_distance() -> None:
    grid = centred_grid([1.0, -2.0, 3.0], (40, 40, 40), 0.5)
    share = lumen_coverage(Anatomy((ball("b", [1.1, -2.1, 3.05], 4.0),)), grid)
    wall = iso_wall(share, grid, 0.5)
    direction = np.random.default_rng(0).normal(size=(200, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    for radius in (3.5, 4.0, 4.6):
        value, slope = wall.distance_and_gradient([1.1, -2.1, 3.05] + radius * direction)
        np.testing.assert_allclose(
            value, radius - 4.0, rtol=0.0, atol=0.06
        )  # a tenth of a voxel: what a threshold is worth
        assert np.median(np.sum(slope * direction, axis=1)) == pytest.approx(1.0, abs=0.02)


def test_iso_wall_gradient_is_its_derivative() -> None:
    grid = centred_grid([0.0, 0, 0], (30, 30, 30), 0.5)
    wall = iso_wall(lumen_coverage(Anatomy((ball("b", [0, 0, 0], 3.0),)), grid), grid, 0.5)
    points = np.random.default_rng(3).uniform(-3, 3, (300, 3))
    slope = wall.distance_and_gradient(points)[1]
    for a in range(3):
        step = 1e-5 * np.eye(3)[a]
        change = (wall.distance_and_gradient(points + step)[0] - wall.distance_and_gradient(points - step)[0]) / 2e-5
        np.testing.assert_allclose(slope[:, a], change, rtol=0.0, atol=1e-6)


def test_wire_painted_into_a_scan_lies_in_its_vessel(tmp_path: Path) -> None:
    grid = centred_grid([0, 0, 10], (72, 48, 96), 0.5)
    scan = 200 * lumen_coverage(shapes.bend(angle_deg=50.0, turn_mm=25.0, radius_mm=1.8), grid)
    sitk.WriteImage(to_image(scan.astype(np.uint8), grid), str(tmp_path / "scan.mha"))
    study = build(background_scene(tmp_path / "scan.mha"), frames=2, truth_step_mm=0.8)
    assert study.truth[-1].depth_mm > 18
    added = study.frame(1).astype(float) - study.reference
    index = np.rint(study.grid.to_index(study.truth[1].points_mm)).astype(int)
    assert np.mean(added[tuple(index.T)]) > 5 * added[:5].std()
    assert np.all(study.reference[tuple(index.T)] > 250)  # vessel is at 1000, its wall at 500, less where pressed


@pytest.mark.slow
def test_a_vessel_is_found_beside_bone_and_above_tissue() -> None:
    """Hounsfield units: the brightest voxels are a skull's, and air is darker than what surrounds the vessel."""
    grid = centred_grid([0, 0, 10], (80, 80, 100), 0.5)
    vessel = lumen_coverage(shapes.bend(angle_deg=20.0, turn_mm=25.0, radius_mm=1.8), grid)
    x, y, _ = np.meshgrid(*(np.linspace(-1, 1, n) for n in grid.shape), indexing="ij", sparse=True)
    tissue, skull = np.hypot(x, y) < 0.9, (np.hypot(x, y) > 0.8) & (np.hypot(x, y) < 0.9)
    scan = np.where(skull, 1500.0, np.where(tissue, 40.0, -1000.0)) + 300.0 * vessel
    scan += np.random.default_rng(1).normal(scale=15.0, size=grid.shape)
    found = find_vessel(scan.astype(np.float32), grid)
    assert found.threshold == pytest.approx(190.0, abs=10.0)
    # the half level goes through voxels' middles: what is counted is the lumen's volume
    assert np.count_nonzero(found.voxels) == pytest.approx(vessel.sum(), rel=0.05)
    assert not np.any(found.voxels & skull)
    assert find_way(found.voxels, grid).length_mm > 25


@pytest.mark.slow
def test_a_vessel_is_painted_into_a_scan_that_shows_none(tmp_path: Path) -> None:
    """In voxels that are not cubes, beside something bright that is no tube."""
    rng = np.random.default_rng(2)
    scan = 500.0 + 40.0 * gaussian_filter(rng.normal(size=(70, 60, 50)), 0.8)
    scan[:, :20] += 900.0
    grid = centred_grid([5.0, 0, 10], scan.shape, 1.0)
    image = to_image(scan.astype(np.uint16), grid)
    image.SetSpacing((0.8, 0.9, 1.1))
    sitk.WriteImage(image, str(tmp_path / "gel.nii.gz"))
    scene = background_scene(tmp_path / "gel.nii.gz")
    assert "made-up vessel" in scene.why
    study = build(scene, frames=2, truth_step_mm=0.8)
    index = np.rint(study.grid.to_index(study.truth[1].points_mm)).astype(int)
    assert np.all(study.reference[tuple(index.T)] > 250)  # tissue is at 0, the vessel at 1000
    assert index[:, 1].min() > 22  # not in what is bright


def test_a_study_is_named_as_a_manifest_may_name_a_case() -> None:
    """One painted into "High quality head", written in a minute, was refused by ``run``."""
    assert name_after(Path("High quality head")) == "High-quality-head"
    assert name_after(Path("Schädel (2).nii.gz")) == "Sch-del-2"
    assert name_after(Path(".nrrd")) == "scan"


def slices_in(folder: Path, series: str, places_mm: tuple[float, ...]) -> None:
    writer = sitk.ImageFileWriter()
    for number, z_mm in enumerate(places_mm):
        image = sitk.Image(20, 20, sitk.sitkInt16)
        place = ("0020|000e", series), ("0020|0032", f"0\\0\\{z_mm}"), ("0020|0037", "1\\0\\0\\0\\1\\0")
        for key, value in (("0008|0060", "CT"), *place, ("0020|0013", str(number))):
            image.SetMetaData(key, value)
        writer.SetFileName(str(folder / f"{series}-{number}.dcm"))
        writer.KeepOriginalImageUIDOn()
        writer.Execute(image)


def test_slices_that_are_not_equally_far_apart_are_no_background(tmp_path: Path) -> None:
    """They were stacked as if they were: a sheared head."""
    slices_in(tmp_path, "1.2.3", (0.0, 1.0, 2.0, 4.5))
    with pytest.raises(ValueError, match="its slices are not equally far apart"):
        background_scene(tmp_path)


def test_a_folder_of_several_series_is_no_background_nor_one_that_holds_them_deeper(tmp_path: Path) -> None:
    """The first of several was taken; of a study's folder it was said that it "cannot be read as a volume"."""
    (tmp_path / "head").mkdir()
    with pytest.raises(ValueError, match=r"holds no DICOM series; .* does one of its folders, as head/, hold it\?"):
        background_scene(tmp_path)
    for series in ("1.2.3", "1.2.4"):
        slices_in(tmp_path / "head", series, (0.0, 1.0))
    with pytest.raises(ValueError, match="head: holds 2 DICOM series; allowed: one"):
        background_scene(tmp_path / "head")


def test_a_scan_without_room_for_a_vessel_is_refused(tmp_path: Path) -> None:
    noise = np.random.default_rng(3).normal(300.0, 20.0, (20, 20, 20)).astype(np.int16)
    sitk.WriteImage(sitk.GetImageFromArray(noise), str(tmp_path / "small.mha"))
    with pytest.raises(ValueError, match=r"small.mha: it shows no vessel, and has no room .* 19 x 19 x 19 mm"):
        background_scene(tmp_path / "small.mha")


@pytest.mark.slow
def test_wire_in_the_real_aneurysm_scan(real_data: Path, tmp_path: Path) -> None:
    import gzip

    raw = gzip.decompress((real_data / "aneurism_3dra" / "aneurism.raw.gz").read_bytes())
    values = np.frombuffer(raw, np.uint8).reshape(256, 256, 256)
    sitk.WriteImage(sitk.GetImageFromArray(values), str(tmp_path / "aneurism.mha"))
    study = build(background_scene(tmp_path / "aneurism.mha", 0.5), truth_step_mm=0.4)
    assert len(study.truth) == 12
    assert study.truth[-1].depth_mm > 60


@pytest.mark.parametrize("name", ["BG001", "BG0002", "BG05", "BG10", "BG0019"])
def test_real_trees_give_a_way(real_data: Path, name: str) -> None:
    way = way_through(read_tree(real_data / "brava_swc" / f"{name}.swc"))
    assert way.tubes[0].length_mm > 35
    inner = way.tubes[0].points_mm[8:-8]
    assert np.all(way.distance(inner) < -0.4)


@pytest.mark.parametrize("name", ["text.mha", "tiny.mha", "flat.mha"])
def test_a_background_that_is_none_is_refused(tmp_path: Path, name: str) -> None:
    """Not a traceback of SimpleITK or scipy."""
    path = tmp_path / name
    if name == "text.mha":
        path.write_text("hello", encoding="utf-8")
    else:
        sitk.WriteImage(sitk.Image([4 if name == "tiny.mha" else 20] * 3, sitk.sitkInt16), str(path))
    with pytest.raises(ValueError, match=rf"{name}: .*allowed"):
        background_scene(path)


def test_a_tree_too_wide_everywhere_has_no_way() -> None:
    """Its whole path was kept: an aorta holds no guide wire in place."""
    edges = np.column_stack([np.arange(len(TRUNK) - 1), np.arange(1, len(TRUNK))])
    with pytest.raises(ValueError, match=r"no path with radii from 3\.0 down to 0\.7 mm"):
        widest_path(Tree(TRUNK, np.full(len(TRUNK), 4.0), edges))


def test_a_jagged_centreline_is_smoothed_until_its_tube_does_not_fold_and_no_further() -> None:
    """Begun anywhere on the way there, the smoothing ends in the same tube; begun beyond, in a smoother one."""
    z = np.arange(0.0, 40.0, 1.0)
    jagged, radii = np.column_stack([1.5 * (-1.0) ** np.arange(len(z)), 8.0 * np.sin(z / 6.0), z]), np.full(len(z), 2.0)
    first, *same, beyond = (smooth_tube("v", jagged, radii, 0.8 * 1.4**n) for n in range(6))
    sharpest = [np.max(np.linalg.norm(np.gradient(t.tangents, t.step_mm, axis=0), axis=1)) for t in (first, beyond)]
    assert sharpest[1] < sharpest[0] < 1.0 / 2.0, "a tube of 2 mm folds where it bends more"
    for tube in same:
        np.testing.assert_allclose(tube.points_mm, first.points_mm, rtol=0.0, atol=1e-9)
