"""The pages of invented results: what stands in them, and how their figures are drawn, looked at before they are."""

from __future__ import annotations

import tempfile
from pathlib import Path

from reports import pdf, tables
from reports.case_files import find_cases, read_case
from reports.case_page import render_case
from reports.figures import figures_of
from reports.run_page import render_index
from reports.schema import ERRORS, SUMMARY
from tests.numbers.drawn import TIMED, drawn, looks, said
from tests.numbers.kept import Numbers, Scene
from tests.reports.fake_pages import write_pages
from tests.reports.fake_results import FakeCase, write_run
from tests.unseen import undrawn

CASES = (
    FakeCase("true", frames=5, truth=True),
    FakeCase("failed", frames=6, seed=3, failed=(2, 3), error_mm=0.35),
    FakeCase("calibration", frames=3, seed=5, role="calibration", error_mm=0.15),
    FakeCase("simulated", frames=3, seed=7, simulated_only=True),
)


def run() -> Numbers:
    """The pages of a run, of its cases, and its summary on paper."""
    with tempfile.TemporaryDirectory() as folder, undrawn(), drawn() as found:
        out = write_run(Path(folder) / "out", CASES, sweep=True)
        for case in find_cases(out):
            render_case(case)
            found |= said(f"{case.name}.page", (case / "report.html").read_text(encoding="utf-8"))
        render_index(out)
        found |= said("index.page", (out / "index.html").read_text(encoding="utf-8"))
        for number, paper in enumerate(pdf._pages(out, tables.read(out / "summary.csv", SUMMARY))):
            found |= {f"paper{number}.{name}": values for name, values in looks(paper.figure).items()}
        return found


def beside() -> Numbers:
    """The pages beside those of a run."""
    with tempfile.TemporaryDirectory() as folder, undrawn(), drawn() as found:
        out = write_run(Path(folder) / "out", CASES[:1])
        for path in write_pages(out, Path(folder)):
            found |= said(f"{path.stem}.page", path.read_text(encoding="utf-8"))
        return found


def figures() -> Numbers:
    """Figures of a wire that is far off, whose skills need an axis of their own."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        (case,) = find_cases(write_run(Path(folder) / "out", [FakeCase("poor", frames=3, seed=9, error_mm=6.0)]))
        errors = tables.read(case / "errors.csv", ERRORS)
        tables.write(case / "errors.csv", ERRORS, errors.assign(skill=[-38.6, -2.0, 0.5], skill_strongest=-1.5))
        files = read_case(case)
        drawings = {name: draw(files) for name, draw in figures_of("case").items() if name not in TIMED}
    for name, drawing in drawings.items():
        if drawing is not None:
            found |= {f"{name}.{key}": values for key, values in looks(drawing.figure).items()}
    return found


SCENES: dict[str, Scene] = {"run": run, "beside": beside, "figures": figures}
