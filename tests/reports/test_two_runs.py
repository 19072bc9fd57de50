"""The verdict on two runs: what differs comes first; the gate closes on frames and on pooled values."""

from __future__ import annotations

import gzip
import json
import re
import shutil
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import pytest

from pipeline import cli
from pipeline.run import ledger
from pipeline.run.ratio import Ratio
from reports import tables
from reports.doubts import MADE_FROM_TRACES
from reports.junit import Outcome, write_junit
from reports.origin import told_alike, what_differs
from reports.schema import ERRORS, POINTS, SIMULATORS
from reports.two_runs import Verdict
from reports.two_runs_files import write
from tests.reports.fake_results import FakeCase, write_run

GROUPS = ("a", "b", "c")
GOLDEN = ERRORS.file, POINTS.file


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of three insertions."""
    out = tmp_path_factory.mktemp("first") / "out"
    write_run(out, tuple(FakeCase(name, frames=3, seed=n, error_mm=0.1) for n, name in enumerate(GROUPS)))
    for name in GROUPS:
        path = out / "cases" / name / "result.json"
        result = json.loads(path.read_text(encoding="utf-8"))
        summary = result["summary"] | {"group": name}
        path.write_text(json.dumps(result | {"group": name, "summary": summary}), encoding="utf-8")
    return out


def main(words: list[str]) -> int:
    """The command on runs that stand as they were written, whatever a test has made of them."""
    for word in words:
        for path in Path(word).glob("**/cases/*/result.json"):
            ledger.write(path.parent, "key")
    return cli.main(words)


def times(out: Path, factor: float) -> None:
    """Make every error of a run larger."""
    for name in GROUPS:
        folder = out / "cases" / name
        for file, table in ((ERRORS.file, ERRORS), (POINTS.file, POINTS)):
            rows = tables.read(folder / file, table)
            for column in {"error_mm", "rms_mm"} & set(rows):
                rows[column] *= factor
            tables.write(folder / file, table, rows)


def raised(out: Path, frame: int, column: str, by: float) -> None:
    """One number of one frame of case b, made larger."""
    path = out / "cases" / "b" / ERRORS.file
    rows = tables.read(path, ERRORS)
    rows.loc[frame, column] += by
    tables.write(path, ERRORS, rows)


@pytest.fixture
def second(first: Path, tmp_path: Path) -> Path:
    return shutil.copytree(first, tmp_path / "second")


def test_the_same_twice_is_not_worse(first: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diff", str(first), str(first)]) == 0
    said = capsys.readouterr().out
    assert "What differs" not in said
    assert said.splitlines()[0] == "Nothing differs in settings, code and inputs."
    assert "the error of no validation frame changed" in said
    assert said.splitlines()[-1].startswith("not worse")
    assert said.endswith(": PASS, exit 0, the gate stays open\n")


def test_what_is_not_known_to_be_the_same_is_not_called_so(first: Path, second: Path, tmp_path: Path) -> None:
    """Of two baselines of tables alone nothing is kept; of changed files, that there were some."""
    golden = shutil.copytree(first, tmp_path / "golden", ignore=shutil.ignore_patterns("*.json"))
    assert told_alike(golden, golden) == ""
    assert told_alike(first, golden) == ""
    for name in GROUPS:
        path = second / "cases" / name / "result.json"
        result = json.loads(path.read_text(encoding="utf-8"))
        result["provenance"]["git_dirty"] = True
        path.write_text(json.dumps(result), encoding="utf-8")
    assert told_alike(first, second) == ""
    assert "files were changed since the commit" in told_alike(second, second)


def test_what_differs_is_said_first(first: Path, second: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in GROUPS:
        path = second / "cases" / name / "result.json"
        result = json.loads(path.read_text(encoding="utf-8"))
        table, key = next((table, key) for table, items in result["config"].items() for key in items)
        result["config"][table][key] = {"value": "another", "source": "command line"}
        result["provenance"]["git_commit"] = "0123abc"
        result["inputs"][4 * (name == "a")]["sha256"] = "f" * 64
        path.write_text(json.dumps(result), encoding="utf-8")
    assert main(["diff", str(first), str(second)]) == 0, "another commit alone is no regression"
    said = capsys.readouterr().out
    assert said.splitlines()[0] == "What differs between the runs:"
    assert "othing differs" not in said
    for what in (f"{table}.{key}", "0123abc", "input of a: frames[4]", "input of b, c: frames[0]"):
        assert what in said


def test_what_the_manifests_state_otherwise_is_said(
    first: Path, second: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of a radius twice as large a reviewer saw two hashes of the manifest."""
    for out, radius_mm in ((first, 0.18), (second, 0.36)):
        for name in GROUPS:
            path = out / "cases" / name / "result.json"
            stated = {
                "wire": {"radius_mm": radius_mm, "name": "w"},
                "entry": {"entry_mm": [0, 0, 1], "used_mm": radius_mm, "roll_deg": radius_mm},
            }
            stated |= {"down": None if out == first else [0, 1, 0]}
            path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | stated), encoding="utf-8")
    main(["diff", str(first), str(second)])
    said = capsys.readouterr().out
    assert re.search(r"manifest of a, b, c: \[wires\] radius_mm +0.18 +0.36", said)
    assert re.search(r"manifest of a, b, c: \[\[case\]\] down +\(none\) +\[0, 1, 0\]", said)
    assert re.search(r"manifest of a, b, c: \[\[case\]\] roll_deg +0.18 +0.36", said)
    assert said.count("manifest of") == 3, "neither what was found, nor what an earlier version does not say"


def test_a_comment_in_a_manifest_states_nothing_else(second: Path, tmp_path: Path) -> None:
    """Two hashes stood there, and no word that nothing which is stated differs."""

    def as_stated(out: Path, said: str) -> None:
        path = out / "cases" / "a" / "result.json"
        path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | {"stated": said}), encoding="utf-8")

    other = shutil.copytree(second, tmp_path / "other")
    for out, text in ((second, "one"), (other, "two")):
        shutil.rmtree(out / "cases" / "b")
        shutil.rmtree(out / "cases" / "c")
        as_stated(out, "same")
        (out / "run.json").write_text(json.dumps({"manifest_sha256": text}), encoding="utf-8")
    (row,) = what_differs(second, other)
    assert row["what"] == "manifest (its text alone: it states the same of every case)"
    as_stated(other, "else")
    assert [row["what"] for row in what_differs(second, other)] == ["manifest"]


def test_of_a_simulators_wires_the_file_that_changed_is_named(second: Path, tmp_path: Path) -> None:
    """Two hashes of five files stood there, where scans are named."""
    other = shutil.copytree(second, tmp_path / "other")
    for out in (second, other):
        path = out / "cases" / "a" / "result.json"
        wires = [{"key": f"simulated.files[{n}]", "path": f"cur/wire_{n}.csv", "sha256": f"{n}" * 64} for n in range(3)]
        wires[2]["sha256"] = out.name * 12
        result = json.loads(path.read_text(encoding="utf-8"))
        path.write_text(json.dumps(result | {"inputs": wires}), encoding="utf-8")
    (row,) = what_differs(second, other)
    assert row["what"] == "input of a: simulated.files"
    assert row["before"].startswith("3 files, ")
    assert row["after"].endswith("; other: wire_2.csv")


def test_wires_whose_files_were_renamed_are_other_inputs(second: Path, tmp_path: Path) -> None:
    """A file's name counts the frame that its wire is held against."""
    other = shutil.copytree(second, tmp_path / "other")
    for out, names in ((second, "01"), (other, "12")):
        path = out / "cases" / "a" / "result.json"
        wires = [
            {"key": f"simulated.files[{i}]", "path": f"wire_{n}.csv", "sha256": str(i) * 64}
            for i, n in enumerate(names)
        ]
        result = json.loads(path.read_text(encoding="utf-8"))
        path.write_text(json.dumps(result | {"inputs": wires}), encoding="utf-8")
    assert [row["what"] for row in what_differs(second, other)] == ["input of a: simulated.files"]


def test_the_verdict_follows_what_differs_and_ends_the_text(
    first: Path, second: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    raised(second, 1, "tip_mm", 1.0)
    raised(second, 2, "tip_mm", 3.0)
    path = second / "cases" / "b" / "result.json"
    result = json.loads(path.read_text(encoding="utf-8"))
    result["provenance"]["git_commit"] = "0123abc"
    path.write_text(json.dumps(result), encoding="utf-8")
    assert main(["diff", str(first), str(second)]) == 1
    said = capsys.readouterr().out
    assert "in a, c; 0123abc in b" in said, "who was run with what"
    heads = ["What differs between the runs:", "Verdict: WORSE.", "What became worse:", "Frame by frame:"]
    places = [said.index(head) for head in heads]
    assert places == sorted(places)
    assert said.splitlines()[-1].startswith(
        "WORSE: 3 cases compared: 2 of 9 frames worse; the worst: case b frame 2, tip_mm"
    )
    assert said.endswith(": FAIL, exit 1, the gate closes\n")
    (verdict,) = [line for line in said.splitlines() if line.startswith("Verdict:")]
    assert re.search(
        r"closes the gate, the worst first: case b frame 2, tip_mm \S+ -> \S+ \(allowed 0.1\)\. Pooled", verdict
    )
    assert verdict.endswith("; it is single frames that close the gate"), "it stood beside 'no difference is shown'"


def test_one_number_that_became_worse_does_not_hide_that_the_errors_are_smaller(
    first: Path, second: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A calibration that made every error three times smaller was WORSE, for a penetration, and nothing else."""
    times(second, 0.3)
    raised(second, 1, "max_penetration_mm", 0.5)
    assert main(["diff", str(first), str(second), "-q"]) == 1
    said = capsys.readouterr().out
    assert said.startswith(
        "WORSE: 3 cases compared: 1 of 9 frames worse; the worst: case b frame 1, max_penetration_mm"
    )
    assert "no error of a simulated wire is worse than is allowed" in said
    assert said.endswith("; but over all frames the errors are 0.3 times those of the first run\n")


def test_pooled_errors_of_both_are_over_the_same_frames(
    first: Path, second: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A run of one easy case of three had a better rms_mm, then a better skill and fewer frames; they are the same."""
    before = shutil.copytree(first, tmp_path / "before")
    for name in ("b", "c"):
        for out in (before, second):
            path = out / "cases" / name / POINTS.file
            rows = tables.read(path, POINTS)
            tables.write(path, POINTS, rows.assign(error_mm=10.0 * rows["error_mm"]))
        shutil.rmtree(second / "cases" / name)
    assert main(["diff", str(before), str(second)]) == 1
    said = capsys.readouterr().out
    assert "WORSE" in said
    assert "case b, case present -> missing" in said
    assert "Over the cases of both" not in said, "which have the same errors, and as many frames"
    assert "frames_ok" not in said


def test_runs_without_a_case_in_common_have_no_number_over_the_frames_of_both(
    first: Path, second: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It said within_1mm 1 -> 0 over frames that were not there; and frames without a number are blank, not <NA>."""
    for name in ("b", "c"):
        shutil.rmtree(second / "cases" / name)
    (second / "cases" / "a").rename(second / "cases" / "other")
    path = second / "cases" / "other" / "result.json"
    result = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps(result | {"case": "other", "group": "other"}), encoding="utf-8")
    assert main(["diff", str(first), str(second)]) == 1
    said = capsys.readouterr().out
    assert "Over the cases of both" not in said
    assert "no frame has points in both runs" in said
    assert "<NA>" not in said


def test_small_changes_of_every_frame_close_the_gate_over_all(first: Path, second: Path, tmp_path: Path) -> None:
    """A tenth more of 0.1 mm is allowed in a frame; in all of them at once it is not."""
    times(second, 1.1)
    junit, page = tmp_path / "diff.xml", tmp_path / "diff.html"
    assert main(["diff", str(first), str(second), "--junit", str(junit), "--html", str(page)]) == 1
    failures = ET.parse(junit).findall(".//failure")
    assert [failure.get("type") for failure in failures] == ["rms_ratio"]
    assert "the second is worse" in str(failures[0].get("message"))
    assert "over all frames it is worse" in page.read_text(encoding="utf-8")
    assert main(["diff", str(second), str(first)]) == 0, "better"


def test_a_frame_that_became_worse_stands_in_every_file(first: Path, second: Path, tmp_path: Path) -> None:
    raised(second, 2, "tip_mm", 1.0)
    (second / "cases" / "b" / "report.html").touch()
    files = {kind: tmp_path / f"diff.{kind}" for kind in ("json", "markdown", "junit", "html")}
    asked = [word for kind, file in files.items() for word in (f"--{kind}", str(file))]
    assert main(["diff", str(first), str(second), *asked]) == 1
    plain = json.loads(files["json"].read_text(encoding="utf-8"), parse_constant=pytest.fail)
    assert plain["closed"] is True
    assert [(row["case"], row["frame"], row["column"]) for row in plain["regressions"]] == [("b", 2, "tip_mm")]
    suites = {suite.get("name"): suite for suite in ET.parse(files["junit"]).getroot()}
    assert {name: suite.get("failures") for name, suite in suites.items()} == {"all": "0", "a": "0", "b": "1", "c": "0"}
    bad = suites["b"].find("testcase[failure]")
    assert bad is not None
    assert bad.get("name") == "frame 2"
    assert "| b | 2 | tip_mm |" in files["markdown"].read_text(encoding="utf-8")
    page = files["html"].read_text(encoding="utf-8")
    assert "tip_mm" in page
    assert str(first) in page, "which runs these are"
    assert str(second) in page
    assert '<a href="second/cases/b/report.html#viewer=2">2</a>' in page


def test_a_depth_that_moved_closes_the_gate_and_is_not_called_worse(
    first: Path, second: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    raised(second, 2, "insertion_mm", 1.0)
    assert main(["diff", "-q", str(first), str(second), "--junit", str(tmp_path / "diff.xml")]) == 1
    said = capsys.readouterr().out
    assert said == "MOVED: 3 cases compared: no regression; 1 value has moved: insertion_mm\n"
    assert [f.get("type") for f in ET.parse(tmp_path / "diff.xml").findall(".//failure")] == ["moved"]


def test_what_too_few_insertions_cannot_tell_is_skipped_not_passed(first: Path, tmp_path: Path) -> None:
    two = [shutil.copytree(first, tmp_path / name) for name in ("one", "other")]
    for out in two:
        shutil.rmtree(out / "cases" / "c")
    assert main(["diff", *map(str, two), "--junit", str(tmp_path / "diff.xml")]) == 0
    skipped = ET.parse(tmp_path / "diff.xml").findall(".//testcase[@name='over all frames']/skipped")
    assert len(skipped) == 1
    assert "at least 3 needed" in str(skipped[0].get("message"))


def test_what_is_missing_is_worse(first: Path, second: Path, tmp_path: Path) -> None:
    shutil.rmtree(second / "cases" / "c")
    junit = tmp_path / "diff.xml"
    assert main(["diff", str(first), str(second), "--junit", str(junit)]) == 1
    assert [f.text for f in ET.parse(junit).findall(".//failure")] == ["case: present -> missing"]


def test_a_build_server_shows_the_worst_column_with_what_is_allowed(first: Path, second: Path, tmp_path: Path) -> None:
    """The message was of whichever column the tolerance names first, and said neither unit nor limit."""
    before, junit = shutil.copytree(first, tmp_path / "before"), tmp_path / "diff.xml"
    path = second / "cases" / "b" / ERRORS.file
    rows = tables.read(path, ERRORS).assign(tip_mm=0.5, skill=0.9)
    tables.write(before / "cases" / "b" / ERRORS.file, ERRORS, rows)
    rows.loc[2, ["rms_mm", "tip_mm", "skill", "insertion_mm"]] += [0.04, 3.0, -0.5, 9.0]
    tables.write(path, ERRORS, rows)
    assert main(["diff", str(before), str(second), "--junit", str(junit)]) == 1
    (failure,) = ET.parse(junit).findall(".//failure")
    assert failure.get("message") == "tip_mm: 0.5 -> 3.5 mm (allowed 0.1 mm more)"
    assert str(failure.text).splitlines()[1:] == [
        *[line for line in str(failure.text).splitlines() if line.startswith("rms_mm")],
        "skill: 0.9 -> 0.4 (allowed 0.03 less)",
        *[line for line in str(failure.text).splitlines() if line.startswith("insertion_mm") and "either way" in line],
    ]
    assert all(float(str(test.get("time"))) == 0.0 for test in ET.parse(junit).iter("testcase"))


def test_golden_tables_alone_are_enough(
    first: Path, second: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With points.csv.gz a baseline of tables holds over all frames, too; without, that nothing is judged is said."""
    for name in GROUPS:
        (tmp_path / "golden" / "cases" / name).mkdir(parents=True)
        shutil.copy(first / "cases" / name / ERRORS.file, tmp_path / "golden" / "cases" / name)
    times(second, 1.1)
    assert main(["diff", str(tmp_path / "golden"), str(second)]) == 0
    said = capsys.readouterr().out
    assert "over all frames nothing is judged: no frame has points in both runs" in said.splitlines()[-1]
    assert said.count("(not kept)") == 1, "one row, not one a setting"
    assert "settings, code and inputs: not compared" in said
    assert "of this run there are tables alone, without result.json" in said
    for name in GROUPS:
        shutil.copy(first / "cases" / name / POINTS.file, tmp_path / "golden" / "cases" / name)
    assert main(["diff", str(tmp_path / "golden"), str(second)]) == 1
    assert "over all frames it is worse" in capsys.readouterr().out.splitlines()[-1]


POINTER = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a21\nsize 12345\n"
SPOILT = {
    "cut": lambda whole: whole[:-60], "altered": lambda whole: whole[:99] + bytes([255]) * 99 + whole[198:],
    "pointer": lambda _: POINTER, "empty": lambda _: b"",
    "bare": lambda whole: gzip.compress(gzip.decompress(whole).splitlines(True)[0]),
    "rows": lambda whole: b"".join(whole.splitlines(True)[:-1]),
}  # fmt: skip


@pytest.mark.parametrize(
    ("file", "spoil"),
    [*((POINTS.file, how) for how in ("cut", "altered", "pointer", "empty", "bare", "gone"))]
    + [(ERRORS.file, how) for how in ("pointer", "rows", "gone")],
)
def test_damaged_golden_tables_are_refused(
    first: Path, second: Path, tmp_path: Path, file: str, spoil: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """What could not be read was left out, and a gate that was closed opened with it."""
    golden = shutil.copytree(first, tmp_path / "golden", ignore=lambda *_: {*ledger.DATA, ledger.FILE} - set(GOLDEN))
    path = golden / "cases" / "b" / file
    if spoil == "gone":
        path.unlink()
    else:
        path.write_bytes(SPOILT[spoil](path.read_bytes()))
    assert main(["diff", str(golden), str(second)]) == 2
    said = capsys.readouterr().err
    assert str(path) in said
    assert ("git lfs pull" in said) == (spoil == "pointer")


def test_what_only_the_second_run_has_is_told_apart(
    first: Path, second: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its tests passed, and it was counted as compared."""
    less, junit = shutil.copytree(first, tmp_path / "less"), tmp_path / "diff.xml"
    shutil.rmtree(less / "cases" / "a")
    for folder, change in ((less, "drop"), (second, "fail")):
        path = folder / "cases" / "b" / ERRORS.file
        rows = tables.read(path, ERRORS)
        rows.loc[2, "status"] = "load_failed"
        tables.write(path, ERRORS, rows.drop(index=2) if change == "drop" else rows)
    path = less / "cases" / "b" / POINTS.file
    points = tables.read(path, POINTS)
    tables.write(path, POINTS, points[points["frame"] != 2])
    assert main(["diff", str(less), str(second), "--junit", str(junit)]) == 0
    said = capsys.readouterr().out.splitlines()[-1]
    assert "2 of 3 cases compared: no regression" in said
    assert "only the second run has them: 4 frames, 1 of which failed" in said
    skipped = [str(test.get("message")) for test in ET.parse(junit).findall(".//skipped")]
    new = [text for text in skipped if text.startswith("only the second run has it: ")]
    assert sorted(text.rpartition(" ")[2] for text in new) == ["load_failed", "ok", "ok", "ok"]
    assert not [t for t in ET.parse(junit).findall(".//testcase") if "nan" in str(t.get("name")).lower()]


def test_another_ruler_makes_nothing_better(first: Path, second: Path, capsys: pytest.CaptureFixture[str]) -> None:
    times(second, 0.5)
    for out, value in ((first, 10.0), (second, 0.0)):
        for path in out.glob("cases/*/result.json"):
            result = json.loads(path.read_text(encoding="utf-8"))
            result["config"].setdefault("compare", {})["skip_mm"] = {"value": value, "source": "command line"}
            path.write_text(json.dumps(result), encoding="utf-8")
    assert main(["diff", str(first), str(second)]) == 0
    said = capsys.readouterr().out
    assert "the second is better" not in said
    assert "errors are measured otherwise in the second run (compare.skip_mm)" in said.splitlines()[-1]


def test_other_predictors_are_no_other_ruler(first: Path, second: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Errors were called measured otherwise, and the ratio said nothing, where skill alone was against others."""
    times(second, 0.5)
    for out, value in ((first, True), (second, False)):
        for path in out.glob("cases/*/result.json"):
            result = json.loads(path.read_text(encoding="utf-8"))
            result["config"].setdefault("compare", {})["simulated_nulls"] = {"value": value, "source": "command line"}
            path.write_text(json.dumps(result), encoding="utf-8")
    assert main(["diff", str(first), str(second)]) == 0
    said = capsys.readouterr().out
    assert "compare.simulated_nulls" in said, "it differs, and that is said"
    assert "measured otherwise" not in said


def test_a_run_that_ended_before_frames_are_compared_is_no_baseline(
    first: Path, second: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Depth, overlap and force were compared, and the errors were not worse."""
    for name in GROUPS:
        path = second / "cases" / name / ERRORS.file
        rows = tables.read(path, ERRORS)
        kept = ["frame", "status", "insertion_mm", "max_penetration_mm", "push_force_N"]
        tables.write(path, ERRORS, rows[kept].assign(max_penetration_mm=0.1))
    for candidate in (first, second):
        assert main(["diff", str(second), str(candidate)]) == 2
        assert "has an error that the tolerance names" in capsys.readouterr().err
    own = tmp_path / "forces.toml"
    own.write_text("max_penetration_mm = 0.02", encoding="utf-8")
    assert main(["diff", str(second), str(second), "--tolerance", str(own)]) == 0, "asked for"
    assert "no error of the simulated wire is judged frame by frame" in capsys.readouterr().out.splitlines()[-1]


def test_a_tolerance_without_an_error_judges_nothing_where_the_ratio_is_withheld(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of one insertion at 3.3 times the error: "not worse", exit 0."""
    own = tmp_path / "num.toml"
    own.write_text("max_penetration_mm = 0.1", encoding="utf-8")
    for name, error_mm in (("one", 0.1), ("two", 0.4)):
        write_run(tmp_path / name, (FakeCase("a", frames=3, seed=1, error_mm=error_mm),))
        path = tmp_path / name / "cases" / "a" / ERRORS.file
        tables.write(path, ERRORS, tables.read(path, ERRORS).assign(max_penetration_mm=0.1))
    assert main(["diff", str(tmp_path / "one"), str(tmp_path / "two"), "--tolerance", str(own)]) == 1
    last = capsys.readouterr().out.splitlines()[-1]
    assert last.startswith("NOTHING WAS JUDGED: no error of the simulated wire is judged frame by frame: the tolerance")


@pytest.mark.parametrize(("text", "said"), [("status = 1", "status holds no number"), (None, "no such file")])
def test_a_tolerance_that_cannot_be_used_is_named(
    first: Path, tmp_path: Path, text: str | None, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "own.toml"
    if text is not None:
        path.write_text(text, encoding="utf-8")
    assert main(["diff", str(first), str(first), "--tolerance", str(path)]) == 2
    assert f"own.toml: {said}" in capsys.readouterr().err


def test_a_page_of_two_runs_without_a_case_in_common(first: Path, second: Path, tmp_path: Path) -> None:
    """No frame stands in its lists: a column without values is left out of a page."""
    for name in GROUPS:
        (second / "cases" / name).rename(second / "cases" / f"other-{name}")
    page = tmp_path / "diff.html"
    assert main(["diff", str(first), str(second), "--html", str(page)]) == 1
    assert "present" in page.read_text(encoding="utf-8")


@pytest.mark.slow
def test_two_scores_are_compared_simulator_by_simulator(
    first: Path, second: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The first simulator's wires alone were looked at."""
    scores = [shutil.copytree(first, tmp_path / name) for name in ("old", "new")]
    times(second, 3.0)
    for score, own, names in zip(scores, (first, second), ("abc", "abd"), strict=True):
        tables.write(score / SIMULATORS.file, SIMULATORS, [{"simulator": name} for name in names])
        for name in names[1:]:
            shutil.copytree(own, score / "simulators" / name)
    junit, page, plain = tmp_path / "diff.xml", tmp_path / "diff.html", tmp_path / "diff.json"
    (scores[1] / "simulators" / "b" / "cases" / "b" / "report.html").touch()
    assert main(["diff", *map(str, scores), "--junit", str(junit), "--html", str(page), "--json", str(plain)]) == 1
    said = capsys.readouterr().out.splitlines()[-1]
    assert "the worst: c, case (all), simulator present -> missing" in said
    suites = {suite.get("name"): suite for suite in ET.parse(junit).findall("testsuite")}
    assert {name: suite.get("failures") for name, suite in suites.items() if name != "all"} == {
        **{f"a, {name}": "0" for name in GROUPS},
        **{f"b, {name}": "3" for name in GROUPS},
        "c, (all)": "1",
        "d, (all)": "0",
    }
    differs = json.loads(plain.read_text(encoding="utf-8"))["differs"]
    assert {"what": "simulator d", "before": "(none)", "after": "present"} in differs
    assert "9 of 9 frames and 1 simulator worse" in said, "not 18 of two simulators"
    assert said.count("only the second run has the simulator d") == 1
    assert 'href="new/simulators/b/cases/b/report.html"' in page.read_text(encoding="utf-8")
    capsys.readouterr()
    assert main(["diff", str(scores[0]), str(scores[0])]) == 0
    assert capsys.readouterr().out.startswith("Nothing differs in settings, code and inputs.")


def test_what_holds_for_one_simulator_is_not_said_of_all(
    first: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Above stood the ratio of one on all frames, in the last line that no frame has points: of the other."""
    scores = [shutil.copytree(first, tmp_path / name) for name in ("old", "new")]
    for score in scores:
        tables.write(score / SIMULATORS.file, SIMULATORS, [{"simulator": name} for name in ("mine", "wireval")])
        shutil.copytree(first, score / "simulators" / "wireval")
    shutil.rmtree(scores[1] / "simulators" / "wireval" / "cases")
    assert main(["diff", *map(str, scores)]) == 1
    said = capsys.readouterr().out.splitlines()[-1]
    assert re.search(
        "; wireval: [^;]*(; )?[^;]*over all frames nothing is judged: no frame has points in both runs", said
    )


@pytest.mark.parametrize(
    ("ratio", "meaning"),
    [
        (Ratio(1.2, 1.1, 1.3, 5, "over 6 insertions"), "the second is worse"),
        (Ratio(0.8, 0.7, 0.9, 5, "over 6 insertions"), "the second is better"),
        (Ratio(1.2, 0.9, 1.5, 5, "over 6 insertions"), "no difference is shown"),
        (Ratio(1.11, 1.04, 1.2, 5, "over 6 insertions"), "the second is worse"),
        (Ratio(1.2, float("nan"), float("nan"), 5, "withheld"), "too few insertions"),
        (Ratio(1.0, 1.0, 1.0, 5, "over 6 insertions"), "the error of no validation frame changed"),
    ],
)
def test_the_words_follow_the_interval(ratio: Ratio, meaning: str) -> None:
    assert meaning in ratio.verdict()
    assert "is worse" not in ratio.verdict(1.15), "as the gate has it"


def test_larger_than_is_allowed_and_not_shown_to_be() -> None:
    """Said to be larger "by no more than is allowed"."""
    assert "whether by more than is allowed (ratio 1.05) is not shown" in Ratio(1.11, 1.04, 1.2, 5, "").verdict(1.05)
    assert "by no more than is allowed" in Ratio(1.04, 1.01, 1.08, 5, "").verdict(1.05)


def test_nearer_one_way_alone_is_said_with_both_intervals() -> None:
    """An interval of 0.7 to 0.9 stood there, and "no difference is shown"."""
    said = Ratio(0.8, 0.7, 0.9, 5, "over 6 insertions", (1.1, 0.95, 1.3)).verdict()
    assert "no difference" not in said
    assert said.endswith(
        "0.800 (95 %: 0.700 to 0.900, over 6 insertions): the second is nearer by rms_mm, and not shown to be nearer "
        "the other way, from the traced wires (back_rms_mm 1.100 times as large, 95 %: 0.950 to 1.300, over 6 "
        "insertions): does it end early?"
    )


def test_a_table_of_markdown_keeps_its_columns(first: Path, tmp_path: Path) -> None:
    from reports.diff import diff_folders

    frames = diff_folders(first, first, {})
    verdict = Verdict((first, first), [{"what": "a|b <c>", "before": "1", "after": "2"}], [], "", "holds", frames)
    write(verdict, markdown=tmp_path / "verdict.md")
    assert "a\\|b &lt;c&gt;" in (tmp_path / "verdict.md").read_text(encoding="utf-8")
    assert replace(verdict, judged="worse").closed


def test_where_nothing_was_judged_no_gate_stays_open(first: Path, tmp_path: Path) -> None:
    """Equal statuses and a ratio that is withheld were called "not worse"."""
    from reports.diff import diff_folders
    from reports.two_runs_files import write

    verdict = Verdict((first, first), [], [], "", "withheld", diff_folders(first, first, {"insertion_mm": 5.0}))
    assert verdict.closed
    assert verdict.lines()[-1].startswith("NOTHING WAS JUDGED")
    assert "not worse" not in "".join(verdict.lines())
    write(verdict, junit=tmp_path / "diff.xml", html=tmp_path / "diff.html")
    assert [f.get("type") for f in ET.parse(tmp_path / "diff.xml").findall(".//failure")] == ["not_judged"]
    assert "not judged" in (tmp_path / "diff.html").read_text(encoding="utf-8")
    assert not replace(verdict, judged="holds").closed


def test_a_baseline_without_numbers_leaves_no_gate_open(
    first: Path, second: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A gate that nothing can close is refused; a case of many that has none is named."""
    for number, name in enumerate(GROUPS):
        path = second / "cases" / name / ERRORS.file
        rows = tables.read(path, ERRORS)
        if number:
            rows["status"] = "no_wire"
        else:  # as of a run until the trace
            rows = rows[["frame", "status", "insertion_mm"]]
        tables.write(path, ERRORS, rows)
    assert main(["diff", str(second), str(first)]) == 2
    assert "nothing to hold against" in capsys.readouterr().err
    shutil.copy(first / "cases" / "a" / ERRORS.file, second / "cases" / "a" / ERRORS.file)
    assert main(["diff", str(second), str(first)]) == 0
    assert "the first run has nothing to hold against in b, c" in capsys.readouterr().out
    assert main(["diff", str(tmp_path / "nope"), str(first)]) == 2
    assert "nope: no such folder" in capsys.readouterr().err


@pytest.mark.quick(1)
@pytest.mark.parametrize("spoil", ["half", POINTS.file, "result.json"])
def test_a_damaged_candidate_closes_the_gate_and_no_baseline_is(
    first: Path, second: Path, spoil: str, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = second / "cases" / "b"
    assert main(["diff", str(first), str(second)]) == 0
    if spoil == "half":
        points = (folder / POINTS.file).read_bytes()
        (folder / POINTS.file).write_bytes(points[: len(points) // 2])
    else:
        (folder / spoil).unlink()
    capsys.readouterr()
    assert cli.main(["diff", str(first), str(second)]) == 1
    assert (POINTS.file if spoil == "half" else spoil) in capsys.readouterr().out
    assert cli.main(["diff", str(second), str(first)]) == 2
    assert "case 'b' of the first run cannot be held against" in capsys.readouterr().err


def test_a_result_and_ledger_taken_away_are_missed(first: Path, second: Path) -> None:
    (second / "cases" / "b" / "result.json").unlink()
    assert main(["diff", str(first), str(second)]) == 1


def test_a_tolerance_without_the_ratio_keeps_the_shipped_one(first: Path, second: Path, tmp_path: Path) -> None:
    """The pooled gate was off without a word."""
    times(second, 1.1)
    path = tmp_path / "own.toml"
    path.write_text("rms_mm = 1.0", encoding="utf-8")
    assert main(["diff", str(first), str(second), "--tolerance", str(path)]) == 1
    path.write_text("rms_mm = 1.0\nrms_ratio = 0.2", encoding="utf-8")
    assert main(["diff", str(first), str(second), "--tolerance", str(path)]) == 0


def test_a_message_with_control_characters_is_still_xml(tmp_path: Path) -> None:
    failed = Outcome("frame 1", "failed", "\ufffe\x08ok", "gate", "line\n\x0cnext\ud800")
    write_junit(tmp_path / "x.xml", "wireval", [("a\x00b\x1b[0m", [failed])])
    (suite,) = ET.parse(tmp_path / "x.xml").getroot()
    failure = suite[0][0]
    assert (suite.get("name"), failure.get("message"), failure.text) == ("ab[0m", "ok", "line\nnext")


def warned(out: Path, *texts: str, case: str = "a") -> None:
    path = out / "cases" / case / "result.json"
    result = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps(result | {"warnings": [*texts]}), encoding="utf-8")


def test_what_only_the_second_run_is_warned_of_is_told(first: Path, second: Path, tmp_path: Path) -> None:
    """A gate stayed open over wires that were doubted, and not a word of it."""
    before = shutil.copytree(first, tmp_path / "before")
    warned(before, "1 frame: the wall is 0.2 mm off")
    warned(second, "2 frames: the wall is 0.31 mm off", "the tip looks folded")
    warned(second, "1 frame: the wall is 0.2 mm off", case="b")
    files = {name: tmp_path / f"diff.{name}" for name in ("json", "markdown", "html")}
    words = [word for name, path in files.items() for word in (f"--{name}", str(path))]
    assert main(["diff", str(before), str(second), *words]) == 0
    texts = {name: path.read_text(encoding="utf-8") for name, path in files.items()}
    rows = json.loads(texts["json"])["warned"]
    assert [(row["case"], row["warning"]) for row in rows] == [
        ("a", "the tip looks folded"),
        ("b", "1 frame: the wall is 0.2 mm off"),
    ]
    assert all("What only the second run is warned of" in texts[name] for name in ("markdown", "html"))
    assert all("the tip looks folded" in text for text in texts.values())


def test_wires_that_were_made_from_the_traces_pass_no_gate(
    first: Path, second: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """They are nearer to the traces than any simulator can be: "not worse", exit 0."""
    warned(second, f"0.001 mm: {MADE_FROM_TRACES}")
    assert main(["diff", str(first), str(second), "--junit", str(tmp_path / "j.xml")]) == 1
    assert f"NOTHING WAS JUDGED: a: 0.001 mm: {MADE_FROM_TRACES}" in capsys.readouterr().out
    assert ET.parse(tmp_path / "j.xml").getroot().find(".//failure[@type='not_judged']") is not None
    assert main(["diff", str(second), str(second)]) == 0, "of a baseline that says the same nothing is new"
    times(second, 3.0)
    assert main(["diff", str(first), str(second)]) == 1
    assert "Verdict: WORSE" in capsys.readouterr().out


def test_a_quiet_report_prints_the_result_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """All other verbs that take long had -q, and a script had to know which does not."""
    monkeypatch.setattr("pipeline.run.case.draw", lambda *_: None)
    monkeypatch.setattr("pipeline.commands.report.MANY", 2)
    out = write_run(tmp_path / "out", tuple(FakeCase(f"c{n}", frames=1, seed=n) for n in range(2)))
    assert main(["report", str(out)]) == 0
    assert capsys.readouterr().err.count(": drawn\n") == 2
    assert main(["report", str(out), "-q"]) == 0
    heard = capsys.readouterr()
    assert (heard.err, heard.out.count("\n")) == ("", 1)
