"""Progress of long work: a bar on a terminal, one line per finished frame elsewhere, everything in log.txt."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any, TextIO

SHOWN = ("segment", "trace", "compare")
"""Stages whose steps are printed; simulating a frame takes milliseconds and goes to the log alone."""


@dataclass
class CaseProgress:
    """Reports the steps of one case."""

    case: str
    log: Path
    stream: TextIO = field(default_factory=lambda: sys.stderr)
    quiet: bool = False
    _start: float = field(default_factory=perf_counter)
    _bar: Any = None
    _stage: str = ""

    def __post_init__(self) -> None:
        """Start an empty log."""
        self.log.parent.mkdir(parents=True, exist_ok=True)
        self.log.write_text("", encoding="utf-8")

    def __call__(self, stage: str, done: int, total: int, text: str) -> None:
        """One step of a stage is finished."""
        line = f"[{self.case}] {stage} {done}/{total}  {text}"
        self.write(line)
        if self.quiet or stage not in SHOWN:
            return
        if self.stream.isatty():
            self._show_bar(stage, done, total, text)
        else:
            self.stream.write(line + "\n")
            self.stream.flush()

    def say(self, text: str) -> None:
        """A line for the reader and the log that belongs to no step."""
        self.write(text)
        if not self.quiet:
            self.stream.write(f"[{self.case}] {text}\n")
            self.stream.flush()

    def write(self, line: str) -> None:
        """A line for the log alone."""
        with self.log.open("a", encoding="utf-8") as handle:
            handle.write(f"{perf_counter() - self._start:8.2f} s  {line}\n")

    def _show_bar(self, stage: str, done: int, total: int, text: str) -> None:
        from tqdm import tqdm

        if stage != self._stage:
            self.close()
            self._bar = tqdm(total=total, desc=f"{self.case} {stage}", file=self.stream, leave=False)
            self._stage = stage
        self._bar.update(done - self._bar.n)
        self._bar.set_postfix_str(text)

    def close(self) -> None:
        """Remove the bar."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None
