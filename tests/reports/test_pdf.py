"""summary.pdf: four pages, whatever the run holds, the same bytes twice."""

from __future__ import annotations

import re
from pathlib import Path

import matplotlib as mpl
import pytest

from reports.case_files import find_cases
from reports.html import render_case, render_index
from reports.pdf import write_pdf
from tests.reports.fake_results import FakeCase, write_run


def _words(path: Path) -> str:
    """The texts of a PDF that was written without compression, its strings one after the other."""
    pattern = r"(?:\[((?:\((?:[^()\\]|\\.)*\)|[^\]])*)\] TJ|(\((?:[^()\\]|\\.)*\)) Tj)"
    shown = re.findall(pattern, path.read_bytes().decode("latin-1"))
    # one text may stand in pieces, with kerning between them
    return " ".join("".join(re.findall(r"\(((?:[^()\\]|\\.)*)\)", one or other)) for one, other in shown)


def test_four_pages_say_verdict_failures_and_the_worst_case(tmp_path: Path) -> None:
    cases = (FakeCase("fine", frames=3), FakeCase("poor", frames=3, failed=(1,), error_mm=0.6))
    out = write_run(tmp_path / "out", cases)
    for folder in find_cases(out):
        render_case(folder)
    render_index(out)
    with mpl.rc_context({"pdf.compression": 0, "pdf.fonttype": 42, "pdf.use14corefonts": True}):
        path = write_pdf(out)
        first = path.read_bytes()
        words = _words(path)
        assert write_pdf(out).read_bytes() == first
    assert len(re.findall(rb"/Type /Page\b", first)) == 4
    for said in ("6 frames", "0.250 mm", "no_wire", "The worst case: poor", "solver.segment_mm", "4 of 4"):
        assert said in words, said


@pytest.mark.parametrize("cases", [(), (FakeCase("s", frames=2, simulated_only=True),)], ids=["none", "simulated"])
def test_a_run_without_errors_has_its_four_pages(tmp_path: Path, cases: tuple[FakeCase, ...]) -> None:
    path = write_pdf(write_run(tmp_path / "out", cases))
    assert len(re.findall(rb"/Type /Page\b", path.read_bytes())) == 4
