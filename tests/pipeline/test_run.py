"""The whole pipeline on a small study of real files, through the command line, as a user types it."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest
import SimpleITK as sitk
from matplotlib.colors import rgb_to_hsv
from PIL import Image

from pipeline.cli import main
from pipeline.model import Clamp, Curve
from pipeline.run import cache, ledger, results
from pipeline.run.aggregate import aggregate
from pipeline.run.cache import decoded
from pipeline.run.case import Job, run_case
from pipeline.run.results import found_results
from pipeline.run.stages import simulate
from pipeline.run.stages.compare import _trusted_before
from pipeline.run.stages.known import Frame, Known
from pipeline.simulate import wall_of
from pipeline.status import FrameStatus
from pipeline.study import own_lumen
from pipeline.study.manifest import read_manifest
from reports import tables
from reports.colours import TRACED, TRUE, rgb
from reports.frames_file import read_scan
from reports.run_page import render_index
from reports.schema import ERRORS, POINTS, SUMMARY, TIMINGS
from solver import Status
from tests.pipeline.test_simulate import MANIFEST
from tests.studies.trees import differences

SIZE, FRAMES = 64, 4
UNTIL = ("--until", "compare")  # where no page is looked at: drawing them takes most of a run
QUICK = (*UNTIL, "--set", "compare.simulated_nulls=false", "--set", "budget.members=0")  # nor predictors and budget


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    assert (
        main(["synth", "bifurcation", "-o", str(folder), "--size", str(SIZE), "--frames", str(FRAMES), "--seed", "7"])
        == 0
    )
    return folder


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The study with two frames."""
    folder = tmp_path_factory.mktemp("short")
    assert main(["synth", "bifurcation", "-o", str(folder), "--size", str(SIZE), "--frames", "2", "--seed", "7"]) == 0
    return folder


@pytest.fixture(scope="module")
def finished(study: Path, store: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("out")
    assert run(study, out) == 0
    return out


@pytest.fixture
def out(finished: Path, tmp_path: Path) -> Path:
    """The finished run, to be changed."""
    return Path(shutil.copytree(finished, tmp_path / "out"))


@pytest.fixture
def folder(study: Path, tmp_path: Path) -> Path:
    """The study, to be changed."""
    return Path(shutil.copytree(study, tmp_path / "study"))


def result_of(out: Path) -> dict[str, Any]:
    """What result.json of the one case says."""
    (path,) = out.glob("cases/*/result.json")
    return json.loads(path.read_text(encoding="utf-8"))


def run(study: Path, out: Path, *more: str) -> int:
    return main(["run", str(study / "manifest.toml"), "-o", str(out), *more])


def errors_of(out: Path) -> pd.DataFrame:
    return tables.read(next((out / "cases").iterdir()) / "errors.csv", ERRORS)


def test_every_frame_is_ok_and_near_the_truth(finished: Path, study: Path) -> None:
    """The bars of the full study, in voxels: the small scan has voxels of 0.75 mm."""
    table = errors_of(finished)
    voxel = sitk.ReadImage(str(study / "reference.mha")).GetSpacing()[0]
    assert list(table["status"]) == ["ok"] * FRAMES
    assert table["trace_mean_mm"].median() < 0.25 * voxel
    assert table["trace_tip_mm"].median() < 1.0 * voxel
    assert table["truth_rms_mm"].median() < 1.0 * voxel


def test_the_output_tree_is_complete(finished: Path) -> None:
    case = finished / "cases" / "bifurcation"
    for name in ("run.json", "config.resolved.toml", "summary.csv", "failures.csv", "index.html"):
        assert (finished / name).stat().st_size > 0, name
    for name in ("result.json", "errors.csv", "points.csv.gz", "frames.h5", "report.html", "log.txt"):
        assert (case / name).stat().st_size > 0, name
    for name in ("lumen.seg.nrrd", "lumen.vtp", "wire_traced_000.mrk.json", "wire_simulated_003.mrk.json"):
        assert (case / "view" / name).stat().st_size > 0, name
    assert (case / "view" / "wire_simulated_003.vtp").exists()
    assert any((case / "figures").glob("*.png"))
    assert not list(finished.rglob(".tmp*"))


def test_the_columns_are_the_contract(finished: Path) -> None:
    case = finished / "cases" / "bifurcation"
    assert set(pd.read_csv(case / "errors.csv")["clamp_note"]) == {"fitted"}
    assert tuple(pd.read_csv(case / "errors.csv").columns) == ERRORS.names
    assert tuple(pd.read_csv(case / "points.csv.gz").columns) == POINTS.names
    assert tuple(pd.read_csv(finished / "summary.csv").columns) == SUMMARY.names
    with h5py.File(case / "frames.h5") as file:
        group = file["frames/000"]
        assert {"traced_mm", "simulated_mm", "error_mm", "arc_mm", "contact_force_N"} <= set(group)
        assert group["simulated_mm"].shape == group["contact_force_N"].shape


def test_points_and_frames_tell_the_same_story(finished: Path) -> None:
    case = finished / "cases" / "bifurcation"
    points, table = pd.read_csv(case / "points.csv.gz"), errors_of(finished)
    for frame, group in points.groupby("frame"):
        rms = float(np.sqrt((group["error_mm"] ** 2).mean()))
        assert rms == pytest.approx(float(table.loc[table["frame"] == frame, "rms_mm"].iloc[0]), rel=1e-6)
    pooled = float(np.sqrt((points["error_mm"] ** 2).mean()))
    assert pooled == pytest.approx(float(pd.read_csv(finished / "summary.csv")["rms_mm"][0]), rel=1e-6)


def test_insertion_is_arc_length_from_the_entry(finished: Path) -> None:
    table = errors_of(finished)
    with h5py.File(finished / "cases" / "bifurcation" / "frames.h5") as file:
        for frame, depth in zip(table["frame"], table["insertion_mm"], strict=True):
            joints = file[f"frames/{frame:03d}/simulated_mm"][...]
            assert np.linalg.norm(np.diff(joints, axis=0), axis=1).sum() == pytest.approx(depth, abs=1e-6)


def test_the_same_command_again_keeps_what_is_finished(
    out: Path, study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = (out / "cases" / "bifurcation" / "frames.h5").stat().st_mtime_ns
    assert run(study, out) == 0
    assert "unchanged since the last run, kept" in capsys.readouterr().err
    assert (out / "cases" / "bifurcation" / "frames.h5").stat().st_mtime_ns == before


def test_a_case_that_was_cut_off_is_finished_by_the_same_command(finished: Path, out: Path, study: Path) -> None:
    (out / "cases" / "bifurcation" / "result.json").unlink()
    assert run(study, out) == 0
    assert differences(finished, out) == []


def test_another_manifest_into_the_same_folder_is_refused(
    finished: Path, study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, other = tmp_path / "out", tmp_path / "study"
    shutil.copytree(finished, out)
    shutil.copytree(study, other)
    (other / "manifest.toml").write_text((study / "manifest.toml").read_text(encoding="utf-8") + "\n# changed\n")
    assert run(other, out) == 2
    assert "--resume" in capsys.readouterr().err


def test_fresh_removes_the_cases_of_the_manifest_before(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One that is resumed leaves them aside, says so, and what anybody else has put into the folder stays."""
    out, other = tmp_path / "out", tmp_path / "study"
    assert run(study, out, "--until", "load") == 0
    shutil.copytree(study, other)
    manifest = other / "manifest.toml"
    text = manifest.read_text(encoding="utf-8").replace('id = "bifurcation"', 'id = "renamed"')
    manifest.write_text(text, encoding="utf-8")
    (out / "cases" / "mine").mkdir()
    assert run(other, out, "--resume", "--until", "load") == 0
    said = capsys.readouterr()
    assert "1 case, 4 frames" in said.out
    assert "no manifest of this folder names them any more: bifurcation" in said.err
    assert run(other, out, "--fresh", "--until", "load") == 0
    assert "any more" not in capsys.readouterr().err
    assert {path.name for path in (out / "cases").iterdir()} == {"renamed", "mine"}


def test_fewer_stages_do_not_wipe_what_is_finished(study: Path, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for more in ((), ("--resume",)):
        assert run(study, out, "--until", "trace", *more) == 2
        assert "say --fresh" in capsys.readouterr().err
    assert len(found_results(out)) == 1
    assert run(study, out) == 0


def test_dry_run_computes_nothing(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It read every scan for a key that only a result which is kept is asked for."""
    monkeypatch.setattr("pipeline.run.store.file_hash", lambda path: pytest.fail(f"reads {path}"))
    assert run(study, tmp_path / "out", "--dry-run", "--sweep", "simulate.wall_scale=0.5,2") == 0
    assert "sweep simulate.wall_scale = 0.5" in capsys.readouterr().out
    assert not (tmp_path / "out").exists()


def test_a_sweep_moves_the_result_and_traces_once(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, junit = tmp_path / "out", str(tmp_path / "junit.xml")
    assert run(study, out, "--sweep", "simulate.roll_offset_deg=-60,60", "--junit", junit, "-q", *UNTIL) == 0
    assert f"sweep: {out / 'sweep.csv'}.  report: {out / 'index.html'}" in capsys.readouterr().out
    point = tables.read(next(out.glob("sweep/*/cases/*/timings.csv")), TIMINGS).iloc[0]
    assert point["clamp_s"] > 0, "most of a point's time"
    assert point[list(point.index[2:-2])].sum() <= point["total_s"], "stages are parts of the whole"
    table = pd.read_csv(out / "sweep.csv")
    assert list(table["parameter"]) == ["(plain)", "simulate.roll_offset_deg", "simulate.roll_offset_deg"]
    assert table["rms_mm"].nunique() == 3
    assert reused_traces(out / "sweep" / "simulate.roll_offset_deg=60") == FRAMES
    assert f'tests="{FRAMES}" failures="0"' in (tmp_path / "junit.xml").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_sweep_of_other_settings_is_not_shown_beside_a_new_result(
    short: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nor a summary on paper: both stood beside the new numbers as if they were theirs."""
    out = tmp_path / "out"
    assert run(short, out, "--sweep", "simulate.wall_scale=2", *QUICK) == 0
    (out / "summary.pdf").touch()
    assert run(short, out, "--set", "simulate.wall_scale=3", "--resume", *QUICK) == 0
    said = capsys.readouterr()
    last = said.out.splitlines()[-1]
    assert f"{out / 'sweep.csv'}: removed, it belongs to an earlier run" in said.err
    assert "sweep:" not in last
    assert re.search(r"skill 0\.\d+ over 1 of 2 frames against the predictor '[a-z ]+'\.", last)
    assert not (out / "sweep.csv").exists()
    assert not (out / "summary.pdf").exists()


@pytest.mark.slow  # a promise of time alone
def test_a_sweep_reads_the_lumen_of_a_case_once(short: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And prepares its wall once: its points follow each other. The two cases here have one scan, and so one lumen."""
    both, out, read = two_cases(short, tmp_path / "study"), tmp_path / "out", []
    monkeypatch.setattr(cache, "decoded", lambda *args: read.append(args[0]) or decoded(*args))
    wall_of.cache_clear()
    points = "--sweep", "simulate.wall_scale=0.5", "--sweep", "simulate.roll_offset_deg=30"
    assert run(both, out, *points, *QUICK) == 0
    assert read.count("segment") == 1
    assert wall_of.cache_info().misses <= 2, "of the lumen as it was segmented, and as it was read"
    assert run(both, out, "--sweep", "simulate.wall_scale=0.25", "--resume", *QUICK) == 0
    assert read.count("segment") == 2, "another run reads it anew"


def edited(study: Path, folder: Path, old: str, new: str) -> Path:
    """The study with another manifest."""
    shutil.copytree(study, folder)
    text = (folder / "manifest.toml").read_text(encoding="utf-8")
    assert old in text
    (folder / "manifest.toml").write_text(text.replace(old, new), encoding="utf-8")
    return folder


def test_what_is_doubtful_in_a_manifest_is_said_by_the_run_itself(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Only `check` and a dry run said it, which nobody has to call; -q hides no warning."""
    out = tmp_path / "out"
    text = (folder / "manifest.toml").read_text(encoding="utf-8")
    case = tomllib.loads(text)["case"][0]
    head, body = text.split("[[case]]")
    parts = []
    for n, mm in enumerate(case["insertion_mm"][:2]):
        part = body.replace('"frames/*.mha"', f'"frames/frame_{n:03d}.mha"').replace('truth = "truth.json"\n', "")
        part = re.sub(r"insertion_mm = .*", f"insertion_mm = [{mm}]", part)
        parts.append(part.replace('id = "bifurcation"', f'id = "part{n}"'))
    (folder / "manifest.toml").write_text("[[case]]".join([head, *parts]), encoding="utf-8")
    said = "depths that follow each other: they count as 2 insertions"
    for words in ((), ("--only", "part1", "--resume")):
        assert run(folder, out, "-q", "--until", "segment", *words) == 0
        assert capsys.readouterr().err.count(said) == 1
        assert said in (out / "index.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_bend_too_sharp_to_be_five_times_as_sharp_is_compared(study: Path, tmp_path: Path) -> None:
    """The case crashed: "got 1.6", which nobody had stated."""
    new = "rest_curvature_per_mm = [[0.0, 0.32], [8.0, 0.32], [8.0, 0.0]]"
    folder = edited(study, tmp_path / "s", "rest_curvature_per_mm = [[0.0, 0.12], [8.0, 0.12], [8.0, 0.0]]", new)
    assert run(folder, tmp_path / "out", *UNTIL, "--set", "solver.segment_mm=2", "--set", "budget.members=0") in (0, 1)
    assert not errors_of(tmp_path / "out")["status"].eq("crashed").any()


def with_lumen(study: Path, folder: Path, labels: np.ndarray, like: sitk.Image) -> Path:
    """The study with a label map as its lumen."""
    if not folder.exists():
        shutil.copytree(study, folder)
        text = (folder / "manifest.toml").read_text(encoding="utf-8")
        (folder / "manifest.toml").write_text(
            text.replace("[[case]]", '[[case]]\nlumen = "lumen.nrrd"'), encoding="utf-8"
        )
    image = sitk.GetImageFromArray(labels)
    image.CopyInformation(like)
    sitk.WriteImage(image, str(folder / "lumen.nrrd"))
    return folder


def test_a_lumen_that_lies_elsewhere_is_what_fails(
    study: Path, finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A mask that lost its scan's origin: every frame failed, and a wire that nobody saw was named for it.

    A run says so before it computes anything, or, of a map of very many voxels, at the latest in its case.
    """
    like = sitk.ReadImage(str(finished / "cases" / "bifurcation" / "view" / "lumen.seg.nrrd"))
    labels = sitk.GetArrayFromImage(like)
    like.SetOrigin((0.0, 0.0, 0.0))
    folder = with_lumen(study, tmp_path / "study", labels, like)
    assert run(folder, tmp_path / "out", *QUICK) == 2
    assert "has no voxel of the lumen within 1.5 mm, which spans" in capsys.readouterr().err
    monkeypatch.setattr(own_lumen, "MOST_VOXELS", 0)
    folder = with_lumen(study, tmp_path / "again", labels, like)
    assert run(folder, tmp_path / "out", *QUICK) == 1
    assert set(errors_of(tmp_path / "out")["status"]) == {"segment_failed"}
    assert "outside the given lumen, which spans" in (tmp_path / "out" / "failures.csv").read_text(encoding="utf-8")


def reused_traces(out: Path) -> float:
    text = (out / "cases" / "bifurcation" / "provenance.json").read_text(encoding="utf-8")
    return float(json.loads(text)["reused"].get("trace", 0))


@pytest.mark.slow
def test_an_edited_lumen_gives_new_traces(study: Path, finished: Path, tmp_path: Path) -> None:
    """Curves are traced inside the lumen: those of another lumen must not come back, nor what it was refused for."""
    like = sitk.ReadImage(str(finished / "cases" / "bifurcation" / "view" / "lumen.seg.nrrd"))
    labels = sitk.GetArrayFromImage(like)
    folder = with_lumen(study, tmp_path / "study", labels, like)
    out = tmp_path / "out"
    assert run(folder, out, "--until", "simulate") < 2
    assert reused_traces(out) == 0
    assert run(folder, out, "--resume", "--set", "simulate.wall_scale=2", "--until", "simulate") < 2
    assert reused_traces(out) == FRAMES
    labels[tuple(np.argwhere(labels)[0])] = 0
    with_lumen(study, folder, labels, like)
    assert run(folder, out, "--resume", "--until", "simulate") < 2
    assert reused_traces(out) == 0


def test_a_finished_case_gets_the_page_that_is_asked_for(study: Path, out: Path) -> None:
    page = out / "cases" / "bifurcation" / "report.html"
    assert 'src="figures/' in page.read_text(encoding="utf-8")
    assert run(study, out, "--embed") == 0
    assert 'src="figures/' not in page.read_text(encoding="utf-8")


@pytest.mark.slow
def test_every_pooled_number_is_of_the_frames_that_are_ok(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Frame 2 disagrees with the manifest's depth: it has errors of its own, and no say in any pooled number."""
    path, lines = folder / "manifest.toml", []
    for line in (folder / "manifest.toml").read_text(encoding="utf-8").splitlines():
        name, _, value = line.partition("=")
        depths = json.loads(value) if name.strip() == "insertion_mm" else []
        lines.append(f"insertion_mm = {[*depths[:2], depths[2] - 8.0, *depths[3:]]}" if depths else line)
    path.write_text("\n".join(lines), encoding="utf-8")
    out = tmp_path / "out"
    assert run(folder, out, "--set", "simulate.roll_offset_deg=60", *UNTIL) == 1
    table = errors_of(out)
    assert list(table["status"]) == ["ok", "ok", "length_mismatch", "ok"]
    assert table["rms_mm"].notna().all()
    points = tables.read(out / "cases" / "bifurcation" / "points.csv.gz", POINTS)
    good = points[points["status"] == "ok"]["error_mm"]
    assert set(points[points["frame"] == 2]["status"]) == {"length_mismatch"}, "a table of its points alone pooled them"
    rms = float(np.sqrt((good**2).mean()))
    info = json.loads((out / "run.json").read_text(encoding="utf-8"))
    assert info["overall"]["rms_mm"] == pytest.approx(rms, rel=1e-6)
    assert pd.read_csv(out / "summary.csv")["rms_mm"][0] == pytest.approx(rms, rel=1e-6)
    assert f"median point error {good.median():.3f} mm (p95 {good.quantile(0.95):.3f})" in capsys.readouterr().out


def test_predictors_are_told_of_trusted_traces_alone(study: Path, tmp_path: Path) -> None:
    """The deepest frame failed: neither the paths' target nor the next frame's ``previous`` may come from it."""
    bad, good = Curve(np.eye(3) * 50.0, np.ones(3)), Curve(np.eye(3), np.ones(3))
    frames = (
        Frame(0, curve=good),
        Frame(1, curve=bad).failed("trace", FrameStatus.LENGTH_MISMATCH, "why"),
        Frame(2, curve=good).failed("simulate", Status.MAX_ITERATIONS),
    )
    assert [frame.trusted_curve for frame in frames] == [good, None, good]
    assert [p is not None and p is good.points_mm for p in _trusted_before(frames)] == [False, True, True]


def test_nothing_of_an_earlier_run_stays_beside_a_new_result(
    study: Path, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Traced only, a case has no errors: those of the run before must not come back in the last line."""
    assert run(study, out, "--until", "trace", "--fresh") == 0
    last = capsys.readouterr().out
    assert "median point error" not in last
    assert "Nothing is scored: the run was to end before frames are compared (--until trace)" in last
    assert "Nothing is scored: the run was" in (out / "index.html").read_text(encoding="utf-8")
    assert pd.read_csv(out / "summary.csv")["within_1mm"].isna().all(), "it was 1"
    assert json.loads((out / "run.json").read_text(encoding="utf-8"))["overall"] == {}
    early = "nothing failed up to where the run was to end (--until trace)"
    case = result_of(out)
    assert case["sentence"] == early, "it was: every frame has a result"
    assert {(f["status"], f["sentence"]) for f in case["frames"]} == {("ok", early)}, "it was: simulated and compared"
    left = {p.name for p in (out / "cases" / "bifurcation").iterdir()}
    assert not left & {"points.csv.gz", "report.html", "figures", "scene3d.html"}
    assert not list((out / "cases" / "bifurcation" / "view").glob("wire_simulated*"))


def test_a_frame_that_the_roll_was_fitted_on_says_so_however_early_the_run_ends(tmp_path: Path) -> None:
    """Its sentence was "nothing failed up to where the run was to end"."""
    (tmp_path / "manifest.toml").write_text(MANIFEST, encoding="utf-8")
    (case,) = read_manifest(tmp_path / "manifest.toml").cases
    fitted = Frame(0, status=FrameStatus.ROLL_FITTED.identifier, sentence=FrameStatus.ROLL_FITTED.value)
    summary = {"case": case.id, "status": "ok", "frames": 2, "frames_ok": 1}
    details = {"until": "simulate", "inputs": []}
    found = results.result_of(case, Known(frames=(fitted, Frame(1))), summary, "", details)
    first, second = (frame["sentence"] for frame in found.frames)
    assert first == FrameStatus.ROLL_FITTED.value
    assert second.startswith("nothing failed up to")


def test_the_page_of_a_case_without_a_lumen_shows_the_scan_at_the_entry(folder: Path, tmp_path: Path) -> None:
    """It had no picture, where one would have shown that the entry lies beside the vessel."""
    scan = sitk.ReadImage(str(folder / "reference.mha"))
    beside = [3, 5, 7]
    manifest = folder / "manifest.toml"
    text = re.sub(
        r"entry_mm = .*",
        f"entry_mm = {list(scan.TransformContinuousIndexToPhysicalPoint(beside))}",
        manifest.read_text(encoding="utf-8"),
    )
    manifest.write_text(text, encoding="utf-8")
    assert run(folder, tmp_path / "out") == 1
    case = tmp_path / "out" / "cases" / "bifurcation"
    assert json.loads((case / "result.json").read_text(encoding="utf-8"))["status"] == "segment_failed"
    shown = read_scan(case / "frames.h5")
    assert shown is not None
    values, slab = sitk.GetArrayFromImage(scan).T, shown.entry_slabs[2]
    assert slab.shape == values.shape[:2]
    half = max(1, round(3.0 / scan.GetSpacing()[2]))
    peaks = values[:, :, max(0, 7 - half) : 7 + half + 1].max(axis=2)
    assert np.corrcoef(slab.ravel(), peaks.ravel())[0, 1] > 0.95
    assert 'id="scan_at_entry"' in (case / "report.html").read_text(encoding="utf-8")


def test_report_rebuilds_from_files_alone(finished: Path, out: Path, tmp_path: Path) -> None:
    for name in ("summary.csv", "index.html"):
        (out / name).unlink()
    shutil.rmtree(out / "cases" / "bifurcation" / "figures")
    assert main(["report", str(out)]) == 0
    pd.testing.assert_frame_equal(pd.read_csv(out / "summary.csv"), pd.read_csv(finished / "summary.csv"))
    assert any((out / "cases" / "bifurcation" / "figures").glob("*.png"))
    assert main(["report", str(tmp_path / "nothing")]) == 2


PVBATCH, DISPLAY = shutil.which("pvbatch"), shutil.which("xvfb-run")


@pytest.mark.skipif(
    not (PVBATCH and DISPLAY), reason="ParaView is not installed: `apt-get install paraview xvfb xauth` brings pvbatch"
)
def test_paraview_opens_a_real_case(finished: Path, tmp_path: Path) -> None:
    """The lumen of both files, wires over frames with their arrays, and a picture in which each wire has its colour."""
    folder, picture = finished / "cases" / "bifurcation" / "view", tmp_path / "paraview.png"
    script = Path(__file__).parents[1] / "reports" / "look_in_paraview.py"
    words = [str(DISPLAY), "-a", str(PVBATCH), str(script), str(folder), str(picture)]
    # ParaView has a Python and a VTK of its own
    env = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=True, env=env)
    said = json.loads(done.stdout.splitlines()[-1])
    assert said["lumen.vtp"]["cells"] == said["lumen.stl"]["cells"] > 1000
    assert {name for name in said if name.endswith(".pvd")} == {
        f"wire_{k}.pvd" for k in ("simulated", "traced", "true")
    }
    assert said["wire_simulated.pvd"]["times"] == list(range(FRAMES))
    points = pd.read_csv(finished / "cases" / "bifurcation" / "points.csv.gz")
    most = points[points["frame"] == FRAMES - 1]["error_mm"].max()
    assert said["wire_simulated.pvd"]["arrays"]["error_mm"][1] == pytest.approx(most, rel=0.1)
    hue, saturation, _ = np.moveaxis(rgb_to_hsv(np.asarray(Image.open(picture).convert("RGB")) / 255.0), -1, 0)
    for name, colour in (("traced", TRACED), ("true", TRUE)):  # seen through the glass of the lumen
        near = np.abs(hue - rgb_to_hsv(rgb(colour))[0]) < 0.04
        assert (near & (saturation > 0.4)).sum() > 50, f"no {name} wire to be seen"


def test_a_run_of_calibration_cases_says_that_nothing_is_scored(out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = out / "cases" / "bifurcation" / "result.json"
    result = json.loads(path.read_text(encoding="utf-8"))
    result |= {"role": "calibration", "summary": result["summary"] | {"role": "calibration"}}
    path.write_text(json.dumps(result), encoding="utf-8")
    ledger.write(path.parent, "key")
    assert main(["report", str(out), "--overview"]) == 0
    said = "Nothing is scored: wireval calibrate learns from every case"
    assert f'{said} (role = "calibration"' in capsys.readouterr().out
    assert said in (out / "index.html").read_text(encoding="utf-8")


def test_diff_is_a_gate(finished: Path, tmp_path: Path) -> None:
    assert main(["diff", str(finished), str(finished)]) == 0
    worse = tmp_path / "worse"
    shutil.copytree(finished, worse)
    path = worse / "cases" / "bifurcation" / "errors.csv"
    table = pd.read_csv(path)
    table["rms_mm"] += 1.0
    table.to_csv(path, index=False)
    ledger.write(path.parent, "key")
    assert main(["diff", str(finished), str(worse)]) == 1
    assert main(["diff", str(worse), str(finished)]) == 0


def test_a_folder_that_is_not_there_is_no_regression(
    finished: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["diff", str(finished), str(tmp_path / "nothere")]) == 2
    assert "nothere: no such folder" in capsys.readouterr().err


def named_by_a_shard(out: Path, case: str) -> None:
    """As if another shard of the same manifest had this case."""
    info = json.loads((out / "run.json").read_text(encoding="utf-8"))
    (out / "run.2-2.json").write_text(json.dumps(info | {"planned": [case]}), encoding="utf-8")


def two_cases(study: Path, folder: Path, broken: bool = False) -> Path:
    shutil.copytree(study, folder)
    text = (folder / "manifest.toml").read_text(encoding="utf-8")
    second = text[text.index("[[case]]") :].replace('id = "bifurcation"', 'id = "second"')
    if broken:
        second = second.replace('frames = "frames/*.mha"', 'frames = "broken/*.mha"')
        shutil.copytree(folder / "frames", folder / "broken")
        damaged = sorted((folder / "broken").iterdir())[1]
        damaged.write_bytes(damaged.read_bytes()[:-5000])
    (folder / "manifest.toml").write_text(text + "\n" + second, encoding="utf-8")
    return folder


@pytest.mark.slow
def test_the_same_scans_count_once(short: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    both = two_cases(short, tmp_path / "study")
    assert main(["check", str(both)]) == 0
    assert "warning: cases 'bifurcation' and 'second' share" in capsys.readouterr().out
    assert run(both, tmp_path / "out", *QUICK) == 0
    assert "bifurcation, second have scans or curves in common and count as one insertion" in capsys.readouterr().err
    assert pd.read_csv(tmp_path / "out" / "overall.csv")["insertions"].item() == 1
    manifest = both / "manifest.toml"
    text = manifest.read_text(encoding="utf-8")
    frames = sorted(f"frames/{path.name}" for path in (both / "frames").iterdir())
    for listed, said in (
        ([*frames[:-1], frames[0]], "listed 2 times"),
        (["reference.mha", *frames[1:]], "reference and frame"),
    ):
        manifest.write_text(text.replace('"frames/*.mha"', json.dumps(listed)), encoding="utf-8")
        assert main(["check", str(both)]) == 2
        assert said in capsys.readouterr().err
    manifest.write_text(
        text.replace("broken/", "frames/").replace('id = "second"', 'id = "second"\ngroup = "bifurcation"')
    )
    assert main(["check", str(both)]) == 0
    assert "its frame counts twice" in capsys.readouterr().out


@pytest.mark.slow
def test_a_frame_under_two_names_counts_once(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A copy is refused at the door; the same voxels in another file are told when they are read."""
    out = tmp_path / "out"
    first, *_, last = sorted((folder / "frames").iterdir())
    own = last.read_bytes()
    shutil.copy(first, last)
    assert main(["check", str(folder)]) == 2
    assert f"{last}: has the content of {first}; a frame counts once" in capsys.readouterr().err
    shutil.copy(folder / "reference.mha", last)
    assert run(folder, out) == 2
    assert "has the content of the reference" in capsys.readouterr().err
    last.write_bytes(own)
    sitk.WriteImage(sitk.Cast(sitk.ReadImage(str(first)), sitk.sitkFloat32), str(folder / "frames" / "frame_001b.nrrd"))
    manifest = folder / "manifest.toml"
    kept = [line for line in manifest.read_text(encoding="utf-8").splitlines() if not line.startswith(("ins", "tru"))]
    manifest.write_text("\n".join(kept).replace("frames/*.mha", "frames/*"), encoding="utf-8")
    assert main(["check", str(folder)]) == 0
    assert run(folder, out, *QUICK) == 1
    assert "repeated: it has the voxels of frame 0" in capsys.readouterr().err
    errors = tables.read(out / "cases" / "bifurcation" / "errors.csv", ERRORS)
    assert list(errors["status"]).count("repeated") == 1
    assert pd.read_csv(out / "overall.csv")["frames_ok"].item() == FRAMES


@pytest.mark.slow
def test_the_same_voxels_in_other_files_are_one_insertion(
    short: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One insertion saved three times had a 95 % interval of no width, over three insertions."""
    both = two_cases(short, tmp_path / "study")
    (both / "again").mkdir()
    for path in (both / "frames").iterdir():
        sitk.WriteImage(sitk.ReadImage(str(path)), str(both / "again" / f"{path.stem}.nrrd"))
    head, case, second = (both / "manifest.toml").read_text(encoding="utf-8").split("[[case]]")
    second = second.replace("frames/*.mha", "again/*.nrrd")
    (both / "manifest.toml").write_text("[[case]]".join((head, case, second)), encoding="utf-8")
    assert run(both, tmp_path / "out", *QUICK) == 0
    assert "bifurcation, second have scans or curves in common and count as one insertion" in capsys.readouterr().err
    assert pd.read_csv(tmp_path / "out" / "overall.csv")["insertions"].item() == 1


def test_own_curves_are_held_against_the_wires_that_are_seen(folder: Path, finished: Path, tmp_path: Path) -> None:
    """Curves given to the wrong frames were ok, at 0.04 mm and a skill of 0.998."""
    said = []
    manifest = folder / "manifest.toml"
    kept = [line for line in manifest.read_text(encoding="utf-8").splitlines() if not line.startswith("insertion_mm")]
    manifest.write_text("\n".join(kept).replace("[[case]]", '[[case]]\ntraces = "own/*.csv"'), encoding="utf-8")
    (folder / "own").mkdir()
    with h5py.File(finished / "cases" / "bifurcation" / "frames.h5") as file:
        curves = [group["traced_mm"][:] for _, group in sorted(file["frames"].items())]
    for order in (curves, curves[::-1]):
        for number, curve in enumerate(order):
            np.savetxt(folder / "own" / f"{number:03d}.csv", curve, delimiter=",", header="x_mm,y_mm,z_mm", comments="")
        run(folder, tmp_path / "out", *QUICK, "--fresh")
        result = result_of(tmp_path / "out")
        said.append([text for text in result["warnings"] if "own curves are not where the scans show" in text])
    assert not said[0]
    (text,) = said[1]
    assert "frame 0: " in text
    assert "mm longer" in text
    assert "roll" not in " ".join(result["warnings"]), "it was said of the roll, fitted to which these curves were met"


def test_results_do_not_depend_on_workers_or_shards(short: Path, tmp_path: Path) -> None:
    """Shards are merged by copying folders together; their tables are those of a run of all cases, byte by byte."""
    both, more = two_cases(short, tmp_path / "study"), ("--sweep", "simulate.wall_scale=2", *QUICK)
    assert run(both, tmp_path / "pool", "-j", "2", "--no-cache", *more) == 0
    for shard in ("1/2", "2/2"):
        assert run(both, tmp_path / shard[0], "--shard", shard, *more) == 0
        assert len(pd.read_csv(tmp_path / shard[0] / "failures.csv")) == 0, "others may be at work on the rest"
        shutil.copytree(tmp_path / shard[0], tmp_path / "shards", dirs_exist_ok=True)
        if shard == "1/2":  # as if the other were lost
            assert main(["report", str(tmp_path / "shards"), "--overview"]) == 1
            assert list(pd.read_csv(tmp_path / "shards" / "failures.csv")["status"]) == ["not_run"]
            whole = pd.read_csv(tmp_path / "shards" / "overall.csv").iloc[0]
            assert (whole["frames"], whole["frames_ok"]) == (2 * whole["frames_ok"], whole["frames_ok"])
    assert main(["report", str(tmp_path / "shards"), "--overview"]) == 0
    assert not (tmp_path / "shards" / "cases" / "second" / "report.html").exists()
    assert differences(tmp_path / "pool" / "cases", tmp_path / "shards" / "cases") == []
    for name in ("summary.csv", "overall.csv", "failures.csv", "sweep.csv"):
        assert (tmp_path / "shards" / name).read_bytes() == (tmp_path / "pool" / name).read_bytes(), name
    assert len(pd.read_csv(tmp_path / "pool" / "timings.csv")) == 2
    table = tables.read(tmp_path / "pool" / "cases" / "second" / "errors.csv", ERRORS)
    pd.testing.assert_frame_equal(table, errors_of(tmp_path / "1"))


def test_a_damaged_frame_costs_that_frame_alone(study: Path, tmp_path: Path) -> None:
    both = two_cases(study, tmp_path / "study", broken=True)
    out = tmp_path / "out"
    assert run(both, out, *QUICK) == 1
    statuses = list(tables.read(out / "cases" / "second" / "errors.csv", ERRORS)["status"])
    assert statuses == ["ok", "load_failed", "ok", "ok"]
    failures = pd.read_csv(out / "failures.csv")
    assert list(failures["case"]) == ["second"]
    assert "cut short" in failures["message"][0] or "cannot be read" in failures["message"][0]


def test_a_wire_that_cannot_enter_is_a_failed_frame(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No point of it is there to be compared with or drawn; the case must not end as crashed."""
    clamp = simulate.clamp_of
    monkeypatch.setattr(simulate, "clamp_of", lambda run, known: aside(clamp(run, known)))
    assert run(study, tmp_path) == 1
    assert set(errors_of(tmp_path)["status"]) == {"entry_outside"}
    assert (tmp_path / "cases" / "bifurcation" / "report.html").exists()


def aside(clamp: Clamp) -> Clamp:
    """A clamp outside the vessel, as a wrong entry of the manifest or a thin lumen makes it."""
    return replace(clamp, entry_mm=clamp.entry_mm + np.array([6.0, 6.0, 0.0]))


def test_an_unexpected_error_costs_one_case(
    short: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    both = two_cases(short, tmp_path / "study")

    def burst(job: object) -> None:
        if job.case.id == "second":  # type: ignore[attr-defined]
            msg = "burst pipe"
            raise RuntimeError(msg)
        from pipeline.run.case import run_case

        run_case(job)  # type: ignore[arg-type]

    monkeypatch.setattr("pipeline.run.launch.run_case", burst)
    monkeypatch.setattr("sys.argv", ["/bin/wireval", "run", "study", "-o", "out"])
    assert run(both, tmp_path / "out", *QUICK) == 1
    said = capsys.readouterr().err.splitlines()
    assert said[-1] == "next: see to what the messages name, then wireval run study -o out --only second --resume"
    assert said[-1].partition("then ")[2] in (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    begun = json.loads((tmp_path / "out" / "provenance.json").read_text(encoding="utf-8"))
    assert begun["argv"] == ["wireval", "run", "study", "-o", "out"]
    failures = pd.read_csv(tmp_path / "out" / "failures.csv")
    assert "burst pipe" in failures["message"][0]
    assert "RuntimeError" in (tmp_path / "out" / "cases" / "second" / "log.txt").read_text(encoding="utf-8")


def test_a_folder_of_scans_is_enough(
    folder: Path, finished: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "manifest.toml").unlink()
    case = result_of(finished)["entry"]
    entry, direction = case["entry_mm"], case["entry_direction"]
    words = [f"--entry={','.join(map(str, entry))}", f"--direction={','.join(map(str, direction))}"]
    assert main(["run", str(folder), "-o", str(tmp_path / "out"), *words]) == 0
    printed = capsys.readouterr().out
    assert "frames: 4 scans in natural order" in printed
    assert printed.count("roll_deg: 0, that is") == 2, "in the manifest, and among what is assumed"
    assert "[wires.assumed]" in printed
    assert list(errors_of(tmp_path / "out")["trace_sigma_mm"].notna()) == [True] * FRAMES


def test_the_entry_is_inferred_where_the_wire_comes_in(folder: Path, finished: Path, tmp_path: Path) -> None:
    (folder / "manifest.toml").unlink()
    assert main(["run", str(folder), "-o", str(tmp_path / "out"), "--until", "segment"]) == 0
    text = (tmp_path / "out" / "manifest.inferred.toml").read_text(encoding="utf-8")
    found = [json.loads(line.split("=")[1]) for line in text.splitlines() if line.startswith("entry_")]
    case = result_of(finished)["entry"]
    # a guess from voxels of 0.75 mm: two of them, and the angle of one over the 5 mm that give the direction
    assert np.linalg.norm(np.subtract(found[0], case["entry_mm"])) < 1.5
    assert np.degrees(np.arccos(np.dot(found[1], case["entry_direction"]))) < 8.0


def test_a_crash_in_a_sweep_is_said_and_counted(
    short: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def burst(job: Job) -> None:
        if job.settings.config.simulate.wall_scale == 2.0:
            raise RuntimeError("burst pipe")
        run_case(job)

    monkeypatch.setattr("pipeline.run.launch.run_case", burst)
    assert run(short, tmp_path / "out", "--sweep", "simulate.wall_scale=2", *QUICK) == 1
    said = capsys.readouterr()
    assert "simulate.wall_scale=2: bifurcation: crashed: RuntimeError: burst pipe" in said.err
    assert "1 result of the sweep lost" in said.out


def test_pages_of_many_cases_are_drawn_with_a_line_each(
    finished: Path, out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that cannot be drawn is named, and the exit code tells."""
    monkeypatch.setattr("pipeline.commands.report.MANY", 1)
    assert main(["report", str(out)]) == 0
    assert capsys.readouterr().err == "1/1 bifurcation: drawn\n"
    (out / "cases" / "bifurcation" / "frames.h5").write_bytes(b"")
    ledger.write(out / "cases" / "bifurcation", "key")
    assert main(["report", str(out)]) == 1
    said = capsys.readouterr().err
    assert "bifurcation: its page cannot be drawn: " in said
    assert "bifurcation: drawn" not in said
    monkeypatch.undo()
    ledger.write(shutil.copytree(finished, tmp_path / "whole") / "cases" / "bifurcation", "key")
    assert main(["report", str(tmp_path / "whole")]) == 0
    assert "drawn" not in capsys.readouterr().err, "of a few there is no line each"


def test_whether_the_lumen_was_segmented_beside_a_wire_is_said(finished: Path, folder: Path, tmp_path: Path) -> None:
    said = "no reference scan: the lumen was segmented from frame 0, which has a wire in it"
    assert said not in result_of(finished)["assumptions"]
    manifest = folder / "manifest.toml"
    lines = manifest.read_text(encoding="utf-8").splitlines(keepends=True)
    manifest.write_text("".join(s for s in lines if not s.startswith("reference")), encoding="utf-8")
    run(folder, tmp_path / "out", "--until", "segment")
    assert said in result_of(tmp_path / "out")["assumptions"]


def test_a_damaged_result_hides_no_other(out: Path, study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (out / "cases" / "other").mkdir()
    named_by_a_shard(out, "other")
    damaged = out / "cases" / "other" / "result.json"
    damaged.write_text("{", encoding="utf-8")
    for words in (["report", str(out), "--overview"], ["run", str(study / "manifest.toml"), "-o", str(out)]):
        assert main(words) == 1
        said = capsys.readouterr()
        assert f"{damaged}: " in said.err
        assert "2 cases" in said.out
    assert list(pd.read_csv(out / "summary.csv")["status"]) == ["ok", "damaged"]
    assert (out / "index.html").read_text(encoding="utf-8").count("a result file cannot be read") <= 1
    damaged.rename(out / "cases" / "bifurcation" / "result.json")
    assert run(study, out) == 0  # a case of the manifest is computed again


SOUND = {"case": "other", "role": "", "group": "", "status": "ok", "sentence": "", "failures": []}
COUNTS = {"case": "other", "status": "ok", "frames": 1, "frames_ok": 1}


@pytest.mark.parametrize(
    "content",
    [
        "[]",
        '{"case": "other"}',
        json.dumps(SOUND | {"frames": [], "summary": {}}),
        json.dumps(SOUND | {"frames": [{}], "summary": COUNTS}),
        json.dumps(SOUND | {"frames": [], "summary": COUNTS | {"frames": None}}),
    ],
)
def test_a_result_with_other_contents_is_damaged(tmp_path: Path, content: str) -> None:
    path = tmp_path / "cases" / "other" / "result.json"
    path.parent.mkdir(parents=True)
    path.write_text(content, encoding="utf-8")
    (found,) = found_results(tmp_path)
    assert found.status == "damaged"
    assert str(path) in found.failures[0]["message"]
    assert aggregate(tmp_path).cases_ok == 0
    assert "other" in render_index(tmp_path).read_text(encoding="utf-8")


def test_points_cut_short_hide_no_other_case(out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree(out / "cases" / "bifurcation", out / "cases" / "other")
    named_by_a_shard(out, "other")
    result = out / "cases" / "other" / "result.json"
    result.write_text(result.read_text(encoding="utf-8").replace('"bifurcation"', '"other"'))
    points = out / "cases" / "other" / "points.csv.gz"
    points.write_bytes(points.read_bytes()[:-200])
    ledger.write(result.parent, "key")
    assert main(["report", str(out)]) == 1
    assert "other: its page cannot be drawn" in capsys.readouterr().err
    assert list(pd.read_csv(out / "summary.csv")["status"]) == ["ok", "damaged"]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--set", "solver.segmnt_mm=1"], "did you mean 'segment_mm'"),
        (["--set", "solver.segmnt_mm=1"], "1 problem in the settings; nothing was run"),
        (["--only", "bifurcatoin"], "did you mean 'bifurcation'"),
        (["--shard", "3/2"], "expected I/N"),
        (["--shard", "\u00b2/3"], "expected I/N"),
        (["--until", "simulat"], "did you mean 'simulate'"),
        (["--sweep", "simulate.wall_scale"], "write table.key=value1,value2"),
    ],
)
def test_a_wrong_command_line_runs_nothing(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], expected: str
) -> None:
    assert run(study, tmp_path / "out", *words) == 2
    assert expected in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_check_lists_problems_of_the_scans(study: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(study / "manifest.toml")]) == 0
    image = sitk.ReadImage(str(folder / "reference.mha"))
    image.SetOrigin([c + 5.0 for c in image.GetOrigin()])
    sitk.WriteImage(image, str(folder / "reference.mha"))
    assert main(["check", str(folder / "manifest.toml")]) == 2
    assert "geometry differs" in capsys.readouterr().err
    text = (
        (study / "manifest.toml").read_text(encoding="utf-8").replace("entry_mm = [", "entry_mm = [1000.0, 0.0, 0.0] #")
    )
    (folder / "manifest.toml").write_text(text, encoding="utf-8")
    shutil.copy(study / "reference.mha", folder / "reference.mha")
    assert main(["check", str(folder / "manifest.toml")]) == 2
    said = capsys.readouterr().err
    assert "lies outside the scan" in said
    image = sitk.ReadImage(str(study / "reference.mha"))
    ends = [image.TransformIndexToPhysicalPoint(at) for at in ((0, 0, 0), [n - 1 for n in image.GetSize()])]
    first, last = ([float(round(x, 1)) for x in end] for end in ends)
    assert f"the scan spans {first} to {last} mm in LPS" in said


def test_a_case_without_frames_is_simulated_only(folder: Path, tmp_path: Path) -> None:
    lines = (folder / "manifest.toml").read_text(encoding="utf-8").splitlines()
    kept = [line for line in lines if not line.startswith(("frames", "truth"))]
    (folder / "manifest.toml").write_text("\n".join(kept), encoding="utf-8")
    assert run(folder, tmp_path / "out") == 0
    table = errors_of(tmp_path / "out")
    assert list(table["status"]) == ["simulated"] * FRAMES
    assert table["rms_mm"].isna().all()
    assert table["joints"].notna().all()
    page = (tmp_path / "out" / "cases" / "bifurcation" / "report.html").read_text(encoding="utf-8")
    assert '<span class="status good">simulated</span>' in page, "ok, where nothing was compared"
    assert "Simulated only: the case has no frames to compare with." in page
    assert "the lumen along its three axes" in page, "there is no scan in the viewer"
    assert "Nothing is scored: no case has scans" in (tmp_path / "out" / "index.html").read_text(encoding="utf-8")


def test_a_case_without_frames_is_no_frame_that_was_planned(finished: Path, study: Path, tmp_path: Path) -> None:
    """Its depths counted among the frames that are to be within 1 mm: of a perfect study 0.5 were."""
    head, case = (study / "manifest.toml").read_text(encoding="utf-8").split("[[case]]")
    lines = [line for line in case.splitlines() if not line.startswith(("frames", "truth"))]
    plan = "\n".join(lines).replace('id = "bifurcation"', 'id = "plan"')
    manifest = study / "planned.toml"
    manifest.write_text(f"{head}[[case]]{case}\n[[case]]{plan}", encoding="utf-8")
    assert main(["run", str(manifest), "-o", str(tmp_path / "out"), *QUICK]) == 0
    whole = [tables.read(out / "overall.csv", SUMMARY).iloc[0] for out in (finished, tmp_path / "out")]
    assert whole[1]["frames"] == whole[0]["frames"] == FRAMES
    assert whole[1]["within_1mm"] == whole[0]["within_1mm"]


def test_interruption_is_130(study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("pipeline.run.launch.run_all", interrupted)
    assert run(study, tmp_path / "out") == 130


def test_version_and_no_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("wireval ")
    assert main([]) == 2


def test_a_borrowed_clamp_is_that_of_the_other_case(finished: Path, study: Path, tmp_path: Path) -> None:
    """The same scans twice: it is the first case's to the last bit, and not called blind."""
    head, case = (study / "manifest.toml").read_text(encoding="utf-8").split("[[case]]")
    second = case.replace('id = "bifurcation"', 'id = "second"\nentry = "case:bifurcation"')
    manifest = study / "borrowed.toml"
    manifest.write_text(f"{head}[[case]]{case}\n[[case]]{second}", encoding="utf-8")
    assert main(["run", str(manifest), "-o", str(tmp_path / "out"), "--only", "second", *UNTIL]) == 0
    own, borrowed = (
        json.loads((folder / "result.json").read_text(encoding="utf-8"))
        for folder in (finished / "cases" / "bifurcation", tmp_path / "out" / "cases" / "second")
    )
    assert any("has scans of this case: the clamp is not blind" in line for line in borrowed["warnings"])
    np.testing.assert_array_equal(own["entry"]["used_mm"], borrowed["entry"]["used_mm"])


def test_a_roll_is_fitted_where_frames_are_left_to_score(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # one frame: it ended as "0 frames: 0 ok", exit 0
    manifest, frame = folder / "manifest.toml", sorted((folder / "frames").iterdir())[0]
    text = re.sub(
        r"^(roll_deg|insertion_mm|truth) = .*\n", "", manifest.read_text(encoding="utf-8"), flags=re.MULTILINE
    )
    text = text.replace("frames/*.mha", f"frames/{frame.name}").replace("[[case]]", '[[case]]\nroll_deg = "fit"')
    manifest.write_text(text, encoding="utf-8")
    assert main(["check", str(folder)]) == 2
    assert 'roll_deg = "fit" with frames: 1' in capsys.readouterr().err
    manifest.write_text(text.replace('role = "validation"', 'role = "calibration"'), encoding="utf-8")
    assert main(["check", str(folder)]) == 0


def test_a_failed_frame_names_its_scan(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its number alone sends nobody to the file."""
    frames = sorted((folder / "frames").iterdir())
    empty = sitk.ReadImage(str(folder / "reference.mha"))
    empty[0, 0, 0] += 1  # a scan of its own
    sitk.WriteImage(empty, str(frames[1]))
    assert run(folder, tmp_path / "out", "--until", "trace") == 1
    assert f"(scan {frames[1].name})" in capsys.readouterr().err
    rows = pd.read_csv(tmp_path / "out" / "failures.csv").set_index("frame")
    assert rows.loc[1, "message"].endswith(f"(scan {frames[1].name})")
