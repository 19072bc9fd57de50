"""What a case writes down on its way: times and counters, assumptions and warnings, and progress for the reader."""

import sys
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any, Literal, TextIO

import numpy as np

from pipeline.model import Counters, Levels
from reports.atomic import write_text, writing

Stage = Literal["load", "segment", "trace", "simulate", "compare", "report"]
STAGES: tuple[Stage, ...] = ("load", "segment", "trace", "simulate", "compare", "report")
Timed = Stage | Literal["clamp"]
TIMED: tuple[Timed, ...] = (*STAGES[:3], "clamp", *STAGES[3:5])
"""What has a column of seconds: the stages whose results are tables, and the clamp, with which `simulate` begins."""
Progress = Callable[[str, int, int, str], None]
"""Called with stage, steps done, steps in all, and a short text."""


def early_end(until: Stage) -> str:
    """The sentence of what is ok where a run was to end before frames are compared; else empty."""
    whole = STAGES.index(until) >= STAGES.index("compare")
    return "" if whole else f"nothing failed up to where the run was to end (--until {until})"


@dataclass
class Log:
    """Times and numbers by stage. seconds : of the whole case; frame_seconds : by (frame, stage).

    of_wires : those of ``warnings`` that concern the simulated wires, which whoever scores these inherits.
    chosen : what was chosen automatically, and why.     reused : number of results by stage that came from the store.
    """

    progress: Progress
    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys((*TIMED, "report"), 0.0))
    frame_seconds: dict[tuple[int, str], float] = field(default_factory=partial(defaultdict, float))
    assumptions: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    of_wires: list[str] = field(default_factory=list)
    chosen: dict[str, str] = field(default_factory=dict)
    reused: dict[str, int] = field(default_factory=partial(defaultdict, int))
    _counts: dict[str, dict[str, float]] = field(default_factory=lambda: defaultdict(dict))
    _levels: dict[str, dict[str, list[float]]] = field(default_factory=lambda: defaultdict(dict))

    @contextmanager
    def timed(self, stage: Timed, frame: int | None = None) -> Iterator[None]:
        """Add the time of a block to a stage, and to a frame where one is given."""
        clock = perf_counter()
        try:
            yield
        finally:
            self.spent(stage, perf_counter() - clock, frame)

    def begins(self, stage: Stage) -> None:
        """Note that a stage begins: the last line of the log of a case that is killed tells where it was."""
        self.progress(stage, 0, 0, "begins")

    def spent(self, stage: Timed, seconds: float, frame: int | None = None) -> None:
        """Add a time that was measured elsewhere."""
        self.seconds[stage] += seconds
        if frame is not None:
            self.frame_seconds[frame, stage] += seconds

    def count(self, stage: Stage, counters: Counters, levels: Levels | None = None) -> None:
        """Add a stage's counters to the case's, and note its levels."""
        total = self._counts[stage]
        for name, value in counters.items():
            total[name] = total.get(name, 0.0) + float(value)
        for name, value in (levels or {}).items():
            self._levels[stage].setdefault(name, []).append(float(value))

    def part(self) -> "Log":
        """An empty log for a part of the case that may be done in another process, to be added afterwards."""
        return Log(self.progress)

    def add(self, part: "Log") -> None:
        """Add the log of a part. Parts are added in their order, wherever they were done."""
        for stage, seconds in part.seconds.items():
            self.seconds[stage] += seconds
        for key, seconds in part.frame_seconds.items():
            self.frame_seconds[key] += seconds
        for stage, times in part.reused.items():
            self.reused[stage] += times
        self.assumptions += part.assumptions
        self.warnings += part.warnings
        self.chosen |= part.chosen
        for stage in STAGES:
            self.count(stage, part._counts[stage])
            for name, values in part._levels[stage].items():
                self._levels[stage].setdefault(name, []).extend(values)

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the progress callback: a log is pickled to be added to another one, which has its own."""
        return vars(self) | {"progress": None}

    @property
    def counters(self) -> dict[str, dict[str, float | dict[str, float]]]:
        """By stage: counts as their sums, levels as their least, median and greatest value."""
        return {stage: {**self._counts[stage], **_spread(self._levels[stage])} for stage in STAGES}


def _spread(levels: dict[str, list[float]]) -> dict[str, dict[str, float]]:
    """Least, median and greatest of the finite values of each level; nothing for a level without any."""
    known = {name: np.array(values)[np.isfinite(values)] for name, values in levels.items()}
    return {
        name: {"min": float(v.min()), "median": float(np.median(v)), "max": float(v.max())}
        for name, v in known.items()
        if v.size
    }


def last_stage(log: Path) -> str:
    """The last stage that a case's log names; empty where it names none."""
    if not log.is_file():
        return ""
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    words = (line.partition("] ")[2].partition(" ")[0] for line in reversed(lines))
    return next((word for word in words if word in STAGES), "")


SHOWN = ("segment", "trace", "compare")
"""Stages whose steps are printed; simulating a frame takes milliseconds and is printed with -v alone."""


@dataclass
class CaseProgress:
    """Reports the steps of one case, a line each. quiet : to its log alone; verbose : steps of every stage."""

    case: str
    log: Path
    stream: TextIO = field(default_factory=lambda: sys.stderr)
    quiet: bool = False
    verbose: bool = False
    _start: float = field(default_factory=perf_counter)

    def start(self) -> None:
        """Empty the log file."""
        write_text(self.log, "")  # in place of whatever stands there, as a pipe, on which nobody would read

    def __call__(self, stage: str, done: int, total: int, text: str) -> None:
        """One step of a stage is finished."""
        line = f"[{self.case}] {stage}{f' {done}/{total}' * bool(total)}  {text}"
        self.write(line)
        if total and (self.verbose or (stage in SHOWN and not self.quiet)):
            self.stream.write(line + "\n")
            self.stream.flush()

    def warn(self, text: str) -> None:
        """Write a line to the log and, even with ``quiet``, to the stream."""
        self.write(text)
        self.stream.write(f"[{self.case}] {text}\n")
        self.stream.flush()

    def write(self, line: str) -> None:
        """Write a line to the log alone, with the seconds since the start."""
        with writing(self.log), self.log.open("a", encoding="utf-8") as handle:
            handle.write(f"{perf_counter() - self._start:8.2f} s  {line}\n")
