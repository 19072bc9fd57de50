"""What is known of a case on its way through the stages."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, Literal

from pipeline.load import scans
from pipeline.model import Lumen
from pipeline.run.cache import Store
from pipeline.run.frame import Frame
from pipeline.simulate.clamp import Entry
from pipeline.status import StageError
from pipeline.study.config import Config
from pipeline.study.manifest import Case

Stage = Literal["load", "segment", "trace", "simulate", "compare", "report"]
STAGES: tuple[Stage, ...] = ("load", "segment", "trace", "simulate", "compare", "report")
Progress = Callable[[str, int, int, str], None]
"""Called with stage, steps done, steps in all, and a short text."""


@dataclass
class CaseRun:
    """A case on its way through the stages: settings in, records out."""

    case: Case
    config: Config
    store: Store
    progress: Progress
    until: Stage = "report"
    frames: list[Frame] = field(default_factory=list)
    headers: scans.Scans | None = None
    lumen: Lumen | None = None
    entry: Entry | None = None
    hashes: dict[str, str] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STAGES, 0.0))
    counters: dict[str, dict[str, float]] = field(default_factory=lambda: {stage: {} for stage in STAGES})
    assumptions: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    failure: StageError | None = None
    failed_stage: str = ""

    @contextmanager
    def timed(self, stage: Stage, frame: Frame | None = None) -> Any:
        """Add the time of a block to a stage, and to a frame where one is given."""
        clock = perf_counter()
        try:
            yield
        finally:
            spent = perf_counter() - clock
            self.seconds[stage] += spent
            if frame is not None:
                frame.seconds[stage] = frame.seconds.get(stage, 0.0) + spent

    def count(self, stage: Stage, counters: Any) -> None:
        """Add a stage's counters to the case's."""
        total = self.counters[stage]
        for name, value in counters.items():
            total[name] = total.get(name, 0.0) + float(value)

    def wants(self, stage: Stage) -> bool:
        """Whether ``--until`` lets this stage run."""
        return STAGES.index(stage) <= STAGES.index(self.until)
