"""The gate: closes for what became worse, for what went missing, and for nothing else."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reports import diff, tables
from reports.schema import ERRORS
from reports.tolerance import load_tolerance
from tests.reports.fake_results import FakeCase, write_run

TOLERANCE = {"rms_mm": 0.1, "skill": 0.05, "branch_ok": 0.0, "insertion_mm": 0.2}


def _table(rows: list[dict[str, object]]) -> pd.DataFrame:
    return tables._conform(pd.DataFrame(rows), ERRORS)


def _row(**changes: object) -> dict[str, object]:
    row = {"frame": 0, "status": "ok", "rms_mm": 0.5, "skill": 0.8, "branch_ok": True, "insertion_mm": 30.0}
    return {**row, **changes}


@pytest.mark.parametrize(
    ("change", "column", "verdict"),
    [
        ({}, "rms_mm", "same"),
        ({"rms_mm": 0.6}, "rms_mm", "within"),
        ({"rms_mm": 0.61}, "rms_mm", "regression"),
        ({"rms_mm": 0.1}, "rms_mm", "better"),
        ({"skill": 0.74}, "skill", "regression"),
        ({"skill": 0.99}, "skill", "better"),
        ({"branch_ok": False}, "branch_ok", "regression"),
        ({"insertion_mm": 29.7}, "insertion_mm", "moved"),
        ({"insertion_mm": 30.1}, "insertion_mm", "within"),
        ({"status": "no_wire"}, "status", "regression"),
    ],
)
def test_verdicts(change: dict[str, object], column: str, verdict: str) -> None:
    found = diff.diff_tables({"c": _table([_row()])}, {"c": _table([_row(**change)])}, TOLERANCE)
    rows = found.rows.set_index("column")
    assert rows.loc[column, "verdict"] == verdict
    others = rows.drop(index=column)
    assert set(others["verdict"]) == ({"same"} if column != "status" else set()), "a frame that fails counts once"
    assert len(found.regressions) == (verdict == "regression")
    assert found.rows["verdict"].isin(diff.CLOSING).sum() == (verdict in ("regression", "moved"))
    assert ("1 value has moved: insertion_mm" in found.sentence) == (verdict == "moved")


@pytest.mark.parametrize(
    ("was", "now", "verdict"),
    [
        ("roll_fitted", "ok", "moved"),
        ("ok", "roll_fitted", "moved"),
        ("no_wire", "roll_fitted", "better"),
        ("roll_fitted", "no_wire", "regression"),
        ("no_wire", "not_to_depth", "moved"),
        ("length_mismatch", "length_mismatch", "same"),
        ("length_mismatch", "ok", "better"),
        ("ok", "simulated", "regression"),
        ("simulated", "ok", "better"),
    ],
)
def test_a_status_is_worse_only_where_that_is_known(was: str, now: str, verdict: str) -> None:
    """A frame that the roll was fitted on, or whose trace is refused, has an error that is in no score."""
    before, after = _row(status=was, rms_mm=0.1), _row(status=now, rms_mm=None if now == "simulated" else 0.9)
    found = diff.diff_tables({"c": _table([before])}, {"c": _table([after])}, {"rms_mm": 0.1})
    rows = found.rows.set_index("column")
    assert rows.loc["status", "verdict"] == verdict
    assert ("rms_mm" in rows.index) == ((was, now) == ("simulated", "ok"))


def test_a_recovered_frame_is_no_regression() -> None:
    """Nor has it moved: the depth that was stated gave way to the traced one, and a gate closed."""
    before = _table([{"frame": 0, "status": "no_wire", "insertion_mm": 30.0}])
    found = diff.diff_tables({"c": before}, {"c": _table([_row(insertion_mm=31.0)])}, TOLERANCE)
    assert not found.rows["verdict"].isin(diff.CLOSING).any()
    assert found.sentence.endswith("no regression; 1 frame that failed is ok now: c frame 0")
    assert found.rows.set_index("column").loc["status", "verdict"] == "better"


def test_missing_frames_and_cases_are_regressions_and_new_ones_are_not() -> None:
    two = _table([_row(), _row(frame=1)])
    one = _table([_row()])
    found = diff.diff_tables({"a": two, "b": one}, {"a": one, "c": one}, TOLERANCE)
    bad = found.regressions[["case", "column", "after"]].to_numpy().tolist()
    assert bad == [["a", "frame", "missing"], ["b", "case", "missing"]]
    assert found.rows[found.rows["verdict"] == "new"]["case"].tolist() == ["c"]
    assert found.sentence.startswith(
        "1 of 3 cases compared: 1 of 2 frames and 1 case worse; the worst: case a frame 1, frame present -> missing"
    )


@settings(max_examples=30, deadline=None)
@given(st.floats(0.01, 10), st.floats(0.01, 10), st.floats(0, 1))
def test_a_change_one_way_is_undone_the_other_way(before: float, after: float, allowed: float) -> None:
    pair = ({"c": _table([_row(rms_mm=before)])}, {"c": _table([_row(rms_mm=after)])})
    there = diff.diff_tables(*pair, {"rms_mm": allowed})
    back = diff.diff_tables(pair[1], pair[0], {"rms_mm": allowed})
    assert not (len(there.regressions) and len(back.regressions)), "at most one direction is worse"
    assert bool(len(there.regressions)) == (after - before > allowed * (1 + 1e-9))
    assert there.rows["change"].sum() == -back.rows["change"].sum()


def test_folders_against_themselves_and_against_a_worse_copy(tmp_path: Path) -> None:
    out = write_run(tmp_path / "a", (FakeCase("c", frames=5, failed=(1,)), FakeCase("d", frames=3)))
    tolerance = load_tolerance()
    same = diff.diff_folders(out, out, tolerance)
    assert same.regressions.empty
    assert same.sentence == "2 cases compared: no regression"
    worse = tmp_path / "b"
    shutil.copytree(out, worse)
    path = worse / "cases" / "d" / "errors.csv"
    errors = tables.read(path, ERRORS)
    errors.loc[2, "tip_mm"] += 1.0
    tables.write(path, ERRORS, errors)
    found = diff.diff_folders(out, worse, tolerance)
    assert found.regressions[["case", "frame", "column"]].to_numpy().tolist() == [["d", 2, "tip_mm"]]
    assert "case d frame 2, tip_mm" in found.sentence
    tip = found.by_column.set_index("column").loc["tip_mm"]
    assert tip["worst"] == pytest.approx(1.0)
    errors.loc[2, "back_rms_mm"], errors.loc[1, "coverage"] = 0.0, errors.loc[1, "coverage"] - 0.3
    tables.write(path, ERRORS, errors)
    coverage = diff.diff_folders(out, worse, tolerance).by_column.set_index("column").loc["coverage"]
    assert coverage["worst"] == pytest.approx(-0.3), "of what is better when larger, the largest loss"
    assert tip["regressions"] == 1
    (path).unlink()
    assert len(diff.diff_folders(out, worse, tolerance).regressions) == 3, "every frame of the case is missing"


@pytest.mark.slow
def test_a_calibration_case_of_one_run_alone_is_named_and_not_compared(tmp_path: Path) -> None:
    """A calibrated run leaves them out itself: its diff with the run before was WORSE, case present -> missing."""
    learnt, judged = FakeCase("c", frames=3, role="calibration"), FakeCase("d", frames=3)
    out, calibrated = write_run(tmp_path / "a", (learnt, judged)), write_run(tmp_path / "b", (judged,))
    told = "1 case compared: no regression; not compared, since one run alone has them and they count in no score: c"
    for pair in ((out, calibrated), (calibrated, out)):
        found = diff.diff_folders(*pair, load_tolerance())
        assert found.regressions.empty
        assert found.sentence == told
    (calibrated / "run.json").write_text(json.dumps({"planned": ["c", "d"]}), encoding="utf-8")
    assert len(diff.diff_folders(out, calibrated, load_tolerance()).regressions) == 1, "it was to be computed"
    other = write_run(tmp_path / "other", (learnt,))
    assert len(diff.diff_folders(out, other, load_tolerance()).regressions) == 1, "a case that is scored is missing"
    elsewhere = write_run(tmp_path / "elsewhere", (FakeCase("e", frames=3),))
    with pytest.raises(ValueError, match="all of it are calibration cases"):
        diff.diff_folders(other, elsewhere, load_tolerance())


def test_a_folder_without_cases_is_no_reference(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="wireval run"):
        diff.diff_folders(tmp_path, tmp_path, TOLERANCE)


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("rmse_mm = 1", "did you mean"),
        ("rms_mm = -1", "from 0 up"),
        ("rms_mm = 'x'", "from 0 up"),
        ("rms_mm = inf", "from 0 up"),
        ("# nothing", "names no column"),
        ("rms_ratio = 0.05", "found rms_ratio: no error, .* name at least rms_mm"),
        ("[share]\nrms_mm = 0.1", r"found \[share\] alone: no error"),
        ("insertion_mm = 5", "name at least rms_mm"),
        ("iterations = 1000\ncoverage = 2", "found iterations, coverage: no error"),
        ("null_shortest_rms_mm = 1", "name at least rms_mm"),
    ],
)
def test_wrong_tolerances_are_refused(tmp_path: Path, text: str, hint: str) -> None:
    path = tmp_path / "t.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=hint):
        load_tolerance(path)


def test_the_shipped_tolerance_gates_shape_tip_and_skill() -> None:
    assert {"rms_mm", "tip_mm", "skill", "truth_rms_mm"} <= set(load_tolerance())


def test_a_frame_that_fails_counts_once() -> None:
    """It was a regression in every column."""
    lost = _row(status="no_wire") | dict.fromkeys(TOLERANCE, None)
    found = diff.diff_tables({"c": _table([_row()])}, {"c": _table([lost])}, TOLERANCE)
    assert found.regressions["column"].tolist() == ["status"]


def test_what_the_second_run_has_in_no_frame_has_moved() -> None:
    """Another simulator has no push force, a score perhaps no truth: "WORSE, 48 regressions", and none was one."""
    tolerance = {"rms_mm": 0.1, "push_force_N": 0.1}
    before = _table([_row(frame=n, push_force_N=0.2) for n in range(3)])
    after = _table([_row(frame=n) for n in range(3)])
    found = diff.diff_tables({"c": before, "d": before}, {"c": after, "d": after}, tolerance)
    assert found.regressions.empty
    assert found.moved["case"].tolist() == ["c", "d"]  # a gate on it must not stay open
    assert found.lacking == ["push_force_N"]
    assert "no regression; the second run has no push_force_N in any frame" in found.sentence
    # missing in one frame alone it is lost there
    for column in tolerance:
        some = before.copy()
        some.loc[2, column] = float("nan")
        part = diff.diff_tables({"c": before}, {"c": some}, tolerance)
        assert part.lacking == []
        assert part.regressions["column"].tolist() == [column]


def test_frames_and_cases_of_two_simulators_count_once() -> None:
    """One lost case of two simulators was "2 cases", one frame that was mended "2 frames"."""
    run = {"a": _table([_row()]), "c": _table([_row(), _row(frame=1, status="no_wire")]), "d": _table([_row()])}
    later = {"c": _table([_row(), _row(frame=1), _row(frame=2, status="no_wire")])}
    rows = diff.diff_tables(run, later, TOLERANCE).rows
    said = diff.Difference(pd.concat([rows.assign(simulator=name) for name in ("x", "y")])).sentence
    assert "compared: 2 cases worse; the worst: " in said
    assert "; 1 frame that failed is ok now: c frame 1; " in said
    assert said.endswith("only the second run has them: 1 frame, 1 of which failed")


def test_errors_stand_before_what_is_none() -> None:
    """An overlap of 1.1 times what is allowed was named the worst, above a tip of another branch."""
    tolerance = {"max_penetration_mm": 0.02, "rms_mm": 0.1, "skill": 0.01}
    before = _table([_row(frame=n, max_penetration_mm=0.1) for n in range(3)])
    after = _table([_row(frame=n, max_penetration_mm=0.9, rms_mm=0.61, skill=0.1) for n in range(2)])
    found = diff.diff_tables({"c": before}, {"c": after}, tolerance)
    assert found.regressions["column"].tolist()[:3] == ["frame", "rms_mm", "rms_mm"]
    assert "3 of 3 frames worse, in 7 values; the worst: case c frame 2, frame present -> missing" in found.sentence
    alone = diff.diff_tables({"c": before}, {"c": _table([_row(max_penetration_mm=0.2)])}, {"max_penetration_mm": 0.02})
    assert not alone.beside_errors, "frames are missing"


def test_an_overlap_is_held_against_its_own_size() -> None:
    """0.3903 -> 0.4122 mm in one frame closed the gate on a change of all errors that is allowed."""
    tolerance, shown = load_tolerance(), {}
    for was, now in ((0.3903, 0.4122), (0.3903, 0.4322), (0.01, 0.029), (0.01, 0.031)):
        pair = [{"c": _table([_row(max_penetration_mm=value)])} for value in (was, now)]
        shown[was, now] = diff.diff_tables(*pair, tolerance)
    assert [len(found.regressions) for found in shown.values()] == [0, 1, 0, 1]
    found = shown[0.3903, 0.4322]
    assert found.beside_errors
    assert (
        "max_penetration_mm 0.3903 -> 0.4322 (allowed 0.03903); no error of a simulated wire is worse" in found.sentence
    )


def test_a_share_is_of_a_column_that_is_named(tmp_path: Path) -> None:
    path = tmp_path / "t.toml"
    path.write_text("rms_mm = 0.1\n[share]\nrms_mm = 0.5", encoding="utf-8")
    tolerance = load_tolerance(path)
    assert [
        len(diff.diff_tables({"c": _table([_row(rms_mm=1.0)])}, {"c": _table([_row(rms_mm=v)])}, tolerance).regressions)
        for v in (1.4, 1.6)
    ] == [0, 1]
    for text in (
        "rms_mm = 0.1\n[share]\ntip_mm = 0.5",
        "rms_mm = 0.1\nshare = 0.5",
        "rms_mm = 1\n[share]\nrms_mm = -1",
    ):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(ValueError, match=r"share.*a number from 0 up for a column that has a line above"):
            load_tolerance(path)
