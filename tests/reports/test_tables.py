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

from reports import schema, tables
from reports.atomic import replacing

# the contract that other people's scripts rely on, typed again on purpose: a rename must be seen here
ERRORS_HEADER = (
    "frame,status,insertion_mm,roll_deg,rms_mm,mean_mm,p95_mm,max_mm,back_rms_mm,hausdorff_mm,arc_rms_mm,"
    "arc_max_mm,tip_mm,tip_angle_deg,branch_ok,null_centreline_rms_mm,null_shortest_rms_mm,"
    "null_min_bending_rms_mm,null_previous_rms_mm,skill,coverage,trace_sigma_mm,max_penetration_mm,"
    "push_force_N,joints,iterations,load_s,segment_s,trace_s,simulate_s,compare_s,trace_mean_mm,"
    "trace_max_mm,trace_tip_mm,truth_rms_mm,truth_tip_mm"
)
POINTS_HEADER = "frame,arc_mm,x_mm,y_mm,z_mm,error_mm,foot_arc_mm,contact_force_N"
SUMMARY_HEADER = (
    "case,group,role,status,frames,frames_ok,frames_failed,rms_mm,rms_low_mm,rms_high_mm,mean_mm,p95_mm,"
    "max_mm,tip_median_mm,tip_low_mm,tip_high_mm,arc_rms_mm,null_centreline_rms_mm,null_shortest_rms_mm,"
    "null_min_bending_rms_mm,null_previous_rms_mm,skill,skill_low,skill_high,branch_ok_fraction,coverage,"
    "trace_mean_median_mm,trace_tip_median_mm,truth_rms_mm,max_penetration_mm,push_force_max_N,load_s,"
    "segment_s,trace_s,simulate_s,compare_s,total_s,peak_memory_MiB"
)
FAILURES_HEADER = "case,frame,stage,status,sentence,message,log"


def _header(path: Path) -> str:
    return path.read_text(encoding="utf-8").splitlines()[0]


def test_headers_are_the_contract(tmp_path: Path) -> None:
    tables.write_errors(tmp_path / "errors.csv", [])
    tables.write_summary(tmp_path / "summary.csv", [])
    tables.write_failures(tmp_path / "failures.csv", [])
    tables.write_points(tmp_path / "points.csv.gz", {})
    assert _header(tmp_path / "errors.csv") == ERRORS_HEADER
    assert _header(tmp_path / "summary.csv") == SUMMARY_HEADER
    assert _header(tmp_path / "failures.csv") == FAILURES_HEADER
    assert gzip.decompress((tmp_path / "points.csv.gz").read_bytes()).decode() == POINTS_HEADER + "\n"


@pytest.mark.parametrize("columns", [schema.ERRORS_COLUMNS, schema.POINTS_COLUMNS, schema.SUMMARY_COLUMNS])
def test_units_are_in_the_names(columns: tuple[schema.Column, ...]) -> None:
    for column in columns:
        suffix = column.name.rsplit("_", 1)[-1]
        assert (suffix == column.unit) == (column.unit not in ("1", "-")), column
        assert column.meaning


def test_not_applicable_is_empty_and_zero_stays_zero(tmp_path: Path) -> None:
    path = tmp_path / "errors.csv"
    rows = [
        {"frame": 0, "status": "ok", "rms_mm": 0.0, "branch_ok": True, "iterations": 0},
        {"frame": 1, "status": "no_wire", "rms_mm": math.nan, "branch_ok": None, "joints": math.nan},
    ]
    tables.write_errors(path, rows)
    first, second = path.read_text(encoding="utf-8").splitlines()[1:]
    assert first.startswith("0,ok,,,0,")
    assert second.replace(",", "") == "1no_wire"
    back = tables.read_errors(path)
    assert back["rms_mm"][0] == 0.0
    assert math.isnan(back["rms_mm"][1])
    assert back["iterations"][0] == 0
    assert back["iterations"].isna()[1]
    assert bool(back["branch_ok"][0]) is True
    assert back["branch_ok"].isna()[1]


def test_unknown_column_is_refused_with_a_suggestion(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"rmse_mm.*did you mean rms_mm"):
        tables.write_errors(tmp_path / "errors.csv", [{"frame": 0, "rmse_mm": 1.0}])
    assert not list(tmp_path.iterdir())


def test_unequal_points_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="differ in length"):
        tables.write_points(tmp_path / "points.csv.gz", {"frame": [0, 0], "arc_mm": [0.0]})


def test_messages_with_commas_quotes_and_new_lines_survive(tmp_path: Path) -> None:
    message = 'trace: "case" 07, frame 12:\n3 components; lower trace.x'
    tables.write_failures(tmp_path / "failures.csv", [{"case": "a,b", "frame": 12, "message": message}])
    back = tables.read_failures(tmp_path / "failures.csv")
    assert back["message"][0] == message
    assert back["case"][0] == "a,b"


def test_a_text_that_looks_like_nothing_is_kept(tmp_path: Path) -> None:
    tables.write_summary(tmp_path / "summary.csv", [{"case": "NA", "group": "null", "frames": 3}])
    back = tables.read_summary(tmp_path / "summary.csv")
    assert back["case"].tolist() == ["NA"]
    assert back["group"].tolist() == ["null"]


def test_a_wrong_field_names_its_file(tmp_path: Path) -> None:
    path = tmp_path / "errors.csv"
    path.write_text("frame,rms_mm\n0,abc\n")
    with pytest.raises(ValueError, match=r"errors\.csv"):
        tables.read_errors(path)


@settings(max_examples=30, deadline=None)
@given(
    error=st.lists(st.floats(0, 1e6), min_size=1, max_size=20),
    force=st.floats(-1e3, 1e3) | st.just(math.nan),
)
def test_points_read_back(tmp_path_factory: pytest.TempPathFactory, error: list[float], force: float) -> None:
    path = tmp_path_factory.mktemp("points") / "points.csv.gz"
    frame = np.arange(len(error)) // 3
    forces = np.full(len(error), force)
    tables.write_points(path, {"frame": frame, "error_mm": np.array(error), "contact_force_N": forces})
    first = path.read_bytes()
    back = tables.read_points(path)
    np.testing.assert_array_equal(back["frame"].to_numpy(dtype=int), frame)
    np.testing.assert_allclose(back["error_mm"].to_numpy(), error, rtol=1e-8)
    np.testing.assert_allclose(back["contact_force_N"].to_numpy(), forces, rtol=1e-8)
    tables.write_table(path, back, schema.POINTS_COLUMNS)
    assert path.read_bytes() == first, "writing what was read gives the same bytes"


def test_an_interrupted_write_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "errors.csv"
    tables.write_errors(path, [{"frame": 0}])
    before = path.read_text(encoding="utf-8")
    with pytest.raises(RuntimeError):
        _fail_half_way(path)
    assert path.read_text(encoding="utf-8") == before
    assert [p.name for p in tmp_path.iterdir()] == ["errors.csv"]


def _fail_half_way(path: Path) -> None:
    with replacing(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError


def test_extra_columns_are_kept_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "errors.csv"
    pd.DataFrame({"mine": ["x"], "frame": [3]}).to_csv(path, index=False)
    back = tables.read_errors(path)
    assert list(back.columns) == [*ERRORS_HEADER.split(","), "mine"]
