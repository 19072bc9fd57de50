"""A study written over an earlier one leaves nothing of it, and touches nothing that was never ours."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from data_synthetic import catalogue
from data_synthetic.catalogue.study import Study
from data_synthetic.write import FORMATS, earlier_files, in_the_way, write_study
from tests.later import later


@pytest.fixture(scope="module")
def longer() -> Study:
    return catalogue.build("bend", frames=3, size=24, truth_step_mm=0.8)


@pytest.fixture(scope="module")
def shorter() -> Study:
    return catalogue.build("bend", frames=1, size=20, truth_step_mm=0.8)


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.mark.parametrize("before", FORMATS)
@pytest.mark.parametrize("after", ["mha", *later("dicom", "h5")])
def test_nothing_is_left_of_the_earlier_study(
    longer: Study, shorter: Study, tmp_path: Path, before: str, after: str
) -> None:
    write_study(longer, tmp_path / "used", format=before)
    write_study(shorter, tmp_path / "used", format=after)
    write_study(shorter, tmp_path / "fresh", format=after)
    used, fresh = files(tmp_path / "used"), files(tmp_path / "fresh")
    assert list(used) == list(fresh)
    if after == "mha":  # the other two hold the time at which they were written
        assert used == fresh
    assert all(any(p.iterdir()) for p in (tmp_path / "used").rglob("*") if p.is_dir()), "no empty folder is left"


def test_what_is_removed_is_what_was_written(longer: Study, tmp_path: Path) -> None:
    write_study(longer, tmp_path)
    (tmp_path / "notes.txt").write_text("mine", encoding="utf-8")
    (tmp_path / "frames" / "notes.txt").write_text("mine", encoding="utf-8")
    written = {str(p.relative_to(tmp_path)) for p in earlier_files(tmp_path)}
    assert written == {n for n in files(tmp_path) if not n.endswith("notes.txt")}
    write_study(longer, tmp_path, format="h5")
    assert set(files(tmp_path)) == {
        "manifest.toml", "truth.json", "study.h5", "notes.txt", "frames/notes.txt"
    }  # fmt: skip


@pytest.mark.parametrize("after", ["mha", "dicom"])
def test_a_file_that_would_be_read_as_a_frame_is_refused_and_all_stays(
    longer: Study, shorter: Study, tmp_path: Path, after: str
) -> None:
    write_study(longer, tmp_path, format=after)
    mine = tmp_path / "frames" / ("mine.mha" if after == "mha" else "frame_000/mine.dcm")
    mine.write_bytes(b"")
    there = files(tmp_path)
    with pytest.raises(ValueError, match=r"mine.*: would be read as a part of the study"):
        write_study(shorter, tmp_path, format=after)
    assert files(tmp_path) == there


def test_a_study_that_was_interrupted_is_ours(longer: Study, shorter: Study, tmp_path: Path) -> None:
    def interrupt(done: int, _frames: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_study(longer, tmp_path, progress=interrupt)
    assert len(earlier_files(tmp_path)) == 5
    write_study(shorter, tmp_path)
    assert len(files(tmp_path)) == 4


@pytest.mark.parametrize("format", ["mha", "h5"])
def test_scans_without_a_manifest_of_ours_are_overwritten_only_if_asked_for(
    shorter: Study, tmp_path: Path, format: str
) -> None:
    """A user's own reference.mha, frames/frame_000.mha and truth.json were gone, with exit code 0."""
    write_study(shorter, tmp_path, format)
    written = files(tmp_path)
    for name in written:
        (tmp_path / name).unlink()
    for name in written.keys() - {"manifest.toml"}:
        (tmp_path / name).write_text("mine", encoding="utf-8")
        with pytest.raises(ValueError, match=f"{name}: is in no study that synth wrote; .* or --fresh"):
            write_study(shorter, tmp_path, format)
        assert (tmp_path / name).read_text(encoding="utf-8") == "mine"
        (tmp_path / name).unlink()
    (tmp_path / "truth.json").write_text("mine", encoding="utf-8")
    write_study(shorter, tmp_path, format, fresh=True)
    assert files(tmp_path).keys() == written.keys()


@pytest.mark.parametrize(
    "change",
    [
        ('reference = "reference.mha"', 'reference = "other.mha"'),
        ('frames = "frames/*.mha"', 'frames = "../*.mha"'),
        ('truth = "truth.json"', 'truth = "../truth.json"'),
        ("[[case]]", "[[case]]\n[[case]]"),
        ("schema = 1", "schema = "),
    ],
)
def test_a_manifest_that_was_changed_is_written_over_only_if_asked_for(
    longer: Study, tmp_path: Path, change: tuple[str, str]
) -> None:
    """It was called none of synth's, with --fresh too; one without the line by which synth knows its own is none."""
    manifest = write_study(longer, tmp_path)
    written = files(tmp_path)
    text = manifest.read_text(encoding="utf-8").replace(*change)
    manifest.write_text(text.rpartition("# written by synth")[0], encoding="utf-8")
    there = files(tmp_path)
    with pytest.raises(ValueError, match=r"manifest\.toml: is not a manifest that synth wrote"):
        write_study(longer, tmp_path, fresh=True)
    assert files(tmp_path) == there
    manifest.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=r"manifest\.toml: was changed since synth wrote it, .*--fresh overwrites it"):
        write_study(longer, tmp_path)
    write_study(longer, tmp_path, fresh=True)
    assert files(tmp_path) == written


def test_a_study_whose_truth_is_gone_is_written_anew_only_if_asked_for(longer: Study, tmp_path: Path) -> None:
    write_study(longer, tmp_path)
    written = files(tmp_path)
    (tmp_path / "truth.json").unlink()
    with pytest.raises(ValueError, match=r"truth\.json: is missing, .* --fresh writes the study anew"):
        write_study(longer, tmp_path)
    write_study(longer, tmp_path, fresh=True)
    assert files(tmp_path) == written


def test_a_file_in_place_of_the_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "study").write_text("", encoding="utf-8")
    assert in_the_way(tmp_path / "study", "mha", 1) == [f"{tmp_path / 'study'}: is a file; give a folder"]


def test_the_manifest_names_as_many_frames_as_there_are(longer: Study, shorter: Study, tmp_path: Path) -> None:
    for study in (longer, shorter, replace(longer, name="again")):
        case = tomllib.loads(write_study(study, tmp_path).read_text(encoding="utf-8"))["case"][0]
        assert len(list(tmp_path.glob(case["frames"]))) == len(study.truth)
        assert len(json.loads((tmp_path / case["truth"]).read_text(encoding="utf-8"))["frames"]) == len(study.truth)
