"""From the case folders found in OUT to summary.csv, failures.csv and run.json: merging is copying folders together.

And to a JUnit summary for CI: one test a frame, so that a build server shows which frame failed and why.
"""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.compare.pooled import intervals, is_pooled, pooled_rms
from pipeline.model import Array
from pipeline.run.results import Result, found_results, lost, write_json
from reports import tables
from reports.atomic import write_bytes
from reports.schema import FAILURES, POINTS, SUMMARY

DRAWS = 2000
"""Resamples behind the interval over groups."""


@dataclass(frozen=True)
class Totals:
    """The numbers of the last line. Errors are those of all points of the frames that are pooled.

    sweep_lost : cases that crashed at a point of a sweep, which are none of ``cases``.
    """

    cases: int
    cases_ok: int
    frames: int
    frames_ok: int
    median_mm: float
    p95_mm: float
    solver_s: float
    sweep_lost: int = 0

    @property
    def all_ok(self) -> bool:
        """The one source of the exit code and of the printed counts."""
        return self.cases > 0 and self.cases_ok == self.cases and not self.sweep_lost


def aggregate(out: Path, run_info: dict[str, Any] | None = None, name: str = "run.json") -> Totals:
    """Write summary.csv and failures.csv over all cases found, and ``name`` where ``run_info`` is given."""
    readable = [_readable(out, result) for result in found_results(out)]
    found, errors = [result for result, _ in readable], [mm for _, mm in readable]
    rows = [result.summary for result in found]
    failures = [row for result in found for row in result.failures]
    for table, given in ((SUMMARY, rows), (FAILURES, failures)):
        # result files may come from another version, with other columns
        known = [{name: row[name] for name in row.keys() & table.names} for row in given]
        tables.write(out / table.file, table, known)
    if run_info is not None:
        info = {"cases": [result.case for result in found], "overall": overall(found, errors)}
        write_json(out / name, run_info | info)
    points = np.concatenate(errors) if errors else np.zeros(0)
    return Totals(
        len(rows),
        sum(result.ok for result in found),
        sum(row["frames"] for row in rows),
        sum(row["frames_ok"] for row in rows),
        float(np.median(points)) if points.size else float("nan"),
        float(np.percentile(points, 95)) if points.size else float("nan"),
        sum(row.get("simulate_s") or 0.0 for row in rows),
    )


def overall(found: Sequence[Result], errors: Sequence[Array], draws: int = DRAWS) -> dict[str, Any]:
    """Pooled error of the validation cases, with an interval from resampling whole groups (three or more of them).

    errors : of each result, its point errors (n,) of frames that count.
    """
    used = [(r, mm) for r, mm in zip(found, errors, strict=True) if r.role == "validation" and mm.size]
    if not used:
        return {}
    table = np.array([(mm.size, float(np.sum(mm**2))) for _, mm in used])
    groups = [result.group or result.case for result, _ in used]
    units = [np.flatnonzero([g == name for g in groups]) for name in dict.fromkeys(groups)]
    (low, high), *_ = intervals(table, units, (pooled_rms,), draws)
    return {
        "rms_mm": pooled_rms(table),
        "rms_low_mm": low,
        "rms_high_mm": high,
        "groups": len(units),
        "cases": len(used),
    }


def _readable(out: Path, result: Result) -> tuple[Result, Array]:
    """A result with its point errors; one whose points cannot be read is damaged, and hides no other."""
    try:
        return result, _point_errors(out, result)
    except (OSError, EOFError, ValueError, KeyError) as error:
        return lost(result.case, "damaged", f"{out / 'cases' / result.case / POINTS.file}: {error}"), np.zeros(0)


def _point_errors(out: Path, result: Result) -> Array:
    """Point errors (n,) of the frames of a case that count, mm."""
    path = out / "cases" / result.case / "points.csv.gz"
    if not path.exists():
        return np.zeros(0)
    points = tables.read(path, POINTS)
    frame, error = points["frame"].to_numpy(dtype=int), points["error_mm"].to_numpy(dtype=float)
    good = [entry["frame"] for entry in result.frames if is_pooled(entry, error[frame == entry["frame"]])]
    return np.asarray(error[np.isin(frame, good)])


def write_junit(path: Path, found: Sequence[Result]) -> None:
    """Write one test suite a case, one test a frame (or one for a case that has no frames to show)."""
    root = ET.Element("testsuites", name="wireval")
    for result in found:
        whole = {"frame": "case", "status": result.status, "sentence": result.sentence, "message": result.sentence}
        frames = result.frames or [whole]
        bad = [f for f in frames if f["status"] not in ("ok", "simulated")]
        suite = ET.SubElement(root, "testsuite", name=result.case, errors="0")
        suite.set("tests", str(len(frames)))
        suite.set("failures", str(len(bad)))
        for frame in frames:
            test = ET.SubElement(suite, "testcase", classname=result.case, name=f"frame {frame['frame']}")
            if frame in bad:
                failure = ET.SubElement(test, "failure", type=frame["status"], message=frame["sentence"])
                failure.text = frame["message"]
    write_bytes(path, ET.tostring(root, encoding="utf-8", xml_declaration=True))
