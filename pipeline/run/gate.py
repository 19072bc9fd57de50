"""A gate for CI: ``run --fail-if "rms_mm>0.5"`` fails where one value of the whole run is beyond a limit."""

import math
import operator
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pipeline.status import UsageError, did_you_mean, nearest
from reports.schema import OURS, OVERALL_FILE, SUMMARY
from reports.texts import NUMBER

CLOSED = "gate closed"
A_FEW = "numbers are rms_mm, tip_median_mm, skill_strongest, frames_failed and those in docs/reference/columns.md"
COUNTED = {"warnings": "in each case and of the run; what cases say alike is one line on a page"}
"""What is counted by columns that a reader counts otherwise: five warnings of five cases stand as one line."""
RELATIONS = {"<=": operator.le, ">=": operator.ge, "<": operator.lt, ">": operator.gt}
WRITTEN = re.compile(rf"\s*(?:([\w.-]+):)?\s*(\w+)\s*({'|'.join(RELATIONS)})\s*({NUMBER})\s*")


@dataclass(frozen=True)
class Gate:
    """A condition on a column of overall.csv; the gate closes where it holds, or where the column has no value.

    of : the one simulator of a score whose wires are asked; empty for each but the solver.
    """

    column: str
    relation: str
    limit: float
    of: str = ""

    @property
    def text(self) -> str:
        """The condition in short."""
        limit = f"{self.limit:g}" if float(f"{self.limit:g}") == self.limit else repr(self.limit)
        return f"{self.of}{':' * bool(self.of)}{self.column}{self.relation}{limit}"

    @property
    def asked(self) -> str:
        """The option in short."""
        return f"--fail-if {self.text}"

    def asks(self, simulator: str) -> bool:
        """Whether this simulator's wires are asked; without a name those of each but the solver."""
        return simulator == self.of if self.of else simulator != OURS

    def closed(self, overall: Mapping[str, Any]) -> str:
        """Why a run with this row of overall.csv must not pass; empty where it may."""
        if not overall:
            why = f"{OVERALL_FILE} has no row, as no case was scored; it cannot be shown to hold"
            return f"{CLOSED}: {self.asked}: {why}"
        found = overall.get(self.column)
        value = float("nan") if found is None else float(found)
        if math.isnan(value):
            interval = str(overall.get("interval", ""))
            end = self.column.endswith(("_low_mm", "_high_mm", "_low", "_high"))
            why = f": {interval}" * (end and ("withheld" in interval or self.column in interval))
            return f"{CLOSED}: {self.asked}: {OVERALL_FILE} has no {self.column}{why}; it cannot be shown to hold"
        passed = not RELATIONS[self.relation](value, self.limit)
        return "" if passed else f"{CLOSED}: {self.asked}: {self._is(value)}"

    def open(self, overall: Mapping[str, Any]) -> str:
        """What is said of a run with this row that may pass."""
        return f"gate open: {self.asked}: {self._is(float(overall[self.column]))}"

    def _is(self, value: float) -> str:
        counted = COUNTED.get(self.column, "") if value > 1 else ""
        return f"{self.column} is {value:.4g}" + f" ({counted})" * bool(counted)


def gate(text: str, simulators: Sequence[str] = ()) -> Gate:
    """Parse ``column>number``; UsageError where it is malformed, or where the column is no number of overall.csv.

    simulators : those of a score, one of which may be named before it: ``mine:column>number``.
    """
    found = parsed(text)
    if found.of and found.of not in simulators:
        do = did_you_mean(found.of, simulators) if simulators else "only score has several; write the condition alone"
        raise UsageError([f"--fail-if {text!r}: no simulator {found.of!r}; {do}"])
    return found


def _instead(column: str, names: Sequence[str]) -> str:
    """What may be meant by a column that is no number of overall.csv; of its 60 numbers a few."""
    if column in SUMMARY.names:
        return f": it is a text; {A_FEW}"
    near = nearest(column, names)
    return f"; did you mean {near!r}?" if near else f"; {A_FEW}"


def parsed(text: str) -> Gate:
    """The condition, of whichever simulator; raises as ``gate`` does."""
    found = WRITTEN.fullmatch(text)
    name, column, relation, limit = found.groups() if found else ("", "", "", "nan")
    number, names = float(limit), [one.name for one in SUMMARY if one.kind != "text"]
    if not math.isfinite(number):
        do = f'write a column of {OVERALL_FILE} and a limit in plain digits, as in "rms_mm>0.5" or "rms_mm>5e-1"'
        unquoted = "; in a shell put it in quotes: a bare > writes into a file" * (text.strip() in names)
        raise UsageError([f"--fail-if {text!r}: {do}{unquoted}"])
    if column not in names:
        raise UsageError([f"--fail-if {text!r}: no number {column!r} in {OVERALL_FILE}{_instead(column, names)}"])
    return Gate(column, relation, number, name or "")
