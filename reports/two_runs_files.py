"""The verdict on two runs as files for people and for CI: JSON, Markdown, JUnit, a page."""

import html
import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pandas as pd

from reports._content import Grid, grid
from reports.atomic import write_text
from reports.closing import change_of, worst_first
from reports.diff import CLOSING
from reports.junit import Outcome, write_junit
from reports.page import write_page
from reports.schema import ERRORS, SUMMARY, Column
from reports.simulators import folders_in
from reports.tolerance import RATIO
from reports.two_runs import NOT_JUDGED, Verdict

ON_PAGE = 1000
"""Regressions that a page names; JSON and JUnit have all."""

_HEADS = {
    "simulator": "whose wires they are",
    "what": "a setting, an input, the code",
    "column": "of overall.csv or errors.csv",
    "warning": "what it is warned of; (all): of the cases together",
    "before": "in the first run",
    "after": "in the second run",
    "pairs": "frames that both runs have",
    "median_change": "second run less first run, median over the pairs",
    "worst": "the largest change for the worse",
    "regressions": "frames that became worse by more than is allowed",
    "moved": "frames in which a value that has no better side changed by more than is allowed",
    "allowed": "by the tolerance",
}


def write(verdict: Verdict, **places: Path | None) -> None:
    """Write the files that are asked for: json, markdown, junit, html."""
    writers: dict[str, Callable[[Path], object]] = {
        "json": lambda path: write_text(path, json.dumps(_plain(verdict), indent=1, ensure_ascii=False) + "\n"),
        "markdown": lambda path: write_text(path, _markdown(verdict)),
        "junit": lambda path: write_junit(path, "wireval diff", _suites(verdict)),
        "html": lambda path: write_page("diff.html.j2", {**_page(verdict, path), "verdict": verdict}, path),
    }
    for kind, path in places.items():
        if path is not None:
            writers[kind](path)


def _page(verdict: Verdict, path: Path) -> dict[str, Any]:
    """Title, runs and tables, each with what the columns of errors.csv or overall.csv are that its rows are about.

    Cases and frames are links to the pages of the second run, from where the page lies.
    """
    known = {c.name: c.meaning for table in (SUMMARY, ERRORS) for c in table}
    grids = []
    for head, table in verdict.tables(ON_PAGE).items():
        if not len(table):
            continue
        texts = {str(n): table[n].map(lambda v: isinstance(v, str)).any() for n in table}
        columns = [Column(n, "-", _HEADS.get(n, ""), "text" if text else "float") for n, text in texts.items()]
        about = dict.fromkeys(table.get("column", ()))
        made = grid(table, columns) | {"about": [(name, known[name]) for name in about if name in known]}
        if {"case", "frame"} <= set(table):
            _link(verdict.runs[1], made, path.parent)
        grids.append({"id": head.lower().replace(" ", "-"), "head": head, "grid": made})
    runs = [{"name": str(run), "link": _there(run / "index.html", path.parent)} for run in verdict.runs]
    return {"title": "Two runs beside each other - wireval", "grids": grids, "runs": runs}


def _link(out: Path, made: Grid, place: Path) -> None:
    """Link case and frame of each row to the page of the second run, where it has one."""
    names = [head["name"] for head in made["columns"]]
    scores = folders_in(out) if "simulator" in names else {}
    for row in made["rows"]:
        cells = dict(zip(names, row["cells"], strict=True))
        folder = scores.get(cells["simulator"]["value"], out) if scores else out
        link = cells["case"]["link"] = _there(folder / "cases" / cells["case"]["value"] / "report.html", place)
        if "frame" in cells:  # a column without any value is left out
            cells["frame"]["link"] = f"{link}#viewer={cells['frame']['value']}" if link else ""


def _plain(verdict: Verdict) -> dict[str, Any]:
    # pandas writes what does not apply as null
    pooled, worse, moved = (
        json.loads(rows.to_json(orient="records", double_precision=12))
        for rows in (pd.DataFrame(verdict.pooled), verdict.frames.regressions, verdict.frames.moved)
    )
    first, second = map(str, verdict.runs)
    head = {"schema": 1, "closed": verdict.closed, "sentence": verdict.sentence, "paired": verdict.paired}
    head |= {"first": first, "second": second}
    head |= {"differs": [*verdict.differs], "warned": [*verdict.warned]}
    return head | {"pooled": pooled, "regressions": worse, "moved": moved}


def _markdown(verdict: Verdict) -> str:
    first, second = (f"`{run}`" for run in verdict.runs)
    parts = [
        f"**{_cell(verdict.sentence)}**\n",
        f"first: {first}, second: {second}\n",
        f"{_cell(verdict.alike)}\n" * bool(verdict.alike),
        f"{_cell(verdict.paired)}\n" * bool(verdict.paired),
    ]
    for head, table in verdict.tables().items():
        if len(table):
            rows = [[*table.columns], ["---"] * len(table.columns), *table.to_numpy().tolist()]
            lines = [f"| {' | '.join(map(_cell, row))} |" for row in rows]
            parts += [f"### {head}\n", "\n".join(lines) + "\n"]
    return "\n".join(filter(None, parts))


def _suites(verdict: Verdict) -> list[tuple[str, list[Outcome]]]:
    """A suite a case, a test a frame, and one test for the whole."""
    whole = Outcome("over all frames")
    if verdict.judged == "worse":
        whole = replace(whole, verdict="failed", kind=RATIO, message=verdict.paired)
    elif verdict.word == NOT_JUDGED:
        whole = replace(whole, verdict="failed", kind="not_judged", message=verdict.sentence)
    elif verdict.judged == "withheld":
        whole = replace(whole, verdict="skipped", message=verdict.paired or "no frame counts in both runs")
    rows = verdict.frames.rows
    cases = rows.groupby([n for n in ("simulator", "case") if n in rows], sort=False)
    suites = {", ".join(map(str, case)): mine.groupby("frame", dropna=False, sort=False) for case, mine in cases}
    return [("all", [whole]), *((name, [_outcome(n, frame) for n, frame in mine]) for name, mine in suites.items())]


def _outcome(frame: Any, rows: pd.DataFrame) -> Outcome:
    """It fails where a row closes the gate, and is skipped where only the second run has the frame."""
    name = "case" if pd.isna(frame) else f"frame {frame!s}"
    bad = rows[rows["verdict"].isin(CLOSING)]
    if len(bad):
        bad = pd.concat([worst_first(bad[bad["verdict"] == verdict]) for verdict in CLOSING])
        said = [change_of(row) for row in bad.to_dict("records")]
        return Outcome(name, "failed", said[0], bad["verdict"].iloc[0], "\n".join(said))
    if (rows["verdict"] == "new").all():
        return Outcome(name, "skipped", f"only the second run has it: {rows['after'].iloc[0]}")
    return Outcome(name)


def _there(page: Path, place: Path) -> str:
    """A link from a folder to a page; empty where there is none."""
    return quote(os.path.relpath(page, place)) if page.exists() else ""


def _cell(value: Any) -> str:
    """A value in a table of Markdown."""
    if not isinstance(value, str) and pd.isna(value):
        return ""
    return f"{value:.4g}" if isinstance(value, float) else html.escape(str(value), quote=False).replace("|", "\\|")
