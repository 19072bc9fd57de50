"""The progress of a batch: on a terminal one bar over all cases and points of a sweep, elsewhere lines of text.

The bar reads the logs that cases write anyway, so that workers need not send anything, wherever they run.
"""

import re
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TextIO

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TaskProgressColumn, TextColumn
from rich.table import Column

from pipeline.run.case import Job
from pipeline.run.ledger import RESULT
from pipeline.run.log import STAGES
from reports.case_files import GOOD, counted
from reports.records import read_json

EVERY_S = 0.3
STEP = re.compile(rf"\] ({'|'.join(STAGES)}) (\d+)/(\d+)  ")
WORK: dict[str, float] = dict(zip(STAGES, (0.05, 0.05, 0.5, 0.1, 0.2, 0.1), strict=True))
"""Rough shares of the stages in a case's time, for the estimate of the time left."""


def share_done(log: str) -> float:
    """How much of a case is done, 0 to 1, by the last step in its log."""
    stage, done, total = (STEP.findall(log) or [(STAGES[0], 0, 1)])[-1]
    before = sum(share for name, share in WORK.items() if STAGES.index(name) < STAGES.index(stage))
    return before + WORK[stage] * int(done) / max(int(total), 1)


def became(folder: Path) -> str:
    """What became of a case, by its result.json; just that it is finished where that cannot be read."""
    try:
        result = read_json(folder / RESULT)
    except (ValueError, OSError):
        return "finished"
    status, numbers = str(result.get("status", "ok")), result.get("summary", {})
    good, planned = numbers.get("frames_ok") or 0, numbers.get("frames") or 0
    if status in GOOD or good == planned > 0:
        return "finished"
    return f"finished, {good} of {counted(planned, 'frame')} ok" if good else f"failed: {status}"


@dataclass
class Watch:
    """Follows the jobs of a batch.

    silent : say nothing.     lines : no bar, even on a terminal.     stream : where bar and lines are written.
    """

    jobs: Sequence[Job]
    silent: bool = False
    lines: bool = False
    stream: TextIO = field(default_factory=lambda: sys.stderr)
    _start: float = field(default_factory=time.time)
    _finished: set[Path] = field(default_factory=set)
    _told: bool = False

    @property
    def bar(self) -> bool:
        """Whether a bar is shown, beside which cases must print nothing. TERM=dumb cannot draw one: it gets lines."""
        able = self.stream.isatty() and Console(file=self.stream).is_interactive
        return able and not (self.silent or self.lines)

    def finished(self, job: Job, error: str = "") -> None:
        """Count a job; where there is no bar a line says how far the batch is."""
        self._finished.add(job.folder)
        done, total = len(self._finished), len(self.jobs)
        if self.silent or self.bar or total < 2:
            return
        passed = time.time() - self._start
        left = self._rest(done)
        rest = f", about {left}" * bool(left)
        what = job.label if job.pictures else f"{job.label} with {job.out.name}"
        self.stream.write(f"{done}/{total} in {_clock(passed)}{rest}: {what} {error or became(job.folder)}\n")
        self.stream.flush()

    def _rest(self, done: float) -> str:
        """The time left, in words; none before it can be told."""
        if not 0 < done < len(self.jobs) or not self._tells():
            return ""
        return f"{_clock((time.time() - self._start) / done * (len(self.jobs) - done))} left"

    def _tells(self) -> bool:
        """Whether what is done says how long the rest takes: a case of a sweep takes ten times as long as a point,
        and comes first, so one with all its points must be finished.
        """
        if not self._told:
            labels = {job.label for job in self.jobs}
            left = {job.label for job in self.jobs if job.folder not in self._finished}
            self._told = len(labels) == len(self.jobs) or bool(labels - left)
        return self._told

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Show the bar while the block runs."""
        if not self.bar:
            yield
            return
        # the words come last and take what is left: on a narrow terminal they are cut, not the share and the rest
        words = TextColumn("{task.description}", markup=False, table_column=Column(ratio=1, no_wrap=True))
        columns = TaskProgressColumn(), TextColumn("{task.fields[rest]}"), BarColumn(16), words
        with Progress(*columns, console=Console(file=self.stream), transient=True, expand=True) as progress:
            task, stop = progress.add_task("starting", total=len(self.jobs), rest=""), threading.Event()
            thread = threading.Thread(target=self._follow, args=(progress, task, stop), daemon=True)
            thread.start()
            try:
                yield
            finally:
                stop.set()
                thread.join()

    def _follow(self, progress: Progress, task: TaskID, stop: threading.Event) -> None:
        while not stop.wait(EVERY_S):
            done, heard = self.now()
            words = f"{len(self._finished)}/{len(self.jobs)} {heard}"
            progress.update(task, completed=done, description=words, rest=self._rest(done))

    def now(self) -> tuple[float, str]:
        """Number of jobs done, with fractions for those that are running, and the latest log text of one of these."""
        done, heard = float(len(self._finished)), ""
        for log in (job.folder / "log.txt" for job in self.jobs if job.folder not in self._finished):
            if log.is_file() and log.stat().st_mtime >= self._start:
                text = log.read_text(encoding="utf-8", errors="replace")
                done, heard = done + share_done(text), text.rstrip().rpartition(" s  ")[2][:60]
        return done, heard


def _clock(seconds: float) -> str:
    """45 s, 3 min or 2 h 5 min."""
    minutes = round(seconds / 60)
    if minutes < 2:
        return f"{seconds:.0f} s"
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"
