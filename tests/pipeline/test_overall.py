"""The whole run in one row: one population, whatever failed; two runs compared by ratios on the frames they share."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest

from pipeline.cli import main
from pipeline.run.aggregate import aggregate
from pipeline.run.last_words import failure_lines, last_line
from pipeline.run.launch import Plan
from pipeline.run.overall import found_cases, overall, ratio, shared_scans
from reports import tables
from reports.run_page import render_index
from reports.schema import ALL, ERRORS, POINTS

pytestmark = pytest.mark.usefixtures("invented")
GOOD, BAD = 0.3, 5.0


def write_case(out: Path, name: str, errors_mm: list[float], statuses: list[str] | None = None, **result: Any) -> None:
    """A case whose frames have 50 points each, all as far off as stated; the null is off by 1 mm."""
    folder, statuses = out / "cases" / name, statuses or ["ok"] * len(errors_mm)
    folder.mkdir(parents=True)
    rows = [
        {"frame": i, "status": s, "insertion_mm": 10.0 + i, "rms_mm": mm, "p95_mm": mm, "tip_mm": mm}
        | {"null_centreline_rms_mm": 1.0}
        for i, (s, mm) in enumerate(zip(statuses, errors_mm, strict=True))
    ]
    tables.write(folder / "errors.csv", ERRORS, rows)
    frame, error = np.repeat(np.arange(len(rows)), 50), np.repeat(errors_mm, 50)
    arc = np.tile(np.arange(50) / 2, len(rows))
    tables.write(folder / "points.csv.gz", POINTS, {"frame": frame, "arc_mm": arc, "error_mm": error})
    good = statuses.count("ok")
    status = "ok" if good == len(rows) else next(s for s in statuses if s != "ok")
    summary = {"case": name, "group": name, "role": "validation", "status": status, "frames": len(rows)}
    summary |= {"frames_ok": good, "frames_failed": len(rows) - good}
    stages = {"ok": "", "max_iterations": "simulate"}
    said = [{"frame": r["frame"], "status": r["status"], "sentence": "", "message": ""} for r in rows]
    said = [frame | {"stage": stages.get(frame["status"], "trace")} for frame in said]
    whole = {"case": name, "role": "validation", "group": name, "status": status, "sentence": "", "frames": said}
    whole |= {"failures": [], "summary": summary | {k: v for k, v in result.items() if k in summary}} | result
    (folder / "result.json").write_text(json.dumps(whole), encoding="utf-8")


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Four insertions with two frames that failed, both far off, and a calibration case that is far off, too."""
    write_case(tmp_path, "a", [GOOD, GOOD, BAD], ["ok", "ok", "length_mismatch"])
    write_case(tmp_path, "b", [GOOD * 1.2, BAD], ["ok", "max_iterations"])
    write_case(tmp_path, "c", [GOOD * 0.9, GOOD])
    write_case(tmp_path, "d", [GOOD, GOOD * 1.1])
    write_case(tmp_path, "tuned", [BAD, BAD], role="calibration")
    return tmp_path


def test_one_population_everywhere(study: Path) -> None:
    """Headline, last line, overall.csv and the figures: frames that are ok, of validation cases. It was 5 mm in one."""
    totals = aggregate(study, {})
    good = GOOD * np.array([1, 1, 1.2, 0.9, 1, 1, 1.1])
    rms = float(np.sqrt(np.mean(good**2)))
    whole = pd.read_csv(study / "overall.csv").iloc[0]
    assert whole["rms_mm"] == pytest.approx(rms)
    assert json.loads((study / "run.json").read_text(encoding="utf-8"))["overall"]["rms_mm"] == pytest.approx(rms)
    assert (whole["frames"], whole["frames_ok"], whole["insertions"]) == (9, 7, 4)
    line = last_line(totals, study / "index.html")
    assert f"median point error {np.median(good):.3f} mm" in line
    interval = f"95 %: {whole['rms_low_mm']:.3f} to {whole['rms_high_mm']:.3f}, from 4 ins"
    assert f"rms {rms:.3f} mm over the 4 cases that are scored ({interval}" in line
    one = replace(totals, pooled={**totals.pooled, "cases": 1})
    assert "mm over the 1 case that is scored (" in last_line(one, study / "index.html")
    page = render_index(study).read_text(encoding="utf-8")
    assert f"<b>{rms:.3f}</b>" in page
    curve = pd.read_csv(study / "figures" / "planned_within.csv")
    curve = curve[curve["case"] == ALL]  # the others are those of single cases
    assert curve["share_of_planned"].max() == pytest.approx(7 / 9), "frames that failed are planned ones, too"
    assert curve.loc[curve["p95_mm"] < BAD, "p95_mm"].max() == pytest.approx(GOOD * 1.2)
    assert whole["within_1mm"] == pytest.approx(7 / 9)


def test_the_last_line_names_scans_that_a_roll_was_fitted_on(study: Path) -> None:
    totals = aggregate(study)
    assert "used for the roll" not in last_line(totals, study)
    result = study / "cases" / "a" / "result.json"
    told = json.loads(result.read_text(encoding="utf-8"))
    told["summary"]["frames_fitted"] = 1
    result.write_text(json.dumps(told), encoding="utf-8")
    assert f", {totals.frames} frames (and 1 used for the roll): " in last_line(aggregate(study), study)


def test_leaving_frames_out_cannot_improve_the_share(study: Path) -> None:
    before = overall(found_cases(study))["within_1mm"]
    write_case(study, "e", [GOOD, BAD, BAD], ["ok", "no_wire", "no_wire"])
    assert overall(found_cases(study))["within_1mm"] < before


def test_a_damaged_case_does_not_improve_the_share_either(study: Path) -> None:
    """Its six frames were missing from the planned ones, and the worst insertion with them."""
    before = overall(found_cases(study))
    points = study / "cases" / "b" / "points.csv.gz"
    points.write_bytes(points.read_bytes()[:-20])
    aggregate(study, {})
    whole = pd.read_csv(study / "overall.csv").iloc[0]
    assert (whole["frames"], whole["frames_ok"]) == (before["frames"], before["frames_ok"] - 1)
    assert whole["within_1mm"] == pytest.approx(before["within_1mm"] - 1 / before["frames"])
    row = pd.read_csv(study / "summary.csv").set_index("case").loc["b"]
    assert (row["status"], row["role"], row["frames"], row["within_1mm"]) == ("damaged", "validation", 2, 0.0)


def test_a_case_without_a_result_is_a_failure_and_its_frames_were_planned(
    study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of three of four shards overall.csv said 9 of 9 frames ok, and failures.csv was empty."""
    before = overall(found_cases(study))
    names = ["a", "b", "c", "d", "tuned", "e", "learnt"]
    info = {"planned": names, "to_score": {"a": 3, "b": 2, "c": 2, "d": 2, "e": 4}, "config": {}}
    (study / "run.1-2.json").write_text(json.dumps(info), encoding="utf-8")
    assert main(["report", str(study), "--overview"]) == 1
    assert "2 cases without a result (failures.csv)" in capsys.readouterr().out
    failures = pd.read_csv(study / "failures.csv", keep_default_na=False)
    assert failures[["case", "stage", "status", "log"]].to_numpy().tolist() == [
        ["e", "run", "not_run", ""],
        ["learnt", "run", "not_run", ""],
    ]
    assert "copy the folder of the shard" in failures["message"][0]
    whole = pd.read_csv(study / "overall.csv").iloc[0]
    assert (whole["frames"], whole["frames_ok"], whole["frames_failed"]) == (13, 7, before["frames_failed"] + 4)
    assert whole["within_1mm"] == pytest.approx(7 / 13)
    assert whole["rms_mm"] == pytest.approx(before["rms_mm"])
    page = (study / "index.html").read_text(encoding="utf-8")
    assert "shares are of all planned frames, theirs among them" in page
    curve = pd.read_csv(study / "figures" / "planned_within.csv")
    assert curve.loc[curve["case"] == ALL, "share_of_planned"].max() == pytest.approx(7 / 13)
    aggregate(study, info, "run.1-2.json")  # a shard that has just run: others may be at work on the rest
    assert pd.read_csv(study / "overall.csv")["frames"][0] == before["frames"]


def test_a_trace_is_trusted_whatever_the_solver_said_of_its_wire(study: Path) -> None:
    """As ``Frame.trusted_curve``: a list of statuses had none of the solver's own."""
    traced = {case.result.case: case.traced_mm for case in found_cases(study)}
    assert traced["a"] == {0: 10.0, 1: 11.0}, "its third trace has another length than is stated"
    assert traced["b"] == {0: 10.0, 1: 11.0}, "its second wire did not converge"


def test_a_skill_over_fewer_insertions_says_so(study: Path) -> None:
    """``from 4 insertions only`` stood beside a skill of two of them, which had no interval and did not say why."""
    for name in ("c", "d"):
        path = study / "cases" / name / "errors.csv"
        errors = pd.read_csv(path)
        tables.write(path, ERRORS, (errors.assign(null_previous_rms_mm=0.5)).to_dict("records"))
    for name in ("a", "b"):
        path = study / "cases" / name / "errors.csv"
        tables.write(path, ERRORS, pd.read_csv(path).assign(null_centreline_rms_mm=np.nan).to_dict("records"))
    whole = overall(found_cases(study))
    assert (whole["insertions"], whole["strongest_null"], whole["strongest_insertions"]) == (4, "previous", 2)
    assert np.isnan(whole["skill_strongest_low"])
    withheld = "skill_strongest interval withheld: 2 insertions, at least 3 needed"
    assert whole["interval"] == f"from 4 insertions only; {withheld}"
    aggregate(study, {})
    assert "(no interval: 2 insertions)" in render_index(study).read_text(encoding="utf-8")


def test_frames_of_one_number_and_other_depths_are_no_pair(study: Path, tmp_path: Path) -> None:
    """Of a case that lists its last scan alone that one is frame 0, and was held against the first."""
    other = tmp_path / "other"
    write_case(other, "a", [GOOD])
    path = other / "cases" / "a" / "errors.csv"
    tables.write(path, ERRORS, pd.read_csv(path).assign(insertion_mm=12.5).to_dict("records"))
    assert ratio(found_cases(study), found_cases(other)) is None
    write_case(other, "c", [GOOD])
    both = ratio(found_cases(study), found_cases(other))
    assert both is not None
    assert both.frames == 1


def test_two_insertions_have_no_interval(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_case(tmp_path, name, [0.2, 0.3] * 9)
    totals = aggregate(tmp_path, {})
    assert np.isnan(totals.pooled["rms_low_mm"])
    assert "(interval withheld: 2 insertions, at least 3 needed)" in last_line(totals, tmp_path)


def test_two_runs_are_compared_on_the_frames_that_both_have(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The second run is twice as far off everywhere, and lost a frame more: the ratio is 2, and certain."""
    other = tmp_path / "other"
    write_case(other, "a", [2 * GOOD, BAD, BAD], ["ok", "no_wire", "length_mismatch"])
    write_case(other, "b", [2 * GOOD * 1.2, BAD], ["ok", "max_iterations"])
    write_case(other, "c", [2 * GOOD * 0.9, 2 * GOOD])
    write_case(other, "d", [2 * GOOD, 2 * GOOD * 1.1])
    found = ratio(found_cases(study), found_cases(other))
    assert found is not None
    assert found.frames == 6
    assert (found.value, found.low, found.high) == pytest.approx((2.0, 2.0, 2.0))
    assert main(["diff", str(study), str(other)]) == 1
    said = "rms of the second run / the first, on 6 frames: 2.000 (95 %: 2.000 to 2.000, from 4 insertions only)"
    assert said in capsys.readouterr().out


def test_a_run_three_times_as_far_off_has_three_times_the_ratio_and_its_interval(tmp_path: Path) -> None:
    worse = [1.5, 0.8, 1.3, 1.1]
    for name, factor in zip("abcd", worse, strict=True):
        write_case(tmp_path / "first", name, [GOOD, GOOD * 1.2])
        for run, times in (("second", 1.0), ("third", 3.0)):
            write_case(tmp_path / run, name, [GOOD * factor * times, GOOD * 1.2 * factor * times])
    first, second, third = (found_cases(tmp_path / run) for run in ("first", "second", "third"))
    one, other = ratio(first, second), ratio(first, third)
    assert one is not None
    assert other is not None
    assert one.value == pytest.approx(np.sqrt(np.mean(np.square(worse))))
    assert one.low < one.value < one.high
    assert [other.value, other.low, other.high] == pytest.approx([3 * one.value, 3 * one.low, 3 * one.high])


def test_a_ratio_hangs_on_no_number_of_points(tmp_path: Path) -> None:
    """A wire of another length, or another step, has other numbers of points at the same errors."""
    write_case(tmp_path, "a", [GOOD, BAD])
    first = found_cases(tmp_path)
    twice = {
        number: frame._replace(error_mm=np.repeat(frame.error_mm, 2), arc_mm=np.repeat(frame.arc_mm, 2))
        for number, frame in first[0].frames.items()
    }
    for runs in ((first, [replace(first[0], frames=twice)]), ([replace(first[0], frames=twice)], first)):
        found = ratio(*runs)
        assert found is not None
        assert found.value == pytest.approx(1.0)


def test_runs_without_a_frame_in_common_have_no_ratio(tmp_path: Path) -> None:
    write_case(tmp_path / "a", "one", [0.1])
    write_case(tmp_path / "b", "two", [0.1])
    assert ratio(found_cases(tmp_path / "a"), found_cases(tmp_path / "b")) is None


def test_cases_with_a_scan_in_common_are_one_insertion(tmp_path: Path) -> None:
    """The same scans under three ids gave an interval over three insertions; chains count, too."""
    for name, scans in (("a", ["1"]), ("b", ["2", "3"]), ("c", ["3", "1"]), ("d", ["4"])):
        write_case(tmp_path, name, [GOOD, BAD], scans=scans)
    assert overall(found_cases(tmp_path))["insertions"] == 2
    aggregate(tmp_path, {})
    text = render_index(tmp_path).read_text("utf-8")
    assert "cases a, b, c have scans or curves in common and count as one insertion" in text
    assert text.count("have scans or curves in common") == 1  # d's are its own


def test_cases_that_the_manifest_names_no_more_count_nowhere(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Ids that were changed doubled the insertions, and narrowed the interval. Shards add up; older runs keep all."""
    everything = [c.result.case for c in found_cases(study)]
    assert everything == ["a", "b", "c", "d", "tuned"]
    for number, names in ((1, ["a", "b"]), (2, ["b", "d"])):
        (study / f"run.{number}-2.json").write_text(json.dumps({"planned": names}), encoding="utf-8")
    assert [c.result.case for c in found_cases(study)] == ["a", "b", "d"]
    assert overall(found_cases(study))["insertions"] == 3
    said = "no manifest of this folder names them any more: c, tuned"
    assert said in render_index(study).read_text(encoding="utf-8")
    assert main(["report", str(study), "--overview"]) == 1
    assert said in capsys.readouterr().err
    assert list(pd.read_csv(study / "summary.csv")["case"]) == ["a", "b", "d"]
    (study / "run.json").write_text("{}", encoding="utf-8")
    assert [c.result.case for c in found_cases(study)] == everything


def test_what_is_null_in_a_result_says_as_little_as_what_is_absent(study: Path) -> None:
    """A null for the settings, which other tools may write, was a traceback."""
    for name in ("x", "y"):
        write_case(study, name, [GOOD], config=None, provenance=None, inputs=None, warnings=None, phantom="one")
    assert main(["report", str(study), "--overview"]) == 1, "other cases of this study have failed frames"
    assert main(["report", str(study)]) == 1
    assert np.isfinite(pd.read_csv(study / "overall.csv").loc[0, "rms_mm"])


def test_cases_of_one_stated_insertion_that_share_scans_have_nothing_to_be_told(study: Path) -> None:
    """Only cases that state two insertions and show the same scans are told that they count as one."""
    for group, told in (("one", 0), ("two", 1)):
        write_case(study / group, "x", [GOOD], group="one", scans=["same"])
        write_case(study / group, "y", [GOOD], group=group, scans=["same"])
        assert len(shared_scans([c.result for c in found_cases(study / group)])) == told


def test_the_last_words_name_a_case_that_is_worse_than_a_guess(tmp_path: Path) -> None:
    """The numbers over both cases were good, and nothing else was said."""
    for name, skill in (("a", 0.9), ("b", -0.6)):
        row = {"case": name, "status": "ok", "frames": 1, "frames_ok": 1, "rms_mm": GOOD}
        write_case(tmp_path, name, [GOOD], summary=row | {"skill_strongest": skill, "strongest_null": "previous"})
    plan = SimpleNamespace(out=tmp_path, template=SimpleNamespace(settings=None), cases=(), points=(), ids=set())
    assert failure_lines(cast(Plan, plan), "-") == ["1 of 2 cases is worse than a guess: b."]
