"""A run as four pages on paper (``wireval report --pdf``): verdict, distribution, worst case, cases and settings."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.backends.backend_pdf import PdfPages

from reports import _content, colours
from reports.alike import alike, of_what
from reports.atomic import replacing
from reports.case_files import (
    WORST,
    CaseFiles,
    counted,
    counted_scans,
    not_reached,
    not_run_sentence,
    read_case,
    results_in,
)
from reports.doubts import assumed, caveats_of, said_by_cases
from reports.figures import figures_of
from reports.gates import gates_in
from reports.origin import why_not_pooled
from reports.pdf_page import RIGHT, WIDE, Figured, Page
from reports.records import read_json
from reports.run_page import frames_not_run, readable_cases, run_files
from reports.schema import FAILURES, OVERALL_FILE, SUMMARY
from reports.sections import declared
from reports.tables import first_row, in_texts, read_if_there
from reports.unscored import unscored
from reports.verdict import WORSE, verdict
from reports.what_next import next_command, typed, worst_frames
from reports.worse import worse_cases, worse_sentence

_MOST_FAILURES, _MOST_CASES, _MOST_SETTINGS = 8, 40, 24
_MOST_WARNINGS, _FOR_ASSUMPTIONS = 4, 0.25
_OF_THE_RUN = ("case_frame_map", "planned_within", "cases_by_error", "sensitivity")
_MORE_OF_WORST = ("budget", "skill_by_depth", "error_over_u", "forces_by_depth")  # none of them on pages 3 and 4


def write_pdf(out_dir: Path) -> Path:
    """Write summary.pdf beside index.html; returns its path. The figures are those of the pages."""
    summary = read_if_there(out_dir / SUMMARY.file, SUMMARY)
    path = out_dir / "summary.pdf"
    with replacing(path) as temporary, PdfPages(temporary, metadata={"CreationDate": None}) as pdf:
        for page in _pages(out_dir, summary):
            page.figure.text(RIGHT, 0.02, f"{pdf.get_pagecount() + 1} of 4", size=8, ha="right")
            pdf.savefig(page.figure)
    return path


def _pages(out_dir: Path, summary: pd.DataFrame) -> Iterator[Page]:
    summary, whole = _content.worst_first(summary), read_if_there(out_dir / OVERALL_FILE, SUMMARY)
    run, files = read_json(out_dir / "run.json"), run_files(out_dir, readable_cases(out_dir)[0])
    case = read_case(out_dir / "cases" / _worst(summary))
    drawn = _drawn("run", files, _OF_THE_RUN)
    page = _first(out_dir, summary, whole)
    # figures go to the first page as far as it has room for them, to the second what is left
    here = max(1, page.most(drawn))
    page.pictures(drawn[:here])
    yield page
    yield _over_all(out_dir, drawn[here:], case)
    yield _worst_case(summary, case)
    yield _last(case, summary, run)


def _first(out_dir: Path, summary: pd.DataFrame, whole: pd.DataFrame) -> Page:
    """Verdict, failures with the next command, tiles, warnings."""
    failures = read_if_there(out_dir / FAILURES.file, FAILURES)
    page = Page("Guide-wire validation")
    ok, planned = int(summary["frames_ok"].sum()), int(summary["frames"].sum())
    row = first_row(whole)
    cases = zip(summary["role"], summary["status"], strict=True)
    results = results_in(out_dir)
    simulator = next((name for one in results.values() if (name := str(one.get("simulator", "")))), "")
    caveats = caveats_of(out_dir, results)
    said = verdict(row, simulator, caveats) or why_not_pooled(out_dir) or unscored(cases) or not_reached(out_dir)
    frames = f"{ok} of {counted(planned, 'frame')} have a result"
    if fitted := int(summary["frames_fitted"].sum()):
        frames = counted_scans(ok, planned, fitted, "with a result")
    page.text(f"{counted(len(summary), 'case')}, {frames}. {said}", size=11)
    for line in gates_in(out_dir)["closed"]:
        page.text(f"{line[0].upper()}{line[1:]}.", size=11, colour=colours.BAD)
    if worse := worse_sentence(summary.to_dict("records")):
        page.text(worse, size=11, colour=colours.BAD)
    if missing := not_run_sentence(out_dir):
        page.text(f"Of the study {missing}. {frames_not_run(out_dir)}", size=11, colour=colours.BAD)
    if len(failures):
        _failures(page, failures, out_dir)
    for tile in _content.in_tiles(_content.overall(declared("overall"), whole))["tiles"]:
        why = f". {tile['why']}" if "why" in tile else ""
        page.text(f"{tile['value']}  {tile['label']}{why}")
    page.some("Warnings", caveats.warnings, "on the pages of the cases", _MOST_WARNINGS)
    return page


def _failures(page: Page, failures: pd.DataFrame, out_dir: Path) -> None:
    """What failed, alike frames once, and the next command. failures : of failures.csv, at least a row."""
    rows = alike(in_texts(failures))
    page.text(f"Failures: {of_what(rows)}", size=11, weight="bold", colour=colours.BAD)
    for row in rows[:_MOST_FAILURES]:
        case = ": ".join(filter(None, (row["simulator"], row["case"])))
        frames = f", {row['of']}" * bool(row["of"])
        text = textwrap.shorten(str(row["message"]), 300, placeholder="…")
        files = f"{row['files']}. " * bool(row["files"])
        page.text(f"{case}{frames}: {row['status']}. {files}{text}")
    if rest := sum(row["count"] for row in rows[_MOST_FAILURES:]):
        page.text(f"… and {rest} more in failures.csv")
    command = next_command(failures["case"], typed(out_dir))
    page.text(f"Next: see to what the messages name, then {command}", width=WIDE * 9 // 10, weight="bold")


def _over_all(out_dir: Path, drawn: Sequence[Figured], worst: CaseFiles) -> Page:
    """Figures over all cases, and what was assumed: as much as the figures leave, which are not shrunk for it.

    Where that leaves room, as in a run of one case, there is more of the worst case.
    """
    assumptions = [*assumed(out_dir), *said_by_cases(results_in(out_dir), "assumptions")]
    page = Page("Over all cases")
    needed = page.height(assumptions)
    drawn = drawn[: page.most(drawn, min(needed, _FOR_ASSUMPTIONS))]
    page.pictures(drawn, min(needed, page.left(drawn)))
    page.some("Assumptions", assumptions, "on the pages")
    more = _drawn("case", worst, _MORE_OF_WORST)
    page.pictures([one._replace(title=f"{worst.name}: {one.title}") for one in more[: page.most(more)]])
    return page


def _drawn(part: str, files: Any, names: Sequence[str]) -> list[Figured]:
    """Figures as a page on the screen has them, as far as there are any. files : what their functions take."""
    entries = {entry["figure"]: entry for entry in declared(part)}
    drawn = [(entries[name], drawing) for name in names if (drawing := figures_of(part)[name](files)) is not None]
    return [
        Figured(one, *(_content.caption(entry[part], one.table) for part in ("title", "read"))) for entry, one in drawn
    ]


def _draw(page: Page, case: CaseFiles, names: Sequence[str]) -> Page:
    """The page, with figures of a case."""
    page.pictures(_drawn("case", case, names))
    return page


def _worst(summary: pd.DataFrame) -> str:
    """The first case that page 1 calls worse than a guess, else the first with errors. summary : worst first."""
    known = summary[summary[WORST].notna()]
    named = known[known["case"].isin(worse_cases(known.to_dict("records")))]
    worst = next((some["case"] for some in (named, known, summary) if len(some)), None)
    return "" if worst is None else str(worst.iloc[0])


def _worst_case(summary: pd.DataFrame, case: CaseFiles) -> Page:
    """The worst case by its own figures."""
    head = "The worst case of those with errors"
    if not len(summary) or case.name == summary["case"].iloc[0]:
        head = "The worst case"
    elif case.name in worse_cases(summary.to_dict("records")):
        head = f"The worst of the cases {WORSE}"
    page = Page(f"{head}: {case.name}")
    frames = [f"{row['frame']} ({row['text']} mm)" for row in worst_frames({case.name: case.errors}, {})]
    page.text(f"Worst frames by {WORST}: {', '.join(frames)}." if frames else "No frame has an error.")
    if failed := len(case.errors) - len(case.good):
        page.text(f"{counted(failed, 'frame')} of it failed.")
    return _draw(page, case, ("projections", "simulated_wires", "error_along_wire"))


def _last(worst: CaseFiles, summary: pd.DataFrame, run: Mapping[str, Any]) -> Page:
    """Cases in their order, worst first; settings that are not defaults; versions; more of the worst case."""
    page = Page("Cases, worst first")
    page.text(f"Cases with failed frames come first, of these the ones without any result; then the largest {WORST}.")
    heads = ("case", "status", "frames", "rms_mm", "p95_mm", "tip_median_mm", "skill_strongest")
    rows = [
        [str(row["case"]), str(row["status"]), f"{row['frames_ok']} of {row['frames']}"]
        + [_content.number(row[name]) for name in heads[3:]]
        for row in summary.head(_MOST_CASES).to_dict("records")
    ]
    page.table([heads, *rows], (0.22, 0.17, 0.08, 0.07, 0.07, 0.12, 0.11))
    if len(summary) > _MOST_CASES:
        page.text(f"… and {len(summary) - _MOST_CASES} more in summary.csv")
    page.text("Settings that are not defaults", size=10.5, weight="bold")
    chosen = [row for row in _content.settings(run.get("config", {})) if row[2] != "default"]
    if chosen:
        page.table([("setting", "value", "from"), *chosen[:_MOST_SETTINGS]], (0.3, 0.34, 0.2))
    else:
        page.text("None: every setting is its default.")
    known = dict(_content.flatten(run.get("provenance", {})))
    names = [name for name in ("wireval", "git_commit", "python") if name in known]
    page.text("; ".join(f"{name} {known[name]}" for name in names), size=8)
    page.text(f"More of {worst.name}", size=10.5, weight="bold")
    return _draw(page, worst, ("error_by_depth", "tip_by_depth"))
