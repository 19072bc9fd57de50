"""The pages: one per case, one for the run. Built from files on disk, so they can be rebuilt at any time."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from urllib.parse import quote

import pandas as pd

from reports import _grids, tables
from reports._format import flatten, settings, size
from reports._pages import write_page
from reports.case_files import GOOD, CaseFiles, find_cases, read_case, read_json
from reports.figures import CASE_FIGURES, RUN_FIGURES, RunFiles
from reports.scene3d import write_scene
from reports.schema import FAILURES_COLUMNS, SUMMARY_COLUMNS, SWEEP_COLUMNS
from reports.sections import draw_sections

_LISTED_FILES = ("result.json", "errors.csv", "points.csv.gz", "frames.h5", "log.txt")


def render_case(case_dir: Path, embed: bool = False) -> Path:
    """Draw figures/*.png with their CSV and write report.html of one case; returns its path.

    embed : put pictures and numbers into the page, for a single file to send. Raises ValueError, naming the
    file, where a result file is damaged; absent files leave out what they would have shown.
    """
    case = read_case(case_dir)
    sections = draw_sections("case", CASE_FIGURES, case, case_dir, embed)
    scene, scene_note = write_scene(case)
    result = case.result
    page = {
        "title": f"{case.name} - wireval",
        "name": case.name,
        "status": result.get("status", "no result.json"),
        "good": result.get("status") in GOOD,
        "sentence": result.get("sentence", "the case has no result.json: it did not finish; see log.txt"),
        "role": result.get("role", ""),
        "group": result.get("group", ""),
        "failures": _case_failures(case),
        "warnings": result.get("warnings", ()),
        "assumptions": result.get("assumptions", ()),
        "cards": _grids.cards(result.get("statistics", {})),
        "points": (case_dir / "points.csv.gz").exists(),
        "compared": bool(case.errors["rms_mm"].notna().any()),
        "scene": scene.name if scene else "",
        "scene_note": scene_note,
        "sections": sections,
        "frames": _grids.frames(case.errors) if len(case.errors) else None,
        "counters": list(flatten(result.get("counters", {}))),
        "physics": list(flatten({k: result.get(k, {}) for k in ("wire", "wall", "entry", "geometry")})),
        "config": settings(result.get("config", {})),
        "provenance": list(flatten(result.get("provenance", {}))),
        "inputs": result.get("inputs", ()),
        "files": _files(case_dir),
        "version": _version(result),
    }
    return write_page("case.html.j2", page, case_dir / "report.html")


def render_index(out_dir: Path, embed: bool = False) -> Path:
    """Draw the figures of the run and write index.html; returns its path. Arguments as for ``render_case``."""
    cases, failures = _read_cases(out_dir)
    summary = _optional(out_dir / "summary.csv", tables.read_summary, SUMMARY_COLUMNS)
    sweep = _optional(out_dir / "sweep.csv", tables.read_sweep, SWEEP_COLUMNS)
    run = RunFiles({case.name: case.errors for case in cases}, summary, sweep)
    links = _links(cases)
    failures += _run_failures(out_dir, cases, links)
    runs = {path.name: read_json(path) for path in sorted(out_dir.glob("run*.json"))}
    page = {
        "title": "wireval",
        **_headline(cases, failures),
        "failures": failures,
        "assumptions": [text for content in runs.values() for text in content.get("assumptions", ())],
        "cards": _grids.overall(next((c["overall"] for c in runs.values() if c.get("overall")), {})),
        "sections": draw_sections("run", RUN_FIGURES, run, out_dir, embed),
        "cases": _grids.cases(summary, links),
        "sweep": _grids.sweep(sweep) if len(sweep) else None,
        "config": settings(next((r["config"] for r in runs.values() if "config" in r), {})),
        "provenance": [
            (name, list(flatten(content.get("provenance", {})))) for name, content in runs.items()
        ],
        "version": next((v for v in map(_version, runs.values()) if v), ""),
    }
    return write_page("index.html.j2", page, out_dir / "index.html")


def _case_failures(case: CaseFiles) -> list[dict[str, Any]]:
    rows = [dict(f) for f in case.result.get("frames", ()) if f.get("status") not in GOOD]
    known = {row.get("frame") for row in rows}
    others = case.errors[~case.errors["status"].isin(GOOD) & ~case.errors["frame"].isin(list(known))]
    rows += [{"frame": int(f), "status": s} for f, s in zip(others["frame"], others["status"], strict=True)]
    if not rows and case.result.get("status") not in GOOD:
        rows = [
            {"frame": "", **{k: case.result.get(k, "") for k in ("stage", "status", "sentence", "message")}}
        ]
    return [{"case": case.name, "stage": "", "sentence": "", "message": "", "log": "", **row} for row in rows]


def _run_failures(out_dir: Path, cases: list[CaseFiles], links: dict[str, str]) -> list[dict[str, Any]]:
    """Rows of failures.csv, then what it does not know of: cases without result.json."""
    table = _optional(out_dir / "failures.csv", tables.read_failures, FAILURES_COLUMNS)
    texts = table.astype(object).where(table.notna(), "")
    rows: list[dict[str, Any]] = [{str(k): v for k, v in row.items()} for row in texts.to_dict("records")]
    known = {row["case"] for row in rows}
    for case in cases:
        if case.name not in known and case.result.get("status") not in GOOD:
            rows += _case_failures(case)
    return [{**row, "link": links.get(row["case"], "")} for row in rows]


def _read_cases(out_dir: Path) -> tuple[list[CaseFiles], list[dict[str, Any]]]:
    """Every case that can be read, and a failure for each that cannot: one bad file must not hide the others."""
    cases, broken = [], []
    for folder in find_cases(out_dir):
        try:
            cases.append(read_case(folder, points=False))
        except ValueError as error:
            row = {
                "case": folder.name,
                "frame": "",
                "stage": "report",
                "status": "damaged",
                "log": "",
                "link": "",
            }
            broken.append(row | {"sentence": "a result file cannot be read", "message": str(error)})
    return cases, broken


def _links(cases: list[CaseFiles]) -> dict[str, str]:
    """Pages by case; a case that was not rendered has none."""
    pages = {case.name: case.folder / "report.html" for case in cases}
    return {name: f"cases/{quote(p.parent.name)}/{p.name}" for name, p in pages.items() if p.exists()}


def _headline(cases: list[CaseFiles], failures: list[dict[str, Any]]) -> dict[str, Any]:
    n_good = sum(len(case.good) for case in cases)
    n_frames = sum(len(case.errors) for case in cases)
    sentence = f"{len(cases)} case{'s' * (len(cases) != 1)}, {n_frames} frames: {n_good} ok"
    sentence += f", {n_frames - n_good} without a result." if n_good < n_frames else "."
    bad = bool(failures) or not cases
    return {"sentence": sentence, "status": "failures" if bad else "ok", "good": not bad}


def _optional(path: Path, read: Any, columns: Any) -> pd.DataFrame:
    table: pd.DataFrame = read(path) if path.exists() else tables.empty_table(columns)
    return table


def _files(case_dir: Path) -> list[dict[str, str]]:
    paths = [case_dir / name for name in _LISTED_FILES]
    view = case_dir / "view"
    paths += sorted(p for p in view.iterdir() if not p.name.startswith(".")) if view.is_dir() else []
    return [
        {
            "name": path.relative_to(case_dir).as_posix(),
            "link": quote(path.relative_to(case_dir).as_posix()),
            "size": size(path.stat().st_size),
        }
        for path in paths
        if path.exists()
    ]


def _version(result: Any) -> str:
    return str(result.get("provenance", {}).get("wireval", ""))
