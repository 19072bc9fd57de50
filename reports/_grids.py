"""What the pages show of the tables: which columns, under which heading, with what marked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from reports._format import NOTHING, interval, number
from reports.case_files import GOOD
from reports.schema import ERRORS_COLUMNS, SUMMARY_COLUMNS, SWEEP_COLUMNS, Column

Grid = dict[str, Any]
_FRAME_COLUMNS = (
    "frame",
    "status",
    "insertion_mm",
    "rms_mm",
    "p95_mm",
    "max_mm",
    "arc_rms_mm",
    "tip_mm",
    "tip_angle_deg",
    "branch_ok",
    "null_centreline_rms_mm",
    "skill",
    "trace_sigma_mm",
    "trace_mean_mm",
    "trace_tip_mm",
    "truth_rms_mm",
    "max_penetration_mm",
    "push_force_N",
    "iterations",
    "simulate_s",
)
_CASE_COLUMNS = (
    "case",
    "role",
    "status",
    "frames",
    "frames_ok",
    "rms_mm",
    "p95_mm",
    "tip_median_mm",
    "null_centreline_rms_mm",
    "skill",
    "truth_rms_mm",
    "total_s",
)
# shown as value (low to high)
_INTERVALS = {
    "rms_mm": ("rms_low_mm", "rms_high_mm"),
    "tip_median_mm": ("tip_low_mm", "tip_high_mm"),
    "skill": ("skill_low", "skill_high"),
}
_CARDS = (
    ("frames_ok", "frames with a result"),
    ("rms_mm", "mm rms, simulated to traced wire"),
    ("tip_median_mm", "mm, tip distance of the median frame"),
    ("skill", "skill: 1 perfect, 0 no better than the centreline"),
    ("null_centreline_rms_mm", "mm rms of the centreline as predictor"),
    ("truth_rms_mm", "mm rms, simulated to true wire"),
    ("trace_mean_median_mm", "mm, trace to true wire, mean of the median frame"),
    ("max_penetration_mm", "mm, deepest overlap with the wall"),
    ("push_force_max_N", "N, largest push force"),
    ("total_s", "s in all"),
    ("peak_memory_MiB", "MiB of memory at most"),
)


def cards(statistics: Mapping[str, Any]) -> list[dict[str, str]]:
    """The numbers at the head of a case's page; those that do not apply are left out."""
    shown = []
    for name, label in _CARDS:
        value = number(statistics.get(name))
        if value != NOTHING:
            shown.append({"value": value, "label": _with_detail(name, label, statistics)})
    return shown


def overall(pooled: Mapping[str, Any]) -> list[dict[str, str]]:
    """The one number over all validation cases, with what it rests on."""
    if number(pooled.get("rms_mm")) == NOTHING:
        return []
    label = "mm rms, simulated to traced wire, all validation cases"
    groups = f"{pooled.get('cases', 0)} / {pooled.get('groups', 0)}"
    first = {"value": number(pooled["rms_mm"]), "label": _with_detail("rms_mm", label, pooled)}
    return [
        first,
        {"value": groups, "label": "validation cases / groups of them, which the interval resamples"},
    ]


def frames(errors: pd.DataFrame) -> Grid:
    """One row per frame; columns without any value are left out."""
    grid = _grid(errors, ERRORS_COLUMNS, _FRAME_COLUMNS)
    for row, status in zip(grid["rows"], errors["status"], strict=True):
        row["bad"] = status not in GOOD
    return grid


def cases(summary: pd.DataFrame, links: Mapping[str, str]) -> Grid:
    """One row per case, linked to its page."""
    grid = _grid(summary, SUMMARY_COLUMNS, _CASE_COLUMNS)
    for row, name, failed in zip(grid["rows"], summary["case"], summary["frames_failed"], strict=True):
        row["cells"][0]["link"] = links.get(name, "")
        row["bad"] = failed is not pd.NA and failed > 0
    return grid


def sweep(table: pd.DataFrame) -> Grid:
    """One row per value and case."""
    return _grid(table, SWEEP_COLUMNS, [c.name for c in SWEEP_COLUMNS])


def _grid(table: pd.DataFrame, columns: Sequence[Column], chosen: Sequence[str]) -> Grid:
    by_name = {c.name: c for c in columns}
    kept = [by_name[name] for name in chosen if table[name].notna().any()]
    heads = [{"name": c.name, "meaning": _meaning(c), "text": c.kind == "text"} for c in kept]
    rows = []
    for record in table.to_dict("records"):
        cells = [_cell(record, c) for c in kept]
        rows.append({"cells": cells, "bad": False})
    return {"columns": heads, "rows": rows}


def _cell(record: Mapping[Any, Any], column: Column) -> dict[str, Any]:
    value = number(record[column.name]).replace(NOTHING, "")
    low, high = _INTERVALS.get(column.name, ("", ""))
    detail = interval(record.get(low), record.get(high))
    return {"value": value, "detail": detail, "text": column.kind == "text", "link": ""}


def _meaning(column: Column) -> str:
    return f"{column.meaning} [{column.unit}]" if column.unit not in ("-", "1") else column.meaning


def _with_detail(name: str, label: str, statistics: Mapping[str, Any]) -> str:
    if name == "frames_ok" and "frames" in statistics:
        return f"of {statistics['frames']} {label}"
    ends = _INTERVALS.get(name)
    detail = interval(statistics.get(ends[0]), statistics.get(ends[1])) if ends else ""
    return f"{label} (95 %: {detail})" if detail else label
