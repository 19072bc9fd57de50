"""``import wireval``: the verbs as typed, results as frames; wrong input raises what the terminal says."""

from __future__ import annotations

import json
import os
import pickle
import re
import subprocess
import sys
from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import wireval
from pipeline.cli import main
from pipeline.load.geometry import LoadError
from pipeline.run.provenance import package_version, this_run
from pipeline.status import FrameStatus
from pipeline.study.manifest import ManifestError
from reports.atomic import WriteError
from reports.case_files import read_case
from reports.sweep import UNCHANGED
from reports.texts import UnreadableError
from tests.pipeline.known_study import run_known, write_csv
from tests.reports.fake_results import FakeCase, write_run
from wireval._arguments import ALLOWED, require


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return wireval.synth("straight", tmp_path_factory.mktemp("scans"), size=72, frames=2).parent


def test_everything_that_is_promised_is_there_and_says_what_it_is() -> None:
    for name in wireval.__all__:
        assert getattr(wireval, name).__doc__, name
    promised = {"check", "run", "read_results", "point_to_curve", "GuideWire", "Insertion", "Insertions", "VesselWall"}
    assert promised | {"score", "calibrate", "Grid", "relax", "InputError"} <= set(wireval.__all__)


def test_what_a_notebook_completes_is_what_is_promised() -> None:
    """json, sys, Path, BAD_INPUT, parsed and carried_out stood among the names."""
    assert wireval.__version__ == package_version() != ""
    assert [name for name in dir(wireval) if not name.startswith("__")] == sorted(wireval.__all__)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("solver.py", "solver.py is in the way: wireval brings a package 'solver'"),
        ("reports/__init__.py", "reports is in the way: wireval brings a package 'reports'"),
    ],
)
def test_an_own_file_of_the_name_of_a_package_is_named(tmp_path: Path, name: str, said: str) -> None:
    """It was "No module named 'solver.grid'; 'solver' is not a package"."""
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).write_text("", encoding="utf-8")
    (tmp_path / "script.py").write_text("import wireval", encoding="utf-8")
    done = subprocess.run([sys.executable, tmp_path / "script.py"], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert f"{tmp_path}/{said}" in done.stderr
    assert "rename it" in done.stderr


@pytest.mark.quick(1)
@pytest.mark.parametrize(("named", "left"), [("nonsense", "agg"), ("module://not.there", "module://not.there")])
def test_a_notebook_s_backend_is_its_own(named: str, left: str) -> None:
    """Jupyter sets MPLBACKEND for ! commands, too: where the backend is not installed, each ended in a ValueError."""
    asked = "import os, wireval, matplotlib; print(matplotlib.get_backend(), os.environ['MPLBACKEND'])"
    given = [sys.executable, "-c", asked]
    done = subprocess.run(given, env={**os.environ, "MPLBACKEND": named}, capture_output=True, text=True, check=False)
    assert (done.stdout.split(), done.stderr) == ([left, named], "")


def test_a_check_gives_sentences(study: Path, tmp_path: Path) -> None:
    assert wireval.check(study) == []
    assert wireval.check(tmp_path / "none.toml") == [f"{tmp_path / 'none.toml'}: no such manifest"]
    assert "expected a number from 0.01 to 20" in wireval.check(study, settings={"solver.segment_mm": -1})[0]
    nested = {"solver": {"segment_mm": 0.5}}
    assert wireval.check(study, settings=nested) == ['settings: write {"solver.segment_mm": 0.5}']
    assert wireval.check(tmp_path)[0].endswith("here or in frames/"), "a folder without scans"


def test_a_setting_that_cannot_be_is_of_the_argument_settings(study: Path, tmp_path: Path) -> None:
    """In a notebook it was called one of the command line."""
    said = r"^settings: no setting 'solver\.segment'; did you mean 'segment_mm'\?$"
    with pytest.raises(wireval.InputError, match=said):
        wireval.run(study, tmp_path / "out", settings={"solver.segment": 1})
    assert wireval.check(study, settings={"solver.segment_mm": -1})[0].startswith("settings: solver.segment_mm")
    with pytest.raises(wireval.InputError, match=r"^sweep: no setting 'solver\.segment'"):
        wireval.run(study, tmp_path / "out", sweep={"solver.segment": [1]})


def test_what_is_not_plausible_is_told_once(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], recwarn: pytest.WarningsRecorder
) -> None:
    """A check warned of it and printed it; a run prints it."""
    text = (study / "manifest.toml").read_text(encoding="utf-8")
    for name in ("reference.mha", "frames", "truth.json"):
        (tmp_path / name).symlink_to(study / name)
    thick = re.sub(r"\nradius_mm = .*", "\nradius_mm = 1.5", text)
    (tmp_path / "manifest.toml").write_text(thick, encoding="utf-8")
    assert wireval.check(tmp_path) == []
    told = [line for line in capsys.readouterr().out.splitlines() if "radius_mm" in line]
    assert {line.partition(":")[0] for line in told} == {"warning"}
    assert not recwarn.list


OTHER_KINDS = [None, 3, 1.5, True, [3], {3: 4}, {"a": 3}, "", b"x", "a\0b", object(), (1, 2), float("nan"), "x" * 5000]


@pytest.mark.parametrize(
    ("verb", "given"),
    [
        ("synth", {"scene": "no scene", "out": "out"}),
        ("run", {"manifest": "none.toml", "out": "out", "settings": {}, "jobs": 1, "sweep": {}, "fail_if": ()}),
        ("run", {"manifest": "none.toml", "out": "out", "junit": "there.xml", "only": "a", "help": False}),
        ("score", {"manifest": "none.toml", "out": "out", "curves": "a=b", "fail_if": (), "settings": {}}),
        ("calibrate", {"manifest": "none.toml", "out": "out", "settings": {}}),
        ("diff", {"first": "none", "second": "none", "tolerance": "none.toml"}),
        ("read_results", {"out": "none"}),
        ("wall_of", {"case": None}),
    ],
)
def test_an_argument_of_another_kind_is_no_bare_error(
    verb: str, given: dict[str, object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They were 'int' object has no attribute 'items', "expected str, bytes or os.PathLike object", an error that is
    not exported, and SystemExit(0)."""
    monkeypatch.chdir(tmp_path)
    for name in given:
        for value in OTHER_KINDS:
            with pytest.raises(wireval.InputError):
                getattr(wireval, verb)(**{**given, name: value})


class BytesPath:
    """A path that is no text."""

    def __fspath__(self) -> bytes:
        return b"x"


NO_TEXT: tuple[object, ...] = None, 3, True, "", b"x", ["a"], BytesPath()
NO_PLACE: tuple[object, ...] = *NO_TEXT, {"a": "b"}, "a\0b", "x" * 5000
NO_LIST: tuple[object, ...] = 0, False, np.array(1), {1}.pop, b"x"
NO_MAPPING: tuple[object, ...] = 0, 3, False, True, "", "a", [], ["a"], (), np.zeros(2), pd.DataFrame({"a": [1, 2]})
NOT_ALLOWED: dict[str, tuple[object, ...]] = {
    "scene": (*NO_TEXT, Path("bend")),
    **dict.fromkeys(("manifest", "out", "first", "second"), NO_PLACE),
    "tolerance": NO_PLACE[1:],
    "settings": NO_MAPPING,
    "jobs": (0, -1, 2.0, True, False, "2", [2], np.float64(2), np.array(2)),
    "sweep": (*NO_MAPPING, {3: [4]}, *({"a": one} for one in (None, "1,2", {"b": 1}, *NO_LIST))),
    "fail_if": (None, "", [""], ["a>1", 3], {"a": 1}, Path("a"), *NO_LIST),
    "curves": (None, "", [""], ["a", 3], {"a": 3}, {"a": ""}, {3: "a"}, {"": "a"}, {"a": BytesPath()}, *NO_LIST),
    "case": (None, "a", {}, Path("a")),
}


@pytest.mark.parametrize("name", ALLOWED)
def test_what_an_argument_may_not_be_is_refused_by_its_name(name: str) -> None:
    for value in NOT_ALLOWED[name]:
        with pytest.raises(wireval.InputError) as error:
            require(**{name: value})
        assert str(error.value).startswith(f"{name}: ")


def test_what_can_be_gone_through_once_is_a_list() -> None:
    """Generators were refused where a list would do."""
    assert require(fail_if=(text for text in ("a>1", "b>2")))["fail_if"] == ["a>1", "b>2"]
    assert require(sweep={"k": map(int, "12"), "l": np.arange(2)})["sweep"] == {"k": [1, 2], "l": [0, 1]}
    assert require(curves=map(Path, "ab"))["curves"] == ["a", "b"]
    assert require(curves={"mine": Path("a")})["curves"] == ["mine=a"]
    assert require(jobs=np.int64(2), sweep=None) == {"jobs": 2, "sweep": None}


def test_an_entry_of_a_folder_is_its_path(study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The study lay in a folder of the name "<DirEntry 'o'>"."""
    (tmp_path / "o").mkdir()
    monkeypatch.chdir(tmp_path)
    with os.scandir(".") as entries:
        (entry,) = entries
    written: list[Path] = []
    monkeypatch.setattr(wireval, "carried_out", lambda args: written.append(args.out))
    assert wireval.synth("straight", entry) == Path("o/manifest.toml")
    assert written == [Path("o")]
    assert require(curves={"mine": entry})["curves"] == ["mine=./o"]
    for path in (BytesPath(), b"x"):
        with pytest.raises(wireval.InputError, match=r"junit: got .*; expected a path"):
            wireval.run(study, tmp_path / "out", junit=path)


def test_what_a_run_exits_with_is_its_own(study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A registered solver's sys.exit was told as an option of the command line."""
    monkeypatch.setattr(wireval, "carried_out", lambda args: sys.exit(7))
    with pytest.raises(SystemExit, match="7"):
        wireval.run(study, tmp_path / "out")
    with pytest.raises(wireval.InputError, match=r"^help: of the command line alone; see help\(wireval\.run\)"):
        wireval.run(study, tmp_path / "out", help=True)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"jobs": 2.0}, "jobs: got 2.0; expected a whole number from 1 on"),
        ({"sweep": 3}, 'sweep: got 3; expected a mapping to lists of values, {"simulate.wall_scale": [0.5, 2]}'),
        ({"fail_if": 3}, 'fail_if: got 3; expected a condition as text, "rms_mm>0.5", or a list of such'),
        ({"sweep": {"simulate.wall_scale": "0.5,2"}}, "sweep: got {'simulate.wall_scale': '0.5,2'}; expected"),
        ({"quiet": "yes"}, "quiet: got 'yes'; expected True or False"),
        ({"fresh": 1}, "fresh: got 1; expected True or False"),
        ({"embed": "no"}, "embed: got 'no'; expected True or False"),
        ({"out": b"out"}, "out: got b'out'; expected a path, as text or pathlib.Path"),
        ({"manifest": "a\0b"}, "manifest: a\0b: cannot be opened (the name holds a zero byte)"),
    ],
)
def test_what_was_found_and_what_is_allowed_is_said(given: dict[str, object], said: str) -> None:
    with pytest.raises(wireval.InputError) as error:
        wireval.run(**{"manifest": "none.toml", "out": "out", **given})
    assert str(error.value).startswith(said)
    assert wireval.check(3) == ["manifest: got 3; expected a path, as text or pathlib.Path"]


def test_a_run_gives_frames(study: Path, tmp_path: Path) -> None:
    wall = {"simulate.wall_scale": [0.5]}
    kept = {"settings": {"solver.segment_mm": 2.0, "compare.simulated_nulls": False}, "quiet": True, "until": "compare"}
    results = wireval.run(study, tmp_path / "out", sweep=wall, **kept)
    assert results.ok
    begun = json.loads((tmp_path / "out" / "provenance.json").read_text(encoding="utf-8"))
    assert begun["cwd"] == str(Path.cwd()), "paths in argv may be relative"
    typed = begun["argv"]
    assert typed[:3] == ["wireval", "run", str(study)], "the next command names what was called"
    assert list(results.errors["case"]) == ["straight"] * 2
    assert list(results.sweep["parameter"]) == [UNCHANGED, "simulate.wall_scale"]
    assert results.cases["straight"].result["config"]["solver"]["segment_mm"]["value"] == 2.0
    assert len(results.cases["straight"].points) == len(results.points) > 0, "read when it is asked for"
    last = results.points[results.points["frame"] == 1]
    rms = (last["error_mm"] ** 2).mean() ** 0.5
    assert rms == pytest.approx(results.errors["rms_mm"].iloc[1], rel=1e-6)
    assert results.cases["straight"].read_frame(1).simulated_mm is not None
    with pytest.raises(KeyError, match="no case 'strait'; did you mean 'straight'"):
        results.cases["strait"]
    with pytest.raises(KeyError, match="case 'straight' has no arrays of frame 2; there are 0, 1"):
        results.cases["straight"].read_frame(2)
    assert "straight" in results._repr_html_()
    assert "1 case, 2 frames, 0 failures" in repr(results)
    gate = "gate closed: --fail-if rms_mm>0: rms_mm is 1"
    closed = replace(results, closed=(gate,), damaged=("straight",))
    assert repr(closed).splitlines()[-2:] == [gate, "damaged, left out: straight"]
    assert "<p>gate closed: --fail-if rms_mm&gt;0: rms_mm is 1</p><p>damaged" in closed._repr_html_()
    assert len(repr(results).splitlines()) < 13
    assert len(repr(results)) < 1000
    assert re.fullmatch(r"\{'straight': CaseFiles\('.*/straight', ok, 2 frames\)\}", repr(results.cases))
    assert re.match(r"FrameArrays\(frame 1, ok, traced_mm \(\d+, 3\), ", repr(results.cases["straight"].read_frame(1)))
    assert wireval.read_results(tmp_path / "out").errors.equals(results.errors)
    assert replayed_mm(results.cases["straight"]) < 0.08, "0.1 voxel; there was no way from a run to its wall"
    changed, settings = results.cases["straight"], results.cases["straight"].result["config"]["simulate"]
    settings["wall_scale"]["value"], settings["friction"]["value"] = 3.0, 0.2
    wall, stated = wireval.wall_of(changed), changed.result["wall"]
    assert (wall.stiffness_N_mm2, wall.friction) == (3.0 * stated["stiffness_N_mm2"], 0.2), "of the run, not as stated"
    table = tmp_path / "out" / "cases" / "straight" / "errors.csv"
    table.write_text(table.read_text(encoding="utf-8").replace("0.1", "0.01"), encoding="utf-8")
    with pytest.warns(UserWarning, match="errors.csv is not as it was written"):
        altered = wireval.read_results(tmp_path / "out")
    assert (altered.ok, altered.damaged, len(altered.errors), len(altered.points)) == (False, ("straight",), 0, 0)
    asked = ["rms_mm>0.001", "rms_mm>9", "tip_max_mm>1e-6", "rms_high_mm<9"]
    again = wireval.run(study, tmp_path / "out", fail_if=asked, resume=True, **kept)
    assert not again.ok, "a closed gate was seen on the terminal alone"
    assert "--fail-if rms_mm>0.001" in again.closed[0]
    assert re.search(r"tip_max_mm is .*; the worst: case straight frame \d \(tip_mm 0", again.closed[1])
    assert len(again.closed) == 3
    rms_mm = results.errors["rms_mm"]
    worst = (
        f"; the worst: case straight frame {rms_mm.argmax()} (rms_mm {rms_mm.max():.4g}), cases/straight/report.html"
    )
    assert again.closed[0].endswith(worst), "the number is of all frames: where to look was not said"
    assert wireval.read_results(tmp_path / "out").closed == again.closed, "nor did a later reader see it"
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert "gate closed</span>" in page, "the page was green"
    assert "Gate closed: --fail-if rms_mm&gt;0.001: rms_mm is" in page
    assert "Gate open: --fail-if rms_mm&gt;9: rms_mm is" in page
    assert main(["report", str(tmp_path / "out"), "--overview"]) == 1
    run_json = tmp_path / "out" / "run.json"
    told = json.loads(run_json.read_text(encoding="utf-8"))
    shard = {**told, "fail_if": ["rms_mm>0"]}
    (tmp_path / "out" / "run.1-2.json").write_text(json.dumps(shard), encoding="utf-8")
    begun = json.dumps({"started": "2001-01-01"})
    (tmp_path / "out" / "provenance.1-2.json").write_text(begun, encoding="utf-8")
    run_json.write_text(json.dumps({**told, "fail_if": ["rms_mm>9", "old_mm>1"]}), encoding="utf-8")
    assert main(["report", str(tmp_path / "out"), "--overview"]) == 1
    (why,) = wireval.read_results(tmp_path / "out").closed
    assert why == "gate closed: --fail-if old_mm>1: overall.csv of this version has no such number", "not the shard's"
    (tmp_path / "out" / "run.1-2.json").unlink()
    (tmp_path / "out" / "gates.json").write_text('{"closed": 3}', encoding="utf-8")
    with pytest.raises(wireval.InputError, match="closed is of another kind than expected"):
        wireval.read_results(tmp_path / "out")
    run_json.write_text(json.dumps(told), encoding="utf-8")
    main(["report", str(tmp_path / "out"), "--overview"])
    verdict = wireval.diff(tmp_path / "out", tmp_path / "out")
    assert (verdict.closed, verdict.word) == (False, "not worse")
    assert repr(verdict).endswith("exit 0, the gate stays open")
    with pytest.raises(wireval.InputError, match="no such folder"):
        wireval.diff(tmp_path / "out", tmp_path / "none")
    open_again = wireval.run(study, tmp_path / "out", resume=True, **kept)
    assert open_again.ok
    assert not (tmp_path / "out" / "gates.json").exists()


def test_results_are_of_their_folder_wherever_the_script_goes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """After a chdir the tables were empty, or those of another run whose folder has the same name."""
    for name in ("a", "b"):
        write_run(tmp_path / name / "out", [FakeCase("c", frames=1 + (name == "b"))])
    monkeypatch.chdir(tmp_path / "a")
    with pytest.warns(UserWarning, match="ledger.json is missing"):
        results = wireval.read_results("out")
    monkeypatch.chdir(tmp_path / "b")
    case = results.cases["c"]
    assert set(case.points["frame"]) == {0}, "b has two"
    assert results.out == case.folder.parents[1] == tmp_path / "a" / "out"
    for name, read in (("points.csv.gz", lambda: case.points), ("frames.h5", lambda: case.read_frame(0))):
        (case.folder / name).unlink()
        with pytest.raises(ValueError, match=f"a/out/cases/c/{re.escape(name)}: no such file, though the case had one"):
            read()


def test_a_working_directory_may_have_been_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run from there, and a prompt that shows its results, ended in a traceback."""
    write_run(tmp_path / "out", [FakeCase("c", frames=1)])
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    assert this_run()["cwd"] == ""
    with pytest.warns(UserWarning, match="ledger.json is missing"):
        results = wireval.read_results(tmp_path / "out")
    assert repr(results).startswith(f"Results of {tmp_path / 'out'}: ")


def replayed_mm(case: wireval.CaseFiles) -> float:
    """How far the solver alone lays the wire in the case's wall from where the run laid it, rms of the worst frame."""
    held, stated, rows = case.result["entry"], case.result["wire"], case.errors
    names = ("radius_mm", "bending_stiffness_N_mm2", "rest_curvature_per_mm")
    wire = wireval.GuideWire(segment_mm=2.0, **{name: stated[name] for name in names})
    clamp = {"entry_mm": held["used_mm"], "entry_direction": held["used_direction"]}
    insertion = wireval.Insertion(wire, wireval.wall_of(case), **clamp, material_axis=held["material_axis"])
    wires = insertion.to_depths(rows["insertion_mm"].to_numpy(), roll_deg=rows["roll_deg"].to_numpy())
    off = [
        wireval.point_to_curve(wire.joints_mm, case.read_frame(number).simulated_mm)[0]
        for number, wire in zip(rows["frame"], wires, strict=True)
    ]
    return max(float(np.sqrt(np.mean(one**2))) for one in off)


def test_a_case_without_a_lumen_has_no_wall(tmp_path: Path) -> None:
    with pytest.raises(wireval.InputError, match=r"lumen\.vtp"):
        wireval.wall_of(read_case(tmp_path))


def test_verbs_are_called_as_they_are_typed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    typed: list[str] = []
    monkeypatch.setattr(wireval, "parsed", lambda words: typed.extend(words))
    monkeypatch.setattr(wireval, "carried_out", lambda args: 0)
    wireval.calibrate("m.toml", tmp_path, design=True, no_cache=False, settings={"solver.segment_mm": "auto"})
    setting = ["--set", 'solver.segment_mm="auto"']
    assert typed == ["calibrate", "m.toml", *setting, "--out", str(tmp_path), "--design"]
    typed.clear()
    for curves in (["a=x", "b=y"], {"a": "x", "b": Path("y")}):
        typed.clear()
        with pytest.raises(wireval.InputError, match="no cases"):
            wireval.score("m.toml", tmp_path, curves, jobs=2)
    assert typed == ["score", "m.toml", "--out", str(tmp_path), "--curves", "a=x", "--curves", "b=y", "--jobs", "2"]
    typed.clear()
    with pytest.raises(wireval.InputError, match="no cases"):
        wireval.score("m.toml", tmp_path, "mine=curves", quiet=True)
    assert typed[-3:] == ["--curves", "mine=curves", "--quiet"]
    monkeypatch.setattr(wireval, "carried_out", lambda args: 2)
    with pytest.raises(wireval.InputError, match="nothing was run"):
        wireval.calibrate("m.toml", tmp_path)


@pytest.mark.parametrize(
    "error",
    [
        wireval.InputError(["one", "two"]),
        ManifestError(["one", "two"], sound=["a case"]),  # type: ignore[list-item]
        wireval.StageError(FrameStatus.SEGMENT_FAILED, "grey: got 1"),
        LoadError("a.mha: got 1"),
        UnreadableError("a.mha: got 1"),
        WriteError("a.mha: no room"),
    ],
)
def test_errors_come_whole_out_of_another_process(error: Exception) -> None:
    """Problems were split into letters, and a StageError broke the pool of its process."""
    found = pickle.loads(pickle.dumps(error))
    assert (type(found), str(found), vars(found)) == (type(error), str(error), vars(error))
    assert copy(error).args == error.args


def test_what_cannot_be_used_is_raised(study: Path, tmp_path: Path) -> None:
    with pytest.raises(wireval.InputError, match="no such case"):
        wireval.run(study, tmp_path / "out", only=["none"])
    assert "expected a mapping" in wireval.check(study, settings=["segment.threshold=-1"])[0]  # type: ignore[arg-type]
    with pytest.raises(wireval.InputError, match="did you mean '--fresh'"):
        wireval.run(study, tmp_path / "out", fesh=True)
    with pytest.raises(wireval.InputError, match="wireval run"):
        wireval.read_results(tmp_path)
    with pytest.raises(wireval.InputError, match="nowhere: no such folder"):
        wireval.read_results(tmp_path / "nowhere")
    with pytest.raises(wireval.InputError, match="nowhere: no such file or folder"):
        wireval.score(study, tmp_path / "scored", f"mine={tmp_path / 'nowhere'}", quiet=True)
    with pytest.raises(wireval.InputError, match="no case has role"):
        wireval.calibrate(study, tmp_path / "calibrated")
    with pytest.raises(wireval.InputError, match="cannot be written"):
        wireval.run(study, study / "manifest.toml" / "out")


def test_a_plain_script_may_use_several_processes(tmp_path: Path) -> None:
    """Each worker ran the script anew, which has no guard, as none of ours in the docs has: 452 lines of tracebacks."""
    script = tmp_path / "plain.py"
    script.write_text(
        "from pipeline.run import workers\nworkers.PRELOADED = 'time'\nprint('begun')\n"
        "print(sorted(one.result for one in workers.in_processes([-1, -2], abs, 2)))\n",
        encoding="utf-8",
    )
    path = {"PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run([sys.executable, script], env=os.environ | path, capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("begun\n[1, 2]\n", "")


@pytest.mark.slow
def test_a_gate_that_any_simulator_closes_is_told(tmp_path: Path) -> None:
    """It was told of the first alone: a script went on where the command line had exit code 1."""
    manifest, wires = run_known(tmp_path)
    for name, off_mm in (("near", 0.05), ("far", 0.7)):
        write_csv(tmp_path / name, [wire + [0.0, off_mm, 0.0] for wire in wires])
    curves = {name: tmp_path / name for name in ("near", "far")}
    scored = wireval.score(
        manifest, tmp_path / "scored", curves, fail_if="rms_mm>0.6", settings={"compare.simulated_nulls": False}
    )
    assert not scored.ok
    (why,) = scored.closed
    assert why.startswith("far: gate closed: --fail-if rms_mm>0.6: rms_mm is 0.")
    pages = {
        page: (tmp_path / "scored" / page).read_text(encoding="utf-8") for page in ("index.html", "simulators.html")
    }
    assert "ate closed" not in pages["index.html"], "near's"
    assert pages["simulators.html"].count("Gate closed: --fail-if rms_mm&gt;0.6") == 1
    assert main(["report", str(tmp_path / "scored"), "--overview"]) == 1
    assert set(scored.simulators["simulator"]) == {"near", "far", "wireval"}
    assert len(scored.where)


def test_what_synth_cannot_do_is_in_its_error(tmp_path: Path) -> None:
    """It was "the problems stand above", which a notebook does not show."""
    with pytest.raises(wireval.InputError, match="frames: got 0; allowed: 1 or more"):
        wireval.synth("bend", tmp_path / "study", frames=0)


def test_what_synth_prints_is_no_study(tmp_path: Path) -> None:
    """It returned the path of a manifest that is not there."""
    with pytest.raises(wireval.InputError, match="list: it writes no study; `wireval synth --list` names the scenes"):
        wireval.synth("straight", tmp_path / "study", list=True)


@pytest.mark.parametrize("off", [False, None, np.False_])
def test_flags_may_be_off_and_of_numpy(tmp_path: Path, off: object) -> None:
    """list=False, which is off like any other flag, and quiet=np.True_ were refused."""
    with pytest.raises(wireval.InputError, match="frames: got 0; allowed: 1 or more"):
        wireval.synth("bend", tmp_path / "study", frames=0, list=off)  # type: ignore[arg-type]
    with pytest.raises(wireval.InputError, match="no such"):
        wireval.run(tmp_path / "none.toml", tmp_path / "out", quiet=np.True_, fresh=off)


def test_settings_may_be_numbers_of_numpy(tmp_path: Path) -> None:
    with pytest.raises(wireval.InputError, match=r"budget\.members"):
        wireval.run(tmp_path, tmp_path / "out", settings={"budget.members": np.int64(-1)})
