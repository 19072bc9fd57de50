"""Enhanced multi-frame DICOM: geometry from the frames themselves, and what is irregular refused by name."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pydicom
import pytest

from pipeline.load import LoadError, load, read_header
from pipeline.load.config import LoadConfig
from pipeline.load.slices import Pixels, grey
from tests.pipeline.enhanced_dicom import enhanced
from tests.pipeline.test_load import numbered, straight_stack
from tests.studies.formats.base import ORIGIN, SPACING


@pytest.mark.parametrize("implicit", [False, True])
@pytest.mark.parametrize("delimited", [False, True])
def test_frames_are_placed_by_their_own_positions(tmp_path: Path, implicit: bool, delimited: bool) -> None:
    """Written from the top down: SimpleITK alone gives such a file the wrong direction."""
    path = tmp_path / "scan.dcm"
    turned = numbered()[:, :, ::-1]
    path.write_bytes(enhanced(turned, SPACING, straight_stack()[::-1], implicit, delimited))
    header = read_header(path)
    assert header.item_count == 1
    np.testing.assert_allclose(header.spacing_mm, SPACING, rtol=1e-9)
    np.testing.assert_allclose(header.origin_mm, ORIGIN)
    np.testing.assert_allclose(header.direction, np.eye(3))
    np.testing.assert_array_equal(load(header).values, numbered())
    crop = load(header, ((1, 2, 3), (4, 6, 8)))
    np.testing.assert_array_equal(crop.values, numbered()[1:4, 2:6, 3:8])


def test_a_folder_with_one_multiframe_file_is_a_series(tmp_path: Path) -> None:
    (tmp_path / "series").mkdir()
    (tmp_path / "series" / "scan.dcm").write_bytes(enhanced(numbered(), SPACING, straight_stack()))
    np.testing.assert_array_equal(load(read_header(tmp_path / "series")).values, numbered())


def test_packed_frames_are_rescaled_by_their_own_slopes(tmp_path: Path) -> None:
    even = np.pad(numbered(), ((0, 3), (0, 1), (0, 0)))  # GDCM refuses tinier planes
    path = tmp_path / "scan.dcm"
    path.write_bytes(enhanced(even, SPACING, straight_stack()))
    scan = pydicom.dcmread(path)
    for k, groups in enumerate(scan.PerFrameFunctionalGroupsSequence):
        rescale = pydicom.Dataset()
        rescale.RescaleSlope, rescale.RescaleIntercept = 1 + 99 * (k > 0), -k
        groups.PixelValueTransformationSequence = [rescale]
    scan.compress(pydicom.uid.RLELossless)
    scan.save_as(path)
    want = even * (1 + 99 * (np.arange(9) > 0)) - np.arange(9)
    np.testing.assert_array_equal(load(read_header(path)).values, want)


def test_a_missing_frame_is_named_or_filled_on_request(tmp_path: Path) -> None:
    positions = straight_stack()
    path = tmp_path / "scan.dcm"
    path.write_bytes(enhanced(np.delete(numbered(), 4, axis=2), SPACING, [*positions[:4], *positions[5:]]))
    with pytest.raises(LoadError, match=r"missing slices: 1 of 7 gaps differ from 0\.700 mm .*after frame 4"):
        read_header(path)
    asked = LoadConfig(resample=True)
    header = read_header(path, asked)
    assert "missing slices" in header.assumed[0]
    np.testing.assert_allclose(load(header, None, asked).values, numbered(), rtol=0.0, atol=1e-3)  # linear along z


def test_a_tilted_multiframe_file_is_refused(tmp_path: Path) -> None:
    positions = [(x, y + 0.5 * k, z) for k, (x, y, z) in enumerate(straight_stack())]
    (tmp_path / "scan.dcm").write_bytes(enhanced(numbered(), SPACING, positions))
    with pytest.raises(LoadError, match="gantry tilt"):
        read_header(tmp_path / "scan.dcm")


def test_two_stacks_in_one_file_are_refused(tmp_path: Path) -> None:
    """Two phases at the same places: which one is meant cannot be known."""
    twice = np.concatenate([numbered(), numbered() + 1], axis=2)
    (tmp_path / "scan.dcm").write_bytes(enhanced(twice, SPACING, straight_stack() * 2))
    with pytest.raises(LoadError, match="repeated position"):
        read_header(tmp_path / "scan.dcm", LoadConfig(resample=True))


def test_a_damaged_file_is_said(tmp_path: Path) -> None:
    path = tmp_path / "scan.dcm"
    path.write_bytes(enhanced(numbered(), SPACING, straight_stack())[:-100])
    with pytest.raises(LoadError, match=r"scan\.dcm: cannot read it: the file is cut short.*is complete"):
        read_header(path)


def test_a_number_of_half_a_length_is_a_sentence(tmp_path: Path) -> None:
    """Bits allocated in three bytes: a traceback of pydicom's own kind of error."""
    path = tmp_path / "scan.dcm"
    whole = enhanced(numbered(), SPACING, straight_stack())
    head = b"\x28\x00\x00\x01US\x02\x00"
    assert head in whole
    path.write_bytes(whole.replace(head, b"\x28\x00\x00\x01US\x03\x00\x00"))
    with pytest.raises(LoadError, match="contradicts its format"):
        read_header(path)


@pytest.mark.parametrize(
    ("kind", "inverted", "greys"),
    [
        ("<i2", False, [-5, 7, -2048]),
        ("<i2", True, [4, -8, 2047]),
        ("<u2", False, [4091, 7, 2048]),
        ("<u2", True, [4, 4088, 2047]),
    ],
)
def test_bits_that_count_are_taken_out_of_wider_values_and_turned_where_white_is_low(
    kind: str, inverted: bool, greys: list[int]
) -> None:
    """12 bits of 16, the highest the 14th of 0 to 15; above and below them is what does not count."""
    stored = (np.array([0xFFB, 7, 0x800], np.uint16) << 3 | 0x8005).view(kind)
    pixels = Pixels(1, 3, 0, kind, 12, 14, inverted)
    assert grey(Mock(pixels=pixels), stored).tolist() == greys
