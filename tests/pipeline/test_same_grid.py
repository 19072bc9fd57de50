"""Scans that do not lie on one grid: the odd one is named, and each is not told anew."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk

from pipeline.load import Crop, Header, Scans, Source, load, read_headers
from pipeline.load.common import on_common_box
from pipeline.load.config import LoadConfig
from pipeline.study.same_grid import apart


def scan(name: str, origin_mm: float = 0.0) -> Header:
    return Header(Source(Path(name)), (9, 9, 9), np.full(3, 0.5), np.full(3, origin_mm), np.eye(3), "int16")


@pytest.mark.parametrize("count", [1, 3])
def test_scans_on_one_grid_are_no_problem(count: int) -> None:
    assert apart([scan(str(n)) for n in range(count)]) == []


def test_a_first_scan_that_differs_from_all_others_is_the_odd_one() -> None:
    """A reference on another grid, or a label map in a folder of scans, was told once for each of thirty frames."""
    (said,) = apart([scan("reference.mha", 7.0), *(scan(f"{n}.mha") for n in range(5))])
    assert said.startswith("reference.mha is the odd one of 6 scans, the others lie on one grid; is it one of them?")
    assert said.count("geometry differs") == 1


def test_one_frame_on_another_grid_is_told_by_itself() -> None:
    (said,) = apart([scan("reference.mha"), scan("0.mha"), scan("1.mha", 7.0)])
    assert said.startswith("geometry differs between scans of one case")
    assert "1.mha" in said


def test_many_grids_are_one_problem() -> None:
    other = replace(scan("2.mha"), shape=(8, 9, 9))
    (said,) = apart([scan("reference.mha"), scan("0.mha"), scan("1.mha", 7.0), other])
    assert said.endswith("Of 4 scans 1 more differ from the first.")


def crop(name: str, begins: tuple[int, int, int], shape: tuple[int, int, int], **otherwise: object) -> Header:
    """A box of a grid of half a millimetre, turned about z."""
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    origin = turn @ (0.5 * np.array(begins)) + [3.0, -2.0, 7.0]
    return replace(Header(Source(Path(name)), shape, np.full(3, 0.5), origin, turn, "int16"), **otherwise)


def test_crops_of_one_grid_are_read_in_the_box_that_all_show() -> None:
    """They were refused, with the advice to make two cases of them."""
    scans = [crop("reference.mha", (0, 0, 0), (20, 20, 20)), crop("0.mha", (3, -2, 1), (16, 20, 18))]
    found = on_common_box(scans)
    assert apart(found) == []
    assert [header.shape for header in found] == [(16, 18, 18)] * 2
    assert [header.first for header in found] == [(3, 0, 1), (0, 2, 0)]
    np.testing.assert_allclose(found[0].origin_mm, found[1].origin_mm, rtol=0.0, atol=1e-9)
    (said,) = Scans(found[0], (found[1],)).assumed
    assert "cut out of one grid, each otherwise: of all are read the [16, 18, 18] voxels" in said
    assert "reference.mha has [20, 20, 20]" in said
    assert found[0].assumed == (), "no header was completed"
    between = crop("1.mha", (3, -2, 1), (16, 20, 18), origin_mm=np.full(3, 0.2))
    assert "1.mha" in apart([*scans, between])[0], "the one that is no crop is named, not the first that differs"


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (crop("1.mha", (3, -2, 1), (16, 20, 18), spacing_mm=np.full(3, 0.45)), "and so do the spacings, [0.5"),
        (crop("1.mha", (3, -2, 1), (16, 20, 18), direction=np.eye(3)), "the axes are turned by 37 degrees"),
        (crop("1.mha", (3, -2, 1), (16, 20, 18), origin_mm=np.zeros(3)), "the second begins at voxel ["),
        (crop("1.mha", (15, 0, 0), (19, 20, 20)), "the second begins at voxel [15.0, 0.0, 0.0] of the first"),
    ],
    ids=["another spacing", "turned", "between voxels", "hardly in common"],
)
def test_scans_of_other_shapes_that_are_no_crops_are_told_in_what_they_differ(other: Header, said: str) -> None:
    scans = [crop("reference.mha", (0, 0, 0), (20, 20, 20)), other]
    assert on_common_box(scans) == scans
    (told,) = apart(scans)
    assert "the shapes differ, [20, 20, 20] and [" in told
    assert said in told
    assert "sitk.Resample(scan, other)" in told


def test_an_origin_that_is_off_by_whole_voxels_is_no_crop() -> None:
    scans = [crop("reference.mha", (0, 0, 0), (20, 20, 20)), crop("0.mha", (2, 0, 0), (20, 20, 20))]
    assert on_common_box(scans) == scans
    assert "voxels apart, allowed 0.5" in apart(scans)[0]


def test_an_origin_that_a_conversion_lost_is_to_be_copied() -> None:
    """To resample such a scan onto the reference's grid was advised, which moves it out of the picture."""
    reference = crop("reference.mha", (0, 0, 0), (20, 20, 20))
    lost = crop("0.mha", (0, 0, 0), (20, 20, 20), origin_mm=np.zeros(3))
    (told,) = apart([reference, lost])
    assert "0.mha lies at the origin, as where a conversion lost the place" in told
    assert told.index("CopyInformation") < told.index("sitk.Resample")
    moved = crop("0.mha", (5, 0, 0), (20, 20, 20))
    assert "CopyInformation" not in apart([reference, moved])[0]


def test_a_crop_holds_the_voxels_that_its_file_has_there(tmp_path: Path) -> None:
    grey = np.arange(12 * 10 * 8, dtype=np.int16).reshape(8, 10, 12)  # z, y, x
    whole = sitk.GetImageFromArray(grey)
    whole.SetSpacing((0.4, 0.5, 0.6))
    sitk.WriteImage(whole, str(tmp_path / "reference.mha"))
    sitk.WriteImage(whole[2:12, 1:10, 0:7], str(tmp_path / "0.nrrd"))
    sources = [Source(tmp_path / name) for name in ("reference.mha", "0.nrrd")]
    scans = read_headers(sources[0], sources[1:], LoadConfig())
    assert scans.reference is not None
    read = [load(header).values for header in scans.all]
    np.testing.assert_array_equal(read[0], read[1])
    np.testing.assert_array_equal(read[0], grey.transpose(2, 1, 0)[2:12, 1:10, 0:7])
    part = Crop(scans.reference, ((1, 2, 3), (5, 6, 7))).load()
    np.testing.assert_array_equal(part.values, read[0][1:5, 2:6, 3:7])
    np.testing.assert_allclose(part.origin_mm, [0.4 * 3, 0.5 * 3, 0.6 * 3])
