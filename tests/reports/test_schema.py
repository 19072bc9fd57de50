"""The schema: a column registered from outside is in every table, page and figure; the declared ones fit together."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from reports import diff, tables
from reports.case_files import read_case
from reports.case_page import render_case
from reports.figures import Drawing, figures_of
from reports.figures._style import LINES, predictors
from reports.result_file import COUNTED
from reports.run_page import render_index
from reports.schema import ERRORS, PLACES, SUMMARY, SWEEP, Column, Table, predictor
from tests.reports.fake_results import FakeCase, write_run
from tests.unseen import scarce as scarce

CASE_FIGURES = figures_of("case")


@pytest.fixture(autouse=True)
def _columns_as_declared(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a test registers is gone after it."""
    for table in (ERRORS, SUMMARY):
        monkeypatch.setattr(table, "columns", table.columns)


def _run_with(folder: Path, column: Column, value: float) -> Path:
    """A run whose files hold the column, written by nothing but the tables' own writer."""
    out = write_run(folder / "out", (FakeCase("c", frames=4), FakeCase("d", frames=3)))
    for path, table, name in (
        *((out / "cases" / case / "errors.csv", ERRORS, column.name) for case in "cd"),
        (out / "summary.csv", SUMMARY, column.pooled_name),
    ):
        rows = tables.read(path, table).astype(object)
        rows[name] = value
        tables.write(path, table, rows.where(rows.notna(), None).to_dict("records"))
    return out


def _legend(drawing: Drawing | None) -> dict[str, str]:
    assert drawing is not None
    handles, labels = drawing.figure.axes[0].get_legend_handles_labels()
    return {label: str(handle.get_color()) for handle, label in zip(handles, labels, strict=True)}


@pytest.mark.usefixtures("scarce")
def test_a_metric_from_outside_is_one_registration(tmp_path: Path) -> None:
    shown = {"frames": "", "error_by_depth": "area between the wires"}
    area = Column(
        "area_mm", "mm", "area between the wires over their length", better="low", pooled="median", shown=shown
    )
    ERRORS.add(area)
    assert (ERRORS.names[-1], SUMMARY.names[-1]) == ("area_mm", "area_median_mm")
    out = _run_with(tmp_path, area, 0.125)
    assert "area_mm" in (out / "cases" / "c" / "errors.csv").read_text(encoding="utf-8").splitlines()[0]
    assert "area_median_mm" in (out / "summary.csv").read_text(encoding="utf-8").splitlines()[0]
    page = render_case(out / "cases" / "c").read_text(encoding="utf-8")
    assert 'title="area between the wires over their length [mm]">area_<wbr>mm</button></th>' in page
    assert page.count("<td>0.125</td>") == 4
    index = render_index(out).read_text(encoding="utf-8")
    assert "median over frames [mm]" in index
    assert index.count("<td>0.125</td>") == 2
    drawing = CASE_FIGURES["error_by_depth"](read_case(out / "cases" / "c"))
    assert drawing is not None
    colours = _legend(drawing)
    assert list(colours.values()).count(colours["area between the wires"]) == 1, "a colour of its own"
    assert (drawing.table["area_mm"] == 0.125).all()
    worse = diff.diff_tables(
        *({"c": pd.DataFrame({"frame": [0], "status": ["ok"], "area_mm": [v]})} for v in (0.1, 0.2)), {"area_mm": 0.05}
    )
    assert worse.regressions["column"].tolist() == ["area_mm"]


@pytest.mark.usefixtures("scarce")
def test_a_predictor_from_outside_is_one_registration(tmp_path: Path) -> None:
    median = predictor("median_frame", "median frame", "the traced wire of the median frame")
    ERRORS.add(median)
    out = _run_with(tmp_path, median, 0.75)
    case = read_case(out / "cases" / "c")
    found = {label: (colour, str(style), marker) for _, label, colour, style, marker in predictors()}
    assert len(found) == len(set(found.values())) == 5
    assert len({colour for colour, *_ in found.values()}) == 5
    lines = _legend(CASE_FIGURES["error_by_depth"](case))
    assert lines["predictor: median frame"] == found["median frame"][0]
    page = render_case(case.folder).read_text(encoding="utf-8")
    assert "rms_mm of a trivial predictor: the traced wire of the median frame [mm]" in page
    assert "null_<wbr>median_<wbr>frame_<wbr>rms_<wbr>mm" in render_index(out).read_text(encoding="utf-8")
    case.result["summary"]["null_median_frame_rms_mm"] = 0.75
    drawing = CASE_FIGURES["skill_by_depth"](case)
    assert drawing is not None
    assert "median frame" in [text.get_text() for text in drawing.figure.axes[1].get_yticklabels()]


def test_many_predictors_still_have_lines() -> None:
    for i in range(9):
        ERRORS.add(predictor(f"guess_{i}", f"guess {i}", "anything"))
    assert len(list(predictors())) == 13


@pytest.mark.parametrize("table", [SUMMARY, SWEEP])
def test_what_is_counted_as_ok_is_what_is_said(table: Table) -> None:
    """A case without scans counts its simulated frames, of which "traced and compared" was said."""
    assert COUNTED == ("ok", "simulated")
    assert table["frames_ok"].meaning.endswith("of a case without scans or traces those that were simulated")


def test_a_column_goes_to_the_end() -> None:
    ERRORS.add(Column("own_mm", "mm", "anything"))
    assert ERRORS.names[-1] == "own_mm"
    assert "own_mm" not in SUMMARY.names, "it is not pooled"


@pytest.mark.parametrize(
    "change", [{"pooled": "sum of squares"}, {"shown": {"frame": ""}}, {"kind": "int"}, {"better": "lower"}]
)
def test_what_would_be_ignored_in_silence_is_refused(change: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"column x_mm: got .* known are"):
        Column("x_mm", "mm", "anything", **change)  # type: ignore[arg-type]


def test_a_name_is_taken_once() -> None:
    with pytest.raises(ValueError, match=r"errors\.csv has a column 'rms_mm'"):
        ERRORS.add(Column("rms_mm", "mm", "another one"))
    with pytest.raises(KeyError):
        ERRORS["rmse_mm"]


def test_every_pooled_column_has_its_place_in_the_summary() -> None:
    names = {column.name: column.pooled_name for column in ERRORS if column.pooled}
    assert set(names.values()) <= set(SUMMARY.names)
    changed = {name: pooled for name, pooled in names.items() if name != pooled}
    assert changed == {
        "tip_mm": "tip_median_mm",
        "tip_along_mm": "tip_along_median_mm",
        "tip_across_mm": "tip_across_median_mm",
        "branch_ok": "branch_ok_fraction",
        "trace_mean_mm": "trace_mean_median_mm",
        "trace_tip_mm": "trace_tip_median_mm",
        "push_force_N": "push_force_max_N",
        "num_push_N": "num_push_max_N",
    }


def test_what_is_declared_is_used() -> None:
    assert {c.style for c in ERRORS if c.style} == set(LINES)
    assert {place for table in (ERRORS, SUMMARY) for c in table for place in c.shown} == set(PLACES)
