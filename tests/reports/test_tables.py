"""The tables: exact headers, empty for not applicable, read back as written, never half a file."""

from __future__ import annotations

import gzip
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reports import tables
from reports._content import quoted_first
from reports.atomic import replacing
from reports.schema import ERRORS, FAILURES, POINTS, SUMMARY, TIMINGS, Table

# the contract that other people's scripts rely on, typed again on purpose: a rename must be seen here
ERRORS_HEADER = (
    "frame,status,insertion_mm,roll_deg,rms_mm,mean_mm,p95_mm,max_mm,distal10_rms_mm,distal20_rms_mm,back_rms_mm,"
    "hausdorff_mm,arc_rms_mm,arc_max_mm,tip_mm,tip_angle_deg,tip_along_mm,tip_across_mm,depth_offset_mm,side_ok,"
    "branch_ok,null_centreline_rms_mm,null_shortest_rms_mm,null_min_bending_rms_mm,null_previous_rms_mm,"
    "null_roll_unknown_rms_mm,null_no_tip_curve_rms_mm,null_pinned_rms_mm,null_neighbours_rms_mm,skill,"
    "skill_strongest,strongest_null,coverage,trace_sigma_mm,tip_sigma_mm,max_penetration_mm,push_force_N,num_push_N,joints,"
    "iterations,num_mm,snaps,uncertain,least_pivot,u_input_mm,u_val_mm,share_beyond_2u,release,release_real,log_score_bits,"
    "energy_score_mm,released,released_at_mm,clamp_note,trace_mean_mm,"
    "trace_max_mm,trace_tip_mm,truth_rms_mm,truth_tip_mm"
)
POINTS_HEADER = "frame,arc_mm,x_mm,y_mm,z_mm,error_mm,foot_arc_mm,contact_force_N,u_val_mm,error_over_u,status"
SUMMARY_HEADER = (
    "case,group,role,status,frames,frames_ok,frames_failed,insertions,interval,effective_frames,rms_mm,"
    "release_frames,rms_calm_mm,releases_both,releases_missed,releases_spurious,rms_low_mm,rms_high_mm,mean_mm,"
    "p95_mm,max_mm,distal10_rms_mm,distal20_rms_mm,tip_median_mm,tip_low_mm,tip_high_mm,arc_rms_mm,"
    "arc_offset_rms_mm,null_centreline_rms_mm,null_shortest_rms_mm,null_min_bending_rms_mm,null_previous_rms_mm,"
    "skill,skill_low,skill_high,skill_strongest,skill_strongest_low,skill_strongest_high,strongest_null,"
    "null_another_rms_mm,frame_spacing_mm,branch_ok_fraction,coverage,within_1mm,trace_mean_median_mm,"
    "trace_tip_median_mm,truth_rms_mm,max_penetration_mm,push_force_max_N,strongest_frames,frames_fitted,ends_rank,"
    "strongest_insertions,warnings,skill_frames,back_rms_mm,tip_max_mm,"
    "tip_along_median_mm,tip_across_median_mm,depth_offset_mm,side_ok,null_roll_unknown_rms_mm,null_no_tip_curve_rms_mm,"
    "null_pinned_rms_mm,null_neighbours_rms_mm,trace_sigma_mm,num_push_max_N,num_mm,u_input_mm,u_val_mm,"
    "share_beyond_2u,log_score_bits,energy_score_mm"
)
TIMINGS_HEADER = "case,frame,load_s,segment_s,trace_s,clamp_s,simulate_s,compare_s,total_s,peak_memory_MiB"
FAILURES_HEADER = "case,frame,stage,status,sentence,message,log,simulator"


def test_the_number_to_quote_stands_before_what_a_narrow_window_cuts_off() -> None:
    """On pages alone: columns of files keep their order."""
    names = [column.name for column in quoted_first(SUMMARY.shown("cases"))]
    for later in ("distal10_rms_mm", "tip_median_mm", "skill"):
        assert names.index("rms_mm") < names.index("skill_strongest") < names.index(later)
    assert names.index("strongest_null") == names.index("skill_strongest") + 1
    assert sorted(names) == sorted(column.name for column in SUMMARY.shown("cases"))


def _header(path: Path) -> str:
    return path.read_text(encoding="utf-8").splitlines()[0]


def test_headers_are_the_contract(tmp_path: Path) -> None:
    tables.write(tmp_path / "errors.csv", ERRORS, [])
    tables.write(tmp_path / "summary.csv", SUMMARY, [])
    tables.write(tmp_path / "failures.csv", FAILURES, [])
    tables.write(tmp_path / "timings.csv", TIMINGS, [])
    tables.write(tmp_path / "points.csv.gz", POINTS, {})
    assert _header(tmp_path / "errors.csv") == ERRORS_HEADER
    assert _header(tmp_path / "summary.csv") == SUMMARY_HEADER
    assert _header(tmp_path / "failures.csv") == FAILURES_HEADER
    assert _header(tmp_path / "timings.csv") == TIMINGS_HEADER
    assert gzip.decompress((tmp_path / "points.csv.gz").read_bytes()).decode() == POINTS_HEADER + "\n"


@pytest.mark.parametrize("table", [ERRORS, POINTS, SUMMARY])
def test_units_are_in_the_names(table: Table) -> None:
    for column in table:
        suffix = column.name.rsplit("_", 1)[-1]
        assert (suffix == column.unit) == (column.unit not in ("1", "-")), column
        assert column.meaning


def test_not_applicable_is_empty_and_zero_stays_zero(tmp_path: Path) -> None:
    path = tmp_path / "errors.csv"
    rows = [
        {"frame": 0, "status": "ok", "rms_mm": 0.0, "branch_ok": True, "iterations": 0},
        {"frame": 1, "status": "no_wire", "rms_mm": math.nan, "branch_ok": None, "joints": math.nan},
    ]
    tables.write(path, ERRORS, rows)
    first, second = path.read_text(encoding="utf-8").splitlines()[1:]
    assert first.startswith("0,ok,,,0,")
    assert second.replace(",", "") == "1no_wire"
    back = tables.read(path, ERRORS)
    assert back["rms_mm"][0] == 0.0
    assert math.isnan(back["rms_mm"][1])
    assert back["iterations"][0] == 0
    assert back["iterations"].isna()[1]
    assert bool(back["branch_ok"][0]) is True
    assert back["branch_ok"].isna()[1]


def test_unknown_column_is_refused_with_a_suggestion(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"rmse_mm.*did you mean rms_mm"):
        tables.write(tmp_path / "errors.csv", ERRORS, [{"frame": 0, "rmse_mm": 1.0}])
    assert not list(tmp_path.iterdir())


def test_a_table_of_other_columns_is_refused(tmp_path: Path) -> None:
    """It was one of frames without numbers."""
    (tmp_path / "errors.csv").write_text("x,y\n1,2\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"errors.csv: .*none of the columns"):
        tables.read(tmp_path / "errors.csv", ERRORS)


def test_unequal_points_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="differ in length"):
        tables.write(tmp_path / "points.csv.gz", POINTS, {"frame": [0, 0], "arc_mm": [0.0]})


def test_messages_with_commas_quotes_and_new_lines_survive(tmp_path: Path) -> None:
    message = 'trace: "case" 07, frame 12:\n3 components; lower trace.x'
    tables.write(tmp_path / "failures.csv", FAILURES, [{"case": "a,b", "frame": 12, "message": message}])
    back = tables.read(tmp_path / "failures.csv", FAILURES)
    assert back["message"][0] == message
    assert back["case"][0] == "a,b"


def test_a_text_that_looks_like_nothing_is_kept(tmp_path: Path) -> None:
    tables.write(tmp_path / "summary.csv", SUMMARY, [{"case": "NA", "group": "null", "frames": 3}])
    back = tables.read(tmp_path / "summary.csv", SUMMARY)
    assert back["case"].tolist() == ["NA"]
    assert back["group"].tolist() == ["null"]


def test_a_wrong_field_names_its_file(tmp_path: Path) -> None:
    path = tmp_path / "errors.csv"
    path.write_text("frame,rms_mm\n0,abc\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"errors\.csv"):
        tables.read(path, ERRORS)


@settings(max_examples=30, deadline=None)
@given(error=st.lists(st.floats(0, 1e6), min_size=1, max_size=20), force=st.floats(-1e3, 1e3) | st.just(math.nan))
def test_points_read_back(tmp_path_factory: pytest.TempPathFactory, error: list[float], force: float) -> None:
    path = tmp_path_factory.mktemp("points") / "points.csv.gz"
    frame = np.arange(len(error)) // 3
    forces = np.full(len(error), force)
    tables.write(path, POINTS, {"frame": frame, "error_mm": np.array(error), "contact_force_N": forces})
    first = path.read_bytes()
    back = tables.read(path, POINTS)
    np.testing.assert_array_equal(back["frame"].to_numpy(dtype=int), frame)
    np.testing.assert_allclose(back["error_mm"].to_numpy(), error, rtol=1e-8)
    np.testing.assert_allclose(back["contact_force_N"].to_numpy(), forces, rtol=1e-8)
    tables.write(path, POINTS, back)
    assert path.read_bytes() == first, "writing what was read gives the same bytes"


def test_an_interrupted_write_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "errors.csv"
    tables.write(path, ERRORS, [{"frame": 0}])
    before = path.read_text(encoding="utf-8")
    with pytest.raises(RuntimeError):
        _fail_half_way(path)
    assert path.read_text(encoding="utf-8") == before
    assert [p.name for p in tmp_path.iterdir()] == ["errors.csv"]


def _fail_half_way(path: Path) -> None:
    with replacing(path) as temporary:
        temporary.write_text("half", encoding="utf-8")
        raise RuntimeError


def test_extra_columns_are_kept_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "errors.csv"
    pd.DataFrame({"mine": ["x"], "frame": [3]}).to_csv(path, index=False)
    back = tables.read(path, ERRORS)
    assert list(back.columns) == [*ERRORS_HEADER.split(","), "mine"]


def test_rows_are_written_as_a_frame_of_them_is(tmp_path: Path) -> None:
    """Rows are written without pandas: not one byte is another."""
    texts = ["plain", "=formula", "-1.5", "- not a number", 'with, "marks"\nand lines', "'=held", "", None]
    numbers = [-0.0, 1 / 3, 1e-12, 1e300, 7, math.nan, math.inf, np.float64(2.5)]
    whole = [0, -3, None, np.int64(12), 10**12, 5, 6, 7]
    said = [True, None, np.bool_(False), False, True, None, True, False]
    of = {"text": texts, "float": numbers, "integer": whole, "boolean": said}
    for table in (ERRORS, SUMMARY):
        rows = [{c.name: of[c.kind][(n + k) % 8] for k, c in enumerate(table)} for n in range(8)]
        del rows[1][table.names[3]]
        frame = pd.DataFrame([dict(row) for row in rows], columns=list(table.names), dtype=object)
        tables.write(tmp_path / "rows.csv", table, rows)
        tables.write(tmp_path / "frame.csv", table, frame)
        written = (tmp_path / "rows.csv").read_bytes()
        assert written == (tmp_path / "frame.csv").read_bytes()
        assert b"'=formula" in written
        assert b",-0," not in written


@pytest.mark.parametrize("row", [{"frame": 1.0}, {"frame": True}, {"rms_mm": "0.1"}, {"rms_mm": False}, {"status": 3}])
def test_a_value_of_another_kind_is_refused_by_name(tmp_path: Path, row: dict[str, object]) -> None:
    ((name, value),) = row.items()
    with pytest.raises(ValueError, match=f"errors.csv: {name}: got {value!r}; allowed"):
        tables.write(tmp_path / "errors.csv", ERRORS, [row])
