"""Other simulators' wires: read by what they state, judged as the solver's own, told apart, refused by name."""

from __future__ import annotations

import json
import math
import pickle
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import cast
from unittest.mock import Mock
from xml.etree import ElementTree

import h5py
import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from pipeline.arrays.polyline import resample
from pipeline.cli import main, parsed
from pipeline.commands.score import _plans, said_once
from pipeline.load.geometry import LoadError, Source
from pipeline.load.vtk import read_vtk_points
from pipeline.load.wires import numbered_frames, read_wires
from pipeline.model import Curve, OtherWire, arc_length
from pipeline.run.case import Job
from pipeline.run.inputs import Inputs, named_files
from pipeline.run.stages.known import Frame
from pipeline.run.stages.others import _aside, of_their_run
from pipeline.simulate.others import begun, not_to_depth, numbered_otherwise, oddity, out_of_order, tightest_bend
from pipeline.status import InputError
from pipeline.study.manifest import read_manifest
from pipeline.study.others import Others, found_for, named
from pipeline.study.settings import resolve
from reports.doubts import OF_THEIR_RUN
from reports.export import write_markups_curve, write_polyline_vtp
from reports.verdict import remarks
from solver import Grid
from tests.pipeline.known_study import FRAMES, PEERS, QUICK, Known, errors_of, peers, run_known, simulated, write_csv

Array = NDArray[np.float64]
ADAPTERS = Path(__file__).parents[2] / "docs" / "adapters.md"


def synth(name: str, folder: Path) -> Path:
    assert main(["synth", name, "-o", str(folder), "--size", "64", "--frames", str(FRAMES), "--seed", "7"]) == 0
    return folder / "manifest.toml"


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> Known:
    return run_known(tmp_path_factory.mktemp("known"))


def run_with(known: Known, files: str, name: str) -> tuple[int, pd.DataFrame, dict[str, object]]:
    """A run of the study with ``simulated`` in its manifest."""
    manifest, out = known[0].with_name(f"{name}.toml"), known[0].parent / name
    manifest.write_text(
        known[0].read_text(encoding="utf-8").replace('id = "bend"', f'id = "bend"\nsimulated = {files}')
    )
    code = main(["run", str(manifest), "-o", str(out), "--until", "compare", *QUICK])
    if code == 2:
        return code, pd.DataFrame(), {}
    return code, errors_of(out), json.loads((out / "cases" / "bend" / "result.json").read_text(encoding="utf-8"))


def test_traces_without_scans_are_compared(known: Known) -> None:
    """They used to be "5 ok" with every error empty."""
    table = errors_of(known[0].parent / "out")
    assert list(table["status"]) == ["ok"] * FRAMES
    assert table["rms_mm"].notna().all()
    assert table["null_centreline_rms_mm"].notna().all()
    assert 0.0 < table["rms_mm"].max() < 1.5
    assert pd.read_csv(known[0].parent / "out" / "overall.csv")["within_1mm"].notna().all()


def test_a_trace_that_begins_at_its_tip_fails_by_name(known: Known) -> None:
    folder, traces = known[0].parent, peers("bend")
    write_csv(folder / "turned", [traces[0], traces[1][::-1], *traces[2:]])
    (folder / "turned.toml").write_text(known[0].read_text(encoding="utf-8").replace("traces/*.csv", "turned/*.csv"))
    assert (
        main(["run", str(folder / "turned.toml"), "-o", str(folder / "out-turned"), "--until", "compare", *QUICK]) == 1
    )
    assert list(errors_of(folder / "out-turned")["status"])[1] == "trace_failed"
    assert "tip first" in (folder / "out-turned" / "failures.csv").read_text(encoding="utf-8")


def test_a_folder_of_a_sweep_may_be_scored() -> None:
    assert named(["mine=out/sweep/simulate.friction=0.2"]) == {"mine": Path("out/sweep/simulate.friction=0.2")}


SOLVERS = ("push_force_N", "num_push_N", "iterations", "num_mm", "snaps", "uncertain", "least_pivot")
"""Columns that only the solver itself can fill."""


def test_a_warning_of_one_simulator_bears_its_name() -> None:
    """A mirrored wire's stood behind the solver's own line, as if it were of that one."""
    said = {"theirs": ["scan", "mirrored"], "third": ["scan", "jagged", "mirrored"], "wireval": ["scan"]}
    assert said_once(said) == ["scan", "theirs, third: mirrored", "third: jagged"]


def test_own_wires_give_the_identical_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """And a third party's are told apart from one without the tip's curve; all beside each other, every page drawn."""
    manifest, run = synth("bend", tmp_path / "study"), tmp_path / "run"
    assert main(["run", str(manifest), "-o", str(run), "--until", "compare", *QUICK]) == 0
    curves = write_csv(tmp_path / "ours", simulated(run))
    wanted = [str(curves), f"PyElastica={PEERS / 'bend'}", f"straight-tip={PEERS / 'bend-straight-tip'}"]
    out = tmp_path / "out"
    assert main(["score", str(manifest), *(x for c in wanted for x in ("--curves", c)), "-o", str(out), *QUICK]) == 0
    assert "ours and wireval have the same error at every point of all 4 frames" in capsys.readouterr().out
    before, after = errors_of(run), errors_of(out)
    same = [c for c in before if not c.endswith("_s") and c not in (*SOLVERS, "max_penetration_mm")]
    pd.testing.assert_frame_equal(before[same], after[same], check_exact=True)
    assert after[list(SOLVERS)].isna().all(axis=None), "what nobody knows is empty, never 0"
    assert np.abs(before["max_penetration_mm"] - after["max_penetration_mm"]).max() < 0.01
    table = pd.read_csv(out / "simulators.csv").set_index(["simulator", "against"])["rms_ratio"]
    assert table["ours", "wireval"] == pytest.approx(1.0, abs=1e-12)
    assert 0.8 < table["PyElastica", "wireval"] < 1.5, "two programs, one physics"
    assert table["straight-tip", "PyElastica"] > 2.0
    assert table["wireval", "straight-tip"] == pytest.approx(1 / table["straight-tip", "wireval"], rel=0.03)
    where = pd.read_csv(out / "where.csv")
    assert not where.loc[where["simulator"] == "straight-tip", "lead"].notna().any(), "nearest nowhere"
    for page in ("simulators.html", "index.html", "simulators/wireval/index.html", "simulators/PyElastica/index.html"):
        assert (out / page).exists()
    assert "simulators.html" in (out / "index.html").read_text(encoding="utf-8")
    for name, folder in (("ours", out), ("PyElastica", out / "simulators" / "PyElastica")):
        for page in (folder / "index.html", folder / "cases" / "bend" / "report.html"):
            text = page.read_text(encoding="utf-8")
            assert f"{name} - wireval</title>" in text, "whose wires they are"
            assert f"The wire of {name} lies " in text
    (out / "simulators.html").unlink()
    assert main(["report", str(out), "--overview"]) == 0
    assert "straight-tip" in (out / "simulators.html").read_text(encoding="utf-8")


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """No page of a case is drawn: one of each simulator, which take most of a score."""
    monkeypatch.setattr("pipeline.run.case.draw", lambda *_: None)


@pytest.mark.slow  # the bend above has the same at every commit
@pytest.mark.usefixtures("undrawn")
def test_a_third_party_in_a_bifurcation(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    manifest, out = synth("bifurcation", tmp_path / "study"), tmp_path / "out"
    words = ["score", str(manifest), "--curves", f"PyElastica={PEERS / 'bifurcation'}", "-o", str(out), *QUICK]
    assert main(words) == 0
    capsys.readouterr()
    assert main([*words, "--fail-if", "rms_mm>0.001", "--fail-if", "frames_failed>0"]) == 1
    assert "PyElastica: gate closed: --fail-if rms_mm>0.001" in capsys.readouterr().err
    of_one, tests = ["--fail-if", "wireval:rms_mm>0.002", "--fail-if", "PyElastica:rms_mm>5"], tmp_path / "tests.xml"
    assert main([*words, *of_one, "--junit", str(tests)]) == 1
    heard = capsys.readouterr().err
    assert "wireval: gate closed: --fail-if wireval:rms_mm>0.002" in heard
    assert heard.count("gate closed") == 1, "the other simulator is held against its own limit alone"
    suites = {suite.get("name"): suite for suite in ElementTree.parse(tests).getroot()}
    assert list(suites) == ["PyElastica/bifurcation", "wireval/bifurcation", "gates"]
    assert [suite.get("failures") for suite in suites.values()] == ["0", "0", "1"]
    assert [case.get("name") for case in suites["gates"]] == [
        "PyElastica: --fail-if PyElastica:rms_mm>5",
        "wireval: --fail-if wireval:rms_mm>0.002",
    ]
    table = pd.read_csv(out / "simulators.csv").set_index(["simulator", "against"])
    assert 0.8 < table.loc[("PyElastica", "wireval"), "rms_ratio"] < 1.5
    assert errors_of(out, "bifurcation")["branch_ok"].all()


@pytest.mark.usefixtures("undrawn")
def test_any_simulator_s_failure_is_the_exit_code(known: Known, tmp_path: Path) -> None:
    """That of a later one was exit 0, and stood in no failures.csv but its own."""
    manifest, good = known[0], PEERS / "bend"
    bad = write_csv(tmp_path / "bad", peers("bend"))
    sorted(bad.iterdir())[1].unlink()
    out = tmp_path / "out"
    words = ["--curves", f"good={good}", "--curves", f"bad={bad}", "--without-own"]
    assert main(["score", str(manifest), *words, "-o", str(out), *QUICK]) == 1
    table = pd.read_csv(out / "simulators" / "failures.csv")
    assert list(table["status"]) == ["curve_missing"]
    assert (out / table["log"].item()).exists()


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_a_case_without_a_folder_has_failed_and_the_others_count(
    known: Known, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A simulator that crashed in one case wrote no folder for it: exit 2, and no summary for the build server."""
    manifest = known[0].with_name("two.toml")
    text = known[0].read_text(encoding="utf-8")
    case = text[text.index("[[case]]") :].replace('id = "bend"', 'id = "lost"')
    manifest.write_text(f"{text}\n{case}", encoding="utf-8")
    write_csv(tmp_path / "sim" / "bend", known[1])
    out, junit = tmp_path / "out", tmp_path / "junit.xml"
    words = ["score", str(manifest), "-o", str(out), "--without-own", *QUICK]
    assert main([*words, "--curves", f"mine={tmp_path / 'sim'}", "--junit", str(junit)]) == 1
    assert f"warning: mine: {tmp_path / 'sim'} has no folder CASE/ nor CASE.h5 for lost" in capsys.readouterr().err
    table = pd.read_csv(out / "failures.csv")
    assert set(zip(table["simulator"], table["case"], table["status"], strict=True)) == {
        ("mine", "lost", "curve_missing")
    }
    suites = {suite.get("name"): suite.get("failures") for suite in ElementTree.parse(junit).getroot()}
    assert (suites["mine/bend"], suites["mine/lost"]) == ("0", str(FRAMES))
    took = pd.read_csv(out / "cases" / "bend" / "timings.csv").set_index("frame")["compare_s"][0]
    (first,) = ElementTree.parse(junit).findall("testsuite[@name='mine/bend']/testcase[@name='frame 0']")
    assert float(str(first.get("time"))) == pytest.approx(took, abs=1e-3), "of a frame that is timed"
    (tmp_path / "sim" / "bend").rename(tmp_path / "sim" / "bent")
    assert main([*words, "--curves", f"mine={tmp_path / 'sim'}"]) == 2
    assert "found neither bend/ nor bend.h5 in it" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_wires_may_be_judged_alone(known: Known, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The solver's own were simulated with every score, by far the longest part of it where a lumen is kept."""
    write_csv(tmp_path / "mine", known[1])
    out = tmp_path / "out"
    words = ["score", str(known[0]), "-o", str(out), "--curves", str(tmp_path / "mine"), *QUICK]
    assert main([*words, "--without-own"]) == 0
    assert "score of mine.  side by side: " in capsys.readouterr().out
    assert list(pd.read_csv(out / "simulators.csv")["simulator"]) == ["mine"]
    assert not (out / "simulators" / "wireval").exists()
    assert "wireval is the solver of this project" not in (out / "simulators.html").read_text(encoding="utf-8")
    assert errors_of(out)["null_centreline_rms_mm"].notna().all(), "held against the predictors all the same"
    assert main(["report", str(out), "--overview"]) == 0
    assert main([*words, "--without-own", "--fail-if", "wireval:rms_mm>1"]) == 2
    assert main(words) == 0
    assert main([*words, "--without-own"]) == 2
    assert "a score of wireval, which would be replaced; name another folder" in capsys.readouterr().err


ENTRY, ALONG = np.array([10.0, -40.0, 7.0]), np.array([0.0, 0.6, 0.8])


def made(length_mm: float = 40.0) -> Array:
    """A wire that leaves an entry along its direction and bends away."""
    s = np.linspace(0.0, length_mm, 81)[:, None]
    return np.asarray(ENTRY + s * ALONG + 0.006 * s**2 * [1.0, 0.0, 0.0])


def judged(wire: Array, folder: Path) -> str:
    """What is said of a wire in a file: by the reader, by where it lies, by its length."""
    write_csv(folder, [wire])
    (found,) = read_wires([Source(folder / "wire_000.csv")], 1)
    if found.points_mm is None:
        return found.problem
    length = float(arc_length(begun(found.points_mm, ENTRY, ALONG))[-1])
    return oddity(found.points_mm, ENTRY, ALONG) or not_to_depth(length, float(arc_length(made())[-1]), 2.0)


def nan(wire: Array) -> Array:
    return np.concatenate([wire[:3], [[np.nan] * 3], wire[3:]])


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (nan, "1 of 82 points are NaN or infinite, the first is point 3"),
        (lambda wire: wire[:1], "1 different points"),
        (lambda wire: np.repeat(wire[:1], 5, axis=0), "1 different points"),
        (lambda wire: wire[:, :2], "x_mm"),
        (lambda wire: wire[::-1], "read from its other end (tip first)"),
        (lambda wire: wire / 1000.0, "if it were in m"),
        (lambda wire: wire / 25.4, "if it were in inch"),
        (lambda wire: wire * [-1.0, -1.0, 1.0], "if it were RAS"),
        (lambda wire: wire[:, ::-1], "if it were written as z, y, x"),
        (lambda wire: wire[::-1, ::-1], "tip first) and written as z, y, x"),
        (lambda wire: wire[::-1] * [-0.1, -0.1, 0.1], "tip first) and RAS and in cm"),
        (lambda wire: wire + 30.0 * np.eye(3)[2], "mm from entry_mm"),
        (lambda wire: wire @ np.diag([1.0, 1.0, -1.0]) + [0.0, 0.0, 14.0], "degrees away"),
        (lambda wire: ENTRY + 1e-3 * (wire - ENTRY), "is it in m?"),
        (lambda wire: wire[:50], "mm long"),
        (lambda wire: wire[[*range(40), 43, 41, 42, 40, *range(44, len(wire))]], "turns straight back at point"),
        (lambda wire: ENTRY + 1.2 * (wire - ENTRY), "mm long"),
    ],
)
def test_a_bad_wire_is_told_by_name(tmp_path: Path, spoil: Callable[[Array], Array], said: str) -> None:
    assert judged(made(), tmp_path / "good") == ""
    assert said in judged(spoil(made()), tmp_path / "bad")


def test_a_unit_that_a_file_states_wrongly_is_told_as_it_is(tmp_path: Path) -> None:
    """Numbers in mm under "unit: m" were "in µm"."""
    folder = write_csv(tmp_path / "metres", [made()], "# space: LPS\n# unit: m\nx,y,z")
    (found,) = read_wires([Source(folder / "wire_000.csv")], 1)
    assert found.points_mm is not None
    assert oddity(found.points_mm, ENTRY, ALONG, found.unit).endswith("it would if it were in mm, not in m")
    assert not_to_depth(40e3, 40.0, 2.0, found.unit).endswith("is it in mm?")
    assert not_to_depth(4.0, 40.0, 2.0).endswith("is it in cm?")
    assert not_to_depth(4.0, 40.0, 2.0, others_fit=True).endswith("does its file end early?"), "a unit would be of all"
    shifted = not_to_depth(20.0, 40.0, 2.0, others_fit=True, lagging=True)
    assert shifted.endswith("wires have the depths of other frames: is each file that of its frame?"), "none ends early"
    assert not_to_depth(36.0, 40.0, 2.0, others_fit=True).endswith("40.00 mm deep")


def test_a_reading_that_only_just_passes_is_none() -> None:
    """5.2 mm beside an entry 0.3 mm beside the origin: the other side of it lies 4.6 mm off, and RAS was it."""
    entry, up = np.array([0.3, 0.0, 50.0]), np.array([0.0, 0.0, 1.0])
    wire = entry - [5.2, 0.0, 0.0] + np.arange(20.0)[:, None] * up
    assert oddity(wire, entry, up).endswith("check its coordinates")


def test_a_wire_in_voxels_is_told_as_such() -> None:
    """It "would if it were in µm": near the origin lies the entry, and with it whatever is divided by 1000."""
    entry, up = np.array([0.3, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    scan = Grid(np.zeros((30, 30, 120)), [0.4] * 3, [-5.0, -6.3, -9.0])
    wire = entry + np.arange(31.0)[:, None] * up
    index = scan.to_index(wire)
    for depth_mm in (math.nan, 30.0):
        assert oddity(wire, entry, up, depth_mm=depth_mm, scan=scan) == ""
        assert oddity(index, entry, up, depth_mm=depth_mm, scan=scan).endswith("it would if it were in voxels")
        assert oddity(index, entry, up, depth_mm=depth_mm).endswith("check its coordinates")
    in_m = 1e3 * index
    assert oddity(1e20 * in_m, entry, up, scan=scan).endswith("check its coordinates")
    assert oddity(in_m, entry, up, "m", scan=scan).endswith("it would if it were in voxels"), "whatever unit was stated"
    assert "in µm" in oddity(1e3 * (wire + 6.0 * up), entry + 6.0 * up, up), "one of 30 mm may be in it"


def test_a_unit_explains_no_wire_that_it_makes_too_long() -> None:
    """A wire of 24 mm that begins 6 mm beyond its entry "would if it were in cm", 300 mm deep."""
    entry, up = np.array([0.3, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    wire = entry + np.array([0.1, 0.0, 0.55]) + 0.1 * np.arange(24.0)[:, None] * up
    assert oddity(10.0 * (wire - entry) + entry, entry, up, depth_mm=30.0).endswith("check its coordinates")
    tenth = 0.1 * (entry + np.arange(30.0)[:, None] * up) + [8.0, 0.0, 0.0]
    assert oddity(tenth, entry, up, depth_mm=30.0).endswith("check its coordinates"), "in cm it lies 80 mm off"
    in_cm = 0.1 * (entry + [60.0, 0.0, 0.0] + np.arange(30.0)[:, None] * up)
    here = entry + [60.0, 0.0, 0.0]
    assert oddity(in_cm, here, up).endswith("in cm")
    assert oddity(in_cm, here, up, depth_mm=30.0).endswith("in cm")
    assert oddity(in_cm, here, up, depth_mm=3.0).endswith("check its coordinates")
    # a wire of 120 mm, 90 of them behind the entry
    whole = 0.1 * (here + (np.arange(121.0)[:, None] - 90.0) * up)
    assert oddity(whole, here, up, depth_mm=30.0).endswith("in cm")


def test_wires_in_another_order_are_told() -> None:
    """Neighbours that were swapped passed where frames lie nearer together than the tolerance of depths."""
    depths = np.array([10.0, 11.5, 13.0, 14.5])
    assert out_of_order(depths + [0.3, -0.2, 0.1, -0.6], depths) == []
    assert out_of_order(depths[[1, 0, 3, 2]], depths) == [(0, 1), (2, 3)]
    assert out_of_order(depths[::-1], depths) == [(0, 1), (1, 2), (2, 3)]
    # frames may come in any order, and some have no wire
    assert out_of_order(np.array([13.0, np.nan, 10.0]), np.array([13.0, 11.5, 10.0])) == []


def test_wires_with_the_depths_of_other_frames_are_told() -> None:
    """Numbers off by one passed where frames lie nearer together than the tolerance of depths."""
    depths = np.array([10.0, 11.3, 12.5, 14.0, 15.1])
    assert numbered_otherwise(depths + [0.1, -0.2, 0.1, 0.0, -0.1], depths) == 0
    assert numbered_otherwise(np.append(depths[1:], 16.4), depths) == 1
    assert numbered_otherwise(np.append(8.8, depths[:-1]), depths) == -1
    assert numbered_otherwise(np.append([7.2, 8.8], depths[:-2]), depths) == -2
    assert numbered_otherwise(depths - 0.7, depths) == 0, "too short, and no other frame's"
    assert numbered_otherwise(np.array([np.nan, 12.5, 14.0, np.nan, 16.4]), depths) == 0, "in two frames alone"
    assert numbered_otherwise(np.array([11.3, np.nan, 14.0, 15.1, 16.4]), depths) == 1


@pytest.mark.parametrize(
    ("shift_mm", "noise_mm", "told"),
    [
        ((0.0, 3.0, 0.0), 0.01, "3.00, "),
        ((0.0, 0.3, 0.0), 0.0, ""),
        ((0.25, 0.25, 0.25), 0.05, "scans (a voxel's corner lies half a voxel from its middle"),
        ((1.0, 0.0, 0.0), 0.6, ""),
    ],
)
def test_wires_that_all_lie_aside_are_told(shift_mm: tuple[float, ...], noise_mm: float, told: str) -> None:
    """3 mm in y: what was said was of axes and rolls. Half a voxel along each axis was not told."""
    rng, frames = np.random.default_rng(0), []
    for n in range(3):
        line = np.column_stack([np.zeros((30, 2)), np.linspace(0.0, 20.0 + 5.0 * n, 30)])
        wire = line + shift_mm + rng.normal(0.0, noise_mm, line.shape)
        frames.append(Frame(n, curve=Curve(line, np.full(30, 0.02)), simulated=OtherWire(wire, 0.0)))
    said = _aside(frames, 0.7)
    assert bool(said) == bool(told)
    assert told in "".join(said)
    assert _aside([Frame(0)], 0.7) == []


def test_a_shift_along_a_wire_is_told_where_it_bends_and_not_where_it_is_pushed_too_far() -> None:
    """Half a voxel along each axis, cut at the clamp's plane, was not told: places of equal arc length are others."""
    turned = np.linspace(0.0, 1.5, 200)
    curve = 25.0 * np.column_stack([np.zeros(200), 1.0 - np.cos(turned), np.sin(turned)])
    shifted = begun(curve + [0.2, -0.2, 0.2], np.zeros(3), np.array([0.0, 0.0, 1.0]))
    tip = np.column_stack([np.zeros(40), np.linspace(0.0, 1.0, 40) ** 2, np.linspace(0.0, 4.0, 40)])
    straight, too_far = (
        np.concatenate([[[0.0, 0.0, z] for z in np.arange(0.0, ends, 0.5)], tip + [0.0, 0.0, ends]])
        for ends in (20.0, 21.2)
    )

    def said(traced: Array, wire: Array) -> list[str]:
        curve = Curve(traced, np.full(len(traced), 0.02))
        return _aside([Frame(0, curve=curve, simulated=OtherWire(wire, 0.0))], 0.3)

    assert said(curve, shifted)[0].startswith("the wires lie (0.20, -0.20, 0.20) mm aside")
    assert said(straight, too_far) == []
    assert said(curve, curve[:1] - [0.0, 0.0, 3.0] * np.arange(2)[:, None]) == [], "it lies nowhere beside the curve"


def test_wires_that_begin_far_beyond_the_clamp_are_told(known: Known, tmp_path: Path) -> None:
    """3 mm beyond it, "few points, give a point every millimetre" was the advice; they had one every half."""
    folder = write_csv(tmp_path / "late", [resample(wire, 0.5)[6:] for wire in known[1]])
    code, _, result = run_with(known, f'"{folder}/*.csv"', "late")
    assert code == 0
    (said,) = (text for text in result["warnings"] if "begin beyond the clamp's plane" in text)
    assert "frame 0: 3.0 mm" in said
    assert not any("few points" in text for text in result["warnings"])


@pytest.mark.parametrize(
    ("held", "name", "value", "refused"),
    [
        ("/", "coordinates", b"RAS", True),
        ("/", "length_unit", "m", True),
        ("/frames/000/simulated_mm", "unit", np.array(["cm"], h5py.string_dtype()), True),
        ("/frames/000", "space", "RAS", True),
        ("/frames", "units", "m", True),
        ("/", "coordinates", "lps", False),
        ("/", "coordinates", "left-posterior-superior", False),
        ("/", "coordinates", "", False),
        ("/", "unit", "N", False),
        ("/", "length_unit", "millimetre", False),
    ],
)
def test_what_hdf5_wires_state_is_read(
    known: Known, tmp_path: Path, held: str, name: str, value: object, refused: bool
) -> None:
    """Attributes were not read: wires in RAS were 13 mm off, and ok."""
    wires = tmp_path / "wires.h5"
    with h5py.File(wires, "w") as file:
        file["frames/000/simulated_mm"] = known[1][0]
        file[held].attrs[name] = value
    if refused:
        with pytest.raises(LoadError, match=rf"wires\.h5: {held}: attribute {name} is '\w+'; allowed in HDF5: LPS mm"):
            read_wires([Source(wires)], 1)
    else:
        assert read_wires([Source(wires)], 1)[0].points_mm is not None


def test_a_wire_that_its_file_calls_not_at_rest_has_failed(known: Known, tmp_path: Path) -> None:
    """Without the result of the run beside it, the status in the file was not read: ok."""
    with h5py.File(tmp_path / "wires.h5", "w") as file:
        for n, status in enumerate(("ok", "MAX_ITERATIONS", "trace_failed", "under_resolved")):
            file[f"frames/{n:03d}/simulated_mm"] = known[1][n]
            file[f"frames/{n:03d}"].attrs["status"] = status
    refused = [file.refused for file in read_wires([Source(tmp_path / "wires.h5")], 4)]
    assert [status for status, *_ in refused] == ["", "max_iterations", "", "under_resolved"]
    assert "iteration limit" in refused[1][1]


def test_a_score_of_swapped_wires_says_so(known: Known, tmp_path: Path) -> None:
    wires = known[1]
    folder = write_csv(tmp_path / "swapped", [wires[0], wires[1], wires[3], wires[2]])
    _, _, result = run_with(known, f'"{folder}/*.csv"', "swapped")
    (said,) = [text for text in map(str, cast(list[object], result["warnings"])) if "order" in text]
    assert "is each file that of its frame?" in said


def folded(wire: Array, back_mm: float, apart_mm: float) -> Array:
    """The wire, its end folded back beside itself in a half circle."""
    last = int(np.searchsorted(arc_length(wire), arc_length(wire)[-1] - back_mm))
    along = wire[last] - wire[last - 1]
    along /= np.linalg.norm(along)
    across = np.cross(along, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    angle = np.linspace(0.0, np.pi, 8)[1:, None]
    half = wire[last] + 0.5 * apart_mm * ((1.0 - np.cos(angle)) * across + np.sin(angle) * along)
    rest = back_mm - 0.5 * np.pi * apart_mm
    return np.concatenate([wire[: last + 1], half, half[-1] - np.arange(0.25, rest, 0.25)[:, None] * along])


def test_a_folded_wire_passes_no_gate_of_warnings(known: Known, tmp_path: Path) -> None:
    """Its tip 6 mm off, it had an rms of 0.27 mm: what was printed as a warning was not counted as one."""
    assert tightest_bend(made(), 0.18) is None
    sharp = tightest_bend(folded(made(), 8.0, 1.2), 0.18)
    assert sharp is not None
    assert sharp[0] > 120.0
    curved_tip = [[0.0, 0.5], [5.0, 0.5], [5.0, 0.0]]
    assert tightest_bend(folded(made(), 12.0, 1.2), 0.18, curved_tip), "the fold is behind the curve of its tip"
    assert tightest_bend(folded(made(), 8.0, 4.0), 0.18) is None, "a loop of 2 mm radius is no fold"
    assert tightest_bend(folded(made(), 8.0, 1.2)[::8], 0.18) is None, "points so far apart tell nothing"
    wires = [*known[1][:2], *(folded(resample(wire, 0.25), 6.0, 1.2) for wire in known[1][2:])]
    folder = write_csv(tmp_path / "folded", wires)
    _, table, result = run_with(known, f'"{folder}/*.csv"', "folded")
    assert list(table["status"]) == ["ok"] * FRAMES
    said = [*map(str, cast(list[object], result["warnings"]))]
    assert said[-1].startswith("2 frames: wires turn as none of radius_mm = 0.18 does: in frame ")
    overall = pd.read_csv(known[0].parent / "folded" / "overall.csv").iloc[0]
    assert remarks(overall), "the tips lie off"
    assert overall["warnings"] == len(said) + len(remarks(overall))


@pytest.mark.slow
def test_another_simulators_wires_have_no_budget_of_ours(known: Known, tmp_path: Path) -> None:
    """What they are off was counted as what inputs do: of a wire turned by 3 degrees nothing was beyond 2 u."""
    folder = write_csv(tmp_path / "wires", known[1])
    manifest, out = tmp_path / "manifest.toml", tmp_path / "out"
    text = known[0].read_text(encoding="utf-8").replace('id = "bend"', f'id = "bend"\nsimulated = "{folder}/*.csv"')
    for name in ("traces", "vessel.swc"):
        text = text.replace(f'"{name}', f'"{known[0].parent / name}')
    manifest.write_text(text, encoding="utf-8")
    words = ["--until", "compare", "--set", "budget.members=9", *QUICK]
    assert main(["run", str(manifest), "-o", str(out), *words]) == 0
    result = json.loads((out / "cases" / "bend" / "result.json").read_text(encoding="utf-8"))
    assert any(text.startswith("no budget: it is drawn by this project's own solver") for text in result["assumptions"])
    assert not (out / "cases" / "bend" / "budget.csv").exists()
    assert pd.read_csv(out / "overall.csv")["u_input_mm"].isna().all()


def test_another_simulators_wire_that_lies_in_itself_has_failed(known: Known, tmp_path: Path) -> None:
    """As the solver's own."""
    wires = [*known[1][:3], folded(resample(known[1][3], 0.25), 8.0, 0.3)]
    code, table, result = run_with(known, f'"{write_csv(tmp_path / "hairpin", wires)}/*.csv"', "hairpin")
    assert code == 1
    assert list(table["status"]) == [*["ok"] * 3, "self_contact"]
    assert "wire_003.csv: the wire lies 0.0" in str(result["failures"])


def test_a_wire_that_its_own_run_refused_has_failed(known: Known, tmp_path: Path) -> None:
    """Three of four wires with too long segments, refused by their run, were ok in a score of its folder."""
    out, words = tmp_path / "coarse", ["--until", "simulate", "--set", "solver.segment_mm=6", *QUICK]
    assert main(["run", str(known[0]), "-o", str(out), *words]) == 1
    code, table, result = run_with(known, f'"{out / "cases" / "bend" / "frames.h5"}"', "coarse")
    own = json.loads((out / "cases" / "bend" / "result.json").read_text(encoding="utf-8"))["frames"]
    assert code == 1
    assert [*table["status"]] == [f["status"] if f["stage"] else "ok" for f in own]
    assert "under_resolved" in [*table["status"]]
    assert "frames.h5#1: a joint is turned by" in str(result["failures"])


def test_wires_of_a_run_bring_its_warnings(tmp_path: Path) -> None:
    """A roll that a run was warned of was a score of its folder without a warning: statuses alone came along."""
    told = ["turned by -30 degrees", f"{OF_THEIR_RUN}it is kinked", "few points"]
    result = {"warnings": ["500 of 1000 members were lost", *told], "warnings_of_wires": told}
    (tmp_path / "result.json").write_text(json.dumps(result))
    wires, log = [Source(tmp_path / "frames.h5")], Mock(warnings=["few points"])
    assert of_their_run(Mock(**{"case.simulated.files": wires}, log=log)) == [
        "in the run that made these wires: turned by -30 degrees",
        "in the run that made these wires: it is kinked",  # of a score of a score it was said twice
    ]
    assert of_their_run(Mock(**{"case.simulated.files": [Source(tmp_path / "wires.h5")]}, log=log)) == []
    assert of_their_run(Mock(**{"case.simulated": None}, log=log)) == []


def test_the_result_beside_wires_is_an_input_of_theirs(known: Known, tmp_path: Path) -> None:
    """Written anew, with other warnings and statuses, it was in no key: the same score said "kept"."""
    (case,) = read_manifest(known[0]).cases
    wires, result = tmp_path / "frames.h5", tmp_path / "result.json"
    wires.write_bytes(b"wires")
    scored = case.model_copy(update={"simulated": Others.model_construct(files=(Source(wires),))})
    job = Job(scored, resolve([]), tmp_path / "out")
    before = job.key
    result.write_text('{"warnings": []}', encoding="utf-8")
    assert job.key != before
    assert named_files(scored)["simulated.result"] == result
    assert result in Inputs.of(scored).states, "nor was it watched"
    (tmp_path / "wire.csv").touch()
    others = case.model_copy(update={"simulated": Others.model_construct(files=(Source(tmp_path / "wire.csv"),))})
    assert "simulated.result" not in named_files(others)


@pytest.mark.parametrize("frame", ['{"stage": "simulate"}', '{"frame": null}', '{"frame": 0, "status": 5}'])
def test_wires_beside_a_damaged_result_are_refused(known: Known, tmp_path: Path, frame: str) -> None:
    """A frame without a number was a KeyError; which of the wires its run refused is not known then."""
    wires = tmp_path / "frames.h5"
    with h5py.File(wires, "w") as file:
        file["frames/000/simulated_mm"] = known[1][0]
    (tmp_path / "result.json").write_text(f'{{"frames": [{frame}]}}', encoding="utf-8")
    with pytest.raises(LoadError, match=r"result\.json: frames.*of the run again, with --resume"):
        read_wires([Source(wires)], 1)


def test_a_wire_begins_at_the_clamps_plane() -> None:
    """Cut where its base passes it, continued back where it begins behind it; a wire that comes back is cut once."""
    wire = made()
    introducer = ENTRY - np.array([[30.0], [0.4]]) * ALONG
    np.testing.assert_allclose(
        begun(np.concatenate([introducer, wire[1:]]), ENTRY, ALONG)[:2], wire[:2], rtol=0.0, atol=2e-3
    )
    late = begun(wire[3:], ENTRY, ALONG)
    assert (late[0] - ENTRY) @ ALONG == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_array_equal(late[1:], wire[3:])
    back = np.concatenate([introducer, wire[1:], wire[-1] - np.array([[50.0], [80.0]]) * ALONG, wire[-1:]])
    assert len(begun(back, ENTRY, ALONG)) == len(back) - 2 + 1
    np.testing.assert_array_equal(begun(wire, ENTRY, ALONG), wire)


def test_bad_frames_fail_and_the_others_count(known: Known, tmp_path: Path) -> None:
    """A missing file, an empty one and a wire that stops half way: none is left out, each says why."""
    wires = known[1]
    folder = write_csv(tmp_path / "sim", [*wires[:3], wires[3][: len(wires[3]) // 2]])
    shutil.copytree(folder, tmp_path / "odd")
    (folder / "wire_001.csv").unlink()
    (folder / "wire_002.csv").write_text("", encoding="utf-8")
    code, table, result = run_with(known, f'"{folder}/*.csv"', "spoilt")
    assert code == 1
    assert list(table["status"]) == ["ok", "curve_missing", "curve_missing", "not_to_depth"]
    assert "wire_003.csv: it is" in str(result["failures"])
    assert "deep: does its file end early?" in str(result["failures"]), "it was asked whether the file is in cm"
    assert pd.DataFrame([result["summary"]])["frames_ok"].item() == 1
    for number, text in ((1, "a,b\n1,2\n"), (2, "x,y,z\n0,0,0\n0,0,1\n"), (3, "\0\1\2")):
        (tmp_path / "odd" / f"wire_00{number}.csv").write_text(text, encoding="utf-8")
    code, table, result = run_with(known, f'"{tmp_path / "odd"}/*.csv"', "odd")
    assert code == 1, "one unreadable file refused all of them"
    assert list(table["status"]) == ["ok", *["curve_unusable"] * 3]
    said = [failure["message"] for failure in json.loads(json.dumps(result["failures"]))]
    assert (
        "wire_001.csv: has columns a, b; expected x_mm, y_mm, z_mm (or x, y, z), separated by commas or semicolons"
        in said[0]
    )
    assert "wire_002.csv: space and unit are not stated" in said[1]
    assert r"wire_003.csv: has columns '\x00\x01\x02'; expected" in said[2], "nothing that a terminal would obey"


def test_a_refusal_says_which_simulator_and_which_file(
    known: Known, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    aside = write_csv(tmp_path / "cv_a", [wire + [7.7, 0.0, 0.0] for wire in known[1]])
    words, good = ["score", str(known[0]), "-o", str(tmp_path / "out"), *QUICK], write_csv(tmp_path / "good", known[1])
    assert main([*words, "--curves", f"good={good}", "--curves", f"a={aside}"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("a: case 'bend': none of the other simulator's 4 wires can be used; ")
    assert f"{aside / 'wire_000.csv'}: its base passes" in error
    assert error.count("none of the other") == 1
    manifest = known[0].with_name("none.toml")
    manifest.write_text(known[0].read_text(encoding="utf-8").replace("entry_mm =", "entry_m ="), encoding="utf-8")
    assert main(["score", str(manifest), *words[2:], "--curves", f"good={good}", "--curves", f"a={aside}"]) == 2
    assert "a: " not in capsys.readouterr().err, "what concerns all is said once, of nobody"


def test_what_is_wrong_with_all_is_refused(known: Known, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wires = known[1]
    for name, folder, said in (
        ("bare", write_csv(tmp_path / "bare", wires, "x,y,z"), "space and unit are not stated"),
        ("cm", write_csv(tmp_path / "cm", wires, "# unit: cm\nx,y,z"), "space is not stated and will not be guessed"),
        ("unit", write_csv(tmp_path / "unit", wires, "# space: LPS\nx,y,z"), "unit is not stated"),
        ("lines", tmp_path / "bare", "or write '# space: LPS' and '# unit: mm' above the table"),
        ("feet", write_csv(tmp_path / "feet", wires, "# space: LPS\n# unit: ft\nx,y,z"), "lengths in 'ft'"),
        ("five", write_csv(tmp_path / "five", [*wires, wires[-1]]), "5 files, wire_000.csv to wire_004.csv, for 4"),
        ("late", write_csv(tmp_path / "late", wires[1:3], first=1), "not known which belongs to which"),
        ("turned", write_csv(tmp_path / "turned", [w[::-1] for w in wires]), "tip first"),
        ("ras", write_csv(tmp_path / "ras", [w * [-1, -1, 1] + [0, 40, 0] for w in wires]), "entry_mm"),
    ):
        assert run_with(known, f'"{folder}/*.csv"', f"all-{name}")[0] == 2
        assert said in capsys.readouterr().err, name
    stated = f'{{files = "{tmp_path}/bare/*.csv", space = "LPS", unit = "mm"}}'
    assert run_with(known, stated, "stated")[0] == 0
    both = f'{{files = "{tmp_path}/feet/*.csv", space = "RAS"}}'
    assert run_with(known, both, "both")[0] == 2
    assert "the file says LPS, stated was RAS" in capsys.readouterr().err


def test_every_format_and_what_it_states(tmp_path: Path) -> None:
    """All give the same points: in RAS, in metres, as nodes that wait at the base, numbered from 1."""
    wires = [made(20.0), made(30.0)]
    for kind in ("vtp", "mrk", "vtk"):
        (tmp_path / kind).mkdir()
    for n, w in enumerate(wires):
        write_polyline_vtp(tmp_path / "vtp" / f"a{n}.vtp", w)
        write_markups_curve(tmp_path / "mrk" / f"a{n}.mrk.json", w, "wire")
        ras = (w * [-1, -1, 1]).astype(">f8").tobytes()
        line = np.array([len(w), *range(len(w))], ">i4").tobytes()
        head = f"# vtk DataFile Version 3.0\nSPACE=RAS\nBINARY\nDATASET POLYDATA\nPOINTS {len(w)} double\n".encode()
        rest = f"\nLINES 1 {len(w) + 1}\n".encode() + line + b"\n"
        (tmp_path / "vtk" / f"a{n}.vtk").write_bytes(head + ras + rest)
    with h5py.File(tmp_path / "all.h5", "w") as file:
        for n, w in enumerate(wires):
            file[f"frames/{n:03d}/simulated_mm"] = w
    write_csv(tmp_path / "ras", [w * [-1e-3, -1e-3, 1e-3] for w in wires], "# space: RAS\n# unit: m\nx,y,z")
    write_csv(tmp_path / "inch", [w / 25.4 for w in wires], "# space: LPS\n# unit: inch\nx,y,z")
    write_csv(tmp_path / "micron", [w * 1e3 for w in wires], "# space: LPS\n# unit: micron\nx,y,z")
    write_csv(tmp_path / "waiting", [np.concatenate([w[:1], w[:1], w]) for w in wires], first=1)
    for place in ("vtp", "mrk", "vtk", "all.h5", "ras", "inch", "micron", "waiting"):
        path = tmp_path / place
        files = [Source(p) for p in ([path] if path.is_file() else sorted(path.iterdir()))]
        for found, wire in zip(read_wires(files, 2), wires, strict=True):
            np.testing.assert_allclose(found.points_mm, wire, rtol=0.0, atol=1e-6, err_msg=place)


def test_which_file_is_which_frame() -> None:
    """By number from 0 or 1, with gaps where that is certain; else by order; never by a guess."""

    def frames(names: str, count: int) -> dict[int, str]:
        found = numbered_frames([Path(f"{name}.csv") for name in names.split()], count)
        return {frame: path.stem for frame, path in found.items()}

    assert frames("w0 w2", 4) == {0: "w0", 2: "w2"}
    assert frames("w1 w2 w4", 4) == {0: "w1", 1: "w2", 3: "w4"}
    assert frames("w10.5 w20.5", 2) == {0: "w10.5", 1: "w20.5"}
    assert frames("a b", 2) == {0: "a", 1: "b"}
    assert frames("run2.0000 run2.0002", 4) == {0: "run2.0000", 2: "run2.0002"}, "were refused as decimals"
    assert frames("cath_1.001 cath_1.003", 3) == {0: "cath_1.001", 2: "cath_1.003"}
    depths = "w8.1mm w18.0mm w27.3mm w37.2mm"
    assert [*frames(depths, 4).values()] == depths.split(), "by their last digits they were frames 1, 0, 3 and 2"
    for names, count in (
        ("w31.0mm w32.1mm w33.2mm", 4),
        ("w31.000 w32.001", 4),
        ("w1.00 w1.02", 4),
        ("w1 w2", 4),
        ("w0 w7", 4),
        ("a b", 3),
        ("w0 w1 w2", 2),
    ):
        with pytest.raises(LoadError, match="not known which belongs to which"):
            frames(names, count)


def test_the_other_vtk_layouts(tmp_path: Path) -> None:
    text = "# vtk DataFile Version 5.1\nvtk output\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0\n1 2 0\n"
    text += "LINES 2 3\nOFFSETS vtktypeint64\n0 3\nCONNECTIVITY vtktypeint64\n2 1 0\n"
    (tmp_path / "a.vtk").write_text(text, encoding="utf-8")
    np.testing.assert_array_equal(read_vtk_points(tmp_path / "a.vtk"), [[1, 2, 0], [1, 0, 0], [0, 0, 0]])


@pytest.mark.parametrize("wires", ["other.h5", "other/w0.csv"])
def test_beside_wires_of_other_cases_a_log_is_no_wire(tmp_path: Path, wires: str) -> None:
    """Beside other.h5 the log of a crash was refused with exit 2; beside other/w0.csv its frames had failed."""
    for path in (tmp_path / wires, tmp_path / "bend" / "crash.log"):
        path.parent.mkdir(exist_ok=True)
        path.touch()
    assert found_for("bend", tmp_path, ["bend", "other"]) == []


def test_wires_that_change_places_are_judged_anew(known: Known) -> None:
    """Files are of the frames that their names count; renamed, with nothing else changed, an old result was kept."""
    folder = known[0].with_name("places")
    write_csv(folder, known[1])
    for n, path in enumerate(sorted(folder.glob("*.csv"))):
        path.rename(folder / f"{'cbad'[n]}_{n:03d}.csv")
    code, table, _ = run_with(known, '"places/*.csv"', "placed")
    assert (code, len(table)) == (0, FRAMES)
    (folder / "c_000.csv").rename(folder / "c_002.csv")
    (folder / "a_002.csv").rename(folder / "a_000.csv")
    code, _, _ = run_with(known, '"places/*.csv"', "placed")
    assert code == 1, "the wires of two frames are exchanged"


def test_where_curves_are_looked_for(known: Known, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mixed = write_csv(tmp_path / "mixed", known[1])
    write_polyline_vtp(mixed / "a.vtp", known[1][0])
    full, bare = tmp_path / "full", tmp_path / "bare"
    write_csv(full, known[1])
    (bare / "deeper").mkdir(parents=True)
    (bare / "notes.txt").touch()
    (tmp_path / "text" / "bend").mkdir(parents=True)
    (tmp_path / "text" / "bend" / "w0.txt").touch()
    ran = tmp_path / "ran"
    (ran / "cases" / "other").mkdir(parents=True)
    for curves, out, said in (
        (tmp_path / "nowhere", "o", f"\n--curves {tmp_path / 'nowhere'}: no such file or folder\n"),
        (bare, "o", "no wire in it (.csv, .vtp, .mrk.json, .vtk, .h5, .hdf5); found deeper/, notes.txt; give a folder"),
        (
            tmp_path / "text",
            "o",
            "no wire in it (.csv, .vtp, .mrk.json, .vtk, .h5, .hdf5); found w0.txt; give a folder",
        ),
        (mixed, "o", ".csv and .vtp files"),
        (f"a={full}/*.vtk", "o", "it matches no file"),
        (f"a={tmp_path}/fu*", "o", "it matches a folder, full"),
        (ran, "o", "it is the output of a run, of other"),
        (f"wireval={full}", "o", "the name 'wireval'"),
        ("sofa=", "o", "no place after the name"),
        (full, "full", "holds no score"),
    ):
        assert main(["score", str(known[0]), "--curves", str(curves), "-o", str(tmp_path / out), *QUICK]) == 2
        heard = capsys.readouterr().err
        assert said in f"\n{heard}"
        assert heard.endswith("1 problem in the command line; nothing was run\n"), "it was in the manifest"


@pytest.mark.usefixtures("undrawn")
def test_a_place_that_was_typed_is_no_string_of_a_manifest(
    known: Known, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A path that goes up, and a # in its name, ended in a traceback."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    wires = write_csv(Path("../run#1"), known[1])
    (wires / "wire_000.csv").rename(wires / "wire#_000.csv")
    assert main(["score", str(known[0]), "--curves", "mine=../run#1", "-o", "out", "--without-own", *QUICK]) == 0
    assert list(errors_of(Path("out"))["status"]) == ["ok"] * FRAMES


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_a_score_of_others_is_not_replaced(known: Known, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The same command with another --curves put its results in the place of the first ones."""
    one, two = write_csv(tmp_path / "one", known[1]), write_csv(tmp_path / "two", known[1])
    words = ["score", str(known[0]), "-o", str(tmp_path / "out"), "--without-own", *QUICK]
    assert main([*words, "--curves", str(one)]) == 0
    kept = (tmp_path / "out" / "simulators.csv").read_bytes()
    assert main([*words, "--curves", str(two)]) == 2
    assert "holds a score of one, which would be replaced; name another folder" in capsys.readouterr().err
    assert (tmp_path / "out" / "simulators.csv").read_bytes() == kept
    assert main([*words, "--curves", str(one), "--curves", str(two)]) == 0
    # nor by another folder under the same name, or with other settings: run refuses that, too
    assert main([*words, "--curves", f"one={two}", "--curves", f"two={one}"]) == 2
    told = f"it holds a score of one by the wires in {one.resolve()}, which would be replaced by that of those in {two}"
    assert told in capsys.readouterr().err
    assert main([*words, "--curves", str(one), "--curves", str(two), "--set", "compare.skip_mm=3"]) == 2
    assert "was scored with other settings: compare.skip_mm" in capsys.readouterr().err
    write_csv(one, [wire + [0.0, 0.01, 0.0] for wire in known[1]])
    assert main([*words, "--curves", str(one), "--curves", str(two)]) == 0, "the same wires, mended"


def test_the_steps_of_a_case_are_printed_once_and_not_once_a_simulator(known: Known, tmp_path: Path) -> None:
    """Of seven simulators the lines of all traces, which are taken again, came seven times."""
    curves = [f"--curves={name}={write_csv(tmp_path / name, known[1])}" for name in ("one", "two")]
    plans = _plans(parsed(["score", str(known[0]), "-o", str(tmp_path / "out"), *curves]))
    assert {name: plan.template.quiet for name, plan in plans.items()} == {"one": False, "two": True, "wireval": False}


@pytest.mark.parametrize("names", [("sofa", "SOFA"), ("Wireval",)])
def test_names_that_a_disk_may_not_tell_apart_are_refused(names: tuple[str, ...]) -> None:
    with pytest.raises(InputError, match=r"is taken|not 'wireval'"):
        named([f"{name}=there" for name in names])


def test_a_name_that_is_too_long_for_a_folder_is_refused_at_once(
    known: Known, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The first simulator was computed, then the folder of the second could not be made."""
    curves = write_csv(tmp_path / "one", known[1])
    words = ["score", str(known[0]), "-o", str(tmp_path / "out"), "--curves", f"a={curves}", *QUICK]
    assert main([*words, "--curves", f"{'x' * 101}={curves}"]) == 2
    assert "...: the name has 101 characters; allowed: 100; write NAME=PLACE" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    assert list(named([f"{'x' * 100}={curves}"])) == ["x" * 100]


def script(name: str) -> str:
    found = re.search(rf"```python {name}\n(.*?)```", ADAPTERS.read_text(encoding="utf-8"), re.DOTALL)
    assert found is not None
    return found[1]


def test_the_adapters_of_the_manual(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each on a file of the layout that the simulator writes."""
    wire = np.array([[0.0, 0, 0], [0, 0, 10], [1, 0, 20]])
    monkeypatch.chdir(tmp_path)
    nodes = [[0, 0, 0, 0, 0, 0, 1]] * 3 + [[*point, 0, 0, 0, 1] for point in wire.tolist()]
    numbers = " ".join(str(x) for node in nodes for x in node)
    Path("wire.state").write_text(
        "".join(f"T= {t}\n  X= {numbers} \n  V= {'0 ' * 36}\n" for t in (0.5, 1.0)), encoding="utf-8"
    )
    exec(script("sofa"), {})
    found = read_wires([Source(Path(f"wire_00{n}.csv")) for n in (0, 1)], 2)
    np.testing.assert_allclose(found[1].points_mm, wire)
    info = {"geom_pos": [wire / 1000.0 * (step + 1) for step in range(4)], "head_pos": []}
    Path("trajectory").write_bytes(pickle.dumps({"obs": [], "info": info}))
    exec(script("cathsim"), {})
    found = read_wires([Source(Path(f"wire_00{n}.csv")) for n in (0, 1)], 2)
    np.testing.assert_allclose(found[0].points_mm, 2 * wire, rtol=0.0, atol=1e-9)
