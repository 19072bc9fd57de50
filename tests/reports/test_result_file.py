"""result.json with a value that no case has: named with its key, before a table or a page is made of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from reports.case_files import amiss, results_in
from reports.records import ALWAYS
from reports.result_file import read_result
from reports.run_page import readable_cases
from tests.reports.fake_results import FakeCase, write_run


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    cases = FakeCase("c", frames=3), FakeCase("bad", frames=3, failed=(1,)), FakeCase("sim", simulated_only=True)
    return write_run(tmp_path_factory.mktemp("fake") / "out", cases)


def test_sound_results_are_read(out: Path) -> None:
    assert list(results_in(out)) == ["bad", "c", "sim"]
    assert all(results_in(out).values())
    assert read_result(out / "none.json") == {}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"case": 5}, "case: got 5; expected a text"),
        ({"role": "god"}, "role: got 'god'; expected validation or calibration"),
        ({"group": ["a"]}, r"group: got \['a'\]; expected a text"),
        ({"summary": {"frames": "two"}}, "summary.frames: got 'two'; expected a whole number"),
        ({"summary": {"frames": 10**30}}, "summary.frames: got 10{30}; expected a whole number"),
        ({"summary": {"frames": 99}}, "summary.frames: got 99; expected 3 to 3"),
        ({"summary": {"frames": True}}, "summary.frames: got True; expected a whole number"),
        ({"summary": {"frames_ok": 1e400}}, "summary.frames_ok: got inf; expected a whole number"),
        ({"summary": {"frames_ok": float("nan")}}, "summary.frames_ok: got nan; expected a whole number"),
        ({"summary": {"frames_ok": 99}}, "summary.frames_ok: got 99; expected 3, the number of frames that are ok"),
        ({"summary": {"rms_mm": "=cmd|calc"}}, r"summary.rms_mm: got '=cmd\|calc'; expected a number"),
        ({"summary": {"rms_mm": float("nan")}}, "summary.rms_mm: got nan; expected a number"),
        ({"summary": {"case": "../x"}}, "summary.case: got '../x'; expected 'c', as case says"),
        ({"summary": {"interval": "w" * 999, "group": 9}}, "summary.group: got 9; expected a text"),
        ({"frames": {"status": 5}}, r"frames\[0\].status: got 5; expected a text"),
        ({"frames": {"frame": "x"}}, r"frames\[0\].frame: got 'x'; expected a whole number"),
        ({"frames": {"snaps": "n" * 999}}, r"frames\[0\].snaps: got 'n{59}\.\.\.; expected a list"),
        ({"failures": [{"case": "c", "frame": -1}]}, r"failures\[0\].frame: got -1; expected a whole number"),
    ],
)
def test_a_value_that_no_case_has_is_named(out: Path, tmp_path: Path, change: dict[str, Any], said: str) -> None:
    result = json.loads((out / "cases" / "c" / "result.json").read_text(encoding="utf-8"))
    if "summary" in change:
        change = {"summary": result["summary"] | change["summary"]}
    if "frames" in change:
        change = {"frames": [result["frames"][0] | change["frames"], *result["frames"][1:]]}
    path = tmp_path / "cases" / "c" / "result.json"
    path.parent.mkdir(parents=True)
    path.write_text(json.dumps(result | change).replace("Infinity", "1e400"), encoding="utf-8")
    with pytest.raises(ValueError, match=rf"result\.json: {said}.*; give the command of the run again"):
        read_result(path)
    assert results_in(tmp_path) == {"c": {}}
    cases, broken = readable_cases(tmp_path)
    assert (cases, [row["status"] for row in broken]) == ([], ["damaged"])


def test_infinities_are_numbers_and_other_columns_are_of_other_versions(out: Path, tmp_path: Path) -> None:
    result = json.loads((out / "cases" / "c" / "result.json").read_text(encoding="utf-8"))
    result["summary"] |= {"skill": "-inf", "p95_mm": None, "of_a_later_version": []}
    (tmp_path / "result.json").write_text(json.dumps(result), encoding="utf-8")
    assert read_result(tmp_path / "result.json")["summary"]["skill"] == "-inf"


@pytest.mark.parametrize("name", ALWAYS)
def test_a_ledger_names_what_every_case_has(tmp_path: Path, name: str) -> None:
    assert amiss(tmp_path) == "", "a case that crashed has none"
    for one in ALWAYS:
        (tmp_path / one).write_text("x", encoding="utf-8")
    files = {one: {"bytes": 1} for one in ALWAYS}
    (tmp_path / "ledger.json").write_text(json.dumps({"files": files}), encoding="utf-8")
    assert amiss(tmp_path) == ""
    del files[name]
    (tmp_path / "ledger.json").write_text(json.dumps({"files": files}), encoding="utf-8")
    assert amiss(tmp_path) == f"ledger.json does not name {name}"
