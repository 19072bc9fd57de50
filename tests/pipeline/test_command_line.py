"""What is typed wrong is said in a line, with exit code 2 and no traceback; what is typed right does what it says."""

from __future__ import annotations

import io
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import SimpleITK as sitk

from pipeline.cli import main
from pipeline.commands.given import _other_manifests
from pipeline.run.gate import Gate, gate
from pipeline.run.guards import guard_apart
from pipeline.status import UsageError
from pipeline.streams import Lasting
from pipeline.study.explain import described
from pipeline.study.own_lumen import fitting
from pipeline.study.settings import Config, SettingsError, parse_assignment, read_settings, resolve
from pipeline.wording import in_words
from solver import Grid


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scans")
    assert main(["synth", "straight", "-o", str(folder), "--size", "72", "--frames", "2"]) == 0
    return folder


@pytest.fixture
def scans(study: Path, tmp_path: Path) -> Path:
    """A folder of scans without a manifest."""
    folder = tmp_path / "own scans"
    shutil.copytree(study, folder, ignore=shutil.ignore_patterns("*.toml", "*.json"))
    return folder


TOO_LONG = (
    "check LONG", "check STUDY -c LONG", "run LONG -o y", "run STUDY -o LONG", "run STUDY -o y --junit LONG",
    "run STUDY -o y --parameters LONG", "score STUDY -o y --curves LONG", "score STUDY -o y --curves x=LONG",
    "init STUDY --to y --reference LONG", "synth --anatomy LONG -o y", "synth --background LONG -o y", "report LONG",
    "diff LONG y", "diff STUDY STUDY --tolerance LONG", "diff STUDY STUDY --json LONG",
)  # fmt: skip
"""Names that no system takes."""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("runn x -o y", "did you mean 'run'?"),
        ("run x -o y --resme", "did you mean '--resume'?"),
        ("cache --info x", "one argument too many"),
        (
            "run STUDY STUDY/manifest.toml -o y",
            "manifest.toml: run takes one manifest; several are joined into one, as",
        ),
        ("run STUDY STUDY -o y", "or run one by one, each with an OUT of its own"),
        ("run a.toml b.toml -o y", "b.toml: run takes one manifest"),
        ("check STUDY STUDY/manifest.toml", "or run one by one"),
        (
            "run m.toml -o out --only a b c",
            "b: not an option of wireval run; --only takes one value; repeat it: --only b",
        ),
        ("check STUDY/reference.mha", "a scan is no manifest; give its folder"),
        ("run STUDY/reference.mha -o y", "wireval init"),
        ("run STUDY -o STUDY/reference.mha", "this is a file; name a folder"),
        ("run STUDY -o STUDY", "this is the folder of the inputs; name another one"),
        ("run STUDY/manifest.toml -o STUDY", "this is the folder of the inputs; name another one"),
        ("run STUDY -o STUDY/reference.mha/below", "cannot be written: Not a directory"),
        ("run STUDY -o /proc/none", "cannot be written: No such file or directory"),
        ("run STUDY -o y --junit STUDY", "this is a folder; name a file"),
        ("run STUDY -o y --junit STUDY/reference.mha/x.xml", "cannot be written"),
        ("synth straight -o /proc/none", "cannot be written"),
        ("bench --quick -o /proc/none", "cannot be written"),
        ("run STUDY -o y --fail-if rms>1", "did you mean 'rms_mm'?"),
        ("run STUDY -o y --fail-if rms_mm", "in a shell put it in quotes: a bare > writes into a file"),
        ("run STUDY -o y --fail-if rms_mm>nan", "write a column"),
        ("run STUDY -o y --fail-if rms_mm>inf", "write a column"),
        ("run STUDY -o y --fail-if rms_mm>1e999", "write a column"),
        ("run STUDY -o y --fail-if max_mm>1_0", "a limit in plain digits, as in"),  # was taken for 10
        ("run STUDY -o y --fail-if max_mm>\N{FULLWIDTH DIGIT ONE}", "a limit in plain digits, as in"),
        ("run STUDY -o y --fail-if case>1", "no number 'case'"),
        (
            "run STUDY -o y --fail-if strongest_null>1",
            "in overall.csv: it is a text; numbers are rms_mm, tip_median_mm",
        ),
        ("run STUDY -o y --fail-if status>0", "frames_failed and those in docs/reference/columns.md"),
        ("run STUDY -o y --fail-if tip_mm>9", "did you mean 'tip_median_mm'?"),
        ("init STUDY", "is there already"),
        ("init STUDY/none", "no such folder"),
        ("init STUDY/reference.mha", "this is a file; give a folder that holds scans"),
        ("RUN STUDY -o y", "did you mean 'run'?"),
        ("run STUDY -o y --fail-if RMS_MM>1", "did you mean 'rms_mm'?"),
        ("run STUDY -o y --fail-if mine:rms_mm>1", "no simulator 'mine'; only score has several"),
        ("score STUDY -o y --curves mine=. --fail-if min:rms_mm>1", "no simulator 'min'; did you mean 'mine'?"),
        ("init STUDY --to /proc/none/m.toml", "cannot be written"),
        ("init STUDY --to y --entry 900,0,0 --direction 0,0,1", "lies outside the scan"),
        ("init STUDY --to y --wire-radius -1", "radius_mm"),
        ("init STUDY --to y --reference STUDY/none.mha", "no such scan"),
        ("settings solver.segmnt_mm", "did you mean 'solver.segment_mm'?"),
        ("run", "missing: MANIFEST, -o; wireval run --help lists what there is"),
        ("run STUDY -o", "-o: its value is missing"),
        ("cache --limit -1G", "--limit: its value is missing (one that begins with - is written --limit=-VALUE)"),
        (f"cache --limit {'9' * 400}G", "expected a size with its unit, as in 20G or 500M"),
        (f"run STUDY -o y --shard 1/{'9' * 400}", "expected I/N with 1 <= I <= N, as in 3/20"),
        ("run STUDY -o EMPTY", "an empty argument"),
        ("run STUDY -o y -j x", "-j 'x': expected a whole number"),
        ("report STUDY -j 0", "-j 0: expected 1 or more"),
        ("run STUDY -o y --case-timeout 1m", "--case-timeout '1m': expected a number of seconds, as 60"),
        ("run STUDY -o y --case-memory 2G", "--case-memory '2G': expected a number of MiB, as 2048"),
        ("score STUDY -o y --curve mine=x", "--curve: not an option of wireval score; did you mean '--curves'?"),
        ("run STUDY -o y -q -v", "-v and -q: give one of them"),
        ("run STUDY -o y --resume --fresh", "--resume and --fresh: keep what fits, or compute again"),
        ("run STUDY -o y --entry 1,2,3", "--entry: of a folder of scans"),
        ("check STUDY --wire-radius 3", "--wire-radius: of a folder of scans"),
        ("run STUDY -o y -c STUDY", "this is a folder"),
        ("run STUDY -o y -c STUDY/none.toml", "none.toml: no such file; wireval settings prints one"),
        ("synth straight -o y --format foo", "--format 'foo': allowed: 'mha', 'nrrd'"),
        ("bench -o y --stress --scenes -1", "--scenes -1: expected 1 to 1000000"),
        (f"bench -o y --stress --scenes 1{4000 * '0'}", "--scenes of more than 12 digits: expected 1 to 1000000"),
        *((words.replace("LONG", 5000 * "n"), "(File name too long)") for words in TOO_LONG),
        ("score STUDY --curves x=/dev/zero -o y", "/dev/zero: this is a device; allowed: a regular file"),
        ("bench -o y --snaps --seed -1", "--seed -1: expected 0 or more"),
        ("bench STUDY -o y --stress", "leave the manifest out"),
        ("cache", "missing: one of --info, --check, --limit, --prune"),
    ],
)
def test_what_is_wrong_is_said(
    words: str, said: str, study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    typed = [
        str(tmp_path / "y") if w == "y" else w.replace("STUDY", str(study)).replace("EMPTY", "") for w in words.split()
    ]
    assert main(typed) == 2
    heard = capsys.readouterr().err.strip().splitlines()
    assert said in heard[0]
    assert len(heard) == 2, "the problem, and how many there are"
    assert "usage:" not in "".join(heard)
    assert not (tmp_path / "y").exists(), "nothing is left behind"


def test_a_place_is_tried_without_leaving_anything(tmp_path: Path) -> None:
    from pipeline.commands import unwritable

    assert unwritable(tmp_path / "a" / "b", "-o", folder=True) == []
    assert unwritable(tmp_path / "a" / "b.xml", "--junit") == []
    (tmp_path / "there.xml").write_text("before", encoding="utf-8")
    assert unwritable(tmp_path / "there.xml", "--junit") == []
    assert [path.name for path in tmp_path.iterdir()] == ["there.xml"]
    assert unwritable(Path("x" * 300), "-o", folder=True)


def test_an_output_that_is_a_link_to_nothing_is_called_so(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """ "File exists; make room" was said of it."""
    link = tmp_path / "link"
    link.symlink_to(tmp_path / "gone")
    for out in (link, link / "below"):
        assert main(["run", str(study), "-o", str(out)]) == 2
        said = f"-o {out}: {link} is a link to nothing ({tmp_path / 'gone'}); remove it, or name a folder\n"
        assert capsys.readouterr().err.startswith(said)


def test_a_folder_is_checked_as_it_is_run(study: Path, scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(study)]) == 0
    assert main(["check", str(scans)]) == 0
    assert "assumed, not confirmed: case 'own_scans': wire: radius 0.18 mm" in capsys.readouterr().out
    assert not list(scans.rglob("*.toml")), "check writes nothing"


def test_a_dry_run_of_a_folder_needs_no_empty_out(
    scans: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The inferred manifest was gone before its hash was asked for: a traceback."""
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "notes.txt").write_text("mine", encoding="utf-8")
    assert main(["run", str(scans), "-o", str(tmp_path / "out"), "--dry-run"]) == 2
    assert "is not empty and holds no run" in capsys.readouterr().err


def test_init_leaves_what_run_infers_and_names_scans_from_there(
    scans: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["init", str(scans)]) == 0
    text = (scans / "manifest.toml").read_text(encoding="utf-8")
    case = tomllib.loads(text)["case"][0]
    assert {note.partition(":")[0] for note in case["assumed"]} >= {
        "wire",
        "roll_deg",
        "material_axis",
        "entry_mm and entry_direction",
    }
    assert any(note.startswith("wall: 2.0 N/mm2, friction 0") for note in case["assumed"])
    assert case["frames"] == ["frames/frame_000.mha", "frames/frame_001.mha"]
    assert f"wireval check '{scans}/manifest.toml' && " in capsys.readouterr().out, "to be pasted as it stands"
    assert main(["check", str(scans.rename(tmp_path / "moved"))]) == 0, "the folder may be moved"
    assert "assumed, not confirmed" in capsys.readouterr().out


def test_a_guess_without_a_reference_is_called_poor_by_all(
    scans: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    next(scans.glob("reference.*")).unlink()
    assert main(["init", str(scans)]) == 0
    assert "such a guess is several mm off" in capsys.readouterr().out
    assert main(["check", str(scans)]) == 0
    assert "such a guess is several mm off" in capsys.readouterr().out
    main(["run", str(scans), "-o", str(tmp_path / "out"), "--until", "load", "-q"])
    assert len(capsys.readouterr().out.splitlines()) == 1, "-q: neither the manifest nor what it assumes"
    case = json.loads(next((tmp_path / "out").glob("cases/*/result.json")).read_text(encoding="utf-8"))
    assert {text.partition(":")[0] for text in case["assumptions"]} >= {"wire", "roll_deg", "material_axis"}
    assert main(["init", str(scans), "--to", str(tmp_path / "m.toml"), "--entry", "1,2,3", "--direction", "0,0,1"]) == 0
    told = tomllib.loads((tmp_path / "m.toml").read_text(encoding="utf-8"))["case"][0]
    assert (told["entry_mm"], told["entry_direction"]) == ([1, 2, 3], [0, 0, 1])
    assert not [text for text in told["assumed"] if text.startswith("entry")]


def test_without_a_reference_init_says_what_to_correct_and_how(
    scans: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The entry lies on the wire, and the lumen was to be found from there."""
    next(scans.glob("reference.*")).unlink()
    assert main(["run", str(scans), "-o", str(tmp_path / "out"), "--until", "trace", "-q"]) == 1
    assert f"next: wireval init '{scans}', correct in it what is assumed" in capsys.readouterr().err
    assert main(["init", str(scans), "--set", "load.most_gib=4"]) == 0
    said = capsys.readouterr().out
    assert "lumen_seed_mm: the entry, from where the vessel is segmented" in said
    assert said.count("/manifest.toml' --set load.most_gib=4") == 2, "what scans are read with is asked of them again"
    manifest = scans / "manifest.toml"
    text = manifest.read_text(encoding="utf-8")
    assert "change the signs of the first two numbers" in text
    assert "# lumen_seed_mm = [[x, y, z]]" in text
    assert "\nmaterial_axis" not in text, "it would be that of a direction which is corrected"
    manifest.write_text(
        text.replace("# lumen_seed_mm = [[x, y, z]]", "lumen_seed_mm = [[0.5, -1.0, 10.0]]"), encoding="utf-8"
    )
    assert main(["check", str(scans)]) == 0
    assert "lumen_seed_mm" not in capsys.readouterr().out, "what is stated is no longer assumed"


def test_a_wire_thinner_than_half_a_voxel_is_warned_of_and_a_fitted_roll_not_assumed(
    scans: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    manifest = scans / "manifest.toml"
    voxel = sitk.ReadImage(str(next(scans.glob("reference.*")))).GetSpacing()[0]
    for radius, warned in ((str(0.24 * voxel), True), (str(0.26 * voxel), False)):
        manifest.unlink(missing_ok=True)
        assert main(["init", str(scans), "--wire-radius", radius]) == 0
        text = manifest.read_text(encoding="utf-8").replace('wire = "assumed"', 'wire = "assumed"\nroll_deg = "fit"')
        manifest.write_text(text, encoding="utf-8")
        capsys.readouterr()
        assert main(["check", str(manifest)]) == 0
        assert ("less than half a voxel" in capsys.readouterr().out) == warned, "headers and manifest show it"
        main(["run", str(scans), "-o", str(tmp_path / radius), "--until", "load"])
        told = json.loads(next((tmp_path / radius).glob("cases/*/result.json")).read_text(encoding="utf-8"))
        assert any("less than half a voxel" in line for line in told["warnings"]) == warned
        assert ("less than half a voxel" in capsys.readouterr().out) == warned
        assert not [line for line in told["assumptions"] if line.startswith("roll_deg: 0")]


def test_init_takes_what_is_said_of_the_scans(scans: Path, tmp_path: Path) -> None:
    next(scans.glob("reference.*")).rename(scans / "empty_phantom.mha")
    words = ["--reference", str(scans / "empty_phantom.mha"), "--to", str(tmp_path / "m.toml"), "--entry", "1,2,3"]
    assert main(["init", str(scans), *words]) == 0
    case = tomllib.loads((tmp_path / "m.toml").read_text(encoding="utf-8"))["case"][0]
    assert case["reference"] == str(scans / "empty_phantom.mha")
    assert len(case["frames"]) == 2
    assert [text.partition(":")[0] for text in case["assumed"] if text.startswith("entry")] == ["entry_direction"]


def test_two_references_are_a_question(scans: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The second one was a frame of the manifest."""
    first = next(scans.glob("reference.*"))
    shutil.copy(first, scans / "reference.MHA")
    assert main(["init", str(scans)]) == 2
    assert "reference.MHA and reference.mha: each has the name of a scan without wire" in capsys.readouterr().err
    assert main(["init", str(scans), "--reference", str(first), "--to", str(tmp_path / "m.toml")]) == 0
    assert "left out: reference.MHA" in capsys.readouterr().out
    case = tomllib.loads((tmp_path / "m.toml").read_text(encoding="utf-8"))["case"][0]
    assert [Path(name).name for name in case["frames"]] == ["frame_000.mha", "frame_001.mha"]


def test_a_stray_scan_and_one_that_stands_alone_are_named(scans: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Scans beside frames/ come before those in it: one without a wire is the first frame."""
    reference = sitk.ReadImage(str(next(scans.glob("reference.*"))))
    sitk.WriteImage(reference, str(scans / "after.mha"))
    assert main(["init", str(scans)]) == 2
    assert f"{scans / 'after.mha'}: no wire is visible in it, the first frame" in capsys.readouterr().err
    (scans / "after.mha").unlink()
    shutil.rmtree(scans / "frames")
    assert main(["init", str(scans)]) == 2
    assert "found reference.mha alone, a reference, and no frames" in capsys.readouterr().err
    (scans / "study.h5").touch()
    assert main(["init", str(scans)]) == 2
    assert 'study.h5: name its items in a manifest, as frames = "study.h5#/frames"' in capsys.readouterr().err


def test_settings_are_a_file_that_reads_back_as_the_defaults(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["settings"]) == 0
    path = tmp_path / "all.toml"
    path.write_text(capsys.readouterr().out, encoding="utf-8")
    assert resolve(read_settings(path)).config == Config()
    for one in described():
        assert one.meaning.endswith("."), f"{one.name} has no sentence"
        assert one.allowed not in ("any", "a text", "a list"), f"{one.name} says not what it may be"
    assert main(["settings", "solver.hull"]) == 0
    assert capsys.readouterr().out.splitlines()[0] == "[solver]"


def test_what_settings_call_allowed_is_what_is_allowed() -> None:
    """A number on the wrong side of the range that is shown is refused, for every setting with a range."""
    for one in described():
        for word, wrong in (("above ", 0), ("from ", -1e-3)):
            if word in one.allowed and f"{word}0" in one.allowed:
                with pytest.raises(SettingsError):
                    resolve([parse_assignment(f"{one.name}={wrong}")])
    assert (
        in_words({"anyOf": [{"type": "null"}, {"type": "integer", "minimum": 2}]})
        == "left out or a whole number from 2"
    )


@pytest.mark.parametrize("below", ["cases/straight/view", "sweep/x", "simulators/y/cases"])
def test_inputs_where_results_are_removed_are_refused(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], below: str
) -> None:
    """Curves that were corrected in the folder that a run had written them to were removed by the next one."""
    out = tmp_path / "out"
    (out / below).mkdir(parents=True)
    curve = out / below / "wire_traced_000.csv"
    curve.write_text("x_mm,y_mm,z_mm\n0,0,0\n0,0,9\n", encoding="utf-8")
    text = (study / "manifest.toml").read_text(encoding="utf-8").replace("truth = ", f'lumen = "{curve}"\ntruth = ', 1)
    (study / "own.toml").write_text(text, encoding="utf-8")
    for words in (["run"], ["score", "--curves", f"mine={tmp_path}"]):
        assert main([words[0], str(study / "own.toml"), "-o", str(out), *words[1:], "--fresh"]) == 2
        heard = capsys.readouterr().err
        assert "a run removes earlier results there" in heard or "holds no score" in heard
    assert curve.exists()


@pytest.mark.parametrize("below", [".", "out"])
def test_no_result_lies_among_the_slices_of_a_scan(tmp_path: Path, below: str) -> None:
    """All that lies in a DICOM frame's folder is read as the scan: it had changed after every run."""
    frame = tmp_path / "frames" / "000"
    frame.mkdir(parents=True)
    with pytest.raises(UsageError, match="are read as a scan; name a folder outside of it"):
        guard_apart(frame / below, [tmp_path / "reference.mha", frame])
    guard_apart(tmp_path / "frames" / "out", [tmp_path / "reference.mha", frame])


def test_a_gate_closes_on_the_limit_s_far_side_and_on_nothing_to_go_by() -> None:
    assert gate("rms_mm > 0.5") == Gate("rms_mm", ">", 0.5)
    for text, limit in (("5e-1", 0.5), (".5", 0.5), ("-1.", -1.0), ("+1E3", 1e3)):
        assert gate(f"skill>{text}") == Gate("skill", ">", limit)
    assert "rms_mm is 0.6" in gate("rms_mm>0.5").closed({"rms_mm": 0.6})
    assert not gate("rms_mm>0.5").closed({"rms_mm": 0.5})
    assert gate("rms_mm>=0.5").closed({"rms_mm": 0.5})
    assert gate("frames_ok<3").closed({"frames_ok": 2})
    withheld = {"rms_low_mm": float("nan"), "interval": "interval withheld: 1 insertion, at least 3 needed"}
    assert "no rms_low_mm: interval withheld: 1 insertion" in gate("rms_low_mm>0.5").closed(withheld)
    assert "no case was scored" in gate("rms_mm>0.5").closed({})
    many, one = gate("warnings>0").closed({"warnings": 5}), gate("warnings>0").closed({"warnings": 1})
    assert many.endswith("warnings is 5 (in each case and of the run; what cases say alike is one line on a page)")
    assert one.endswith("warnings is 1"), "a page shows one, too"
    for nothing in ({}, {"rms_mm": None}, {"rms_mm": float("nan")}):
        assert "cannot be shown" in gate("rms_mm>0.5").closed(nothing)


def test_lines_that_are_written_at_once_outlast_their_reader() -> None:
    """The stream's own ``writelines`` went past what discards them."""
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, "w", encoding="utf-8") as gone:
        stream = Lasting(gone)
        stream.writelines(["a line\n"] * 20_000)
        stream.flush()
    assert not stream.lost, "a reader that has gone is no full disk"


def test_a_wrong_gate_is_refused_before_what_takes_seconds_is_imported() -> None:
    words = ["run", "study", "-o", "out", "--fail-if", "foo>1"]
    code = f"import sys; from pipeline.cli import main; print(main({words}), 'numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["2", "False"]
    assert "no number 'foo'" in done.stderr


def test_other_settings_ask_before_they_overwrite(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Until load: what is under test is the door, and the gate behind it."""
    words = ["run", str(study), "-o", str(tmp_path / "out"), "--until", "load", "-q"]
    assert main([*words, "--fail-if", "rms_mm>1"]) == 1
    heard = capsys.readouterr().err
    assert "cannot be shown to hold" in heard
    assert "[straight]" not in heard, "-q prints the result alone"
    assert main([*words, "--set", "solver.step_mm=0.5"]) == 2
    assert "solver.step_mm 1.0 before, 0.5 now" in capsys.readouterr().err
    code = main(words)
    assert main([*words, "--set", "solver.step_mm=0.5", "--fresh"]) == code != 2
    assert main([*words, "--set", "solver.step_mm=0.25", "--resume"]) == code


def test_the_package_runs_and_completes(tmp_path: Path) -> None:
    """Names of files, too, which it had not."""
    done = subprocess.run(
        [sys.executable, "-m", "pipeline", "--print-completion", "bash"], capture_output=True, text=True, check=True
    )
    assert "--fail-if" in done.stdout
    (tmp_path / "study").mkdir()
    for words in (["run", "st"], ["run", "x", "-o", "st"], ["diff", "x", "st"]):
        typed = shlex.join(["wireval", *words])
        asked = f'COMP_WORDS=({typed}); COMP_CWORD={len(words)}; _shtab_wireval; echo "${{COMPREPLY[@]}}"'
        found = subprocess.run(
            ["bash", "-c", f"{done.stdout}\n{asked}"], capture_output=True, text=True, check=True, cwd=tmp_path
        )
        assert found.stdout.strip() == "study", words


@pytest.mark.slow
@pytest.mark.parametrize("closed", ["stdout", pytest.param("stderr", marks=pytest.mark.slow)])
def test_a_reader_that_has_gone_does_not_change_the_exit_code(study: Path, tmp_path: Path, closed: str) -> None:
    """A gate in a pipe, ``wireval run | head -1``, said that all was well; and the verb has to finish."""
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, "wb") as gone:
        others = dict.fromkeys(("stdout", "stderr"), subprocess.DEVNULL)
        run = [sys.executable, "-m", "pipeline", "run", str(study), "-o", str(tmp_path / "out"), "--until", "load"]
        done = subprocess.run([*run, "--fail-if", "rms_mm>0.5"], **(others | {closed: gone}), check=False)
    assert done.returncode == 1
    assert (tmp_path / "out" / "index.html").exists()


def test_each_gate_is_a_test(study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["run", str(study), "-o", str(tmp_path / "out"), "--until", "load", "--junit", str(tmp_path / "x.xml")]
    assert main([*words, "--fail-if", "rms_mm>0.5"]) == 1
    assert "\nFAIL: gate closed: --fail-if rms_mm>0.5" in f"\n{capsys.readouterr().err}"
    suite = ET.parse(tmp_path / "x.xml").getroot().findall("testsuite")[-1]
    assert (suite.get("name"), suite.get("tests"), suite.get("failures")) == ("gates", "1", "1")
    assert "gate closed" in str(suite[0][0].get("message"))


SUMMARIES = {
    "junit": "<?xml version='1.0' encoding='utf-8'?>\n<testsuites name=\"wireval diff\"></testsuites>",
    "json": '{\n "schema": 1,\n "closed": false,\n',
    "markdown": "**no worse**\n\nfirst: `a`, second: `b`\n",
    "html": "<!doctype html>\n<title>Two runs beside each other - wireval</title>",
}


def test_a_refused_command_leaves_no_summary_of_an_earlier_one(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A build server read the file of the run before, in which all had passed."""
    old = {name: tmp_path / f"old.{name}" for name in SUMMARIES}
    for name, path in old.items():
        path.write_text(SUMMARIES[name], encoding="utf-8")
    assert main(["run", str(tmp_path / "none"), "-o", str(tmp_path / "out"), "--junit", str(old["junit"])]) == 2
    assert not old["junit"].exists()
    old["junit"].touch()
    asked = [word for name, path in old.items() for word in (f"--{name}", str(path))]
    assert main(["diff", str(tmp_path / "a"), str(tmp_path / "b"), *asked]) == 2
    assert not any(path.exists() for path in old.values())


@pytest.mark.parametrize("name", SUMMARIES)
def test_what_is_no_summary_is_not_replaced_by_one(
    name: str, study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A scan, a result or a device was removed for one, and the command then missed it."""
    scan, pipe, long = tmp_path / "reference.mha", tmp_path / "pipe", tmp_path / ("n" * 300)
    scan.write_bytes(b"ObjectType = Image\n")
    os.mkfifo(pipe)
    words = ["run", str(study), "-o", str(tmp_path / "out")] if name == "junit" else ["diff", str(study), str(study)]
    for path, said in ((scan, "no earlier summary"), (pipe, "a device or a pipe"), (long, "too long")):
        assert main([*words, f"--{name}", str(path)]) == 2
        assert said in capsys.readouterr().err
    assert scan.read_bytes() == b"ObjectType = Image\n"
    assert pipe.is_fifo()
    if name == "junit":
        assert main([*words, "--junit", str(tmp_path / "out")]) == 2
        assert "the folder of the results; name a file" in capsys.readouterr().err


def test_a_dry_run_leaves_a_summary(study: Path, tmp_path: Path) -> None:
    kept = tmp_path / "junit.xml"
    kept.write_text(SUMMARIES["junit"], encoding="utf-8")
    assert main(["run", str(study), "-o", str(tmp_path / "out"), "--junit", str(kept), "--dry-run"]) == 0
    assert kept.exists(), "a dry run does nothing"


def test_check_does_not_say_that_nothing_was_run(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(study / "none.toml")]) == 2
    assert "nothing was run" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "counted"),
    [
        ("check {}", "1 problem in {}"),
        ("run {} -o {}/out", "1 problem in {}; nothing was run"),
        ("init {}", "1 problem in {}; nothing was run"),
        ("report {}", "1 problem in {}; nothing was drawn"),
    ],
)
def test_an_empty_folder_is_called_by_its_name(
    words: str, counted: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It had been a problem in the command line, or in OUT."""
    assert main(words.replace("{}", str(tmp_path)).split()) == 2
    assert capsys.readouterr().err.splitlines()[-1] == counted.format(tmp_path)


def test_check_tells_a_copied_frame_and_one_that_is_cut_short_at_once(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = shutil.copytree(study, tmp_path / "study")
    shutil.copy(folder / "reference.mha", folder / "frames" / "frame_000.mha")
    with (folder / "frames" / "frame_001.mha").open("r+b") as file:
        file.truncate(1000)
    assert main(["check", str(folder)]) == 2
    said = capsys.readouterr().err
    assert "has the content of the reference" in said
    assert "cut short" in said


def _twice(study: Path, place: Path) -> Path:
    """A study of two cases with the same scans, the second one's files in a folder of its own."""
    folder = shutil.copytree(study, place)
    shutil.copytree(study, folder / "other", ignore=shutil.ignore_patterns("manifest.toml"))
    text = (folder / "manifest.toml").read_text("utf-8")
    case = text[text.index("[[case]]") :].replace('id = "straight"', 'id = "other"')
    for name in ("frames/", "reference.mha", "truth/"):
        case = case.replace(f'"{name}', f'"other/{name}')
    (folder / "manifest.toml").write_text(f"{text}\n{case}", encoding="utf-8")
    return folder


def test_what_cannot_be_read_hides_nothing_else_of_its_case(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A missing reference hid a frame that is cut short, and that an entry outside the scan."""
    folder = shutil.copytree(study, tmp_path / "study")
    (folder / "reference.mha").unlink()
    (folder / "frames" / "frame_000.mha").write_text("no scan", encoding="utf-8")
    with (folder / "frames" / "frame_001.mha").open("r+b") as file:
        file.truncate(1000)
    text = (folder / "manifest.toml").read_text("utf-8").splitlines()
    moved = [line if not line.startswith("entry_mm") else "entry_mm = [500, 0, 0]" for line in text]
    (folder / "manifest.toml").write_text("\n".join(moved), encoding="utf-8")
    assert main(["check", str(folder)]) == 2
    said = capsys.readouterr().err
    for problem in ("reference.mha: no such file", "frame_000.mha: cannot read it", "cut short", "outside the scan"):
        assert problem in said


@pytest.mark.parametrize(
    ("entry", "told"),
    [
        ([-50.0, -60.0, 5.0], "is it in RAS? Read so, [50.0, 60.0, 5.0], it lies there"),
        ([0.05, 0.06, 0.005], "is it in m? Read so, [50.0, 60.0, 5.0], it lies there"),
        ([5.0, 6.0, 0.5], "is it in cm? Read so, [50.0, 60.0, 5.0], it lies there"),
        ([5.0, 60.0, 50.0], "is it written as z, y, x? Read so, [50.0, 60.0, 5.0], it lies there"),
        ([-5.0, -6.0, 0.5], "is it in RAS and in cm? Read so, [50.0, 60.0, 5.0], it lies there"),
        ([500.0, 0.0, 0.0], "is one of them in RAS, or in another unit than mm?"),
    ],
)
def test_what_would_put_an_entry_into_the_lumen_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], entry: list[float], told: str
) -> None:
    rows = [f"{i + 1} 3 50 60 {i} 2.0 {i if i else -1}" for i in range(61)]
    (tmp_path / "tube.swc").write_text("\n".join(rows), encoding="utf-8")
    case = f'id = "a"\nlumen = "tube.swc"\nentry_mm = {entry}\nentry_direction = [0, 0, 1]\nwire = "w"\n'
    wire = "schema = 1\n[wires.w]\nradius_mm = 0.18\nbending_stiffness_N_mm2 = 5.0\n"
    text = f"{wire}[[case]]\n{case}insertion_mm = [9]\n[case.wall]\nstiffness_N_mm2 = 2.0\n"
    (tmp_path / "manifest.toml").write_text(text, encoding="utf-8")
    assert main(["check", str(tmp_path)]) == 2
    assert told in capsys.readouterr().err
    (tmp_path / "manifest.toml").write_text(text.replace("tube.swc", "tubes.swc"), encoding="utf-8")
    assert main(["check", str(tmp_path)]) == 2
    assert "tubes.swc: no such file or folder; did you mean 'tube.swc'?" in capsys.readouterr().err


@pytest.mark.parametrize(("entry", "told"), [([9.0, 70.0, 20.0], "is it in voxels? Read so"), ([9.0, 70.5, 20.0], "")])
def test_an_entry_of_whole_numbers_alone_may_be_in_voxels(entry: list[float], told: str) -> None:
    """In a scan of 60 mm from 0 on, in voxels of 0.3 mm, any other wrong entry was told to be in voxels, too."""
    scan = Grid(np.zeros((200, 200, 200), np.int8), np.full(3, 0.3), np.zeros(3))
    said = fitting(entry, lambda point: bool(np.all((point >= 0.0) & (point <= 60.0))), scan)
    assert said.startswith(told)
    assert bool(said) == bool(told)


def test_bad_cases_are_left_out_and_named_where_that_is_asked_for(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One junk frame stopped all cases of a study."""
    folder, out = _twice(study, tmp_path / "study"), tmp_path / "out"
    junk = folder / "other" / "frames" / "frame_000.mha"
    whole = junk.read_bytes()
    junk.write_text("no scan", encoding="utf-8")
    command = ["run", str(folder), "-o", str(out), "--until", "load"]
    assert main(command) == 2
    assert capsys.readouterr().err.splitlines()[-1].endswith("nothing was run; --skip-bad runs the 1 other case")
    assert not out.exists()
    assert main([*command, "--skip-bad"]) == 1
    said = capsys.readouterr().err
    assert "other: refused: " in said
    assert f"{junk}: cannot read it" in said
    status = pd.read_csv(out / "summary.csv").set_index("case")["status"]
    assert status.to_dict() == {"straight": "ok", "other": "refused"}
    junk.write_bytes(whole)
    assert main(command) == 0
    assert set(pd.read_csv(out / "summary.csv")["status"]) == {"ok"}


def test_a_refused_case_is_refused_in_the_sweep_and_to_the_build_server_too(study: Path, tmp_path: Path) -> None:
    """Its earlier result in a point of the sweep was pooled with what the others have now."""
    folder, out, junit = _twice(study, tmp_path / "study"), tmp_path / "out", tmp_path / "junit.xml"
    command = ["run", str(folder), "-o", str(out), "--until", "compare", "--sweep", "simulate.wall_scale=2"]
    assert main(command) == 0
    shutil.rmtree(folder / "other" / "frames")
    assert main([*command, "--skip-bad", "--junit", str(junit)]) == 1
    swept = pd.read_csv(out / "sweep.csv").set_index(["parameter", "case"])["frames_ok"]
    assert swept["simulate.wall_scale", "straight"] == swept["(plain)", "straight"] > 0
    assert not swept["simulate.wall_scale", "other"] > 0
    assert "matches no file" in junit.read_text("utf-8")
    assert not (out / "cases" / "other" / "errors.csv").exists()


def test_where_every_case_is_bad_each_is_named(study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """As a shard of one case is: nothing would tell it from one that was never started."""
    folder, out = _twice(study, tmp_path / "study"), tmp_path / "out"
    (folder / "other" / "reference.mha").unlink()
    command = ["run", str(folder), "-o", str(out), "--until", "load"]
    assert main([*command, "--shard", "1/2", "--skip-bad"]) == 1
    assert list(pd.read_csv(out / "summary.csv")["status"]) == ["refused"]
    said = capsys.readouterr().err
    assert "--only other --resume" in said
    assert "--shard" not in said.splitlines()[-1], "with it, another part of the cases is meant"
    assert main(command) == 2


def test_how_many_frames_there_are_is_said_once_all_headers_are_read(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two files of three volumes each were two frames, and a list of another length hid what was wrong with files."""
    folder = shutil.copytree(study, tmp_path / "study")
    frames = [sitk.ReadImage(str(path)) for path in sorted((folder / "frames").glob("*.mha"))[:2]]
    for name in ("a", "b"):
        sitk.WriteImage(sitk.JoinSeries(frames), str(folder / f"{name}.nrrd"))
    text = (folder / "manifest.toml").read_text("utf-8")
    text = re.sub(r"(?m)^(truth|insertion_mm) = .*\n", "", text).replace('"frames/*.mha"', '["a.nrrd", "b.nrrd"]')
    (folder / "manifest.toml").write_text(text.replace("[[case]]", "[[case]]\ninsertion_mm = [1, 2, 3, 4]"), "utf-8")
    main(["check", str(folder)])
    assert "entries for" not in capsys.readouterr().err
    (folder / "manifest.toml").write_text(text.replace("[[case]]", "[[case]]\ninsertion_mm = [1, 2, 3]"), "utf-8")
    (folder / "reference.mha").unlink()
    assert main(["check", str(folder)]) == 2
    said = capsys.readouterr().err
    assert "insertion_mm has 3 entries for 4 frames" in said
    assert "no such file" in said


def test_check_names_missing_scans_beside_a_wrong_key(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Files were looked for only once all keys were right: a second round of corrections."""
    folder = shutil.copytree(study, tmp_path / "study")
    (folder / "reference.mha").unlink()
    wrong = "".join(f"[[case]]{text}\n" for text in (folder / "manifest.toml").read_text("utf-8").split("[[case]]")[1:])
    with (folder / "manifest.toml").open("a", encoding="utf-8") as file:
        file.write(wrong.replace('id = "straight"', 'id = "other"').replace("entry_mm", "entry_m"))
    assert main(["check", str(folder)]) == 2
    said = capsys.readouterr().err
    assert "case 'other' entry_m: unknown key; did you mean 'entry_mm'?" in said
    assert f"case 'straight': {folder / 'reference.mha'}: no such file or folder" in said


def test_many_damaged_cases_are_a_line_and_few_a_line_each(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for count in (2, 60):
        out = tmp_path / str(count)
        for number in range(count):
            folder = out / "cases" / f"c{number:02d}"
            folder.mkdir(parents=True)
            (folder / "result.json").write_text("{", encoding="utf-8")
        assert main(["report", str(out)]) == 1
        said = [line for line in capsys.readouterr().err.splitlines() if "result.json" in line]
        assert len(said) == (2 if count == 2 else 1)
    assert said[0].startswith("60 cases have no new page: c00, c01, c02, c03, c04 and 55 more; the first: c00: ")


def test_a_folder_that_is_no_output_is_told_with_what_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "out" / "cases" / "a").mkdir(parents=True)
    (tmp_path / "out" / "cases" / "a" / "result.json").write_text("{", encoding="utf-8")
    for inner in ("out/cases", "out/cases/a"):
        assert main(["report", str(tmp_path / inner)]) == 2
        assert f"give {tmp_path / 'out'}" in capsys.readouterr().err
    assert main(["report", str(tmp_path)]) == 2
    assert "this is not an output of wireval run" in capsys.readouterr().err
    (tmp_path / "run.json").write_text("{}", encoding="utf-8")
    assert main(["report", str(tmp_path)]) == 2
    assert "the run into it has finished no case: run it again" in capsys.readouterr().err


@pytest.mark.parametrize(("verb", "kept"), [("run", True), ("synth", False)])
def test_what_keeps_nothing_does_not_say_that_it_goes_on(
    verb: str, kept: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(_args: object) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr("pipeline.cli.carried_out", interrupted)
    assert main([verb, "straight", "-o", "y"]) == 130
    assert ("goes on from there" in capsys.readouterr().err) == kept


def test_diff_says_where_the_candidate_is_no_run(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A folder of scans was told as a run that has lost all cases, exit code 1; a run that lost all is one."""
    out = tmp_path / "out"
    assert main(["run", str(study), "-o", str(out), "--until", "compare"]) == 0
    empty = tmp_path / "empty"
    empty.mkdir()
    shutil.copy(out / "run.json", empty)
    for second, code in ((study, 2), (out, 0), (empty, 1)):
        capsys.readouterr()
        assert main(["diff", str(out), str(second)]) == code
        assert ("no case below it: is this what `wireval run` wrote?" in capsys.readouterr().err) == (code == 2)


def test_an_output_that_cannot_be_written_is_no_success() -> None:
    """A full disk under `wireval settings > FILE` was a traceback."""
    if not Path("/dev/full").exists():
        pytest.skip("this system has no /dev/full")
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        done = subprocess.run(
            [sys.executable, "-m", "pipeline", "settings"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 1
    assert done.stderr.strip().splitlines() == [
        "the output cannot be written: No space left on device; make room, then give the command again"
    ]


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("cannot cache function 'x': no locator available for file 'y'", "set NUMBA_CACHE_DIR"),
        ("Could not determine home directory.", "set HOME"),
    ],
)
def test_a_user_without_a_home_is_told_what_to_set(
    said: str, told: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Containers run as a number that no file knows: a traceback from numba or pathlib."""

    def homeless(_args: object) -> int:
        raise RuntimeError(said)

    monkeypatch.setattr("pipeline.cli.carried_out", homeless)
    assert main(["cache", "--info"]) == 2
    assert told in capsys.readouterr().err
    monkeypatch.setattr("pipeline.cli.NOWHERE", {})
    with pytest.raises(RuntimeError):
        main(["cache", "--info"])


@pytest.mark.parametrize(
    ("name", "told"),
    [("Gr\udcc3\udcb6\udcc3\udc9fe", "set LC_ALL=C.UTF-8 or PYTHONUTF8=1"), ("\udcff", "rename the file")],
)
def test_a_name_that_the_locale_does_not_know_is_not_to_be_changed(
    name: str, told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """In the C locale a folder with umlauts, as Python has it there, was to be renamed."""
    assert main(["check", name]) == 2
    assert told in capsys.readouterr().err


def test_a_terminal_that_knows_no_umlaut_gets_it_spelt_out() -> None:
    """A run that had computed everything ended in a traceback at its last line."""
    raw = io.BytesIO()
    stream = Lasting(io.TextIOWrapper(raw, "ascii"))
    stream.write("report: Gefäß/index.html")
    stream.flush()
    assert raw.getvalue() == rb"report: Gef\xe4\xdf/index.html"


@pytest.mark.slow
def test_a_closed_output_is_no_trouble() -> None:
    done = subprocess.run(
        f"{sys.executable} -m pipeline settings >&-", shell=True, stderr=subprocess.PIPE, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_check_sees_an_entry_direction_that_is_turned_round(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It said "no problem found", and the run had a depth below zero."""
    text = (study / "manifest.toml").read_text(encoding="utf-8")
    assert main(["check", str(study)]) == 0
    assert "leads out of the scan" not in capsys.readouterr().out
    back = re.sub(
        r"entry_direction = \[(.*)\]",
        lambda found: f"entry_direction = {[-float(v) for v in found[1].split(',')]}",
        text,
    )
    (study / "back.toml").write_text(back, encoding="utf-8")
    assert main(["check", str(study / "back.toml")]) == 0
    assert "entry_direction leads out of the scan" in capsys.readouterr().out
    run = ["run", str(study / "back.toml"), "-o", str(study.parent / "back")]
    assert main([*run, "--dry-run"]) == 0
    assert "warning: case 'straight': entry_direction leads out of the scan" in capsys.readouterr().out
    main([*run, "-q", "--until", "load"])
    heard = capsys.readouterr()
    assert "warning: entry_direction leads out of the scan" in heard.err
    assert len(heard.out.splitlines()) == 1, "-q prints the result alone"


def test_only_a_file_that_states_cases_is_another_manifest(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A folder of that name was a traceback, and settings that mention [[case]] in a comment refused the scans."""
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "gone.toml").symlink_to(tmp_path / "nowhere")
    for name, text in (("settings", "# as in [[case]]\n"), ("study", "schema = 1\n[[ case ]]\n")):
        (tmp_path / f"{name}.toml").write_text(text, encoding="utf-8")
    assert main(["check", str(tmp_path)]) == 2
    assert "study.toml is a manifest; give that file" in capsys.readouterr().err, "the first that is one is named"


def test_a_folder_that_holds_another_manifest_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One was inferred from the scans beside good.toml, and judged instead."""
    assert _other_manifests(tmp_path) == []
    (tmp_path / "good.toml").touch()
    (said,) = _other_manifests(tmp_path)
    assert "though it holds good.toml: name the file instead of the folder" in said
    (tmp_path / "good.toml").write_text("schema = 1\n[[case]]\n", encoding="utf-8")
    assert main(["check", str(tmp_path)]) == 2, "a single scan beside it was one case, in which no problem was found"
    assert f"good.toml is a manifest; give that file: {tmp_path / 'good.toml'}" in capsys.readouterr().err
