"""The verdict on two runs, in words and tables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import pandas as pd

from reports.diff import Difference

SHOWN = 30
"""Regressions that a text names; JSON and JUnit have all."""

NOT_JUDGED = "not judged"
"""The word on two runs of which nothing was compared: a gate must not stay open for that."""

Judged = Literal["worse", "holds", "withheld"]


@dataclass(frozen=True, eq=False)
class Verdict:
    """What became of a second run against a first one.

    runs : the two folders.     differs : rows (what, before, after) of where they come from; pooled : rows (column,
    before, after) of overall.csv.     paired : the sentence on the ratio of their errors with its interval.
    judged : worse where that closes the gate, holds, or withheld where there are too few insertions to tell.
    caveat : what the last line has to add, as that the two were not measured alike.
    alike : the sentence that nothing differs in where they come from; empty where something does.
    """

    runs: tuple[Path, Path]
    differs: Sequence[Mapping[str, str]]
    pooled: Sequence[Mapping[str, Any]]
    paired: str
    judged: Judged
    frames: Difference
    caveat: str = ""
    alike: str = ""

    @property
    def closed(self) -> bool:
        """Whether a gate must close."""
        return self.word != "not worse"

    @property
    def word(self) -> str:
        """worse, moved, not judged (no value was held against another) or not worse."""
        if self.judged == "worse" or len(self.frames.regressions):
            return "worse"
        if len(self.frames.moved):
            return "moved"
        return "not worse" if self.judged == "holds" or self.frames.judged else NOT_JUDGED

    @property
    def sentence(self) -> str:
        """The verdict in a line."""
        pooled = "; over all frames it is worse" * (self.judged == "worse") + f"; {self.caveat}" * bool(self.caveat)
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
        }
        shown = {}
        for head, rows in lists.items():
            cut = f" (the first {most} of {len(rows)}; --json has all)" * (len(rows) > most)
            shown[head + cut] = rows.head(most)
        return shown | {"Over the frames of both": pd.DataFrame(self.pooled), "Frame by frame": self.frames.by_column}

    def lines(self) -> list[str]:
        """For a terminal: what differs, the verdict, the worst frames, tables; and the verdict again at the end."""
        parts = [
            f"{head}:\n{table.to_string(index=False, na_rep='', float_format='{:.4g}'.format)}\n"
            for head, table in self.tables().items()
            if len(table)
        ]
        verdict = f"Verdict: {self.word.upper()}.{f' Pooled: {self.paired}' if self.paired else ''}\n"
        parts.insert(1 if self.differs else 0, verdict)
        parts[:0] = [f"{self.alike[0].upper()}{self.alike[1:]}.\n"] if self.alike else []
        gate = "exit 1, the gate closes" if self.closed else "exit 0, the gate stays open"
        return [*parts, f"{self.sentence}: {gate}"]
