"""The tables of a run and run.json from the case folders found in OUT: to merge runs, copy their folders together.

Also a JUnit summary for CI: one test per frame, so that a build server shows which frame failed and why.
"""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.run.another import copies, with_another
from pipeline.run.exchanged import exchanged
from pipeline.run.gate import CLOSED, parsed
from pipeline.run.kin import told_of_kin
from pipeline.run.overall import Found, found_cases, frames_of, overall, shared_scans, strangers, validation
from pipeline.run.results import Result, Row, found_results, lost, write_json
from pipeline.status import UsageError
from reports import tables
from reports.atomic import remove_files
from reports.case_files import GOOD, not_reached, not_run, planned_frames
from reports.doubts import AMONG, caveats_in, copied_from_traces, doubted, warnings_in
from reports.gates import GATES, asked_of, with_page
from reports.junit import Outcome, write_junit
from reports.origin import why_not_pooled
from reports.schema import ERRORS, FAILURES, OVERALL_FILE, SUMMARY, TIMINGS
from reports.unscored import unscored
from reports.verdict import remarks


@dataclass(frozen=True)
class Totals:
    """The numbers of the last line. Errors are those of all points of the frames that are pooled, as in overall.csv.

    unscored : why there are no errors.     mixed : whether the reason is that settings or manifests differ.
    gates : by each condition that was asked, why the run must not pass, empty where it may.     opened : a sentence for
    each of those.
    sweep_lost, sweep_missing : cases that crashed at a point of a sweep, or were not run there; they are not counted in
    ``cases``.
    missing : cases that the manifest names and that have no result; they are not counted in ``cases`` either.
    frames_fitted : scans that a roll was fitted on; they are not counted in ``frames``.
    """

    cases: int
    cases_ok: int
    frames: int
    frames_ok: int
    median_mm: float
    p95_mm: float
    solver_s: float
    pooled: Mapping[str, Any] = field(default_factory=dict)
    unscored: str = ""
    mixed: bool = False
    gates: Mapping[str, str] = field(default_factory=dict)
    opened: Sequence[str] = ()
    sweep_lost: int = 0
    sweep_missing: int = 0
    frames_fitted: int = 0
    missing: int = 0

    @property
    def all_ok(self) -> bool:
        """Whether every case is ok: decides the exit code and the printed counts alike."""
        return (
            self.cases > 0 and self.cases_ok == self.cases and not (self.mixed or self.sweep_lost or self.sweep_missing)
        )

    @property
    def closed(self) -> list[str]:
        """A sentence for each gate that is closed."""
        return [why for why in self.gates.values() if why]


def aggregate(out: Path, run_info: dict[str, Any] | None = None, name: str = "run.json") -> Totals:
    """Write the tables over all cases found, and ``name`` where ``run_info`` is given.

    Without it, when no run is at work, also of cases that the manifest names and that have no result: of a run that is
    a shard others may still compute them.
    """
    cases, mixed = found_cases(out), why_not_pooled(out)
    found, among = [case.result for case in cases], [] if mixed else with_another(out, cases)
    missing = _without_result(out) if run_info is None else []
    whole = overall(among, missing)
    _keep_what_is_seen(out, found, among)
    if whole:
        whole["warnings"] += len(doubted(out)) + len(remarks(whole, caveats=caveats_in(out)))
    rows, (times, replayed_s) = [result.summary for result in found], _times(out, found)
    _write_tables(out, rows, whole, [row for result in (*found, *missing) for row in result.failures])
    tables.write(out / TIMINGS.file, TIMINGS, times)
    if run_info is not None:
        write_json(out / name, run_info | {"cases": [result.case for result in found], "overall": whole})
    pooled = [] if mixed else frames_of(validation(cases))
    points = np.concatenate([np.zeros(0), *(frame.error_mm for frame in pooled)])
    return Totals(
        len(rows),
        sum(result.ok for result in found),
        sum(row["frames"] for row in rows),
        sum(row["frames_ok"] for row in rows),
        float(np.median(points)) if points.size else float("nan"),
        float(np.percentile(points, 95)) if points.size else float("nan"),
        replayed_s,
        whole,
        mixed or unscored((result.role, result.status) for result in found) or not_reached(out),
        bool(mixed),
        *_judged(out, asked_of(out) if run_info is None else run_info.get("fail_if", ()), whole, validation(among)),
        frames_fitted=sum(row.get("frames_fitted") or 0 for row in rows),
        missing=len(missing),
    )


def _write_tables(out: Path, summary: Sequence[Row], whole: Row, failures: Sequence[Row]) -> None:
    """Write the rows of the cases, of all of them (none where ``whole`` is empty) and of what failed."""
    for file, table, given in (
        (SUMMARY.file, SUMMARY, summary),
        (OVERALL_FILE, SUMMARY, [whole] * bool(whole)),
        (FAILURES.file, FAILURES, failures),
    ):
        # result files may come from another version, with other columns
        known = [{name: row[name] for name in row.keys() & table.names} for row in given]
        tables.write(out / file, table, known)


def _without_result(out: Path) -> list[Result]:
    """Stand-ins for the cases that runs into a folder name and that have no result there, as those of a lost shard.

    They have the frames that the manifest plans where they were to be scored, else none; and no log, if none was begun.
    """
    planned, found = planned_frames(out), []
    why = "no run into this folder has finished it; run it, or copy the folder of the shard that did here"
    for name in not_run(out):
        one = lost(name, "not_run", why, stage="run", frames=planned.get(name, 0))
        log = (out / "cases" / name / "log.txt").exists()
        found.append(one if log else replace(one, failures=[row | {"log": ""} for row in one.failures]))
    return found


def _keep_what_is_seen(out: Path, found: Sequence[Result], among: Sequence[Found]) -> None:
    """Write what is assumed and doubted of the cases that none of them tells alone.

    Anew each time, apart from what runs say of themselves: a shard has not seen the cases of the others.
    """
    scored = validation(among)
    placed, alike = told_of_kin(out, scored)
    assumed = [*shared_scans(found), *placed, *strangers([case.result for case in scored])]
    doubts = [*copies(scored), *alike, *exchanged(out, scored)]
    remove_files(out / AMONG)
    if assumed or doubts:
        write_json(out / AMONG, {"assumptions": assumed, "doubts": doubts})


def _judged(
    out: Path, asked: Sequence[str], overall: Mapping[str, Any], scored: Sequence[Found]
) -> tuple[dict[str, str], list[str]]:
    """By each condition why a run must not pass, empty where it may, and what is said of those; also for its page.

    Errors of wires that were made from the traces open no gate. overall : the row of the run into ``out``.
    scored : its cases.
    """
    remove_files(out / GATES)
    if not asked:
        return {}, []
    copied = copied_from_traces(warnings_in(out))  # reads the results of all cases
    told, pages, opened = {}, {}, []
    for text in asked:
        try:
            one = parsed(text)
        except UsageError:  # written by another version
            told[f"--fail-if {text}"] = f"{CLOSED}: --fail-if {text}: {OVERALL_FILE} of this version has no such number"
            continue
        told[one.asked] = why = f"{CLOSED}: {one.asked}: {copied}" if copied else one.closed(overall)
        if why and not copied and pd.notna(overall.get(one.column)):
            worst, page = _worst(scored, one.column)
            told[one.asked] += worst
            pages[told[one.asked]] = page
        opened += [] if why else [one.open(overall)]
    write_json(out / GATES, {"closed": [why for why in told.values() if why], "worst_pages": pages, "open": opened})
    return {asked: with_page(why, pages.get(why, ""), out) for asked, why in told.items()}, opened


_OVER_FRAMES = re.compile(r"_(?:median|max|low|high|fraction)(?=_|$)")
"""What a column of overall.csv says of how it sums up that of the frames: tip_max_mm is the largest tip_mm."""


def _worst(scored: Sequence[Found], column: str) -> tuple[str, str]:
    """Which frame is the worst by a column of overall.csv, and its page below OUT; empty for what no frame has."""
    name = column if column in ERRORS.names else _OVER_FRAMES.sub("", column)
    if name not in ERRORS.names or not ERRORS[name].better:
        return "", ""
    sign = -1.0 if ERRORS[name].better == "high" else 1.0
    of_all: list[tuple[str, int, Any]] = [
        (case.result.case, n, frame.row.get(name)) for case in scored for n, frame in case.frames.items()
    ]
    known = [(case, n, float(value)) for case, n, value in of_all if pd.notna(value)]
    if not known:
        return "", ""
    case, frame, value = max(known, key=lambda row: sign * row[2])
    return f"; the worst: case {case} frame {frame} ({name} {value:.4g})", f"cases/{case}/report.html"


def _times(out: Path, found: Sequence[Result]) -> tuple[pd.DataFrame, float]:
    """The rows of the run's timings.csv, one for each whole case, and the seconds of simulation, summed over frames.

    A damaged file is skipped: only its times are missing.
    """
    parts, replayed_s = [], 0.0
    for result in found:
        with suppress(OSError, ValueError):
            table = tables.read_if_there(out / "cases" / result.case / TIMINGS.file, TIMINGS)
            parts.append(table[table["frame"].isna()])
            replayed_s += float(table.loc[table["frame"].notna(), "simulate_s"].sum())
    return pd.concat(parts, ignore_index=True) if parts else tables.read_if_there(None, TIMINGS), replayed_s


def write_tests(path: Path, folders: Mapping[str, Path], gates: Mapping[str, str]) -> None:
    """Write a JUnit summary: a suite per case, a test per frame (one test for a case without frames), a suite of gates.

    folders : outputs by what the names of their cases' suites begin with.     gates : as in ``Totals``.
    """
    suites = []
    for whose, out in folders.items():
        for result in found_results(out):
            seconds = _seconds(out / "cases" / result.case / TIMINGS.file)
            frames = [_outcome(frame, seconds) for frame in result.frames or [_whole(result)]]
            suites.append((f"{whose}{result.case}", frames))
    if gates:
        suites.append(("gates", [Outcome(n, "failed" if why else "passed", why, "gate") for n, why in gates.items()]))
    write_junit(path, "wireval", suites)


def _seconds(path: Path) -> dict[Any, float]:
    """Seconds of a case's frames by their numbers, in all stages that are known by frame; of the whole under "case"."""
    with suppress(OSError, ValueError):
        table = tables.read_if_there(path, TIMINGS)
        steps = table[[name for name in TIMINGS.names if name.endswith("_s")]].fillna(0.0)
        by_frame = steps.drop(columns="total_s").sum(axis=1).where(table["frame"].notna(), steps["total_s"])
        return dict(zip(table["frame"].astype(object).where(table["frame"].notna(), "case"), by_frame, strict=True))
    return {}


def _whole(result: Result) -> dict[str, Any]:
    why = next((failure["message"] for failure in result.failures), "") or result.sentence
    return {"frame": "case", "status": result.status, "sentence": result.sentence, "message": why}


def _outcome(frame: Mapping[str, Any], seconds: Mapping[Any, float]) -> Outcome:
    name, took = f"frame {frame['frame']}", float(seconds.get(frame["frame"], 0.0))
    if frame["status"] in GOOD:
        return Outcome(name, seconds=took)
    return Outcome(name, "failed", frame["sentence"], frame["status"], frame["message"], took)
