"""Identity of the data: what a kept result hangs on, in which order frames come, whose geometry is whose."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
import SimpleITK as sitk

from pipeline.cli import main
from pipeline.load import Crop, LoadError, Source, each_volume, load, parts_of, read_header, read_headers
from pipeline.load.config import LoadConfig
from pipeline.load.geometry import Mask
from pipeline.load.order import in_order
from pipeline.model import Array, Volume
from pipeline.run.hashing import file_hash
from pipeline.run.store import digest
from pipeline.study.first_wire import AT_EDGE, IN_PLACE, MOVED_IN, infer_entry
from pipeline.study.infer import _deeper, _order, _scans_in, infer_manifest
from pipeline.study.manifest import ManifestError, read_manifest
from pipeline.study.same_scans import repeated
from tests.pipeline.test_load import numbered
from tests.pipeline.test_manifest import GOOD
from tests.studies.formats import variants
from tests.studies.formats.base import SPACING, image


def test_voxels_of_a_detached_file_belong_to_the_key_of_a_crop(tmp_path: Path) -> None:
    """New .raw, same header: another scan."""
    keys = []
    for values in (numbered(), numbered() + 1):
        sitk.WriteImage(image(values), str(tmp_path / "a.mhd"))
        header = read_header(tmp_path / "a.mhd")
        keys.append(digest(Crop(header, header.box)))
    assert keys[0] != keys[1]


NRRD = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n"
MHD = "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\n"
PLANES = ["s 1.raw", "s 2.raw"]


@pytest.mark.parametrize(
    ("name", "text", "files"),
    [
        ("a.mhd", f"{MHD}ElementDataFile = größe.raw\n", ["größe.raw"]),
        ("a.mhd", f"{MHD}ElementDataFile = LIST\ns 1.raw\ns 2.raw\n", PLANES),
        ("a.mhd", f"{MHD}  ElementDataFile = v.raw\n", ["v.raw"]),
        ("a.mhd", f"{MHD}ElementDataFile = s[1]_%02d.raw 1 2 1\n", ["s[1]_01.raw", "s[1]_02.raw"]),
        ("a.mhd", f"{MHD}ElementDataFile = s_%d.raw\n", ["s_1.raw", "s_2.raw"]),
        ("a.nhdr", f"{NRRD}data file: größe.raw\n\n", ["größe.raw"]),
        ("a.nhdr", f"{NRRD}data file : v.raw\n\n", ["v.raw"]),
        ("a.nhdr", f"{NRRD} data file: v.raw\n\n", ["v.raw"]),
        ("a.nhdr", f"{NRRD}datafile: v.raw\n\n", ["v.raw"]),
        ("a.nhdr", f"{NRRD}data file: LIST\ns 1.raw\ns 2.raw\n", PLANES),
        ("a.nhdr", f"{NRRD}# a LIST\ndata file: LIST\ns 1.raw\ns 2.raw\n", PLANES),
        ("a.nhdr", f"{NRRD}data file: listed.raw\n\n", ["listed.raw"]),
    ],
)
def test_the_files_that_are_read_are_those_that_belong_to_the_key(
    tmp_path: Path, name: str, text: str, files: list[str]
) -> None:
    """What one file of code read, another one looked for anew, and missed: an old result was kept for a new scan."""
    (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "other.raw").write_bytes(b"nobody reads it")
    for file in files:
        (tmp_path / file).write_bytes(bytes(range(8 // len(files))))
    header = read_header(tmp_path / name)
    values, before = load(header, header.box).values, file_hash(tmp_path / name)
    for file in files:
        (tmp_path / file).write_bytes(bytes(range(9, 9 + 8 // len(files))))
        assert file_hash(tmp_path / name) != before
    assert np.all(load(header, header.box).values != values), "they are what was read"
    assert sorted(parts_of(tmp_path / name)) == sorted(tmp_path / file for file in files)


def test_a_file_in_anothers_place_with_its_size_and_time_is_another(tmp_path: Path) -> None:
    """A scan put there by cp -p between two runs of one notebook: the second had the first one's curve, ok."""
    for name, content in (("thin", b"thin"), ("wide", b"wide"), ("kept", b"thin")):
        (tmp_path / name).write_bytes(content)
        os.utime(tmp_path / name, ns=(0, 0))
    before = file_hash(tmp_path / "thin")
    shutil.copy2(tmp_path / "wide", tmp_path / "thin")  # into the same inode, with the time of the copy's original
    assert file_hash(tmp_path / "thin") != before
    (tmp_path / "kept").replace(tmp_path / "thin")
    assert file_hash(tmp_path / "thin") == before


def test_datasets_labels_and_levels_belong_to_keys(tmp_path: Path) -> None:
    path = tmp_path / "study.h5"
    path.write_bytes(b"same file")
    sources = [Source(path, "/frames"), Source(path, "/run2"), Source(path, "/frames", 1), Mask(path, "/frames")]
    sources += [
        Mask(path, "/frames", label=label, level=level) for label, level in ((1, None), ("a", None), (None, 0.5))
    ]
    assert len({digest(source) for source in sources}) == len(sources)


def test_frames_whose_headers_are_alike_are_one_scan_only_where_their_voxels_are(tmp_path: Path) -> None:
    """The header of a NIfTI pair names no file: of one grid, all frames but the first were refused as copies."""
    (tmp_path / "frames").mkdir()
    for name, values in (("a", numbered()), ("b", numbered() + 1), ("c", numbered())):
        sitk.WriteImage(image(values), str(tmp_path / "frames" / f"{name}.hdr"))
    (tmp_path / "m.toml").write_text(GOOD.replace("frames/*.mha", "frames/*.hdr"), encoding="utf-8")
    assert [text.split(": ")[0] for text in repeated(read_manifest(tmp_path / "m.toml").cases[0])] == [
        str(tmp_path / "frames" / "c.hdr")
    ]


def test_natural_order_over_whole_paths(tmp_path: Path) -> None:
    for name in ("depth_10", "depth_2", "depth_1"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "recon.mha").touch()
    (tmp_path / "m.toml").write_text(GOOD.replace("frames/*.mha", "depth_*/recon.mha"), encoding="utf-8")
    frames = read_manifest(tmp_path / "m.toml").cases[0].frames
    assert [source.path.parent.name for source in frames] == ["depth_1", "depth_2", "depth_10"]
    (tmp_path / "m.toml").write_text(GOOD.replace("frames/*.mha", f"{tmp_path}/depth_*/recon.mha"), encoding="utf-8")
    assert read_manifest(tmp_path / "m.toml").cases[0].frames == frames  # an absolute pattern, too


def test_natural_order_of_any_name() -> None:
    names = ["f", "f01", "f1", "f2", "f10", "f" + "9" * 5000, "g", "²"]
    assert in_order([*names[::2], *names[1::2]]) == names


@pytest.mark.parametrize(
    "names",
    [
        ["a1", "a9", "a10", "b1"],
        ["d25.mha", "d25.25.mha", "d25.5.mha", "d26.mha"],
        ["t=0.5s.csv", "t=0.75s.csv", "t=1s.csv", "t=1.25s.csv", "t=10s.csv"],
        ["7,25", "7,5", "8", "10,125"],
        ["scan.9.5.nii.gz", "scan.10.nii.gz", "scan.10.5.nii.gz"],
        ["d9.50", "d10.00", "d10.50"],
        ["1.9/recon.mha", "1.10/recon.mha", "1.11/recon.mha", "2.1/recon.mha"],
        ["1.2.840.9", "1.2.840.10", "1.3.1.1"],
        ["v0.40_d25.mha", "v0.40_d25.5.mha", "v0.40_d26.mha"],
        ["s1.1", "s1.3", "s1.5", "s1.7", "s1.9", "s1.11", "s1.13"],
        ["0.25", "0.5", "0.75"],
        ["1.9", "1.10"],
        ["2.5", "2.75", "3.25", "3.5", "3.75"],
        ["2026.9.30", "2026.10.1", "2026.10.02"],
    ],
)
def test_numbers_with_points_are_decimals_where_nothing_is_counted(names: list[str]) -> None:
    """d25.5 came before d25, each trace was held against the next frame's wire, and the skill rose."""
    assert in_order(reversed(names)) == names


def group(path: Path, **of_10: object) -> Source:
    with h5py.File(path, "w") as file:
        for i in (10, 0, 11, 2, 1):
            data = file.create_dataset(f"frames/{i}", data=numbered().T + i)
            data.attrs.update({"spacing_mm": SPACING} | (of_10 if i == 10 else {}))
    return Source(path, "/frames")


def test_datasets_of_a_group_come_in_natural_order(tmp_path: Path) -> None:
    volumes = [load(header) for header in each_volume(read_header(group(tmp_path / "s.h5")))]
    assert [int(v.values[0, 0, 0]) for v in volumes] == [0, 1, 2, 10, 11]


@pytest.mark.parametrize("change", [{"spacing_mm": (0.4, 0.5, 0.9)}, {"origin_mm": (1, 0, 0)}, {"axes": "x,y,z"}])
def test_every_dataset_has_its_own_geometry(tmp_path: Path, change: dict[str, object]) -> None:
    with pytest.raises(LoadError, match=r"geometry differs.*\n.*\n.*/frames/10"):
        read_header(group(tmp_path / "s.h5", **change))


def test_a_reference_of_several_volumes_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LoadError, match="holds 5 volumes; allowed: one"):
        read_headers(group(tmp_path / "s.h5"), [], LoadConfig())


def test_uint16_beyond_32767_is_not_folded(tmp_path: Path) -> None:
    """What stages subtract is two bytes with a sign."""
    sitk.WriteImage(image(numbered() * 70, "uint16"), str(tmp_path / "a.mha"))
    values = load(read_header(tmp_path / "a.mha")).values
    assert values.dtype == np.int32
    assert values.max() == numbered().astype(int).max() * 70


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("frames", '"../frames/*.mha"', "leads out of the manifest's folder; if it is meant, write '/"),
        ("frames", '["a/../../b.mha"]', "leads out of the manifest's folder"),
        ("frames", '"/**/*.mha"', "whole machine"),
        ("frames", "[]", "an empty list"),
        ("simulated", '{space = "RAS"}', "a table without files"),
        ("roll_deg", "1e9", "from -100000 to 100000"),
        ("frames", '"' + "x" * 300 + '.mha"', "a name of 304 bytes"),
        ("wire", "[]", "not among"),
        ("reference", '""', "an empty name"),
        ("lumen", '{file = "a.nrrd", label = 0}', "a number that is not 0"),
        ("lumen", '{file = "a.nrrd", level = 2}', "above 0 and below 1"),
        ("lumen", '{file = "a.nrrd", label = 1, level = 0.5}', "allowed: file, and label"),
        ("lumen", '{path = "a.nrrd"}', "allowed: file, and label"),
    ],
)
def test_names_of_files_are_judged(tmp_path: Path, key: str, value: str, said: str) -> None:
    lines = [line for line in GOOD.splitlines() if not line.startswith(f"{key} =")]
    (tmp_path / "m.toml").write_text("\n".join([*lines, f"{key} = {value}"]), encoding="utf-8")
    with pytest.raises(ManifestError, match=said):
        read_manifest(tmp_path / "m.toml")


def test_a_lumen_takes_a_label_or_a_level(tmp_path: Path) -> None:
    for value, label, level in (('"artery"', "artery", None), ("2", 2, None), (None, None, 0.4)):
        key = f"label = {value}" if value else "level = 0.4"
        (tmp_path / "m.toml").write_text(
            GOOD.replace("frames/*.mha", "x.mha") + f'lumen = {{file = "s.nrrd", {key}}}\n', encoding="utf-8"
        )
        assert read_manifest(tmp_path / "m.toml").cases[0].lumen == Mask(tmp_path / "s.nrrd", "", None, label, level)


def test_everything_that_is_wrong_with_the_files_of_a_case_is_said_at_once(tmp_path: Path, capsys: object) -> None:
    (tmp_path / "frames").mkdir()
    for k, text in enumerate(("0 0.5 0.7", "0.4 0.5 0.7", "nan 0.5 0.7")):
        path = tmp_path / "frames" / f"f_{k}.mha"
        sitk.WriteImage(image(), str(path), useCompression=False)
        raw = path.read_bytes()
        at = raw.index(b"ElementSpacing")
        path.write_bytes(raw[:at] + f"ElementSpacing = {text}".encode() + raw[raw.index(b"\n", at) :])
    (tmp_path / "t.json").write_text(
        json.dumps({"frames": [{"points_mm": [[0, 0, float("nan")]] * 3}] * 3}), encoding="utf-8"
    )
    (tmp_path / "l.stl").write_text("vertex 1 2 3\n" * 2, encoding="utf-8")
    (tmp_path / "m.toml").write_text(GOOD + 'lumen = "l.stl"\ntruth = "t.json"\n', encoding="utf-8")
    for verb in (["check", str(tmp_path / "m.toml")], ["run", str(tmp_path / "m.toml"), "-o", str(tmp_path / "out")]):
        assert main(verb) == 2
        said = capsys.readouterr().err.splitlines()  # type: ignore[attr-defined]
        assert len(said) == 6, said
        parts = ("f_0.mha", "f_2.mha", "outside the scan", "t.json", "l.stl", "5 problems")
        for part, line in zip(parts, said, strict=True):
            assert part in line
        assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["dicom, no suffixes", "dicom, enhanced", "dicom, enhanced, no suffix"])
def test_dicom_is_found_in_a_folder(tmp_path: Path, name: str) -> None:
    """A folder of slices is one frame; folders of slices and enhanced files in it are frames."""
    write = next(variant.write for variant in variants() if variant.name == name)
    whole = tmp_path / "study"
    whole.mkdir()
    made = write(whole)
    assert _scans_in(whole, None) == (None, [made], [])
    below = tmp_path / "below"
    for k in (10, 2):
        (below / "frames" / f"f{k}").mkdir(parents=True)
        write(below / "frames" / f"f{k}")
    (below / "frames" / "notes").mkdir()
    assert [path.name for path in _scans_in(below, None)[1]] == ["f2", "f10"]


def test_scans_further_down_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An archive's patient/study/series was "found no scans", and nobody was told where they lie."""
    assert _deeper(tmp_path) == ""
    for number in range(5):
        folder = tmp_path / "patient" / f"study{number}"
        folder.mkdir(parents=True)
        (folder / "scan.mha").touch()
    said = _deeper(tmp_path)
    assert (
        "further down are scans: patient/study0/scan.mha, patient/study1/scan.mha, patient/study2/scan.mha and 2"
        in said
    )
    assert f"up into {tmp_path.name}/frames" in said
    monkeypatch.chdir(tmp_path)
    assert f"up into {tmp_path.name}/frames" in _deeper(Path()), "it was /frames, of the disk"


def test_folders_that_look_like_cases_are_no_frames_of_one(tmp_path: Path) -> None:
    """Frames of three insertions were to be moved into one folder."""
    for name in ("ins1", "ins2", "ins3", "ins4"):
        (tmp_path / name / "frames").mkdir(parents=True)
        for scan in ("reference.mha", "frames/d22.mha"):
            (tmp_path / name / scan).touch()
    with pytest.raises(LoadError) as error:
        infer_manifest(tmp_path, None, None, None, LoadConfig())
    here, said = tmp_path.name, str(error.value)
    assert f"{here} holds 4 folders that look like cases: ins1, ins2, ins3 and 1 more; run `wireval init`" in str(
        error.value
    )
    assert f"into one {here}/manifest.toml, with ins1/ and so on before their paths" in said
    assert "move" not in said


def test_manifests_below_a_folder_are_named(tmp_path: Path) -> None:
    """A folder of two finished studies was to be run through `wireval init`."""
    for name in ("monday", "tuesday", "out"):
        (tmp_path / name / "frames").mkdir(parents=True)
        (tmp_path / name / "frames" / "d22.mha").touch()
    for name in ("monday/manifest.toml", "tuesday/study.toml", "out/manifest.inferred.toml"):
        (tmp_path / name).write_text("schema = 1\n[[case]]\n", encoding="utf-8")
    (tmp_path / "out" / "settings.toml").write_text("[solver]\n", encoding="utf-8")
    with pytest.raises(LoadError) as error:
        infer_manifest(tmp_path, None, None, None, LoadConfig())
    said = str(error.value)
    first = tmp_path / "monday" / "manifest.toml"
    assert f"below it are manifests: monday/manifest.toml, tuesday/study.toml; give one, as {first}; to judge" in said
    assert "init" not in said
    (tmp_path / "tuesday" / "study.toml").unlink()
    with pytest.raises(LoadError, match=f"below it is a manifest: monday/manifest.toml; give one, as {first}$"):
        infer_manifest(tmp_path, None, None, None, LoadConfig())


def test_what_is_packed_is_to_be_unpacked(tmp_path: Path) -> None:
    """A folder as a data set was handed out was "found no scans"."""

    def said() -> str:
        with pytest.raises(LoadError) as error:
            infer_manifest(tmp_path, None, None, None, LoadConfig())
        return str(error.value)

    (tmp_path / "reference.nii.gz").touch()
    assert "is packed" not in said(), "a scan was to be unpacked"
    (tmp_path / "scan.zip").touch()
    assert said().endswith("; scan.zip is packed: unpack it")
    (tmp_path / "scan").mkdir()
    (tmp_path / "scan" / "first.mha").touch()
    assert "further down are scans: scan/first.mha" in said(), "it was unpacked, and told to be"


def test_the_wire_begins_where_it_stays_in_place() -> None:
    """A tip nearer to the edge of the scan than the entry was taken for it, and all traces ran backwards."""

    def scan(last: int) -> Volume:
        values = np.zeros((20, 30, 40), np.int16)
        values[2 + np.arange(last) // 3, 15, 5 + np.arange(last)] = 1000  # sideways, towards the edge
        return Volume(values[::-1], np.ones(3), np.zeros(3))

    first, final = scan(16), scan(30)
    last = final.to_mm(np.argwhere(final.values > 0))
    entry, direction, which = infer_entry(first, None, Path("f.mha"), last)
    assert (entry.tolist(), which) == ([17.0, 15.0, 5.0], IN_PLACE)
    assert direction[2] > 0.9
    for told in (np.zeros((0, 3)), first.to_mm(np.argwhere(first.values > 0))):  # one frame, or all of one depth
        assert infer_entry(first, None, Path("f.mha"), told)[2] == AT_EDGE


@pytest.mark.parametrize(("medium", "begins"), [(1000.0, 12.0), (0.0, 1.0)])
def test_an_entry_lies_in_the_vessel_that_the_reference_shows(medium: float, begins: float) -> None:
    """It lay in the vessel's end, where the wire comes out of its introducer: the first run was segment_failed."""
    values = np.random.default_rng(0).normal(0.0, 50.0, (40, 20, 20)).astype(np.float32)
    values[12:, 7:13, 7:13] += medium  # from 12 mm on; an unfilled phantom tells nothing
    wire = np.zeros_like(values)
    wire[1:30, 10, 10] = 5000.0
    reference, frame = Volume(values, np.ones(3), np.zeros(3)), Volume(values + wire, np.ones(3), np.zeros(3))
    entry, direction, which = infer_entry(frame, reference, Path("f.mha"))
    np.testing.assert_allclose(entry, [begins, 10.0, 10.0], rtol=0.0, atol=1.0)  # a voxel
    assert which == AT_EDGE + MOVED_IN * (medium > 0)
    assert direction[0] > 0.99


@pytest.mark.parametrize(
    ("medium", "begins"),
    [
        (np.where(np.arange(60) < 20, 800.0, 1000.0), 1.0),
        (np.linspace(750.0, 1150.0, 60), 1.0),
        (np.where(np.arange(60) < 24, 0.0, 1000.0), 24.0),
        (np.where(np.arange(60) < 30, 0.0, 1000.0), 1.0),
    ],
    ids=["a fifth thinner", "rising", "half of it outside", "most of it outside"],
)
def test_an_entry_is_not_moved_through_medium_that_is_thinner_there(medium: Array, begins: float) -> None:
    """It lay 20 of 49 voxels in the vessel, of whose medium a fifth was missing up to there; 11 where it rose."""
    values = np.random.default_rng(0).normal(0.0, 40.0, (60, 24, 24)).astype(np.float32)
    values[:, 7:17, 7:17] += medium[:, None, None]
    wire = np.zeros_like(values)
    wire[1:50, 12, 12] = 5000.0
    reference, frame = Volume(values, np.ones(3), np.zeros(3)), Volume(values + wire, np.ones(3), np.zeros(3))
    entry, _, which = infer_entry(frame, reference, Path("f.mha"))
    np.testing.assert_allclose(entry, [begins, 12.0, 12.0], rtol=0.0, atol=1.0)  # a voxel
    assert which == AT_EDGE + MOVED_IN * (begins > 1.0)


@pytest.mark.parametrize("zero", [0, -1000, 3000, 10000, -5000])
def test_the_entry_does_not_depend_on_where_grey_has_its_zero(zero: int) -> None:
    """At 3000 the whole scan was the wire, at -5000 there was none."""
    values = np.zeros((24, 24, 24))
    values[6:18, 6:18] = 250
    values[11:13, 11:13, :16] = 3000
    noise = np.random.default_rng(1).normal(0.0, 20.0, values.shape)
    frame = Volume((values + noise + zero).astype(np.float32), np.full(3, 0.4))
    entry, direction, _ = infer_entry(frame, None, Path("f.mha"))
    assert np.abs(entry - [4.6, 4.6, 0.0]).max() < 0.5
    assert direction[2] > 0.95


def test_an_entry_in_fine_voxels_needs_no_square_of_their_number(monkeypatch: pytest.MonkeyPatch) -> None:
    """A filled vessel in voxels of 0.07 mm ended in a MemoryError: 3 GB for three directions."""
    asked: list[bool] = []
    svd = np.linalg.svd
    monkeypatch.setattr(np.linalg, "svd", lambda a, full_matrices=True: asked.append(full_matrices) or svd(a, False))
    infer_entry(Volume(np.pad(np.ones((3, 3, 9)), 4), np.ones(3)), None, Path("f.mha"))
    assert asked == [False]


@pytest.mark.parametrize(("size", "origin_mm", "said"), [(12, 0.3, "the shapes differ"), (16, 1.0, "voxels apart")])
def test_a_reference_on_another_grid_is_told_before_it_is_subtracted(
    tmp_path: Path, size: int, origin_mm: float, said: str
) -> None:
    """One of another shape ended in a traceback; one that lies elsewhere gave an entry of noise."""
    reference = sitk.Image(size, size, size, sitk.sitkInt16)
    reference.SetOrigin((origin_mm,) * 3)
    sitk.WriteImage(reference, str(tmp_path / "reference.mha"))
    for number in range(2):
        sitk.WriteImage(sitk.Image(16, 16, 16, sitk.sitkInt16), str(tmp_path / f"f{number}.mha"))
    with pytest.raises(LoadError, match=f"geometry differs between scans of one case: .*{said}"):
        infer_manifest(tmp_path, None, None, None, LoadConfig())
    assert main(["init", str(tmp_path)]) == 2


def test_an_order_that_no_listing_shows_is_told_name_by_name() -> None:
    """Only the first and the last name were: d25, d25.5 could be read in any order between them."""
    assert _order(["d25.mha", "d26.mha"]) == "d25.mha to d26.mha"
    assert _order(["d9.mha", "d10.mha"]) == "which is not the alphabetical one: d9.mha, d10.mha"
