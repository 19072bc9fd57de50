"""The pages: one per case, one for the run. Built from files on disk, so they can be rebuilt at any time."""

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
    assumed,
    counted,
    doubted,
    find_cases,
    left_out_sentence,
    left_over_sentence,
    not_reached,
    not_run,
    not_run_sentence,
    read_case,
    said_by_cases,
)
from reports.counts import scans
from reports.figures import RunFiles, declared
from reports.listing import listed_files, listed_view
from reports.origin import why_not_pooled
from reports.page import Each, begun_first, draw_sections, longest, one_by_one, section, write_page
from reports.records import read_json
from reports.schema import ERRORS, FAILURES, OVERALL_FILE, SIMULATORS, SUMMARY, SWEEP
from reports.sweep import silent_points
from reports.tables import read_if_there
from reports.verdict import OF_CALIBRATION, badge, next_command, typed, unscored, verdict, worst_frames
from reports.viewer import viewer_data
from reports.worse import worse_cases, worse_sentence

PHYSICS = ("wire", "catheter", "down", "wall", "entry", "chosen", "geometry")


def render_case(case_dir: Path, embed: bool = False, each: Each = one_by_one) -> Path:
    """Draw figures/*.png with their CSV and write report.html of one case; returns its path.

    embed : put pictures and numbers into the page, for a single file to send.     each : who draws the figures.
    Raises ValueError, naming the file, where a result file is damaged; absent files leave out what they would have
    shown.
    """
    case = read_case(case_dir)
    result, errors = case.result, case.errors
    failures = _case_failures(case)
    frames = _content.grid(errors, ERRORS.shown("frames", "work"), bad=~errors["status"].isin(GOOD))
    page = {
        "title": " - ".join(filter(None, (case.name, case.simulator, "wireval"))),
        "name": case.name,
        "badge": badge(result.get("status", "no result.json"), result.get("status") in GOOD, _scored(case)),
        "verdict": _case_verdict(case),
        "worst": worst_frames({case.name: errors}, {}),
        "next": next_command([case.name], typed(case_dir)),
        **_drawn(case, embed, each),
        **{key: result.get(key, "") for key in ("role", "group", "simulator")},
        "failures": alike(failures),
        **{key: result.get(key, ()) for key in ("warnings", "assumptions", "inputs")},
        "numbers": _content.in_tiles(_content.cards(declared("cards"), case.statistics)),
        "points": (case_dir / "points.csv.gz").exists(),
        # of projections the assumptions say whether wires were shifted
        "compared": bool(errors["rms_mm"].notna().any()) and "projections" not in result.get("chosen", {}),
        "frames": frames if len(errors) else None,
        "counters": list(flatten(result.get("counters", {}))),
        "physics": list(flatten({key: result.get(key, {}) for key in PHYSICS})),
        "config": settings(result.get("config", {})),
        "provenance": list(flatten(result.get("provenance", {}))),
        "files": listed_files(case_dir),
        "view": listed_view(case_dir),
        "version": _version([result]),
    }
    return write_page("case.html.j2", page, case_dir / "report.html")


def _drawn(case: CaseFiles, embed: bool, each: Each) -> dict[str, Any]:
    """What is drawn on a case's page: the viewer and the sections; what takes longest is begun first."""
    entries = declared("case")

    def part(n: int) -> dict[str, Any]:
        return section("case", entries[n - 1], case, case.folder, embed) if n else {"of": viewer_data(case)}

    viewer, *sections = begun_first([0, *longest(entries)], part, 1 + len(entries), each)
    frames = viewer["of"]["frames"] if viewer["of"] else ()
    curves = {name for frame in frames for name in frame["curves"]}
    return {"viewer": viewer["of"], "curves": curves, "sections": [one for one in sections if one]}


def render_index(out_dir: Path, embed: bool = False, each: Each = one_by_one) -> Path:
    """Draw the figures of the run and write index.html; returns its path. Arguments as for ``render_case``."""
    cases, failures = readable_cases(out_dir)
    damaged = {row["case"] for row in failures}
    files = run_files(out_dir, cases)
    summary, errors, whole = files.summary, files.errors, read_if_there(out_dir / OVERALL_FILE, SUMMARY)
    pages = {case.name: case.folder / "report.html" for case in cases}
    links = {name: f"cases/{quote(p.parent.name)}/{p.name}" for name, p in pages.items() if p.exists()}
    failures += _run_failures(out_dir, cases, links)
    runs = {path.name: read_json(path) for path in sorted(out_dir.glob("run*.json"))}
    infos = list(runs.values())
    row = dict(whole.iloc[0]) if len(whole) else {}
    uncounted = damaged | set(summary["case"][summary["role"] == "calibration"])
    missing = not_run(out_dir)
    mixed, cases_said = why_not_pooled(out_dir), zip(summary["role"], summary["status"], strict=True)
    why_none = mixed or unscored(cases_said) or not_reached(out_dir)
    page = {
        **_headline(cases, _status(out_dir, [f for f in failures if not _of_another(f)], mixed), row, missing, damaged),
        **_worse_cases(summary, links),
        "verdict": verdict(row, _simulator(cases)) or why_none,
        "worst": worst_frames({n: t for n, t in errors.items() if n not in uncounted}, links),
        # of several shards' commands none is the one of the run
        "next": next_command([*(f["case"] for f in failures), *missing], typed(out_dir) if len(infos) == 1 else ()),
        "failures": alike(failures),
        "beside_others": (out_dir / SIMULATORS.file).exists(),
        **_not_counted(out_dir),
        "assumptions": assumed(out_dir),
        "warnings": [*doubted(out_dir), *said_by_cases({case.name: case.result for case in cases}, "warnings")],
        "numbers": _content.in_tiles(_content.overall(declared("overall"), whole)),
        # the first stands beside the tiles: not the map of hundreds of cases, which is taller than a screen
        "sections": sorted(draw_sections("run", files, out_dir, embed, each), key=_is_tall),
        "sweep": _content.grid(files.sweep, SWEEP.columns) if len(files.sweep) else None,
        "sweep_silent": silent_points(files.sweep),
        "config": settings(next((run["config"] for run in infos if "config" in run), {})),
        "provenance": [(name, list(flatten(run.get("provenance", {})))) for name, run in runs.items()],
        "version": _version(infos),
    }
    return write_page("index.html.j2", page, out_dir / "index.html")


def run_files(out_dir: Path, cases: Sequence[CaseFiles]) -> RunFiles:
    """The tables of a run, its cases worst first."""
    summary, sweep = (read_if_there(out_dir / table.file, table) for table in (SUMMARY, SWEEP))
    summary, found = _content.worst_first(summary), {case.name: case.errors for case in cases}
    names = dict.fromkeys([*summary["case"], *found])
    return RunFiles({name: found[name] for name in names if name in found}, summary, sweep)


def _case_failures(case: CaseFiles) -> list[dict[str, Any]]:
    """What went wrong: frame by frame as result.json says, what errors.csv says beyond that, or the whole case."""
    whole = [dict(row) for row in case.result.get("failures", ()) if row.get("frame") is None]
    if whole:  # a lumen that is not found fails every frame alike: said once, as in failures.csv
        return [dict.fromkeys(FAILURES.names, "") | {"case": case.name} | row for row in whole]
    rows = [dict(f) for f in case.result.get("frames", ()) if f.get("status") not in GOOD]
    known = [row.get("frame") for row in rows]
    others = case.errors[~case.errors["status"].isin(GOOD) & ~case.errors["frame"].isin(known)]
    rows += [{"frame": int(f), "status": s} for f, s in zip(others["frame"], others["status"], strict=True)]
    if not rows and case.result.get("status") not in GOOD:
        rows = [{key: case.result.get(key, "") for key in ("stage", "status", "sentence", "message")}]
    return [dict.fromkeys(FAILURES.names, "") | {"case": case.name} | row for row in rows]


def _scored(case: CaseFiles) -> Mapping[str, Any]:
    """The case's row of summary.csv; empty where its errors are no score."""
    return {} if case.result.get("role") == "calibration" else case.statistics


def _case_verdict(case: CaseFiles) -> str:
    """What became of the case, how many frames have a result, and how good they are.

    Where some have none, why stands below, with the frames and the next command: said here, too, it read as if it were
    of all.
    """
    nothing = "the case has no result.json: it did not finish; see log.txt"
    said = str(case.result.get("sentence", nothing)).strip().rstrip(".")
    good, planned = case.statistics.get("frames_ok"), case.statistics.get("frames")
    became = said[:1].upper() + said[1:] + "."
    if fitted := case.statistics.get("frames_fitted"):
        became = scans(good or 0, planned or 0, fitted, _scored_or_ok([case])) + "."
    elif planned and good != planned:
        became = f"{good} of {counted(planned, 'frame')} have a result."
    scored = _scored(case)
    how = verdict(scored, case.simulator) if scored or not case.statistics else OF_CALIBRATION
    judged = bool(how) and _content.number(scored.get("skill_strongest")) != _content.NOTHING
    alone = "The predictor 'another insertion' may be stronger; it is judged over the run, on its first page." * judged
    return " ".join(filter(None, (became, how, alone)))


def _scored_or_ok(cases: Sequence[CaseFiles]) -> str:
    """What a frame with a result is called: not all are scored where parameters are learnt or nothing is compared."""
    results = [case.result for case in cases]
    learnt = any(result.get("role") == "calibration" or result.get("status") == "simulated" for result in results)
    return "ok" if learnt else "scored"


def _is_tall(section: Mapping[str, Any]) -> bool:
    return int(section["height"]) > int(section["width"])


def _run_failures(out_dir: Path, cases: list[CaseFiles], links: dict[str, str]) -> list[dict[str, Any]]:
    """Rows of failures.csv, and what it does not know of: cases without result.json; then those of other simulators,
    whose pages lie beside their logs."""
    table = read_if_there(out_dir / FAILURES.file, FAILURES)
    rows: list[dict[Any, Any]] = table.astype(object).where(table.notna(), "").to_dict("records")
    beside = [row for row in rows if _of_another(row)]
    # the page finds out itself what it cannot read
    own = [row for row in rows if row not in beside and row["status"] != "damaged"]
    known = {row["case"] for row in own}
    for case in cases:
        if case.name not in known and case.result.get("status") not in GOOD:
            own += _case_failures(case)
    pages = [Path(row["log"]).with_name("report.html") for row in beside]
    theirs = [row | {"link": quote(str(p)) * (out_dir / p).exists()} for row, p in zip(beside, pages, strict=True)]
    return [*(row | {"link": links.get(row["case"], "")} for row in own), *theirs]


def _of_another(failure: Mapping[Any, Any]) -> bool:
    """Whether a failure is of another simulator of a score, and no fault of the one whose page it stands on."""
    return str(failure.get("log", "")).startswith("simulators/")


def readable_cases(out_dir: Path) -> tuple[list[CaseFiles], list[dict[str, Any]]]:
    """Every case that can be read, and a failure for each that has a bad file, or lost one: it must not hide others."""
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


def _status(out_dir: Path, failures: Sequence[Any], mixed: str) -> str:
    """The worst that can be said of a run in a word or two."""
    if failures:
        return "failures"
    return "cases missing" if not_run(out_dir) else "not pooled" if mixed else "ok"


def _worse_cases(summary: pd.DataFrame, links: Mapping[str, str]) -> dict[str, Any]:
    """The table of the cases, and which of them are worse than a guess, whatever a number over all of them says."""
    rows = summary.to_dict("records")
    return {"cases": _content.cases(summary, links, worse_cases(rows)), "worse": worse_sentence(rows)}


def _not_counted(out_dir: Path) -> dict[str, str]:
    """Cases that no number of the page is over."""
    said = {"left_over": left_over_sentence, "not_run": not_run_sentence, "left_out": left_out_sentence}
    return {name: sentence(out_dir) for name, sentence in said.items()}


def _simulator(cases: list[CaseFiles]) -> str:
    """Whose wires they are in a score of several simulators; empty in a run."""
    return next((case.simulator for case in cases if case.simulator), "")


def _headline(
    cases: list[CaseFiles], status: str, row: Mapping[str, Any], missing: Sequence[str], damaged: Container[str]
) -> dict[str, Any]:
    """Cases and frames as the last line on the terminal counts them: a case that crashed had frames, too.

    status : ok, or what the badge says instead.     missing : cases without a result here.     damaged : those of which
    no frame counts.
    """
    whole = [case for case in cases if case.name not in damaged]
    n_good = sum(case.statistics.get("frames_ok", len(case.good)) for case in whole)
    n_frames = sum(case.statistics.get("frames") or len(case.errors) for case in cases)
    absent = set(missing) - {case.name for case in cases}
    of = f"{len(cases)} of " * bool(absent)
    frames = f"{counted(n_frames, 'frame')}: {n_good} ok"
    frames += f", {n_frames - n_good} without a result" * (n_good < n_frames)
    if fitted := sum(case.statistics.get("frames_fitted") or 0 for case in cases):
        frames = scans(n_good, n_frames, fitted, _scored_or_ok(cases))
    sentence = f"{of}{counted(len(cases) + len(absent), 'case')}, {frames}."
    look = badge(status if cases else "failures", bool(cases) and status == "ok", row)
    name = _simulator(cases)
    title = " - ".join(filter(None, (name, "wireval")))
    return {"sentence": sentence, "badge": look, "simulator": name, "title": title}


def _version(infos: Sequence[Any]) -> str:
    """The version of wireval that the first of the files names."""
    found = (str(info.get("provenance", {}).get("wireval", "")) for info in infos)
    return next(filter(None, found), "")
