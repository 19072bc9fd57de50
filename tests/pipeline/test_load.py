"""Scans in: what the format study (``test_formats``) asks of no format: parts, ends of packed data, stacks."""

from __future__ import annotations

import bz2
import gzip
import os
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pydicom
import pytest
import SimpleITK as sitk

from pipeline.arrays.grids import corners_mm
from pipeline.load import (
    Crop,
    LoadError,
    Source,
    each_volume,
    load,
    of_several_greys,
    outside,
    read_header,
    require_same_geometry,
)
from pipeline.load.config import LoadConfig
from pipeline.load.files import parts as file_parts
from pipeline.run.hashing import file_hash
from pipeline.study.infer import infer_manifest
from tests.studies.formats import base
from tests.studies.formats.base import ORIGIN, SPACING, TURN, image


def numbered() -> np.ndarray:
    return base.numbered().astype(np.int16)


@pytest.mark.parametrize(
    ("words", "numbers"),
    [
        ("s_%03d.raw", (1, 2, 3)),
        ("s_%03d.raw 5 7", (5, 6, 7)),
        ("s_%03d.raw 99990 99993", (99990, 99991, 99992, 99993)),
        ("s_%03d.raw 4 10 3", (4, 7, 10)),
        ("s_%03d.raw 4 4", (4,)),
    ],
)
def test_numbered_files_are_those_of_their_pattern(words: str, numbers: tuple[int, ...]) -> None:
    """A high first number is no long list; three slices are meant where none are counted."""
    found = outside.numbered(Path("/study/scan.mhd"), words.split(), 3)
    assert [path.name for path in found] == [f"s_{number:03d}.raw" for number in numbers]


@pytest.mark.parametrize(
    "words", ["s_%03d.raw 4 3", "s_%03d.raw 1 9 0", "s_%03d.raw 1 9999999", "s.raw 1 3", "%d_%d 1 3"]
)
def test_numbered_files_that_cannot_be_meant_are_refused(words: str) -> None:
    with pytest.raises(LoadError):
        outside.numbered(Path("/study/scan.mhd"), words.split(), 3)


def test_what_a_crop_reads_is_counted(tmp_path: Path) -> None:
    sitk.WriteImage(image(), str(tmp_path / "scan.mha"))
    counted = Crop(read_header(tmp_path / "scan.mha"), ((1, 2, 3), (4, 6, 8))).counters
    assert counted == {"voxels_total": 315.0, "voxels_read": 60.0, "voxels_skipped": 255.0}


@pytest.mark.parametrize("suffix", [".nii.gz", ".nrrd"])
def test_what_follows_packed_voxels_is_seen_wherever_a_crop_ends(tmp_path: Path, suffix: str) -> None:
    """Crops, which frames are read as, ended before it: 5000 bytes of something else passed."""
    path, box = tmp_path / f"scan{suffix}", ((1, 0, 2), (4, 5, 6))
    sitk.WriteImage(image(), str(path), useCompression=True)
    raw = path.read_bytes()
    begin = raw.index(b"\x1f\x8b\x08")
    voxels = gzip.decompress(raw[begin:])
    members = raw[:begin] + gzip.compress(voxels[:400]) + gzip.compress(voxels[400:])
    for legal in (raw, raw + bytes(600_000), members, members + bytes(5)):
        path.write_bytes(legal)
        np.testing.assert_array_equal(load(read_header(path), box).values, numbered()[1:4, 0:5, 2:6])
    ends = {
        b"not gzip at all": "damaged",
        bytes(600_000) + b"no padding": "damaged",
        gzip.compress(b"more"): "more than",
        raw[begin:]: "more than",
    }
    for added, found in ends.items():
        path.write_bytes(raw + added)
        with pytest.raises(LoadError, match=found):
            load(read_header(path), box)


def nrrd_of(packed: bytes, *fields: str) -> bytes:
    """The numbered voxels' header, and what is to follow it."""
    head = ("NRRD0004", "type: short", "dimension: 3", "sizes: 5 7 9", "endian: little", *fields)
    return "\n".join(head).encode() + b"\n\n" + packed


@pytest.mark.parametrize(("encoding", "pack"), [("gzip", gzip.compress), ("bzip2", bz2.compress), ("raw", bytes)])
def test_bytes_of_an_nrrd_are_skipped_unpacked_and_lines_before_that(
    tmp_path: Path, encoding: str, pack: Callable[[bytes], bytes]
) -> None:
    """Both were skipped in the packed file: sound ones were refused as damaged."""
    path, voxels = tmp_path / "a.nrrd", numbered().tobytes(order="F")
    for byte, line, content in (
        (6, 0, pack(b"a head" + voxels)), (0, 2, b"two\nlines\n" + pack(voxels)), (1, 1, b"\n" + pack(b"!" + voxels)),
    ):  # fmt: skip
        path.write_bytes(nrrd_of(content, f"encoding: {encoding}", f"byte skip: {byte}", f"line skip: {line}"))
        for box in (((0, 0, 0), (5, 7, 9)), ((1, 0, 2), (4, 5, 6))):
            want = numbered()[tuple(map(slice, *box))]
            np.testing.assert_array_equal(load(read_header(path), box).values, want)


@pytest.mark.parametrize("count", [0, 9])
def test_an_nrrd_has_axes_but_not_too_many(tmp_path: Path, count: int) -> None:
    (tmp_path / "a.nrrd").write_bytes(nrrd_of(b"", "encoding: raw").replace(b"dimension: 3", b"dimension: %d" % count))
    with pytest.raises(LoadError, match=f"dimension: {count}; allowed: 3, or 4 for a sequence"):
        read_header(tmp_path / "a.nrrd")


def test_what_an_nrrd_cannot_skip_is_refused(tmp_path: Path) -> None:
    path, voxels = tmp_path / "a.nrrd", numbered().tobytes(order="F")
    path.write_bytes(nrrd_of(b"a head" + voxels, "encoding: raw", "byte skip: -1"))
    np.testing.assert_array_equal(load(read_header(path)).values, numbered())
    refused = (
        ("gzip", "byte skip: -1", "byte skip -1 with encoding gzip; allowed: 0 or more, and -1 if raw"),
        ("raw", "byte skip: -2", "byte skip -2 with encoding raw"),
        ("raw", "line skip: 1001", "line skip 1001; allowed: 0 to 1000"),
        ("raw", "byte skip: -1\nline skip: -5", "line skip -5; allowed: 0 to 1000"),
        ("raw", "byte skip: 5000", r"begin at byte 5\d{3}, the file has \d{3} bytes; correct the header"),
    )
    for encoding, skip, said in refused:
        path.write_bytes(nrrd_of(gzip.compress(voxels), f"encoding: {encoding}", skip))
        with pytest.raises(LoadError, match=said):
            read_header(path)


def test_voxels_at_the_end_of_a_file_do_not_begin_in_its_header(tmp_path: Path) -> None:
    """Of a file that was cut short the header's last bytes were read as voxels."""
    voxels = numbered().tobytes(order="F")
    nrrd = nrrd_of(voxels, "encoding: raw", "byte skip: -1")
    mha = b"NDims = 3\nDimSize = 5 7 9\nElementType = MET_SHORT\nHeaderSize = -1\nElementDataFile = LOCAL\n" + voxels
    for name, content in (("a.nrrd", nrrd), ("a.mha", mha)):
        (tmp_path / name).write_bytes(content)
        np.testing.assert_array_equal(load(read_header(tmp_path / name)).values, numbered())
        (tmp_path / name).write_bytes(content[:-20])
        with pytest.raises(LoadError, match="cut short: 610 bytes of voxels, the header asks for 630"):
            load(read_header(tmp_path / name))


def test_what_follows_a_bzip2_stream_is_seen_wherever_a_crop_ends(tmp_path: Path) -> None:
    path, voxels = tmp_path / "a.nrrd", numbered().tobytes(order="F")
    for box in (((0, 0, 0), (5, 7, 9)), ((1, 0, 2), (4, 5, 6))):
        for length in range(400, 440):  # the end of a stream lies anywhere in a byte
            path.write_bytes(nrrd_of(bz2.compress(voxels[:length]) + bz2.compress(voxels[length:]), "encoding: bzip2"))
            assert load(read_header(path), box).values[-1, -1, -1] == numbered()[tuple(np.subtract(box[1], 1))]
        path.write_bytes(nrrd_of(bz2.compress(voxels) + b"something else", "encoding: bzip2"))
        with pytest.raises(LoadError, match="does not end with its bzip2 data"):
            load(read_header(path), box)


def test_files_that_hold_a_headers_voxels_are_part_of_it(tmp_path: Path) -> None:
    """An edit of theirs is one of the scan: kept results hang on them."""
    for name in ("a.mhd", "b.nhdr", "c.hdr"):
        sitk.WriteImage(image(), str(tmp_path / name), useCompression=False)
    for attached, header in (("d.mha", "a.mhd"), ("e.nrrd", "b.nhdr")):
        (tmp_path / attached).write_bytes((tmp_path / header).read_bytes())
    sitk.WriteImage(image(), str(tmp_path / "whole.mha"), useCompression=False)
    assert file_parts(tmp_path / "whole.mha") == ()
    voxels = {
        "a.mhd": "a.raw",
        "b.nhdr": "b.raw",
        "c.hdr": "c.img",
        "c.img": "c.hdr",
        "d.mha": "a.raw",
        "e.nrrd": "b.raw",
    }
    for name, other in voxels.items():
        assert file_parts(tmp_path / name) == (tmp_path / other,)
        before = file_hash(tmp_path / name)
        changed = bytearray((tmp_path / other).read_bytes())
        changed[-1] ^= 1
        (tmp_path / other).write_bytes(changed)
        assert file_hash(tmp_path / name) != before


def test_a_folder_of_scans_is_told_how_to_be_named(tmp_path: Path) -> None:
    sitk.WriteImage(image(), str(tmp_path / "f_2.nii.gz"))
    with pytest.raises(LoadError, match=rf"holds scans, as f_2.nii.gz; name these, as in {tmp_path.name}/\*\.nii\.gz"):
        read_header(tmp_path)


def test_a_small_scan_is_told_how_small_the_setting_is(tmp_path: Path) -> None:
    """ "asks for 0.0 GiB; allowed: 1e-09"."""
    sitk.WriteImage(image(), str(tmp_path / "a.mha"))
    with pytest.raises(LoadError, match=r"asks for [1-9.]+e-0\d GiB; allowed: 1e-09 GiB"):
        read_header(tmp_path / "a.mha", LoadConfig(most_gib=1e-9))


def test_a_pair_in_capitals_is_a_pair(tmp_path: Path) -> None:
    sitk.WriteImage(image(), str(tmp_path / "a.hdr"), useCompression=False)
    header, voxels = ((tmp_path / f"a{end}").rename(tmp_path / f"A{end.upper()}") for end in (".hdr", ".img"))
    for path, other in ((header, voxels), (voxels, header)):
        np.testing.assert_array_equal(load(read_header(path)).values, numbered())
        assert file_parts(path) == (other,)


def test_a_key_opens_no_header_of_a_series(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every frame and every point of a sweep asks for the hash of its folder."""
    for name in ("a.dcm", "b"):
        (tmp_path / name).write_bytes(name.encode())
    monkeypatch.delattr("pipeline.load.dicom.dataset")
    assert file_hash(tmp_path) == file_hash(tmp_path)


def test_a_format_from_outside_says_what_else_belongs_to_its_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Vox:
        """Voxels in a .vox file, their geometry in a .json beside it."""

        @staticmethod
        def parts(path: Path) -> tuple[Path, ...]:
            return (path.with_suffix(".json"),) if path.suffix == ".vox" else ()

    monkeypatch.setattr("pipeline.load.FORMATS", (Vox,))
    (tmp_path / "a.vox").write_bytes(b"voxels")
    (tmp_path / "a.json").write_text("1", encoding="utf-8")
    before = file_hash(tmp_path / "a.vox")
    (tmp_path / "a.json").write_text("22", encoding="utf-8")
    assert file_hash(tmp_path / "a.vox") != before


def test_loaded_voxels_outlive_the_image_that_holds_them(tmp_path: Path) -> None:
    sitk.WriteImage(image(), str(tmp_path / "scan.mha"))
    volumes = [load(read_header(tmp_path / "scan.mha")) for _ in range(3)]
    others = [sitk.Image(5, 7, 9, sitk.sitkInt16) + 77 for _ in range(20)]  # would land in freed memory
    for volume in volumes:
        np.testing.assert_array_equal(volume.values, numbered())
    assert len(others) == 20


def test_an_hdf5_sequence_is_one_header_a_volume(tmp_path: Path) -> None:
    path = tmp_path / "study.h5"
    with h5py.File(path, "w") as file:
        data = file.create_dataset("frames", data=np.stack([numbered().T, numbered().T + 1]))
        data.attrs["spacing_mm"] = SPACING
    header = read_header(Source(path, "/frames"))
    assert header.item_count == 2
    second = load(list(each_volume(header))[1], ((0, 1, 2), (5, 3, 4)))
    np.testing.assert_array_equal(second.values, (numbered() + 1)[:, 1:3, 2:4])


@pytest.mark.parametrize("kind", [str, np.bytes_, lambda axes: np.array([f"{axes} ".encode()])])
@pytest.mark.parametrize("axes", ["x,y,z", "z,y,x"])
def test_an_hdf5_group_of_volumes_is_a_sequence_with_either_axis_order(
    tmp_path: Path, axes: str, kind: Callable[[str], Any]
) -> None:
    """C and MATLAB write a text as bytes, or as an array of one: these were refused."""
    path = tmp_path / "study.h5"
    with h5py.File(path, "w") as file:
        for i in range(3):
            values = numbered() + i
            data = file.create_dataset(f"frames/{i:03d}", data=values if axes == "x,y,z" else values.T)
            data.attrs.update(spacing_mm=SPACING, origin_mm=ORIGIN, direction=TURN, axes=kind(axes))
    header = read_header(Source(path, "/frames"))
    assert (header.item_count, header.shape) == (3, (5, 7, 9))
    last = load(list(each_volume(header))[2], ((0, 1, 2), (5, 3, 4)))
    np.testing.assert_array_equal(last.values, (numbered() + 2)[:, 1:3, 2:4])
    assert last.values.flags.f_contiguous  # stages sample voxels in memory's order: sigma was 4 % larger in the other
    np.testing.assert_allclose(last.origin_mm, header.grid.to_mm([0, 1, 2]))


def test_an_unknown_axis_order_is_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "study.h5", "w") as file:
        file.create_dataset("volume", data=numbered()).attrs.update(spacing_mm=SPACING, axes="y,x,z")
    with pytest.raises(LoadError, match="allowed: 'z,y,x' or 'x,y,z'"):
        read_header(tmp_path / "study.h5")


def test_an_hdf5_dataset_without_spacing_names_what_is_missing(tmp_path: Path) -> None:
    path = tmp_path / "study.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("frames", data=numbered().T)
    with pytest.raises(LoadError, match=r"lacks the attribute spacing_mm"):
        read_header(Source(path, "/frames"))
    with pytest.raises(LoadError, match=r"holds /frames \(9, 7, 5\)"):
        read_header(Source(path, "/wrong"))


def test_a_damaged_hdf5_file_is_said(tmp_path: Path) -> None:
    path = tmp_path / "study.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("volume", data=numbered().T).attrs["spacing_mm"] = SPACING
    path.write_bytes(path.read_bytes()[:500])
    with pytest.raises(LoadError, match=r"study\.h5: .*truncated.*Check that the file is complete"):
        read_header(path)


@pytest.mark.parametrize("where", ["volume", "/"])
@pytest.mark.parametrize(("name", "said"), [
    ("space", "RAS"), ("space", ["R", "A", "S"]), ("space", "scanner-RAS mm"), ("units", "cm"), ("unit", ["cm"] * 3),
    ("coordinates", "voxel index"),
])  # fmt: skip
def test_a_volume_in_hdf5_that_states_another_space_or_unit_is_refused(
    tmp_path: Path, where: str, name: str, said: str | list[str]
) -> None:
    """Its numbers were taken for LPS mm, as they would be without the attribute."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["volume"] = numbered().T
        file["volume"].attrs.update(spacing_mm=SPACING, space="LPS: right to left, anterior to posterior", unit="mm")
        # what is of greys, or netCDF's names of coordinates
        file["volume"].attrs.update(units="pixel value", length_unit="mm/pixel", coordinates="z_index y_index x_index")
    assert read_header(tmp_path / "a.h5").shape == numbered().shape
    with h5py.File(tmp_path / "a.h5", "a") as file:
        file[where].attrs[name] = said
    with pytest.raises(LoadError, match=f"attribute {name} is '.*'; allowed in HDF5: LPS mm"):
        read_header(tmp_path / "a.h5")


def write_series(folder: Path, values: np.ndarray, positions: list[tuple[float, float, float]]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    writer = sitk.ImageFileWriter()
    writer.KeepOriginalImageUIDOn()
    for k, position in enumerate(positions):
        plane = sitk.GetImageFromArray(np.ascontiguousarray(values[:, :, k].T))
        plane.SetSpacing(SPACING[:2].tolist())
        tags = {
            "0008|0060": "CT", "0020|000e": "1.2.3.4", "0020|000d": "1.2.3", "0008|0018": f"1.2.3.4.{k + 1}",
            "0008|0016": "1.2.840.10008.5.1.4.1.1.2", "0020|0013": str(k + 1),
            "0020|0032": "\\".join(map(str, position)), "0020|0037": "1\\0\\0\\0\\1\\0",
        }  # fmt: skip
        for key, value in tags.items():
            plane.SetMetaData(key, value)
        writer.SetFileName(str(folder / f"slice{(k * 7) % 11:02d}.dcm"))  # file names out of order on purpose
        writer.Execute(plane)


def straight_stack(count: int = 9, gap: float = 0.7) -> list[tuple[float, float, float]]:
    return [(12.0, -30.0, 5.0 + gap * k) for k in range(count)]


@pytest.mark.parametrize("content", [b"", b"no DICOM", None])
def test_a_damaged_slice_is_named_wherever_it_lies(tmp_path: Path, content: bytes | None) -> None:
    """Without its last slice a series is a shorter one, in which nothing is missing."""
    write_series(tmp_path / "series", numbered(), straight_stack())
    last = tmp_path / "series" / f"slice{(8 * 7) % 11:02d}.dcm"
    last.write_bytes(last.read_bytes()[:200] if content is None else content)
    with pytest.raises(LoadError, match=rf"1 of its files cannot be read as DICOM: {last.name}"):
        read_header(tmp_path / "series")


def test_slices_that_were_edited_and_given_their_time_back_are_read_anew(tmp_path: Path) -> None:
    write_series(tmp_path / "series", numbered(), straight_stack())
    assert read_header(tmp_path / "series").origin_mm[0] == 12.0
    for path in (tmp_path / "series").iterdir():
        times = path.stat()
        path.write_bytes(path.read_bytes().replace(b"12\\-30", b"13\\-30"))
        os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
    assert read_header(tmp_path / "series").origin_mm[0] == 13.0


def test_an_orientation_that_is_written_with_one_decimal_is_taken_as_such(tmp_path: Path) -> None:
    """45 degrees as 0.7, 0.7 were refused for a length of 0.99, and exported again they still are."""
    write_series(tmp_path / "series", numbered(), straight_stack())

    def written(*orientation: str) -> Path:
        for path in (tmp_path / "series").iterdir():
            plane = pydicom.dcmread(path)
            plane.ImageOrientationPatient = list(orientation)
            plane.save_as(path)
        return tmp_path / "series"

    header = read_header(written("0.7", "0.7", "0", "-0.7", "0.7", "0"))
    half = np.sqrt(0.5)
    np.testing.assert_allclose(header.direction, [[half, -half, 0], [half, half, 0], [0, 0, 1]], rtol=0.0, atol=1e-12)
    assert header.assumed[0].startswith("series: ImageOrientationPatient has vectors that are off the length 1")
    for wrong in (("0.70", "0.70", "0", "-0.70", "0.70", "0"), ("1", "1", "0", "-1", "1", "0")):
        with pytest.raises(LoadError, match="or divide by the lengths"):
            read_header(written(*wrong))


def test_contours_beside_the_slices_are_no_damaged_slice(tmp_path: Path) -> None:
    """The archive of a planning system holds an RTSTRUCT in the folder of its slices; GDCM lists it in no series."""
    write_series(tmp_path / "series", numbered(), straight_stack())
    contours = pydicom.Dataset()
    contours.SOPClassUID, contours.SOPInstanceUID = "1.2.840.10008.5.1.4.1.1.481.3", "1.2.3.4"
    contours.file_meta = pydicom.dataset.FileMetaDataset()
    contours.file_meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
    contours.save_as(tmp_path / "series" / "RS.dcm", enforce_file_format=True)
    np.testing.assert_array_equal(load(read_header(tmp_path / "series")).values, numbered())


def test_a_repeated_slice_is_named(tmp_path: Path) -> None:
    positions = straight_stack()
    positions[5] = positions[4]
    write_series(tmp_path / "series", numbered(), positions)
    with pytest.raises(LoadError, match="repeated position"):
        read_header(tmp_path / "series", LoadConfig(resample=True))


def test_a_tilted_stack_is_refused_or_straightened_never_sheared(tmp_path: Path) -> None:
    """A plane of constant height + y in space must stay one after resampling."""
    lean = 0.5  # pixels of 0.5 mm a slice
    positions = [(12.0, -30.0 + lean * k, 5.0 + 0.7 * k) for k in range(9)]
    index = np.indices((5, 20, 9))
    true_y = -30.0 + 0.5 * index[1] + lean * index[2]
    write_series(tmp_path / "series", np.round(10 * (true_y + 40)).astype(np.int16), positions)
    with pytest.raises(LoadError, match="gantry tilt"):
        read_header(tmp_path / "series")
    asked = LoadConfig(resample=True)
    header = read_header(tmp_path / "series", asked)
    assert any("tilt" in text for text in header.assumed)
    volume = load(header, None, asked)
    inner = np.argwhere(np.ones(volume.shape, bool))
    inner = inner[(inner[:, 1] > 9) & (inner[:, 1] < 19)]
    expected = 10 * (volume.to_mm(inner)[:, 1] + 40)
    np.testing.assert_allclose(volume.values[tuple(inner.T)], expected, rtol=0.0, atol=1.0)


def test_two_series_in_a_folder_are_listed(tmp_path: Path) -> None:
    write_series(tmp_path / "series", numbered(), straight_stack())
    one = sitk.ReadImage(str(next((tmp_path / "series").iterdir())))
    one.SetMetaData("0020|000e", "9.9.9")
    one.SetMetaData("0008|103e", "Series 10")
    writer = sitk.ImageFileWriter()
    writer.KeepOriginalImageUIDOn()
    writer.SetFileName(str(tmp_path / "series" / "other.dcm"))
    writer.Execute(one)
    one.SetMetaData("0020|000e", "9.9.10")
    one.SetMetaData("0008|103e", "Series 9")
    writer.SetFileName(str(tmp_path / "series" / "third.dcm"))
    writer.Execute(one)
    with pytest.raises(LoadError, match="found 3 DICOM image series") as told:
        read_header(tmp_path / "series")
    assert "Series 9 (9.9.10): 1 files\n    Series 10 (9.9.9): 1 files" in str(told.value)
    # named so, the folder of frames is no frame, and "no frames" was all that was said of it
    (tmp_path / "series").rename(tmp_path / "frames")
    slices = len(list((tmp_path / "frames").iterdir()))
    with pytest.raises(LoadError, match=f"frames/ holds {slices} slices of 3 series: one folder a series"):
        infer_manifest(tmp_path, None, None, None, LoadConfig())


def test_what_is_not_there_or_no_scan_is_said(tmp_path: Path) -> None:
    with pytest.raises(LoadError, match="no such file"):
        read_header(tmp_path / "nothing.mha")
    (tmp_path / "below" / "series").mkdir(parents=True)
    with pytest.raises(
        LoadError, match=r"expected one\.\n  It has sub-folders: series; name one .* as in below/series"
    ):
        read_header(tmp_path / "below")
    (tmp_path / "capitals").mkdir()
    (tmp_path / "capitals" / "A.NII").write_bytes(bytes(400))
    with pytest.raises(LoadError, match=r"It holds scans, as A\.NII; name these, as in capitals/\*\.NII"):
        read_header(tmp_path / "capitals")


def test_two_slices_are_a_volume(tmp_path: Path) -> None:
    sitk.WriteImage(image(numbered()[:, :, :2]), str(tmp_path / "2.mha"))
    assert load(read_header(tmp_path / "2.mha")).values.shape == (5, 7, 2)


NO_GREYS = [("float64", np.nan), ("float64", -np.inf), ("float64", 1e20), ("float64", 1e300)]
NO_GREYS += [("int32", -(2.0**31)), ("int32", 2.0**31 - 1)]


@pytest.mark.parametrize(("kind", "grey"), NO_GREYS)
def test_voxels_that_are_no_grey_are_refused(tmp_path: Path, kind: str, grey: float) -> None:
    """Squares of 1e20 overflowed, and no frame of its case had a result; whole numbers were not asked."""
    values = numbered().astype(kind)
    values[1, 2, 3] = grey
    sitk.WriteImage(image(values, kind), str(tmp_path / "scan.mha"))
    with pytest.raises(LoadError, match="1 voxels are NaN, infinite or beyond 1e"):
        load(read_header(tmp_path / "scan.mha"))


def test_a_scan_of_one_grey_is_told_as_such(tmp_path: Path) -> None:
    """A frame of zeros was told as a faint wire: "got 5.8 mm of line; scan with more dose"."""
    sitk.WriteImage(image(np.zeros_like(numbered())), str(tmp_path / "scan.mha"))
    header = read_header(tmp_path / "scan.mha")
    with pytest.raises(LoadError, match=r"scan.mha: all \d+ voxels around the vessel have one grey, 0; expected"):
        of_several_greys(load(header), header.source)
    sitk.WriteImage(image(), str(tmp_path / "scan.mha"))
    several = load(read_header(tmp_path / "scan.mha"))
    assert of_several_greys(several, header.source) is several


@pytest.mark.parametrize(("change", "accepted"), [(1e-8, True), (0.05, True), (0.3, False)])
def test_geometry_is_compared_in_voxels_at_the_far_corner(tmp_path: Path, change: float, accepted: bool) -> None:
    first, second = image(), image()
    second.SetOrigin((ORIGIN[0] + change, *ORIGIN[1:]))
    for name, scan in (("a", first), ("b", second)):
        sitk.WriteImage(scan, str(tmp_path / f"{name}.mha"))
    headers = [read_header(tmp_path / f"{name}.mha") for name in "ab"]
    if accepted:
        require_same_geometry(*headers)
    else:
        with pytest.raises(LoadError, match=r"corners lie 0\.75 voxels apart, allowed 0\.5"):
            require_same_geometry(*headers)


def test_a_spacing_from_the_manifest_is_reported_as_assumed(tmp_path: Path) -> None:
    sitk.WriteImage(image(), str(tmp_path / "scan.mha"))
    header = read_header(tmp_path / "scan.mha", spacing_mm=(0.5, 0.5, 0.5))
    np.testing.assert_array_equal(header.spacing_mm, 0.5)
    assert f"taken from the manifest, where the file has {np.round(SPACING, 4).tolist()}" in header.assumed[0]
    same = read_header(tmp_path / "scan.mha", spacing_mm=(0.4, 0.5, 0.7))
    assert same.assumed[-1].endswith("taken from the manifest")


def unpacked(archive: Path, folder: Path) -> Path:
    zipfile.ZipFile(archive).extractall(folder)
    return next(p for p in folder.rglob("*") if p.is_dir() and any(p.glob("*.dcm")))


def test_the_real_catphan_series_has_its_geometry(real_data: Path, tmp_path: Path) -> None:
    series = unpacked(real_data / "catphan504_cbct" / "High_quality_head.zip", tmp_path)
    header = read_header(series)
    assert header.shape == (512, 512, 64)
    np.testing.assert_allclose(header.spacing_mm, (0.48828125, 0.48828125, 2.5))
    np.testing.assert_allclose(header.direction[:, 0], (0.9999863, 0.0, 0.005236), rtol=0.0, atol=1e-6)
    volume = load(header, ((200, 200, 28), (300, 300, 30)))
    assert volume.shape == (100, 100, 2)
    assert -1000 <= volume.values.min() < volume.values.max() <= 1810


def test_the_real_tilted_head_is_refused_or_resampled(real_data: Path, tmp_path: Path) -> None:
    series = unpacked(real_data / "head_ct_tilted_dicom" / "GE_head_28slices.zip", tmp_path)
    with pytest.raises(LoadError, match=r"(?s)irregular slice gaps.*leans 18\.5 degrees"):
        read_header(series)
    asked = LoadConfig(resample=True)
    volume = load(read_header(series, asked), None, asked)
    assert len(volume.assumed) == 2
    assert volume.values.min() >= -1500.0
    assert volume.values.max() <= 2121.0


def test_a_rounded_quaternion_is_a_rotation_all_the_same(tmp_path: Path) -> None:
    """b = 1.0004, rounded by its writer: half a turn about x, lengths unchanged."""
    path = tmp_path / "scan.nii"
    sitk.WriteImage(image(turn=np.diag([1.0, -1.0, -1.0])), str(path))
    data = bytearray(path.read_bytes())
    data[252:256] = struct.pack("<hh", 1, 0)  # the qform alone
    data[256:268] = struct.pack("<fff", 1.0004, 0.0, 0.0)
    path.write_bytes(data)
    grid = read_header(path).grid
    np.testing.assert_allclose(grid.direction.T @ grid.direction, np.eye(3), rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(grid.spacing_mm, SPACING, rtol=1e-6)


def test_corners_are_the_outermost_voxels_centres(tmp_path: Path) -> None:
    path = tmp_path / "scan.mha"
    sitk.WriteImage(image(), str(path))
    grid = read_header(path).grid
    np.testing.assert_allclose(np.ptp(corners_mm(grid) @ TURN, axis=0), SPACING * (4, 6, 8))
