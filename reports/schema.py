"""What is known of every column, in one place: name, unit, meaning, pooling, where a page shows it and how it looks.

The columns stand in columns.toml, one line each; tables, figures and pages take them from here. A name carries its
unit (``_mm``, ``_deg``, ``_N``, ``_s``); one without is a count, a fraction or a text. A value that does not apply is
an empty field, never 0. A new error metric is one line of columns.toml, or ``ERRORS.add(Column(...))`` from outside
this package; a new trivial predictor is ``ERRORS.add(predictor(...))``.
"""

import difflib
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

_DECLARED = tomllib.loads((Path(__file__).parent / "columns.toml").read_text(encoding="utf-8"))
POOLED = {
    "points": "from all points of the frames that are ok",
    "rms": "root of the mean square over frames, weighted by their number of points",
    "mean": "mean over frames",
    "weighted": "mean over frames, weighted by their number of points",
    "median": "median over frames",
    "max": "largest over frames",
    "share": "fraction of frames in which it is true",
}
"""The rules by which a case's value comes from those of its frames."""
PLACES = (
    *("frames", "work"),  # case page: the table of frames, first how far, then forces and effort
    "cases",  # index page: the table of cases
    *("predictors", "rivals"),  # every figure with lines of trivial predictors; beside them where they are pooled
    *("error_by_depth", "tip_by_depth", "tip_angle_by_depth", "skill_by_depth"),  # panels against depth
    *("trace_by_depth", "truth_by_depth", "force_by_depth", "overlap_by_depth"),
)


@dataclass(frozen=True)
class Column:
    """One column of a table. Raises ValueError for a kind, a rule or a place that does not exist."""

    name: str
    """The header, exactly as written."""
    unit: str
    """mm, deg, N, s, MiB, 1 (a number without unit) or - (a text)."""
    meaning: str
    """One line for the reader."""
    kind: str = "float"
    """float, integer, boolean or text."""
    formula: str = ""
    """How it is computed: w are points of the simulated wire, c of the traced curve, at arc length s from the entry."""
    better: str = ""
    """low or high where a comparison of two runs has a direction, else empty."""
    pooled: str = ""
    """How summary.csv gets a case's value from its frames': a rule of POOLED; empty: it has none."""
    shown: Mapping[str, str] = field(default_factory=dict)
    """The PLACES that show it, each with what a legend calls it there."""
    style: str = ""
    """How figures draw it, a name of ``figures._style.LINES``; empty: in a colour that the panel does not use."""
    module: str = ""
    """Where what computes it stands, of one that was registered; empty for those of columns.toml."""

    def __post_init__(self) -> None:
        """Refuse what would be ignored in silence."""
        known = ("float", "integer", "boolean", "text", "low", "high", *POOLED, *PLACES)
        wrong = {self.kind, self.better, self.pooled, *self.shown} - {"", *known}
        if wrong:
            raise ValueError(f"column {self.name}: got {min(wrong)!r}; known are {', '.join(known)}")

    def with_word(self, word: str) -> str:
        """The name with a word before its unit: tip_mm with median is tip_median_mm."""
        suffix = "" if self.unit in ("1", "-") else f"_{self.unit}"
        return f"{self.name.removesuffix(suffix)}_{word}{suffix}"

    @property
    def pooled_name(self) -> str:
        """Header of the case's value in summary.csv; a name that says the rule already stays as it is."""
        word = {"median": "median", "max": "max", "share": "fraction"}.get(self.pooled, "")
        return self.name if not word or word in self.name.split("_") else self.with_word(word)

    def pooled_column(self) -> "Column":
        """The column of summary.csv for the case's value, where the table does not have one with words of its own."""
        shown = {"cases": ""} if "frames" in self.shown else {}
        meaning = f"{self.meaning}; {POOLED[self.pooled]}"
        return Column(self.pooled_name, self.unit, meaning, better=self.better, shown=shown)


class Table:
    """A table: its file's name and its columns in the order of the file."""

    def __init__(self, file: str, pooled_in: "Table | None" = None) -> None:
        """The table of columns.toml for a file; ``pooled_in`` gets the pooled columns that it does not have."""
        self.file = file
        self.columns = tuple(Column(**entry) for entry in _DECLARED[file])
        self._pooled_in = pooled_in
        for column in self.columns:
            self._pool(column)

    @property
    def names(self) -> tuple[str, ...]:
        """Headers in order."""
        return tuple(column.name for column in self.columns)

    def __iter__(self) -> Iterator[Column]:
        """The columns in order."""
        return iter(self.columns)

    def __getitem__(self, name: str) -> Column:
        """The column of a name; KeyError for one that the table does not have."""
        return {column.name: column for column in self.columns}[name]

    def shown(self, *places: str) -> tuple[Column, ...]:
        """Columns that a page shows at these places, place by place, each in the order of the file."""
        return tuple(c for place in places for c in self.columns if place in c.shown)

    def add(self, column: Column) -> None:
        """Take in a column from outside, at the end, and its pooled column; ValueError where it is there.

        One that the same module registers again, as a notebook's cell that is run twice does, replaces the earlier one.
        """
        if column.name in self.names:
            if self[column.name].module != column.module or not column.module:
                raise ValueError(f"{self.file} has a column {column.name!r}; choose another name")
            self._drop(self[column.name])
        self.columns = (*self.columns, column)
        self._pool(column)

    def check(self, given: Iterable[str], where: str) -> None:
        """Refuse a name that the table does not have; ``where`` (a file) goes into the message."""
        unknown = sorted(set(given) - set(self.names))
        if unknown:
            near = difflib.get_close_matches(unknown[0], self.names, n=1)
            hint = f"did you mean {near[0]}?" if near else f"known columns: {', '.join(self.names)}"
            raise ValueError(f"unknown column {unknown[0]!r} in {where}; {hint}")

    def _drop(self, column: Column) -> None:
        self.columns = tuple(one for one in self.columns if one != column)
        if self._pooled_in and column.pooled:
            self._pooled_in._drop(column.pooled_column())

    def _pool(self, column: Column) -> None:
        if self._pooled_in and column.pooled and column.pooled_name not in self._pooled_in.names:
            self._pooled_in.add(column.pooled_column())


def predictor(name: str, label: str, meaning: str) -> Column:
    """The column of a trivial predictor, ``null_<name>_rms_mm``, for ERRORS: every figure and table shows it.

    label : what legends call it.     meaning : where its wire lies.
    """
    text = f"rms_mm of a trivial predictor: {meaning}"
    shown = {"frames": "", "predictors": label}
    return Column(f"null_{name}_rms_mm", "mm", text, pooled="rms", shown=shown)


SUMMARY = Table("summary.csv")
OVERALL_FILE = "overall.csv"  # one row over all validation cases, with the columns of summary.csv
ALL = "(all)"
"""Stands where the name of a case would, in rows over all of them."""
ERRORS = Table("errors.csv", pooled_in=SUMMARY)
POINTS = Table("points.csv.gz")
WIRE_LINES = Table("view/wire_KIND_NNN.vtp")  # the point arrays of a wire
FAILURES = Table("failures.csv")
TIMINGS = Table("timings.csv")  # of a case and its frames; of a run, one row a case
BUDGET = Table("budget.csv")
ENTRIES = Table("entries.csv")
SWEEP = Table("sweep.csv")
SIMULATORS = Table("simulators.csv")
WHERE = Table("where.csv")
BENCH = Table("bench.csv")
STRESS = Table("stress.csv")
CLAIMS = Table("claims.csv")
ORDERS = Table("orders.csv")
OURS = "wireval"
"""Name of this package's own wire among the simulators of these tables."""
