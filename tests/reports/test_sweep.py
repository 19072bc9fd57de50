"""A point of a sweep in which every frame fails is said: its row of the table is empty."""

from __future__ import annotations

from pathlib import Path

from reports import tables
from reports.html import render_index
from reports.schema import SWEEP
from reports.sweep import UNCHANGED, silent_points
from tests.reports.fake_results import FakeCase, write_run


def _written(out: Path, *rows: tuple[str, str, str, int | None]) -> Path:
    columns = "parameter", "value", "case", "frames_ok"
    tables.write(out / SWEEP.file, SWEEP, [dict(zip(columns, row, strict=True)) for row in rows])
    return out / SWEEP.file


def test_a_point_without_a_frame_is_said_beside_the_table(tmp_path: Path) -> None:
    out = write_run(tmp_path / "out", (FakeCase("a", frames=3),))
    name = "solver.max_iterations"
    file = _written(out, (UNCHANGED, "", "a", 3), (name, "1", "a", 0), (name, "2", "a", None), (name, "400", "a", 3))
    said = [f"sweep point {name} = {value}: no frame is ok" for value in (1, 2)]
    assert silent_points(tables.read(file, SWEEP)) == said
    page = render_index(out).read_text(encoding="utf-8")
    assert all(text[1:] in page for text in said)


def test_a_point_of_which_a_case_has_a_frame_is_not_silent(tmp_path: Path) -> None:
    file = _written(tmp_path, (UNCHANGED, "", "a", 1), ("k", "1", "a", 0), ("k", "1", "b", 2))
    assert silent_points(tables.read(file, SWEEP)) == []


def test_of_a_study_without_scans_no_point_is_said(tmp_path: Path) -> None:
    file = _written(tmp_path, (UNCHANGED, "", "a", 0), ("k", "1", "a", 0))
    assert silent_points(tables.read(file, SWEEP)) == []
    assert silent_points(tables.read(file, SWEEP).iloc[:0]) == []
