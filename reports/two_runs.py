"""The verdict on two runs, written for people and for CI: text, JSON, Markdown, JUnit, a page."""

import html
import json
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from reports._content import grid
from reports.atomic import write_bytes, write_text
from reports.diff import Difference
from reports.html import write_page
from reports.schema import ERRORS, SUMMARY, Column

SHOWN = 30
"""Regressions that a text names; JSON and JUnit have all."""

_HEADS = {
    "what": "a setting, an input, the code",
    "column": "of overall.csv or errors.csv",
    "before": "in the first run",
    "after": "in the second run",
    "pairs": "frames that both runs have",
    "median_change": "second run less first run, median over the pairs",
    "worst": "the largest change for the worse",
    "regressions": "frames that became worse by more than is allowed",
    "allowed": "by the tolerance",
    "meaning": "what the column holds",
}


@dataclass(frozen=True, eq=False)
class Verdict:
    """What became of a second run against a first one.

    differs : rows (what, before, after) of where they come from; pooled : rows (column, before, after) of overall.csv.
    paired : the sentence on the ratio of their errors with its interval; pooled_worse : whether it closes the gate.
    """

    differs: Sequence[Mapping[str, str]]
    pooled: Sequence[Mapping[str, Any]]
    paired: str
    pooled_worse: bool
    frames: Difference

    @property
    def closed(self) -> bool:
        """Whether a gate must close."""
        return self.pooled_worse or len(self.frames.regressions) > 0

    @property
    def sentence(self) -> str:
        """The verdict in a line."""
        pooled = "; over all frames it is worse" * self.pooled_worse
        return f"{'WORSE' if self.closed else 'not worse'}: {self.frames.sentence}{pooled}"

    @property
    def tables(self) -> dict[str, pd.DataFrame]:
        """What a reader is shown, by heading: first what differs, then pooled, then frame by frame."""
        return {
            "What differs between the runs": pd.DataFrame(self.differs),
            "Over all frames": pd.DataFrame(self.pooled),
            "Frame by frame": self.frames.by_column,
            self._worse: self.frames.regressions.head(SHOWN).drop(columns="verdict"),
        }

    @property
    def _worse(self) -> str:
        """The head of the last table, which says where it is cut."""
        count = len(self.frames.regressions)
        return "What became worse" + f" (the first {SHOWN} of {count}; --json has all)" * (count > SHOWN)

    def lines(self) -> list[str]:
        """For a terminal."""
        said = []
        for head, table in self.tables.items():
            if len(table):
                said += [f"{head}:", table.to_string(index=False, na_rep="", float_format="{:.4g}".format), ""]
        return [*said, *([self.paired] if self.paired else []), self.sentence]

    def write(self, **places: Path | None) -> None:
        """Write the files that are asked for: json, markdown, junit, html."""
        writers: dict[str, Callable[[Path], object]] = {
            "json": lambda path: write_text(path, json.dumps(self._plain(), indent=1, ensure_ascii=False) + "\n"),
            "markdown": lambda path: write_text(path, self._markdown()),
            "junit": lambda path: write_bytes(path, ET.tostring(self._junit(), encoding="utf-8", xml_declaration=True)),
            "html": lambda path: write_page("diff.html.j2", {**self._page(), "verdict": self}, path),
        }
        for kind, path in places.items():
            if path is not None:
                writers[kind](path)

    def _page(self) -> dict[str, Any]:
        """Title and tables; a row of a column of errors.csv or overall.csv says what that is."""
        known = {c.name: c.meaning for table in (SUMMARY, ERRORS) for c in table}
        grids = []
        for head, table in self.tables.items():
            if not len(table):
                continue
            shown = table.assign(meaning=table["column"].map(known)) if "column" in table else table
            texts = {str(n): shown[n].map(lambda v: isinstance(v, str)).any() for n in shown}
            columns = [Column(n, "-", _HEADS.get(n, ""), "text" if text else "float") for n, text in texts.items()]
            grids.append({"id": head.lower().replace(" ", "-"), "head": head, "grid": grid(shown, columns)})
        return {"title": "Two runs beside each other - wireval", "grids": grids}

    def _plain(self) -> dict[str, Any]:
        # pandas writes what does not apply as null
        pooled, worse = (
            json.loads(rows.to_json(orient="records", double_precision=12))
            for rows in (pd.DataFrame(self.pooled), self.frames.regressions)
        )
        head = {"schema": 1, "closed": self.closed, "sentence": self.sentence, "paired": self.paired}
        return head | {"differs": [*self.differs], "pooled": pooled, "regressions": worse}

    def _markdown(self) -> str:
        parts = [f"**{_cell(self.sentence)}**\n", f"{_cell(self.paired)}\n" * bool(self.paired)]
        for head, table in self.tables.items():
            if len(table):
                rows = [[*table.columns], ["---"] * len(table.columns), *table.to_numpy().tolist()]
                lines = [f"| {' | '.join(map(_cell, row))} |" for row in rows]
                parts += [f"### {head}\n", "\n".join(lines) + "\n"]
        return "\n".join(filter(None, parts))

    def _junit(self) -> ET.Element:
        """A suite a case, a test a frame, and one test for the whole."""
        root, rows = ET.Element("testsuites", name="wireval diff"), self.frames.rows
        suite = ET.SubElement(root, "testsuite", name="all", tests="1", failures=str(int(self.pooled_worse)))
        test = ET.SubElement(suite, "testcase", classname="all", name="over all frames")
        if self.pooled_worse:
            ET.SubElement(test, "failure", type="rms_ratio", message=self.paired)
        for case, mine in rows.groupby("case", sort=False):
            groups = {f"frame {frame}": group for frame, group in mine.groupby("frame", dropna=False, sort=False)}
            bad = {name: group[group["verdict"] == "regression"] for name, group in groups.items()}
            suite = ET.SubElement(root, "testsuite", name=str(case), tests=str(len(groups)))
            suite.set("failures", str(sum(len(group) > 0 for group in bad.values())))
            for name, group in bad.items():
                test = ET.SubElement(suite, "testcase", classname=str(case), name=name.replace("frame <NA>", "case"))
                if len(group):
                    said = [f"{r.column}: {_cell(r.before)} -> {_cell(r.after)}" for r in group.itertuples()]
                    ET.SubElement(test, "failure", type="regression", message=said[0]).text = "\n".join(said)
        return root


def _cell(value: Any) -> str:
    """A value in a table of Markdown."""
    if not isinstance(value, str) and pd.isna(value):
        return ""
    return f"{value:.4g}" if isinstance(value, float) else html.escape(str(value), quote=False).replace("|", "\\|")
