"""Where results come from: what was not the same in two runs is named; cases of different settings are not pooled."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import wireval
from pipeline.cli import main
from pipeline.load import Source
from pipeline.load.geometry import Mask
from pipeline.run import aggregate, case, inputs
from pipeline.study.manifest import read_manifest
from reports.doubts import doubted
from reports.origin import of_two_simulators, what_differs, why_not_pooled
from tests.pipeline.test_calibrate import PARAMETERS

QUICK = ("--until", "load", "-q")
COMPARED = ("--until", "compare", "-q", "--set", "budget.members=0", "--set", "compare.simulated_nulls=false")
FINE = ("--set", "solver.step_mm=0.5")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made")
    assert main(["synth", "straight", "-o", str(folder), "--size", "72", "--frames", "2"]) == 0
    for number, path in enumerate(sorted((folder / "frames").iterdir())):
        (folder / f"depth_{number}").mkdir()
        path.rename(folder / f"depth_{number}" / "recon.mha")
    text = (folder / "manifest.toml").read_text(encoding="utf-8")
    text = text.replace('"frames/*.mha"', '["depth_0/recon.mha", "depth_1/recon.mha"]').replace('"straight"', '"a"')
    case = text[text.index("[[case]]") :].replace('id = "a"', 'id = "b"')
    (folder / "manifest.toml").write_text(f"{text}\n{case}", encoding="utf-8")
    return folder


@pytest.fixture
def study(made: Path, tmp_path: Path) -> Path:
    """Two cases of the same scans, whose frames all have the same base name; a test may change its files."""
    return Path(shutil.copytree(made, tmp_path / "study"))


def run(study: Path, out: Path, *more: str) -> int:
    return main(["run", str(study), "-o", str(out), *QUICK, *more])


def differing(study: Path, tmp_path: Path, *more: str) -> set[str]:
    """What differs from the run of before, by name."""
    run(study, tmp_path / "after", *more)
    return {row["what"] for row in what_differs(tmp_path / "before", tmp_path / "after")}


def test_every_input_of_a_run_is_held_against_the_other_s(study: Path, tmp_path: Path) -> None:
    """A truth was never named, of frames of one base name the last alone."""
    run(study, tmp_path / "before")
    assert differing(study, tmp_path) == set()
    frame = study / "depth_0" / "recon.mha"
    frame.write_bytes(frame.read_bytes()[:-1] + b"\1")
    truth = study / "truth.json"
    truth.write_text(truth.read_text(encoding="utf-8") + " ", encoding="utf-8")
    assert differing(study, tmp_path) == {"input of a, b: frames[0]", "input of a, b: truth"}


def test_every_key_of_a_case_is_held_against_the_other_s(study: Path, tmp_path: Path) -> None:
    """Of these none was kept, and each changes what is computed: two hashes of the manifest stood there."""
    run(study, tmp_path / "before")
    manifest = study / "manifest.toml"
    keys = {"entry_sigma_mm": "3.2", "entry_direction_sigma_deg": "12.0", "lumen_seed_mm": "[[0.0, 0.0, 20.0]]"}
    keys |= {"insertion_sigma_mm": "0.01", "roll_sigma_deg": "0.7", "uncertainty.friction": "0.02"}
    stated = "".join(f"{key} = {value}\n" for key, value in keys.items())
    text = manifest.read_text(encoding="utf-8")
    manifest.write_text(text.replace('id = "a"\n', f'id = "a"\n{stated}'), encoding="utf-8")
    told = {f"[[case]] {key}" for key in keys} - {"[[case]] uncertainty.friction"} | {"[case.uncertainty] friction"}
    assert differing(study, tmp_path) == {f"manifest of a: {key}" for key in told} | {"manifest"}
    held = json.loads((tmp_path / "after" / "cases" / "a" / "result.json").read_text(encoding="utf-8"))["manifest_keys"]
    assert (held["entry_sigma_mm"], held["push_force_sigma_N"]) == (3.2, 0.001), "a default, too"
    assert "as_stated" not in held, "none of the manifest's"


def test_what_is_stated_of_files_beside_their_places_is_kept(study: Path) -> None:
    case = read_manifest(study / "manifest.toml").cases[0]
    assert "frames" not in inputs.keys_of(case)
    frames, lumen = [Source(Path("a.h5"), "scan", 0), Source(Path("b.h5"))], Mask(Path("l.nrrd"), label=2)
    held = inputs.keys_of(case.model_copy(update={"frames": tuple(frames), "lumen": lumen}))
    assert (held["frames"], held["lumen"]) == ([{"dataset": "scan", "item": 0}, {}], [{"label": 2}])


def test_the_wires_of_another_simulator_are_one_input(study: Path, tmp_path: Path) -> None:
    """Every file's hash stood before the verdict on two simulators."""
    run(study, tmp_path / "before")
    run(study, tmp_path / "after")
    path = tmp_path / "after" / "cases" / "a" / "result.json"
    result = json.loads(path.read_text(encoding="utf-8"))
    wires = [{"key": f"simulated.files[{n}]", "path": f"w{n}.csv", "sha256": f"{n}" * 64} for n in range(2)]
    path.write_text(json.dumps(result | {"inputs": [*result["inputs"], *wires]}), encoding="utf-8")
    (row,) = what_differs(tmp_path / "before", tmp_path / "after")
    assert (row["what"], row["before"]) == ("input of a: simulated.files", "(none)")
    assert row["after"].startswith("2 files, ")
    assert of_two_simulators(tmp_path / "before", tmp_path / "after")
    role = {"role": "calibration"}
    path.write_text(json.dumps(result | role | {"summary": result["summary"] | role}), encoding="utf-8")
    rows = what_differs(tmp_path / "before", tmp_path / "after")
    assert [(row["what"], row["after"]) for row in rows] == [("manifest of a: [[case]] role", "calibration")]


def test_a_simulator_that_wrote_nothing_for_one_case_is_still_the_same(study: Path, tmp_path: Path) -> None:
    """After a crash half-way the wires of one run "are the solver's own", since a case of it had no file."""
    runs = [tmp_path / name for name in ("before", "after")]
    for out in runs:
        run(study, out)
        for name in "ab" if out.name == "before" else "a":
            path = out / "cases" / name / "result.json"
            result = json.loads(path.read_text(encoding="utf-8"))
            wires = [{"key": "simulated.files[0]", "path": "w.csv", "sha256": "0" * 64}]
            path.write_text(json.dumps(result | {"inputs": [*result["inputs"], *wires]}), encoding="utf-8")
    assert [row["what"] for row in what_differs(*runs)] == ["input of b: simulated.files"]
    assert of_two_simulators(*runs) == ""
    # of one case alone a score's results say whose the wires are
    for out in runs:
        shutil.rmtree(out / "cases" / "a")
        path = out / "cases" / "b" / "result.json"
        path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | {"simulator": "mine"}), "utf-8")
    assert of_two_simulators(*runs) == ""


def test_given_parameters_are_told_by_their_content(study: Path, tmp_path: Path) -> None:
    file = tmp_path / "p.toml"
    manifest = (study / "manifest.toml").read_text(encoding="utf-8")
    wire = manifest.partition("[wires.")[2].partition("]")[0]
    text = PARAMETERS.replace('wire = "w"', f'wire = "{wire}"').partition("[stated]")[0]
    file.write_text(text, encoding="utf-8")
    run(study, tmp_path / "before", "--parameters", str(file))
    assert differing(study, tmp_path, "--parameters", str(shutil.copy(file, tmp_path / "q.toml"))) == set()
    file.write_text(f"{text}\n# found again\n", encoding="utf-8")
    assert run(study, tmp_path / "after", "--parameters", str(file)) == 2, "it has other results"
    assert differing(study, tmp_path, "--parameters", str(file), "--resume") == {"calibrate.parameters"}


def test_a_part_of_the_cases_is_not_run_with_other_settings(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    run(study, out)
    for words in (("--resume",), ("--fresh",)):
        for part in (("--only", "a"), ("--shard", "1/2")):
            capsys.readouterr()
            assert run(study, out, *FINE, *words, *part) == 2
            said = capsys.readouterr().err
            assert "case 'b' would keep its result of other settings: solver.step_mm 1.0 before, 0.5 now" in said
    assert run(study, out, "--resume", "--only", "a") != 2
    assert run(study, out, *FINE, "--resume") != 2, "all of them"


@pytest.mark.slow
def test_shards_of_different_settings_are_not_pooled(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, words = tmp_path / "out", (str(tmp_path / "out"), "--overview")
    for shard, settings in (("1/2", ()), ("2/2", FINE)):
        main(["run", str(study), "-o", str(tmp_path / shard[0]), *COMPARED, "--shard", shard, *settings])
        shutil.copytree(tmp_path / shard[0], out, dirs_exist_ok=True)
    capsys.readouterr()
    assert main(["report", *words, "--pdf"]) == 1
    said = "Nothing is pooled: the cases were run with different settings (solver.step_mm 1.0 in a; 0.5 in b)"
    assert said in capsys.readouterr().out
    page = (out / "index.html").read_text(encoding="utf-8")
    assert said in page
    assert "not pooled" in page
    assert pd.read_csv(out / "overall.csv").empty
    assert not wireval.read_results(out).ok
    main(["run", str(study), "-o", str(tmp_path / "3"), *COMPARED, "--shard", "1/2", *FINE])
    shutil.copytree(tmp_path / "3", out, dirs_exist_ok=True)
    assert main(["report", *words]) == 0
    assert why_not_pooled(out) == ""
    assert len(pd.read_csv(out / "overall.csv")) == 1


def test_cases_of_a_file_that_changed_between_them_are_not_pooled(study: Path, tmp_path: Path) -> None:
    """A file of several cases, as the parameters of a wire, that was edited before the second shard: pooled, and ok."""
    frame = study / "depth_0" / "recon.mha"
    run(study, tmp_path / "1", "--shard", "1/2")
    frame.write_bytes(frame.read_bytes()[:-1] + b"\1")
    run(study, tmp_path / "2", "--shard", "2/2")
    for shard in "12":
        shutil.copytree(tmp_path / shard, tmp_path / "out", dirs_exist_ok=True)
    assert f"{frame} was changed between case a and case b" in why_not_pooled(tmp_path / "out")
    run(study, tmp_path / "3", "--shard", "1/2")
    shutil.copytree(tmp_path / "3", tmp_path / "out", dirs_exist_ok=True)
    assert why_not_pooled(tmp_path / "out") == ""


@pytest.mark.slow
def test_shards_of_arrays_of_other_sizes_are_not_pooled(study: Path, tmp_path: Path) -> None:
    """A case of the earlier array lay on top of the later one's, with the error of a scan that had been replaced."""
    out = tmp_path / "out"
    for shard in ("1/1", "1/2", "2/2"):
        place = tmp_path / shard.replace("/", "of")
        assert main(["run", str(study), "-o", str(place), *COMPARED, "--shard", shard]) == 0
        shutil.copytree(place, out, dirs_exist_ok=True)
    assert "shards of arrays of 1 and of 2 were merged" in why_not_pooled(out)
    # into one folder the later array takes over the earlier one's cases
    assert main(["run", str(study), "-o", str(out), *COMPARED, "--shard", "1/2"]) == 0
    assert why_not_pooled(out) == ""


def test_shards_that_ended_at_different_stages_are_not_pooled(study: Path, tmp_path: Path) -> None:
    """They were two cases that are ok, with the error of one."""
    out = tmp_path / "out"
    for shard, until in (("1/2", "simulate"), ("2/2", "compare")):
        words = ["run", str(study), "-o", str(tmp_path / shard[0]), "-q", "--shard", shard]
        assert main([*words, "--until", until]) == 0
        shutil.copytree(tmp_path / shard[0], out, dirs_exist_ok=True)
    assert main(["report", str(out), "--overview"]) == 1
    assert "(--until simulate in a; compare in b)" in why_not_pooled(out)


def test_a_shard_that_was_not_merged_is_missed(study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Half of a study was "1 case: ok", exit 0."""
    run(study, tmp_path / "out", "--shard", "1/2")
    capsys.readouterr()
    assert main(["report", str(tmp_path / "out"), "--overview"]) == 1
    assert "named by the manifest and without a result here: b" in capsys.readouterr().err
    assert "without a result here: b" in (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    run(study, tmp_path / "out", "--shard", "2/2")
    assert main(["report", str(tmp_path / "out"), "--overview"]) == 0


def test_a_case_that_only_left_out_is_said_and_is_no_failure(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was exit 1, as if a shard had been lost."""
    out = tmp_path / "out"
    run(study, out, "--only", "a")
    capsys.readouterr()
    assert main(["report", str(out), "--overview"]) == 0
    assert "left out by --only and without a result here: b" in capsys.readouterr().err
    assert "left out by --only" in (out / "index.html").read_text(encoding="utf-8")
    run(study, out, "--shard", "1/2")
    assert main(["report", str(out), "--overview"]) == 1, "of a study in shards the other one is missed"


def test_a_case_that_an_earlier_run_was_to_compute_is_missed_after_only(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    run(study, out)
    shutil.rmtree(out / "cases" / "b")  # as if that run had been ended before
    run(study, out, "--only", "a")
    capsys.readouterr()
    assert main(["report", str(out), "--overview"]) == 1
    assert "named by the manifest and without a result here: b" in capsys.readouterr().err


def test_a_result_that_cannot_be_read_says_nothing_of_settings(study: Path, tmp_path: Path) -> None:
    run(study, tmp_path / "out")
    path = tmp_path / "out" / "cases" / "a" / "result.json"
    path.write_text(json.dumps([1]), encoding="utf-8")
    assert why_not_pooled(tmp_path / "out") == ""


def test_what_is_missing_is_no_ok_anywhere(study: Path, tmp_path: Path) -> None:
    """The index was green, with "Failures: none", and read_results ok, where `report` exits with 1."""
    out = tmp_path / "out"
    main(["run", str(study), "-o", str(out), "--until", "segment", "-q"])
    assert main(["report", str(out), "--overview"]) == 0
    assert wireval.read_results(out).ok
    assert "Failures: none" in (out / "index.html").read_text(encoding="utf-8")
    frames = out / "cases" / "b" / "frames.h5"
    kept = frames.read_bytes()
    frames.unlink()
    assert main(["report", str(out)]) == 1
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "frames.h5 is missing" in page
    assert '<span class="status bad">failures</span>' in page
    with pytest.warns(UserWarning, match="frames.h5 is missing"):
        assert not wireval.read_results(out).ok
    frames.write_bytes(kept)
    assert main(["report", str(out), "--overview"]) == 0
    assert wireval.read_results(out).ok
    shutil.rmtree(out / "cases" / "b")
    assert main(["report", str(out), "--overview", "--pdf"]) == 1
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "Failures: none" not in page
    assert '<span class="status bad">cases missing</span>' in page
    assert "1 of 2 cases, 2 frames: 2 ok." in page
    assert not wireval.read_results(out).ok


def with_a_thinner_wire(study: Path) -> None:
    path = study / "manifest.toml"
    text = path.read_text(encoding="utf-8")
    assert "radius_mm = 0.18" in text
    path.write_text(text.replace("radius_mm = 0.18", "radius_mm = 0.17"), encoding="utf-8")


def of_two_manifests(study: Path, tmp_path: Path) -> Path:
    """Two shards in one folder, of which the second's manifest has another wire."""
    out = tmp_path / "out"
    run(study, tmp_path / "1", "--shard", "1/2")
    with_a_thinner_wire(study)
    run(study, tmp_path / "2", "--shard", "2/2")
    for part in ("1", "2"):
        shutil.copytree(tmp_path / part, out, dirs_exist_ok=True)
    return out


def test_shards_of_manifests_that_state_a_case_otherwise_are_not_pooled(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A second wire, ten times as stiff, was pooled with the first, exit 0."""
    out = of_two_manifests(study, tmp_path)
    capsys.readouterr()
    assert main(["report", str(out), "--overview"]) == 1
    began(out, "1-2", "2026-01-01"), began(out, "2-2", "2026-01-02")
    said = "Nothing is pooled: a was computed from another manifest, which stated it otherwise"
    assert said in capsys.readouterr().out
    assert said in (out / "index.html").read_text(encoding="utf-8")
    assert not wireval.read_results(out).ok


def began(out: Path, shard: str, day: str) -> None:
    """Say that a shard's run began on a day: two short ones begin within a second."""
    path = out / f"provenance.{shard}.json"
    path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | {"started": day}), encoding="utf-8")


def test_of_shards_merged_again_one_by_one_those_that_are_left_are_named(study: Path, tmp_path: Path) -> None:
    """The record of the other shard, of an older manifest, made a case that was computed anew the one to blame."""
    out = tmp_path / "out"

    def merged(shard: str, day: str) -> str:
        run(study, tmp_path / day, "--shard", f"{shard}/2")
        began(tmp_path / day, f"{shard}-2", day)
        shutil.copytree(tmp_path / day, out, dirs_exist_ok=True)
        return why_not_pooled(out)

    assert not merged("1", "2026-01-01")
    assert not merged("2", "2026-01-02")
    with_a_thinner_wire(study)
    assert "Nothing is pooled: b was computed from another manifest" in merged("1", "2026-01-03")
    assert not merged("2", "2026-01-04")


def test_a_run_that_was_ended_leaves_no_tables_of_an_earlier_one(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Another manifest's error over all cases stood beside one case that was computed anew, and `ok` was True."""
    out, stages = tmp_path / "out", case.run_stages
    run(study, out)
    shutil.copytree(out, tmp_path / "before")
    with_a_thinner_wire(study)

    def ended(job: case.Job, *more: object) -> object:
        if job.case.id == "b":
            raise KeyboardInterrupt
        return stages(job, *more)

    monkeypatch.setattr(case, "run_stages", ended)
    assert run(study, out, "--resume") == 130
    (out / "cases" / "b").mkdir(exist_ok=True)
    shutil.copytree(tmp_path / "before" / "cases" / "b", out / "cases" / "b", dirs_exist_ok=True)
    with pytest.warns(UserWarning, match="the run into it has not ended"):
        assert not wireval.read_results(out).ok
    capsys.readouterr()
    assert main(["report", str(out), "--overview"]) == 1
    assert "Nothing is pooled: b was computed from another manifest" in capsys.readouterr().out


def test_a_large_file_that_was_replaced_by_one_of_its_size_is_another(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A kept case was pooled beside it: files of more than 1 MiB were the same wherever the size was."""
    monkeypatch.setattr(inputs, "SMALL_BYTES", 0)
    out, frame = tmp_path / "out", study / "depth_1" / "recon.mha"
    run(study, out)
    assert run(study, out, "--only", "a") == 0
    frame.write_bytes(frame.read_bytes()[:-1] + b"\1")
    capsys.readouterr()
    assert run(study, out, "--only", "a") == 2
    assert "case 'b' would keep its result of another file: frames[1]" in capsys.readouterr().err


def test_tables_of_one_shard_are_not_those_of_all(study: Path, tmp_path: Path) -> None:
    """Merged and not yet reported, one case's error passed for that of both."""
    out = tmp_path / "out"
    for shard in ("1/2", "2/2"):
        run(study, tmp_path / shard[0], "--shard", shard)
        shutil.copytree(tmp_path / shard[0], out, dirs_exist_ok=True)
    with pytest.warns(UserWarning, match=r"are not of the cases beside them \(a\)"):
        found = wireval.read_results(out)
    assert found.other_tables
    assert not found.ok
    main(["report", str(out), "--overview"])
    assert not wireval.read_results(out).other_tables
    rows = pd.read_csv(out / "summary.csv")
    rows.assign(frames_ok=np.nan).to_csv(out / "summary.csv", index=False)
    with pytest.warns(UserWarning, match=r"are not of the cases beside them \(a, b\)"):
        assert not wireval.read_results(out).ok, "none is no number, and was a traceback"


@pytest.mark.slow
def test_what_is_doubtful_among_cases_of_several_shards_is_found_by_report(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One insertion, counted twice, was told by a run of all cases alone."""
    alike = "insertions 'a' and 'b' are one scan"
    monkeypatch.setattr(aggregate, "copies", lambda scored: [alike] * (len(scored) == 2))
    out = tmp_path / "out"
    for shard in ("1/2", "2/2"):
        main(["run", str(study), "-o", str(tmp_path / shard[0]), "--until", "compare", "-q", "--shard", shard])
        shutil.copytree(tmp_path / shard[0], out, dirs_exist_ok=True)
    main(["report", str(out), "--overview"])
    assert alike in doubted(out)
    assert alike in (out / "index.html").read_text(encoding="utf-8").replace("&#39;", "'")
    apart = sum(pd.read_csv(out / "summary.csv")["warnings"])
    assert int(pd.read_csv(out / "overall.csv")["warnings"].item()) == apart + len(doubted(out))


@pytest.mark.slow
def test_what_a_shard_saw_among_its_cases_alone_is_not_said_of_all(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of twelve cases in four shards "count as 3", "6", "9" and "12" stood beside each other: 17 warnings for 13."""
    monkeypatch.setattr(aggregate, "copies", lambda scored: [f"they count as {len(scored)}"])
    out, whole = tmp_path / "out", tmp_path / "whole"
    for shard in ("1/2", "2/2"):
        main(["run", str(study), "-o", str(out), *COMPARED, "--shard", shard])
    assert doubted(out) == ["they count as 2"], "the second shard saw the first one's case"
    for shard in ("1/2", "2/2"):
        main(["run", str(study), "-o", str(tmp_path / shard[0]), *COMPARED, "--shard", shard])
        shutil.copytree(tmp_path / shard[0], out, dirs_exist_ok=True)
    assert doubted(out) == ["they count as 1"]
    main(["report", str(out), "--overview"])
    main(["run", str(study), "-o", str(whole), *COMPARED])
    assert doubted(out) == doubted(whole) == ["they count as 2"]
    assert (out / "overall.csv").read_bytes() == (whole / "overall.csv").read_bytes()


def test_the_command_that_the_tool_names_next_is_pooled(study: Path, tmp_path: Path) -> None:
    """A case that failed was mended in the manifest and run alone; the shards of before still stated the old one."""
    out = tmp_path / "out"
    for shard in ("1/2", "2/2"):
        run(study, out, "--shard", shard)
    path = study / "manifest.toml"
    head, _, last = path.read_text(encoding="utf-8").rpartition("[[case]]")
    path.write_text(f'{head}[[case]]\nphantom = "another"{last}', encoding="utf-8")
    assert run(study, out, "--only", "b", "--resume") == 0
    assert why_not_pooled(out) == ""


def test_runs_of_two_manifests_that_do_not_say_what_they_state_are_not_pooled(study: Path, tmp_path: Path) -> None:
    """So are the records of earlier versions."""
    out = of_two_manifests(study, tmp_path)
    for path in out.glob("run*.json"):
        known = json.loads(path.read_text(encoding="utf-8"))
        known.pop("stated")
        path.write_text(json.dumps(known), encoding="utf-8")
    assert "Nothing is pooled: a, b were computed from another manifest" in why_not_pooled(out)


def test_all_but_the_places_of_files_is_stated(study: Path) -> None:
    """A lumen at another level, a frame less, was the same case; a lender's group was the borrower's."""
    (a, b) = read_manifest(study / "manifest.toml").cases
    said = inputs.stated(a)
    assert said != inputs.stated(b)
    moved = tuple(Source(one.path.with_name("elsewhere.mha")) for one in a.frames)
    assert inputs.stated(a.model_copy(update={"frames": moved})) == said
    mask = Mask(Path("lumen.nrrd"), level=0.3)
    lumens = [a.model_copy(update={"lumen": one}) for one in (mask, replace(mask, level=0.8), replace(mask, label=2))]
    others = [*lumens, a.model_copy(update={"frames": a.frames[:1]})]
    assert len({said, *map(inputs.stated, others)}) == 5
    lent = [b.model_copy(update={"entry_case": one}) for one in (a, a.model_copy(update={"group": "day 1"}))]
    assert len(set(map(inputs.stated, lent))) == 1
