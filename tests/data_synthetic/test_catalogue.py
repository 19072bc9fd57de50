"""Every scene builds small, its files say what its arrays say, and its truth is sound."""

from __future__ import annotations

import json
import tomllib
from collections import Counter
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk
from PIL import Image

from data_synthetic import catalogue
from data_synthetic.catalogue.study import Study
from data_synthetic.write import FORMATS, write_study
from tests.studies import catalogue_page

SMALL = {"frames": 2, "size": 40, "truth_step_mm": 0.8}


@pytest.fixture(scope="module")
def study() -> Study:
    return catalogue.build("bend", frames=2, size=48, truth_step_mm=0.4)


def as_array(image: sitk.Image) -> np.ndarray:
    return sitk.GetArrayFromImage(image).transpose(2, 1, 0)


@pytest.mark.parametrize("name", catalogue.names())
def test_scene_says_why(name: str) -> None:
    scene = catalogue.describe(name)
    assert 10 < len(scene.why) < 120
    assert len(scene.expected_statuses(5)) == 5


def test_unknown_scene_names_the_known_ones() -> None:
    with pytest.raises(KeyError, match="allowed: straight, bend"):
        catalogue.describe("strait")


def test_same_seed_same_study_other_seed_other_anatomy() -> None:
    a, b, c = (catalogue.build("bend", frames=1, size=32, truth_step_mm=0.8, seed=s) for s in (1, 1, 2))
    np.testing.assert_array_equal(a.frame(0), b.frame(0))
    assert a.manifest == b.manifest
    assert a.manifest["case"]["entry_mm"] != c.manifest["case"]["entry_mm"]


def test_manifest_is_wrong_by_as_much_as_it_should_be(study: Study) -> None:
    case = study.manifest["case"]
    entry, direction = np.array(case["entry_mm"]), np.array(case["entry_direction"])
    offset = np.linalg.norm(entry - study.setup.entry_mm)
    assert offset == pytest.approx(0.5 * study.grid.voxel_mm, abs=1e-3)
    assert np.degrees(np.arccos(direction @ study.setup.direction)) == pytest.approx(2.0, abs=1e-3)
    assert abs(np.dot(case["material_axis"], direction)) < 1e-5
    error = np.array(case["insertion_mm"]) - [f.depth_mm for f in study.truth]
    assert 0 < np.max(np.abs(error)) < 1.0


def test_wire_is_where_the_truth_says(study: Study) -> None:
    added = study.frame(1).astype(float) - study.reference
    points = study.truth[1].points_mm
    index = np.rint(study.grid.to_index(points)).astype(int)
    assert np.median(added[tuple(index.T)]) > 5 * added[:4].std()


@pytest.mark.parametrize("format_", FORMATS)
def test_files_read_back_identically(study: Study, format_: str, tmp_path: Path) -> None:
    manifest_path = write_study(study, tmp_path, format=format_)
    case = tomllib.loads(manifest_path.read_text(encoding="utf-8"))["case"][0]
    for i, image in enumerate(read_frames(tmp_path, case["frames"])):
        np.testing.assert_array_equal(as_array(image), study.frame(i))
        np.testing.assert_allclose(image.GetSpacing(), study.grid.spacing_mm, rtol=1e-6)
        np.testing.assert_allclose(image.GetOrigin(), study.grid.origin_mm, rtol=0.0, atol=1e-4)
        np.testing.assert_allclose(np.reshape(image.GetDirection(), (3, 3)), study.grid.direction, rtol=0.0, atol=1e-6)
    truth = json.loads((tmp_path / case["truth"]).read_text(encoding="utf-8"))
    assert len(truth["frames"]) == 2
    np.testing.assert_allclose(truth["frames"][1]["points_mm"], study.truth[1].points_mm, rtol=0.0, atol=1e-6)


@pytest.mark.quick(2)
@pytest.mark.parametrize("format_", FORMATS)
def test_oblique_anisotropic_geometry_reads_back(study: Study, format_: str, tmp_path: Path) -> None:
    turned = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turned *= np.sign(np.linalg.det(turned))
    grid = replace(study.grid, spacing_mm=np.array([0.4, 0.55, 0.9]), direction=turned)
    manifest = write_study(replace(study, grid=grid), tmp_path, format=format_)
    case = tomllib.loads(manifest.read_text(encoding="utf-8"))["case"][0]
    corner = np.array(grid.shape) - 1
    for i, image in enumerate(read_frames(tmp_path, case["frames"])):
        np.testing.assert_array_equal(as_array(image), study.frame(i))
        there = image.TransformContinuousIndexToPhysicalPoint(corner.astype(float).tolist())
        np.testing.assert_allclose(there, grid.to_mm(corner), rtol=0.0, atol=1e-3)


def read_frames(folder: Path, frames: str | list[str]) -> list[sitk.Image]:
    if isinstance(frames, list):
        return [read_series(folder / f) for f in frames]
    if frames.startswith("study.h5"):
        return read_hdf5(folder / "study.h5")
    return [sitk.ReadImage(str(p)) for p in sorted(folder.glob(frames))]


def read_series(folder: Path) -> sitk.Image:
    reader = sitk.ImageSeriesReader()
    reader.SetFileNames(reader.GetGDCMSeriesFileNames(str(folder)))
    return reader.Execute()


def read_hdf5(path: Path) -> list[sitk.Image]:
    import h5py

    images = []
    with h5py.File(path) as file:
        for data in file["frames"].values():
            image = sitk.GetImageFromArray(np.ascontiguousarray(data[()].transpose(2, 1, 0)))
            image.SetSpacing(data.attrs["spacing_mm"].tolist())
            image.SetOrigin(data.attrs["origin_mm"].tolist())
            image.SetDirection(data.attrs["direction"].ravel().tolist())
            images.append(image)
    return images


def test_unknown_format_is_refused(study: Study, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="allowed: mha"):
        write_study(study, tmp_path, format="tiff")


def test_every_scene_tries_something_and_every_stage_is_tried() -> None:
    tried = [catalogue.describe(name).tries for name in catalogue.names()]
    assert all(tried)
    times = Counter(chain.from_iterable(tried))
    assert set(times) == {"load", "segment", "trace", "simulate", "compare", "report"}
    assert min(times.values()) >= 3, times


def test_the_page_of_the_catalogue_is_up_to_date() -> None:
    assert catalogue_page.PAGE.read_text(encoding="utf-8") == catalogue_page.page(), (
        "python -m tests.studies.catalogue_page"
    )
    for name in catalogue.names():
        with Image.open(catalogue_page.PICTURES / f"{name}.png") as picture:
            assert max(picture.size) == catalogue_page.EDGE
            assert len(set(picture.convert("L").tobytes())) > 20, "not a blank picture"


@pytest.mark.quick(2)
@pytest.mark.parametrize("name", ["helix", "two-wires", "moved-phantom", "anisotropic", "oblique", "stenosis"])
def test_scene_builds_small_with_a_sound_truth(name: str) -> None:
    study = catalogue.build(name, **SMALL)
    assert study.quality["largest_residual_N"] < 1e-7
    assert study.quality["node_spacing_mm"] == pytest.approx(min(SMALL["truth_step_mm"], study.truth[0].depth_mm / 8))
    assert study.frame(1).shape == study.reference.shape == study.grid.shape
    assert len(study.expected) == 2
    lengths = [np.linalg.norm(np.diff(f.points_mm, axis=0), axis=1).sum() for f in study.truth]
    np.testing.assert_allclose(lengths, [f.depth_mm for f in study.truth], rtol=0.0, atol=2e-3)
