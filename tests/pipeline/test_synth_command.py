"""``wireval synth`` on the command line: what is wrong is one line and exit code 2, never a traceback."""

from __future__ import annotations

import importlib.util
import json
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.cli import main
from pipeline.commands import synth
from tests.later import later


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["bnd"], "did you mean 'bend'"),
        ([], "give one of NAME"),
        (["bend", "--anatomy", "x.swc"], "give one of NAME"),
        (["--anatomy", "nothing.swc"], "nothing.swc: no such file"),
        (["--anatomy", "nothing.swc", "--scanner", "conebeam"], "only the catalogue's scenes"),
        (["bend", "--friction", "-0.1"], "--friction -0.1: expected 0 to 1"),
        (["bend", "--friction", "nan"], "--friction nan: expected 0 to 1"),
    ],
)
def test_wrong_words(tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], expected: str) -> None:
    assert main(["synth", *words, "-o", str(tmp_path / "out")]) == 2
    assert expected in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_folder_is_a_background_of_slices_and_no_anatomy(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for option, expected in (("--anatomy", "this is a folder"), ("--background", "holds no DICOM series")):
        assert main(["synth", option, str(tmp_path), "-o", str(tmp_path / "out")]) == 2
        assert expected in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["bend", "--frames", "0"], "frames: got 0; allowed: 1 or more"),
        (["bend", "--size", "3"], "allowed for bend: 48 or more for 4 voxels across a lumen of 4.0 mm"),
        (["bend", "--size", "0"], "allowed for bend: 48 or more"),
        (["bend", "--size", "-1"], "allowed for bend: 48 or more"),
        (["straight", "--size", "64"], "allowed for straight: 72 or more"),
        (["siphon", "--size", "64"], "allowed for siphon: 82 or more for voxels no wider than 1.8 wires"),
        (["bend", "--voxel-mm", "0"], "voxel-mm: got 0; allowed: above 0"),
        (["bend", "--voxel-mm", "-0.5"], "voxel-mm: got -0.5; allowed: above 0"),
        (["bend", "--voxel-mm", "nan"], "voxel-mm: got nan; allowed: above 0"),
        (["bend", "--seed", "-1"], "seed: got -1; allowed: 0 or more"),
        (["bend", "--size", "1000000"], "size: got 1000000; allowed: up to 1500 (65 GiB of memory)"),
        (["bend", "--size", "1" + "0" * 4000], "size: got a number of more than 20 digits; allowed: up to 1500"),
        (["bend", "--frames", "1" + "0" * 4000], "frames: got a number of more than 20 digits; allowed: up to 10000"),
        (["bend", "--frames", "1" + "0" * 9, "--insertions", "2"], "frames: got 1000000000; allowed: up to 10000"),
        (["bend", "--insertions", "1" + "0" * 4000], "--insertions: expected 1 to 1000"),
    ],
)
def test_wrong_numbers_are_refused_before_any_truth_is_computed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, words: list[str], expected: str
) -> None:
    monkeypatch.setattr("data_synthetic.catalogue.build", lambda *_args, **_numbers: pytest.fail("built"))
    assert main(["synth", *words, "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err.splitlines()
    assert expected in said[0]
    assert said[1:] == ["1 problem in the command line; nothing was run"]
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("more", [[], ["--insertions", "2"]], ids=["one", "several"])
def test_a_full_disk_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, more: list[str]
) -> None:
    """ITK raises a RuntimeError."""

    def full(*_: object, **__: object) -> None:
        raise RuntimeError("Exception thrown in WriteImage: ... No space left on device.")

    monkeypatch.setattr("SimpleITK.WriteImage", full)
    assert main(["synth", "bend", "--size", "48", "--frames", "1", *more, "-o", str(tmp_path / "out")]) == 1
    assert "cannot be written: No space left on device; make room" in capsys.readouterr().err


def test_scans_that_do_not_fit_into_memory_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def build(*_: object, **__: object) -> None:
        raise MemoryError

    monkeypatch.setattr("data_synthetic.catalogue.build", build)
    assert main(["synth", "bend", "-o", str(tmp_path / "out")]) == 2
    assert "the scans do not fit into memory; give a smaller --size" in capsys.readouterr().err


def test_a_study_written_over_an_earlier_one_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["synth", "short-wire", "-o", str(tmp_path / "study"), "--size", "54"]
    for frames in ("3", "2"):
        assert main([*words, "--frames", frames]) == 0
    assert "an earlier study is replaced: its 6 files are removed" in capsys.readouterr().out
    assert main([*words, "--frames", "2", "-q"]) == 0
    quiet = capsys.readouterr()
    assert len(quiet.out.splitlines()) == 1
    assert "manifest: " in quiet.out
    assert quiet.err == ""
    assert len(list((tmp_path / "study" / "frames").iterdir())) == 2
    (tmp_path / "study" / "frames" / "mine.mha").write_bytes(b"")
    assert main([*words, "--frames", "2"]) == 2
    assert "mine.mha: would be read as a part of the study" in capsys.readouterr().err


@pytest.mark.parametrize("more", [[], ["--insertions", "2"]], ids=["one", "several"])
def test_a_manifest_that_was_changed_is_not_overwritten(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], more: list[str]
) -> None:
    """The how-to on calibration has a study's roles changed; with -q they were gone without a word."""
    words = ["synth", "short-wire", "-o", str(tmp_path), "--size", "54", "--frames", "1", "-q", *more]
    manifest = tmp_path / "manifest.toml"
    assert [main(words), main(words)] == [0, 0]
    written = manifest.read_text(encoding="utf-8")
    manifest.write_text(written.replace('"validation"', '"calibration"'), encoding="utf-8")
    assert main(words) == 2
    assert f"{manifest}: was changed since synth wrote it" in capsys.readouterr().err
    assert "calibration" in manifest.read_text(encoding="utf-8")
    assert main([*words, "--fresh"]) == 0
    assert manifest.read_text(encoding="utf-8") == written


def test_a_study_that_was_interrupted_is_called_incomplete(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its manifest is written first: it was told to hold too many depths."""
    assert main(["synth", "short-wire", "-o", str(tmp_path), "--size", "54", "--frames", "2", "-q"]) == 0
    (tmp_path / "frames" / "frame_001.mha").unlink()
    assert main(["check", str(tmp_path)]) == 2
    assert "the study is incomplete: give synth again" in capsys.readouterr().err


def test_no_folder(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["synth", "bend"]) == 2
    assert "-o DIR is missing" in capsys.readouterr().err


def test_the_list_gives_each_scene_its_reason(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["synth", "--list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) >= 20
    assert all(len(line.split(maxsplit=1)[1]) > 10 for line in lines)


@pytest.mark.skipif(importlib.util.find_spec("itk") is not None, reason="the extra [conebeam] is installed")
def test_an_absent_extra_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["synth", "bend", "-o", str(tmp_path), "--frames", "1", "--size", "32", "--scanner", "conebeam"]
    assert main(words) == 2
    assert "wireval[conebeam]" in capsys.readouterr().err


@pytest.mark.slow
def test_an_anatomy_file_becomes_a_study(tmp_path: Path) -> None:
    """A straight tube as SWC, radius 2 mm, 60 mm long."""
    rows = [f"{i + 1} 3 0 0 {i} 2.0 {i if i else -1}" for i in range(61)]
    (tmp_path / "tube.swc").write_text("\n".join(rows), encoding="utf-8")
    words = ["--anatomy", str(tmp_path / "tube.swc"), "-o", str(tmp_path / "study"), "--frames", "2", "--size", "64"]
    assert main(["synth", *words]) == 0
    assert main(["check", str(tmp_path / "study" / "manifest.toml")]) == 0


@pytest.mark.parametrize("kind", ["nii.gz", "dicom", *later("nrrd", "h5")])
def test_every_format_goes_through_the_pipeline(tmp_path: Path, kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    """An oblique scan, so that a swapped axis or a lost direction would put the entry outside the vessel."""
    words = ["synth", "oblique", "-o", str(tmp_path / "study"), "--frames", "2", "--size", "64", "--format", kind]
    assert main(words) == 0
    run = ["run", str(tmp_path / "study" / "manifest.toml"), "-o", str(tmp_path / "out"), "--no-cache"]
    for asked in (["check", run[1]], [*run, "--dry-run"]):
        capsys.readouterr()
        assert main(asked) == 0
        assert "2 frames" in capsys.readouterr().out, "those of one HDF5 group, too, which were 1"
    # a page is drawn from what the run has written, whatever its scans were: one of them is enough
    assert main([*run, *(() if kind == "dicom" else ("--until", "compare"))]) == 0


def test_friction_of_the_true_wire_is_in_its_truth_and_its_manifest(tmp_path: Path) -> None:
    """Of every insertion: the planted error that a simulator without friction makes begins here."""
    few, ends = ["--size", "48", "--frames", "2", "--seed", "3"], {}
    for words in ([], ["--friction", "0.3"]):
        out = tmp_path / (words or ["none"])[-1]
        assert main(["synth", "bend", *few, *words, "--insertions", "2", "-o", str(out)]) == 0
        cases = tomllib.loads((out / "manifest.toml").read_text(encoding="utf-8"))["case"]
        assert [case["wall"]["friction"] for case in cases] == [0.3 if words else 0.0] * 2
        truth = [json.loads((out / case["truth"]).read_text(encoding="utf-8")) for case in cases]
        ends[out.name] = np.array([one["frames"][-1]["points_mm"][-1] for one in truth])
    assert np.all(np.linalg.norm(ends["0.3"] - ends["none"], axis=1) > 0.01)


@pytest.mark.quick(1)
@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL])
def test_no_process_outlives_the_command(how: signal.Signals, tmp_path: Path) -> None:
    """Insertions were drawn to their end, minutes after the command had been ended."""
    words = ["synth", "circle-of-willis", "-o", str(tmp_path), "--insertions", "16", "--size", "192", "-j", "2"]
    command = subprocess.Popen([sys.executable, "-m", "pipeline", *words], stderr=subprocess.DEVNULL)
    children = Path(f"/proc/{command.pid}/task/{command.pid}/children")
    _until(lambda: bool(children.read_text(encoding="ascii").split()))
    helpers = [Path("/proc") / number for number in children.read_text(encoding="ascii").split()]
    command.send_signal(how)
    assert command.wait() == (143 if how == signal.SIGTERM else -how)
    _until(lambda: not any(helper.exists() for helper in helpers))


def _until(holds: Callable[[], bool]) -> None:
    """Wait until it holds: for a minute, a fraction of what all insertions take."""
    for _ in range(600):
        if holds():
            return
        time.sleep(0.1)
    raise AssertionError("it never held")


@pytest.mark.parametrize(("slices_mm", "told"), [(2.5, True), (1.0, False)])
def test_slices_too_thick_for_a_wire_are_told_before_it_is_painted(slices_mm: float, told: bool) -> None:
    """`check` said of the study that was written that no trace is accepted in it."""
    grid = SimpleNamespace(spacing_mm=np.array([0.5, 0.5, slices_mm]))
    assert ("5.0 times as thick as its pixels" in synth._thick(SimpleNamespace(scan=(grid, None)))) == told
    assert synth._thick(SimpleNamespace(scan=None)) == ""
