"""The verdict on two runs, in words and tables."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import pandas as pd

from reports.diff import Difference
from reports.doubts import copied_from_traces, doubted, warnings_in
from reports.schema import ALL

SHOWN = 30
"""Regressions that a text names; JSON and JUnit have all."""

NOT_JUDGED = "not judged"
"""The word on two runs of which nothing was compared: a gate must not stay open for that."""

Judged = Literal["worse", "holds", "withheld"]
Warned = Mapping[str, Sequence[str]]
"""What each case of a run is warned of, by case; under ALL what is doubtful among them."""


def warned_of(out: Path) -> Warned:
    """What a run and its cases are warned of."""
    return {ALL: doubted(out)} | warnings_in(out)


def newly_warned(first: Warned, second: Warned) -> list[dict[str, str]]:
    """Rows (case, warning) of what a case of the second run is warned of and that of the first is not; the numbers in a
    text, and the plurals that go by them, may differ.

    None where the first run has no case that could say it, as golden tables have not.
    """
    before = {(case, _words(text)) for case, texts in first.items() for text in texts}
    rows = [{"case": case, "warning": text} for case, texts in second.items() for text in texts]
    return [row for row in rows if (row["case"], _words(row["warning"])) not in before] if len(first) > 1 else []


def newly_void(first: Warned, second: Warned) -> str:
    """The warning that the second run's wires were made from the traces, where the first run's were not; else empty."""
    return "" if copied_from_traces(first) else copied_from_traces(second)


def _blank(table: pd.DataFrame) -> pd.DataFrame:
    """A table whose missing whole numbers are printed as its other gaps are: pandas writes <NA> whatever is asked."""
    out = table.copy()
    for name in out:
        if out[name].dtype.kind not in "iuf" or isinstance(out[name].dtype, pd.api.extensions.ExtensionDtype):
            out[name] = out[name].astype(object).where(out[name].notna(), "")
    return out


def _words(text: str) -> str:
    return re.sub(r"# (frame|place|case|point|insertion)s?\b", r"# \1", re.sub(r"[-+]?\d[\d.e+-]*", "#", text))


@dataclass(frozen=True, eq=False, repr=False)
class Verdict:
    """What became of a second run against a first one.

    runs : the two folders.     differs : rows (what, before, after) of where they come from.     pooled : rows
    (column, before, after) of overall.csv.     paired : a sentence on the ratio of their errors, with its interval.
    judged : worse (the ratio closes the gate), holds (it does not), or withheld (too few insertions to tell).
    caveat : what the last line has to add, for instance that the two were not measured alike.
    alike : a sentence that they come from the same; empty where something differs.
    warned : rows (case, warning) of what the second run alone is warned of.     void : why the errors of the second
    run cannot be judged; empty where they can.
    """

    runs: tuple[Path, Path]
    differs: Sequence[Mapping[str, str]]
    pooled: Sequence[Mapping[str, Any]]
    paired: str
    judged: Judged
    frames: Difference
    caveat: str = ""
    alike: str = ""
    warned: Sequence[Mapping[str, str]] = ()
    void: str = ""

    def __repr__(self) -> str:
        """What a prompt shows: as on a terminal."""
        return "\n".join(self.lines())

    @property
    def closed(self) -> bool:
        """Whether a gate must close."""
        return self.word != "not worse"

    @property
    def word(self) -> str:
        """worse, moved, not judged (no value was held against another, or the second run's are void) or not worse."""
        if self.judged == "worse" or len(self.frames.regressions):
            return "worse"
        if self.void:
            return NOT_JUDGED
        if len(self.frames.moved):
            return "moved"
        return "not worse" if self.judged == "holds" or self.frames.judged else NOT_JUDGED

    @property
    def sentence(self) -> str:
        """The verdict in a line."""
        pooled = "; over all frames it is worse" * (self.judged == "worse") + f"; {self.caveat}" * bool(self.caveat)
        if self.word == NOT_JUDGED and self.void:
            return f"NOTHING WAS JUDGED: {self.void}"
        if self.word == NOT_JUDGED:
            return f"NOTHING WAS JUDGED: no error of the first run could be held against one of the second{pooled}"
        return f"{self.word.upper() if self.closed else self.word + ' than is allowed'}: {self.frames.sentence}{pooled}"

    def tables(self, most: int = SHOWN) -> dict[str, pd.DataFrame]:
        """What a reader is shown, by heading: first what differs, then the worst frames, then all of them.

        most : rows of the lists, whose headings say where they are cut.
        """
        lists = {
            "What differs between the runs": pd.DataFrame(self.differs),
            "What became worse": self.frames.regressions.drop(columns="verdict"),
            "What moved, neither worse nor better": self.frames.moved.drop(columns="verdict"),
            "What only the second run is warned of": pd.DataFrame(self.warned),
        }
        shown = {}
        for head, rows in lists.items():
            cut = f" (the first {most} of {len(rows)}; --json has all)" * (len(rows) > most)
            shown[head + cut] = rows.head(most)
        return shown | {"Over the cases of both": pd.DataFrame(self.pooled), "Frame by frame": self.frames.by_column}

    def lines(self) -> list[str]:
        """For a terminal: what differs, the verdict, the worst frames, tables; and the verdict again at the end."""
        parts = [
            f"{head}:\n{_blank(table).to_string(index=False, na_rep='', float_format='{:.4g}'.format)}\n"
            for head, table in self.tables().items()
            if len(table)
        ]
        by = self.frames.closes
        closed = f" What closes the gate, the worst first: {by}." * bool(by and self.word in ("worse", "moved"))
        alone = " No error of a simulated wire is worse than is allowed." * self.frames.beside_errors
        pooled = f" Pooled: {self.paired}" * bool(self.paired)
        # WORSE stood beside "no difference is shown", as if one of the two were wrong
        pooled += "; it is single frames that close the gate" * bool(self.paired and closed and self.judged != "worse")
        verdict = f"Verdict: {self.word.upper()}.{closed}{alone if self.judged != 'worse' else ''}{pooled}\n"
        parts.insert(1 if self.differs else 0, verdict)
        parts[:0] = [f"{self.alike[0].upper()}{self.alike[1:]}.\n"] if self.alike else []
        gate = "FAIL, exit 1, the gate closes" if self.closed else "PASS, exit 0, the gate stays open"
        return [*parts, f"{self.sentence}: {gate}"]
