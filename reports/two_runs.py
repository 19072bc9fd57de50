"""The verdict on two runs, written for people and for CI: text, JSON, Markdown, JUnit, a page."""

import html
import json
import os
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal
from urllib.parse import quote

import pandas as pd

from reports._content import Grid, grid
from reports.atomic import write_text
from reports.diff import Difference
from reports.html import write_page
from reports.junit import add_suite, write_junit
from reports.schema import ERRORS, SUMMARY, Column
from reports.simulators import folders_in

SHOWN, ON_PAGE = 30, 1000
"""Regressions that a text and a page name; JSON and JUnit have all."""

_HEADS = {
    "simulator": "whose wires they are",
    "what": "a setting, an input, the code",
    "column": "of overall.csv or errors.csv",
    "before": "in the first run",
    "after": "in the second run",
    "pairs": "frames that both runs have",
    "median_change": "second run less first run, median over the pairs",
    "worst": "the largest change for the worse",
    "regressions": "frames that became worse by more than is allowed",
    "moved": "frames in which a value that has no better side changed by more than is allowed",
    "allowed": "by the tolerance",
    "meaning": "what the column holds",
}


Judged = Literal["worse", "holds", "withheld"]


@dataclass(frozen=True, eq=False)
class Verdict:
    """What became of a second run against a first one.

    runs : the two folders.     differs : rows (what, before, after) of where they come from; pooled : rows (column,
    before, after) of overall.csv.     paired : the sentence on the ratio of their errors with its interval.
    judged : worse where that closes the gate, holds, or withheld where there are too few insertions to tell.
    caveat : what the last line has to add, as that the two were not measured alike.
    """

    runs: tuple[Path, Path]
    differs: Sequence[Mapping[str, str]]
    pooled: Sequence[Mapping[str, Any]]
    paired: str
    judged: Judged
    frames: Difference
    caveat: str = ""

    @property
    def closed(self) -> bool:
        """Whether a gate must close."""
        return self.word != "not worse"

    @property
    def word(self) -> str:
        """worse, moved or not worse."""
        if self.judged == "worse" or len(self.frames.regressions):
            return "worse"
        return "moved" if len(self.frames.moved) else "not worse"

    @property
    def sentence(self) -> str:
        """The verdict in a line."""
        pooled = "; over all frames it is worse" * (self.judged == "worse") + f"; {self.caveat}" * bool(self.caveat)
        return f"{self.word.upper() if self.closed else self.word + ' than is allowed'}: {self.frames.sentence}{pooled}"

    def tables(self, most: int = SHOWN) -> dict[str, pd.DataFrame]:
        """What a reader is shown, by heading: first what differs, then the worst frames, then all of them.

        most : rows of the lists, whose headings say where they are cut.
        """
        lists = {
            "What differs between the runs": pd.DataFrame(self.differs),
            "What became worse": self.frames.regressions.drop(columns="verdict"),
            "What moved, neither worse nor better": self.frames.moved.drop(columns="verdict"),
        }
        shown = {}
        for head, rows in lists.items():
            cut = f" (the first {most} of {len(rows)}; --json has all)" * (len(rows) > most)
            shown[head + cut] = rows.head(most)
        return shown | {"Over all frames": pd.DataFrame(self.pooled), "Frame by frame": self.frames.by_column}

    def lines(self) -> list[str]:
        """For a terminal: what differs, the verdict, the worst frames, tables; and the verdict again at the end."""
        parts = [
            f"{head}:\n{table.to_string(index=False, na_rep='', float_format='{:.4g}'.format)}\n"
            for head, table in self.tables().items()
            if len(table)
        ]
        verdict = f"Verdict: {self.word.upper()}{f'. {self.paired}' if self.paired else ''}\n"
        parts.insert(1 if self.differs else 0, verdict)
        gate = "exit 1, the gate closes" if self.closed else "exit 0, the gate stays open"
        return [*parts, f"{self.sentence}: {gate}"]

    def write(self, **places: Path | None) -> None:
        """Write the files that are asked for: json, markdown, junit, html."""
        writers: dict[str, Callable[[Path], object]] = {
            "json": lambda path: write_text(path, json.dumps(self._plain(), indent=1, ensure_ascii=False) + "\n"),
            "markdown": lambda path: write_text(path, self._markdown()),
            "junit": lambda path: write_junit(path, self._junit()),
            "html": lambda path: write_page("diff.html.j2", {**self._page(path), "verdict": self}, path),
        }
        for kind, path in places.items():
            if path is not None:
                writers[kind](path)

    def _page(self, path: Path) -> dict[str, Any]:
        """Title, runs and tables; a row of a column of errors.csv or overall.csv says what that is.

        Cases and frames are links to the pages of the second run, from where the page lies.
        """
        known = {c.name: c.meaning for table in (SUMMARY, ERRORS) for c in table}
        grids = []
        for head, table in self.tables(ON_PAGE).items():
            if not len(table):
                continue
            shown = table.assign(meaning=table["column"].map(known)) if "column" in table else table
            texts = {str(n): shown[n].map(lambda v: isinstance(v, str)).any() for n in shown}
            columns = [Column(n, "-", _HEADS.get(n, ""), "text" if text else "float") for n, text in texts.items()]
            made = grid(shown, columns)
            if {"case", "frame"} <= set(shown):
                self._link(made, path.parent)
            grids.append({"id": head.lower().replace(" ", "-"), "head": head, "grid": made})
        runs = [{"name": str(run), "link": _there(run / "index.html", path.parent)} for run in self.runs]
        return {"title": "Two runs beside each other - wireval", "grids": grids, "runs": runs}

    def _link(self, made: Grid, place: Path) -> None:
        """Link case and frame of each row to the page of the second run, where it has one."""
        out, names = self.runs[1], [head["name"] for head in made["columns"]]
        scores = folders_in(out) if "simulator" in names else {}
        for row in made["rows"]:
            cells = dict(zip(names, row["cells"], strict=True))
            folder = scores.get(cells["simulator"]["value"], out) if scores else out
            link = cells["case"]["link"] = _there(folder / "cases" / cells["case"]["value"] / "report.html", place)
            if "frame" in cells:  # a column without any value is left out
                cells["frame"]["link"] = f"{link}#viewer={cells['frame']['value']}" if link else ""

    def _plain(self) -> dict[str, Any]:
        # pandas writes what does not apply as null
        pooled, worse, moved = (
            json.loads(rows.to_json(orient="records", double_precision=12))
            for rows in (pd.DataFrame(self.pooled), self.frames.regressions, self.frames.moved)
        )
        first, second = map(str, self.runs)
        head = {"schema": 1, "closed": self.closed, "sentence": self.sentence, "paired": self.paired}
        head |= {"first": first, "second": second}
        return head | {"differs": [*self.differs], "pooled": pooled, "regressions": worse, "moved": moved}

    def _markdown(self) -> str:
        first, second = (f"`{run}`" for run in self.runs)
        parts = [
            f"**{_cell(self.sentence)}**\n",
            f"first: {first}, second: {second}\n",
            f"{_cell(self.paired)}\n" * bool(self.paired),
        ]
        for head, table in self.tables().items():
            if len(table):
                rows = [[*table.columns], ["---"] * len(table.columns), *table.to_numpy().tolist()]
                lines = [f"| {' | '.join(map(_cell, row))} |" for row in rows]
                parts += [f"### {head}\n", "\n".join(lines) + "\n"]
        return "\n".join(filter(None, parts))

    def _junit(self) -> ET.Element:
        """A suite a case, a test a frame, and one test for the whole."""
        root, rows = ET.Element("testsuites", name="wireval diff"), self.frames.rows
        suite = ET.SubElement(root, "testsuite", name="all", tests="1", failures=str(int(self.judged == "worse")))
        suite.set("skipped", str(int(self.judged == "withheld")))
        test = ET.SubElement(suite, "testcase", classname="all", name="over all frames")
        if self.judged == "worse":
            ET.SubElement(test, "failure", type="rms_ratio", message=self.paired)
        elif self.judged == "withheld":
            ET.SubElement(test, "skipped", message=self.paired or "no frame counts in both runs")
        for case, mine in rows.groupby([n for n in ("simulator", "case") if n in rows], sort=False):
            add_suite(root, ", ".join(map(str, case)), mine)
        return root


def _there(page: Path, place: Path) -> str:
    """A link from a folder to a page; empty where there is none."""
    return quote(os.path.relpath(page, place)) if page.exists() else ""


def _cell(value: Any) -> str:
    """A value in a table of Markdown."""
    if not isinstance(value, str) and pd.isna(value):
        return ""
    return f"{value:.4g}" if isinstance(value, float) else html.escape(str(value), quote=False).replace("|", "\\|")
