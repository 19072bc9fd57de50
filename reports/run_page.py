"""The page of a run over all its cases, built from files on disk, so that it can be built again at any time."""

import shlex
from collections.abc import Container, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pandas as pd

from reports import _content
from reports._content import flatten, settings
from reports.alike import alike
from reports.case_files import (
    GOOD,
    CaseFiles,
    amiss,
    counted,
    counted_scans,
    find_cases,
    left_out_sentence,
    left_over_sentence,
    not_reached,
    not_run,
    not_run_sentence,
    provenance_of,
    read_case,
)
from reports.case_page import case_failures, scored_or_ok, version_of
from reports.doubts import assumed, caveats_of
from reports.figures import RunFiles
from reports.gates import gates_in
from reports.origin import why_not_pooled
from reports.page import Each, draw_sections, one_by_one, write_page
from reports.records import read_json, run_records
from reports.schema import FAILURES, OVERALL_FILE, SIMULATORS, SUMMARY, SWEEP
from reports.sections import declared
from reports.sweep import not_run_sentence as not_swept_sentence
from reports.sweep import silent_points
from reports.tables import first_row, in_texts, read_if_there
from reports.unscored import unscored
from reports.verdict import badge, first_that_holds, headline
from reports.what_next import next_command, typed, worst_frames
from reports.worse import one_case, worse_cases, worse_sentence


def render_index(out_dir: Path, embed: bool = False, each: Each = one_by_one) -> Path:
    """Draw the figures of the run and write index.html; returns its path. Arguments as for ``render_case``."""
    cases, failures = readable_cases(out_dir)
    damaged, files = {row["case"] for row in failures}, run_files(out_dir, cases)
    summary, whole = files.summary, read_if_there(out_dir / OVERALL_FILE, SUMMARY)
    drawn = [case for case in cases if (case.folder / "report.html").exists()]
    links = {case.name: f"cases/{quote(case.folder.name)}/report.html" for case in drawn}
    failures += _run_failures(out_dir, cases, links)
    runs = {path.name: read_json(path) for path in run_records(out_dir)}
    infos, row = list(runs.values()), first_row(whole)
    uncounted = damaged | set(summary["case"][summary["role"] == "calibration"])
    missing, gates, aside = not_run(out_dir), gates_in(out_dir), _not_counted(out_dir)
    mixed, cases_said = why_not_pooled(out_dir), zip(summary["role"], summary["status"], strict=True)
    why_none = mixed or unscored(cases_said) or not_reached(out_dir)
    failed = not (cases and all(map(_of_another, failures)))
    why = {"failures": failed, "cases missing": missing, "not pooled": mixed, "gate closed": gates["closed"]}
    why["sweep incomplete"] = aside["not_swept"]
    page = {
        **_headline(cases, missing, damaged),
        **_judged(out_dir, cases, first_that_holds(why), row, why_none, one_case(summary.to_dict("records"))),
        **_worse_cases(summary, links),
        "worst": worst_frames({n: t for n, t in files.errors.items() if n not in uncounted}, links),
        "next": _next(failures, missing, typed(out_dir) if len(infos) == 1 else ()),
        "failures": alike(failures),
        "beside_others": (out_dir / SIMULATORS.file).exists(),
        **aside,
        "gates": gates,
        "assumptions": assumed(out_dir),
        "numbers": _content.in_tiles(_content.overall(declared("overall"), whole)),
        # the first stands beside the tiles: not the map of hundreds of cases, which is taller than a screen
        "sections": sorted(draw_sections("run", files, out_dir, embed, each), key=_is_tall),
        "sweep": _content.grid(files.sweep, SWEEP.columns) if len(files.sweep) else None,
        "sweep_silent": silent_points(files.sweep),
        "config": settings(next((run["config"] for run in infos if "config" in run), {})),
        "provenance": [(n, list(flatten(r.get("provenance", {}))), _made(out_dir / n)) for n, r in runs.items()],
        "version": version_of(infos),
    }
    return write_page("index.html.j2", page, out_dir / "index.html")


def _made(run: Path) -> dict[str, str]:
    """On which day and by which command a run was made, and the file that says so; empty where nothing tells."""
    path = provenance_of(run)
    command = shlex.join(typed(path.parent, path.name))
    return {"day": str(read_json(path).get("started", ""))[:10], "command": command, "file": path.name}


def run_files(out_dir: Path, cases: Sequence[CaseFiles]) -> RunFiles:
    """The tables of a run, its cases worst first."""
    summary, sweep = (read_if_there(out_dir / table.file, table) for table in (SUMMARY, SWEEP))
    summary, found = _content.worst_first(summary), {case.name: case.errors for case in cases}
    names = dict.fromkeys([*summary["case"], *found])
    whole = first_row(read_if_there(out_dir / OVERALL_FILE, SUMMARY))
    planned = int(whole["frames"]) if whole and _not_run_counted(out_dir) else 0
    return RunFiles({name: found[name] for name in names if name in found}, summary, sweep, planned)


def _is_tall(section: Mapping[str, Any]) -> bool:
    return int(section["height"]) > int(section["width"])


def _run_failures(out_dir: Path, cases: list[CaseFiles], links: dict[str, str]) -> list[dict[str, Any]]:
    """Rows of failures.csv, and what it does not know of: cases without result.json; then those of other simulators,
    whose pages lie beside their logs."""
    rows = in_texts(read_if_there(out_dir / FAILURES.file, FAILURES))
    beside = [row for row in rows if _of_another(row)]
    # the page finds out itself what it cannot read, and which cases have no result
    own = [row for row in rows if row not in beside and row["status"] not in ("damaged", "not_run")]
    known = {row["case"] for row in own}
    for case in cases:
        if case.name not in known and case.result.get("status") not in GOOD:
            own += case_failures(case)
    pages = [Path(row["log"]).with_name("report.html") for row in beside]
    theirs = [row | {"link": quote(str(p)) * (out_dir / p).exists()} for row, p in zip(beside, pages, strict=True)]
    return [*(row | {"link": links.get(row["case"], "")} for row in own), *theirs]


def _of_another(failure: Mapping[Any, Any]) -> bool:
    """Whether a failure is of another simulator of a score, and no fault of the one whose page it stands on."""
    return str(failure.get("log", "")).startswith("simulators/")


def readable_cases(out_dir: Path) -> tuple[list[CaseFiles], list[dict[str, Any]]]:
    """Every case that can be read, and a failure for each with a bad or missing file: it must not hide the others."""
    cases, broken = [], []
    for folder in find_cases(out_dir):
        wrong = amiss(folder)
        message = f"{folder}: {wrong}; run the case again" * bool(wrong)
        try:
            cases.append(read_case(folder, points=False, rest=False))
        except ValueError as error:
            message = str(error)
        if message:
            row = dict.fromkeys((*FAILURES.names, "link"), "") | {"case": folder.name, "stage": "report"}
            row |= {"status": "damaged", "sentence": "a result file cannot be read", "message": message}
            broken.append(row)
    return cases, broken


def _worse_cases(summary: pd.DataFrame, links: Mapping[str, str]) -> dict[str, Any]:
    """The table of the cases, and which of them are worse than a guess, whatever a number over all of them says."""
    rows = summary.to_dict("records")
    table = _content.cases(summary, links, worse_cases(rows))
    scored = bool(summary["rms_mm"].notna().any())
    return {"cases": table, "scored": scored, "worse": worse_sentence(rows)}


def _not_counted(out_dir: Path) -> dict[str, str]:
    """Cases that no number of the page is over, and results that its sweep lacks."""
    said = {"left_over": left_over_sentence, "not_run": not_run_sentence, "left_out": left_out_sentence}
    said |= {"not_swept": not_swept_sentence, "not_run_counted": frames_not_run}
    return {name: sentence(out_dir) for name, sentence in said.items()}


def _not_run_counted(out_dir: Path) -> bool:
    """Whether the tables count the frames of cases without a result: those of a shard that has just run do not."""
    return bool(read_if_there(out_dir / FAILURES.file, FAILURES)["status"].eq("not_run").any())


def frames_not_run(out_dir: Path) -> str:
    """What becomes of the frames of cases without a result in the numbers of the page."""
    if not _not_run_counted(out_dir):
        return "Every number below is over the other cases alone, shares of planned frames, too."
    return "Errors below are over the other cases alone; shares are of all planned frames, theirs among them."


def _simulator(cases: Sequence[CaseFiles]) -> str:
    """Whose wires they are in a score of several simulators; empty in a run."""
    return next((case.simulator for case in cases if case.simulator), "")


def _judged(
    out_dir: Path, cases: Sequence[CaseFiles], status: str, row: Mapping[str, Any], why_none: str, hidden: str
) -> dict[str, Any]:
    """Badge, verdict and warnings over all cases. row : of overall.csv.     why_none : why there may be no verdict.
    hidden : what of one case the numbers over all hide.
    """
    caveats = caveats_of(out_dir, {case.name: case.result for case in cases})
    said, more = headline(row, _simulator(cases), caveats)
    shown = badge(status, status == "ok", row, caveats, hidden)
    return {"verdict": said or why_none, "more": more, "badge": shown, "warnings": caveats.warnings}


def _next(failures: Sequence[Mapping[str, Any]], missing: Sequence[str], words: Sequence[str]) -> str:
    """The command that comes next. words : of this run; none of several shards', of which none is that of the run."""
    return next_command([*(f["case"] for f in failures), *missing], words, [f["status"] for f in failures])


def _headline(cases: list[CaseFiles], missing: Sequence[str], damaged: Container[str]) -> dict[str, str]:
    """Cases and frames as the last line on the terminal counts them: a case that crashed had frames, too.

    missing : cases without a result here.     damaged : those of which no frame counts.
    """
    whole = [case for case in cases if case.name not in damaged]
    n_good = sum(case.statistics.get("frames_ok", len(case.good)) for case in whole)
    n_frames = sum(case.statistics.get("frames") or len(case.errors) for case in cases)
    absent = set(missing) - {case.name for case in cases}
    of = f"{len(cases)} of " * bool(absent)
    frames = f"{counted(n_frames, 'frame')}: {n_good} ok"
    frames += f", {n_frames - n_good} without a result" * (n_good < n_frames)
    if fitted := sum(case.statistics.get("frames_fitted") or 0 for case in cases):
        frames = counted_scans(n_good, n_frames, fitted, scored_or_ok(cases))
    sentence = f"{of}{counted(len(cases) + len(absent), 'case')}, {frames}."
    name = _simulator(cases)
    title = " - ".join(filter(None, (name, "wireval")))
    return {"sentence": sentence, "simulator": name, "title": title}
