"""What the pages show of the tables: headings with their meanings, cells with their intervals, cards."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import pandas as pd

from reports._format import NOTHING, interval, number
from reports.case_files import GOOD
from reports.schema import ERRORS, SUMMARY, SWEEP, Column

Grid = dict[str, Any]


def cards(entries: Iterable[Mapping[str, str]], statistics: Mapping[str, Any]) -> list[dict[str, str]]:
    """The numbers at the head of a page; those that do not apply are left out.

    entries : ``column`` and ``label`` of each, as in sections.toml; ``of`` names the column of a total.
    """
    shown = []
    for entry in entries:
        column = SUMMARY[entry["column"]]
        value = number(statistics.get(column.name))
        if value != NOTHING:
            total = f"of {statistics[entry['of']]} " if entry.get("of") in statistics else ""
            ends = _interval(statistics, column)
            interval_95 = f" (95 %: {ends})" if ends else ""
            shown.append({"value": value, "label": f"{total}{entry['label']}{interval_95}"})
    return shown


def overall(pooled: Mapping[str, Any]) -> list[dict[str, str]]:
    """The one number over all validation cases, with what it rests on."""
    label = "mm rms, simulated to traced wire, all validation cases"
    first = cards([{"column": "rms_mm", "label": label}], pooled)
    groups = {
        "value": f"{pooled.get('cases', 0)} / {pooled.get('groups', 0)}",
        "label": "validation cases / groups of them, which the interval resamples",
    }
    return [*first, groups] if first else []


def frames(errors: pd.DataFrame) -> Grid:
    """One row per frame; columns without any value are left out."""
    return grid(errors, ERRORS.shown("frames", "work"), bad=~errors["status"].isin(GOOD))


def cases(summary: pd.DataFrame, links: Mapping[str, str]) -> Grid:
    """One row per case, linked to its page."""
    table = grid(summary, SUMMARY.shown("cases"), bad=(summary["frames_failed"] > 0).fillna(value=False))
    for row, name in zip(table["rows"], summary["case"], strict=True):
        row["cells"][0]["link"] = links.get(name, "")
    return table


def sweep(table: pd.DataFrame) -> Grid:
    """One row per value and case."""
    return grid(table, SWEEP.columns)


def grid(
    table: pd.DataFrame, columns: Sequence[Column], bad: Iterable[Any] | None = None, nothing: str = ""
) -> Grid:
    """Headings and rows for a template; columns without any value are left out.

    bad : for each row, whether it is marked.     nothing : what stands in an empty cell.
    """
    kept = [c for c in columns if table[c.name].notna().any()]
    marks = [False] * len(table) if bad is None else map(bool, bad)
    rows = [
        {"cells": [_cell(record, column, nothing) for column in kept], "bad": mark}
        for record, mark in zip(table.to_dict("records"), marks, strict=True)
    ]
    heads = [{"name": c.name, "meaning": _meaning(c), "text": c.kind == "text"} for c in kept]
    return {"columns": heads, "rows": rows}


def _cell(record: Mapping[Any, Any], column: Column, nothing: str) -> dict[str, Any]:
    value = number(record[column.name]).replace(NOTHING, nothing)
    return {"value": value, "detail": _interval(record, column), "text": column.kind == "text", "link": ""}


def _interval(record: Mapping[Any, Any], column: Column) -> str:
    """The 95 % interval of rms_mm, tip_median_mm, ...: what rms_low_mm, tip_low_mm, ... hold; empty without."""
    low, high = (column.with_word(end).replace("_median_", "_") for end in ("low", "high"))
    return interval(record.get(low), record.get(high))


def _meaning(column: Column) -> str:
    return f"{column.meaning} [{column.unit}]" if column.unit not in ("-", "1") else column.meaning
