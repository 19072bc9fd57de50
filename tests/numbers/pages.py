"""The pages of invented results: what stands in them, and how their figures are drawn."""

from __future__ import annotations

import tempfile
from pathlib import Path

from reports import pdf, tables
from reports.case_files import find_cases
from reports.html import render_case, render_index
from reports.schema import SUMMARY
from tests.numbers.drawn import drawn, looks, said
from tests.numbers.kept import Numbers, Scene
from tests.reports.fake_pages import write_pages
from tests.reports.fake_results import FakeCase, write_run

CASES = (
    FakeCase("true", frames=5, truth=True),
    FakeCase("failed", frames=6, seed=3, failed=(2, 3), error_mm=0.35),
    FakeCase("calibration", frames=3, seed=5, role="calibration", error_mm=0.15),
    FakeCase("simulated", frames=3, seed=7, simulated_only=True),
)


def run() -> Numbers:
    """The pages of a run, of its cases, and its summary on paper."""
    with tempfile.TemporaryDirectory() as folder, drawn() as found:
        out = write_run(Path(folder) / "out", CASES, sweep=True)
        for case in find_cases(out):
            render_case(case)
            found[f"{case.name}.page"] = said((case / "report.html").read_text(encoding="utf-8"))
        render_index(out)
        found["index.page"] = said((out / "index.html").read_text(encoding="utf-8"))
        for number, paper in enumerate(pdf._pages(out, tables.read(out / "summary.csv", SUMMARY))):
            found |= {f"paper{number}.{name}": values for name, values in looks(paper.figure).items()}
        return found


def beside() -> Numbers:
    """The pages beside those of a run."""
    with tempfile.TemporaryDirectory() as folder, drawn() as found:
        out = write_run(Path(folder) / "out", CASES[:1])
        for path in write_pages(out, Path(folder)):
            found[f"{path.stem}.page"] = said(path.read_text(encoding="utf-8"))
        return found


SCENES: dict[str, Scene] = {"run": run, "beside": beside}
