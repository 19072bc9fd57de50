"""A point of a sweep in which frames fail is said: its row of the table is over the others, or empty."""

from __future__ import annotations

from pathlib import Path

from reports import tables
from reports.run_page import render_index
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


def test_a_point_with_fewer_frames_is_said_beside_the_table(tmp_path: Path) -> None:
    """12 of 15 frames were ok: not a word, and its rms_mm, over the easier ones, was better."""
    out = write_run(tmp_path / "out", (FakeCase("a", frames=3),))
    plain = (UNCHANGED, "", "a", 5), (UNCHANGED, "", "b", 10), (UNCHANGED, "", "(all)", 15)
    fewer = ("k", "1", "a", 5), ("k", "1", "b", 7), ("k", "1", "(all)", 12), ("k", "2", "a", 0), ("k", "2", "b", 1)
    as_many = ("k", "3", "a", 5), ("k", "3", "b", 10), ("k", "3", "(all)", 15)
    first, second = silent_points(tables.read(_written(out, *plain, *fewer, *as_many), SWEEP))
    assert first.startswith("sweep point k = 1: 12 frames are ok, 15 in the plain result: its rms_mm, ")
    assert "over those alone, its rms_ratio and skill_strongest over the frames that are ok in both" in first
    assert second.startswith("sweep point k = 2: 1 frame is ok, 15 in the plain result: ")
    page = render_index(out).read_text(encoding="utf-8")
    assert all(text[1:] in page for text in (first, second))


def test_a_case_that_was_not_swept_is_no_lost_frame(tmp_path: Path) -> None:
    """What lacks its result at a point is said elsewhere; a sweep of one case of two lacks nothing."""
    file = _written(tmp_path, (UNCHANGED, "", "a", 1), (UNCHANGED, "", "b", 2), ("k", "1", "b", 2))
    assert silent_points(tables.read(file, SWEEP)) == []
    file = _written(tmp_path, (UNCHANGED, "", "b", 1), ("k", "1", "b", 3))
    assert silent_points(tables.read(file, SWEEP)) == []


def test_of_a_study_without_scans_no_point_is_said(tmp_path: Path) -> None:
    file = _written(tmp_path, (UNCHANGED, "", "a", 0), ("k", "1", "a", 0))
    assert silent_points(tables.read(file, SWEEP)) == []
    assert silent_points(tables.read(file, SWEEP).iloc[:0]) == []
