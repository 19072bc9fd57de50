"""From the case folders found in OUT to summary.csv, failures.csv and run.json: merging is copying folders together."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import results
from pipeline.summary import intervals, pooled_rms
from reports import tables
from reports.schema import FAILURES, POINTS, SUMMARY, Table


@dataclass(frozen=True)
class Totals:
    """The numbers of the last line."""

    cases: int
    cases_ok: int
    frames: int
    frames_ok: int
    median_mm: float
    p95_mm: float
    solver_s: float

    @property
    def all_ok(self) -> bool:
        """The one source of the exit code and of the printed counts."""
        return self.cases > 0 and self.cases_ok == self.cases


def found_results(out: Path) -> list[dict[str, Any]]:
    """result.json of every case below OUT, by id."""
    paths = sorted((out / "cases").glob("*/result.json"))
    return [json.loads(path.read_text(encoding="utf-8")) for path in paths]


def _only(row: dict[str, Any], table: Table) -> dict[str, Any]:
    allowed = set(table.names)
    return {k: v for k, v in row.items() if k in allowed}


def _point_errors(out: Path, case: str) -> Any:
    path = out / "cases" / case / "points.csv.gz"
    return tables.read(path, POINTS)["error_mm"].to_numpy() if path.exists() else np.zeros(0)


def overall(out: Path, found: list[dict[str, Any]], draws: int = 2000) -> dict[str, Any]:
    """Pooled error of the validation cases, with an interval from resampling whole groups (three or more of them)."""
    rows, groups = [], []
    for result in found:
        row = result["summary"]
        errors = _point_errors(out, result["case"])
        if row.get("role", "validation") == "validation" and errors.size:
            rows.append((errors.size, float(np.sum(errors**2))))
            groups.append(row.get("group") or result["case"])
    if not rows:
        return {}
    table = np.array(rows)
    units = [np.flatnonzero([g == name for g in groups]) for name in dict.fromkeys(groups)]
    (low, high), *_ = intervals(table, units, (pooled_rms,), draws)
    return {
        "rms_mm": pooled_rms(table),
        "rms_low_mm": low,
        "rms_high_mm": high,
        "groups": len(units),
        "cases": len(rows),
    }


def aggregate(out: Path, run_info: dict[str, Any] | None = None, name: str = "run.json") -> Totals:
    """Write summary.csv and failures.csv over all cases found, and ``name`` where ``run_info`` is given."""
    found = found_results(out)
    rows = [result["summary"] for result in found]
    tables.write(out / "summary.csv", SUMMARY, [_only(row, SUMMARY) for row in rows])
    failures = [row for result in found for row in result["failures"]]
    tables.write(out / "failures.csv", FAILURES, [_only(row, FAILURES) for row in failures])
    if run_info is not None:
        info = run_info | {"cases": [row["case"] for row in rows], "overall": overall(out, found)}
        results.write_json(out / name, info)
    errors = [_point_errors(out, row["case"]) for row in rows]
    points = np.concatenate(errors) if errors else np.zeros(0)
    return Totals(
        len(rows),
        sum(row["status"] == "ok" for row in rows),
        sum(row["frames"] for row in rows),
        sum(row["frames_ok"] for row in rows),
        float(np.median(points)) if points.size else float("nan"),
        float(np.percentile(points, 95)) if points.size else float("nan"),
        sum(row.get("simulate_s") or 0.0 for row in rows),
    )
