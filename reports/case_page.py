"""The page of a case, built from its files on disk, so that it can be built again at any time."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from reports import _content
from reports._content import flatten, settings
from reports.alike import alike
from reports.case_files import GOOD, CaseFiles, counted, counted_scans, read_case, runs_in
from reports.doubts import Caveats, copied_from_traces, weightiest_first
from reports.listing import listed_files, listed_view
from reports.page import Each, begun_first, longest, one_by_one, section, write_page
from reports.schema import ERRORS, FAILURES
from reports.sections import declared
from reports.unscored import OF_CALIBRATION
from reports.verdict import badge, headline
from reports.viewer import viewer_data
from reports.what_next import next_command, typed, worst_frames

PHYSICS = ("wire", "catheter", "down", "wall", "entry", "chosen", "geometry")


def render_case(case_dir: Path, embed: bool = False, each: Each = one_by_one) -> Path:
    """Draw figures/*.png with their CSV and write report.html of one case; returns its path.

    embed : put pictures and numbers into the page, for a single file to send.     each : who draws the figures.
    Raises ValueError, naming the file, where a result file is damaged; absent files leave out what they would have
    shown.
    """
    case = read_case(case_dir)
    result, errors = case.result, case.errors
    failures, warnings = case_failures(case), weightiest_first(result.get("warnings", ()))
    caveats = Caveats(copied_from_traces({case.name: warnings}), warnings=warnings)
    frames = _content.grid(errors, ERRORS.shown("frames", "work"), bad=~errors["status"].isin(GOOD))
    page = {
        "title": " - ".join(filter(None, (case.name, case.simulator, "wireval"))),
        "name": case.name,
        "badge": badge(result.get("status", "no result.json"), result.get("status") in GOOD, _scored(case), caveats),
        **_case_verdict(case, caveats),
        "worst": worst_frames({case.name: errors}, {}),
        "next": next_command([case.name], typed(case_dir), [result.get("status", "")]),
        **_drawn(case, embed, each),
        **{key: result.get(key, "") for key in ("role", "group", "simulator")},
        "failures": alike(failures),
        "warnings": warnings,
        **{key: result.get(key, ()) for key in ("assumptions", "inputs")},
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
        "version": version_of([result]),
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


def case_failures(case: CaseFiles) -> list[dict[str, Any]]:
    """What went wrong in a case: by frame, as result.json and (beyond that) errors.csv say, or as a whole."""
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
    """The case's row of summary.csv; empty where its errors are no score.

    Without its interval, which one insertion never has: what it shows of others is the run's page's to say. All pages
    of a run of twenty cases were amber for it.
    """
    return {} if case.result.get("role") == "calibration" else {**case.statistics, "interval": None}


def _case_verdict(case: CaseFiles, caveats: Caveats) -> dict[str, Any]:
    """What became of the case, how many frames have a result, and how good they are; what more there is to know.

    Where some have none, why stands below, with the frames and the next command: said here, too, it read as if it were
    of all.
    """
    nothing = "the case has no result.json: it did not finish; see log.txt"
    said = str(case.result.get("sentence", nothing)).strip().rstrip(".")
    scored = _scored(case)
    judges = bool(scored) or not case.statistics
    how, more = headline(scored, case.simulator, caveats) if judges else (OF_CALIBRATION, [])
    good, planned = case.statistics.get("frames_ok"), case.statistics.get("frames")
    became = said[:1].upper() + said[1:] + "."
    if fitted := case.statistics.get("frames_fitted"):
        became = counted_scans(good or 0, planned or 0, fitted, scored_or_ok([case])) + "."
    elif planned and good != planned:
        became = "" if how.startswith("On ") else f"{good} of {counted(planned, 'frame')} have a result."
    judged = bool(how) and not caveats.copied and _content.number(scored.get("skill_strongest")) != _content.NOTHING
    ids = {name for run in runs_in(case.folder.parents[1]) for name in run.get("planned") or ()}
    alone = "The predictor 'another insertion' may be stronger; it is judged over the run, on its first page."
    alone *= judged and len(ids) != 1
    return {"verdict": " ".join(filter(None, (became, how))), "more": [*more, *[alone] * bool(alone)]}


def scored_or_ok(cases: Sequence[CaseFiles]) -> str:
    """The word for a frame with a result: "scored" is wrong where parameters are learnt, or nothing is compared."""
    results = [case.result for case in cases]
    learnt = any(result.get("role") == "calibration" or result.get("status") == "simulated" for result in results)
    return "ok" if learnt else "scored"


def version_of(infos: Sequence[Any]) -> str:
    """The version of wireval that the first of the files names."""
    found = (str(info.get("provenance", {}).get("wireval", "")) for info in infos)
    return next(filter(None, found), "")
