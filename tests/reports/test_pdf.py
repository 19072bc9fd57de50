"""summary.pdf: four pages, whatever the run holds, the same bytes twice."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest

from reports import pdf, tables
from reports._content import worst_first
from reports.case_files import find_cases
from reports.html import render_case, render_index
from reports.pdf import write_pdf
from reports.schema import SUMMARY
from tests.reports.fake_results import FakeCase, write_run


def test_four_pages_say_verdict_failures_and_the_worst_case(tmp_path: Path) -> None:
    cases = (FakeCase("fine", frames=3), FakeCase("poor", frames=3, failed=(1,), error_mm=0.6))
    out = write_run(tmp_path / "out", cases)
    for folder in find_cases(out):
        render_case(folder)
    render_index(out)
    first = write_pdf(out).read_bytes()
    assert len(re.findall(rb"/Type /Page\b", first)) == 4
    assert write_pdf(out).read_bytes() == first
    summary = tables.read(out / "summary.csv", SUMMARY)
    pages = [" ".join(text.get_text() for text in page.figure.texts) for page in pdf._pages(out, summary)]
    said = (
        ("5 of 6 frames", "0.250 mm", "frame 1: no_wire", "--only poor"),
        ("planned frames",),
        ("worst case: poor", "Error against insertion depth", "stands among the assumptions", "Worst frames by p95_mm"),
    )
    for page, words in zip(pages, (*said, ("solver.segment_mm", "frames_failed")), strict=True):
        assert not [word for word in words if word not in page], page


def test_worst_is_the_same_on_every_page(tmp_path: Path) -> None:
    """One page called the only case that was ok the worst, and the next had it last, below one without any result."""
    cases = (FakeCase("far", frames=3, error_mm=0.9), FakeCase("poor", frames=3, failed=(1,)))
    cases += (FakeCase("fine", frames=3, error_mm=0.1), FakeCase("none", frames=3, failed=(1,)))
    out = write_run(tmp_path / "out", cases)
    summary = tables.read(out / "summary.csv", SUMMARY)
    summary.loc[summary["case"] == "none", "p95_mm"] = math.nan
    summary = worst_first(summary)
    assert summary["case"].tolist() == ["none", "poor", "far", "fine"]
    pages = [" ".join(text.get_text() for text in page.figure.texts) for page in pdf._pages(out, summary)]
    assert "The worst case of those with errors: poor" in pages[2]
    assert re.findall("none|poor|far|fine", pages[3].partition("skill_strongest")[2])[:4] == summary["case"].tolist()


def test_warnings_and_assumptions_stand_on_the_first_page(tmp_path: Path) -> None:
    out = write_run(tmp_path / "out", [FakeCase(name, frames=2) for name in "ab"])
    for path in out.glob("cases/*/result.json"):
        result = json.loads(path.read_text(encoding="utf-8"))
        warnings = [f"warning {n} " + "of many words " * 40 for n in range(7)]
        assumptions = ["the roll is 0", f"only {path.parent.name} says so"]
        path.write_text(json.dumps(result | {"warnings": warnings, "assumptions": assumptions}), encoding="utf-8")
    page = next(pdf._pages(out, tables.read(out / "summary.csv", SUMMARY)))
    said = " ".join(text.get_text() for text in page.figure.texts)
    for words in (
        "Warnings (7)",
        "a, b: warning 0",
        "and 3 more",
        "Assumptions (3)",
        "a, b: the roll is 0",
        "b: only b",
    ):
        assert words in said
    assert page.at > 0.3, "room for more than that"


@pytest.mark.parametrize("cases", [(), (FakeCase("s", frames=2, simulated_only=True),)], ids=["none", "simulated"])
def test_a_run_without_errors_has_its_four_pages(tmp_path: Path, cases: tuple[FakeCase, ...]) -> None:
    path = write_pdf(write_run(tmp_path / "out", cases))
    assert len(re.findall(rb"/Type /Page\b", path.read_bytes())) == 4
