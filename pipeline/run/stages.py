"""One case through the stages: load -> segment -> trace -> simulate -> compare."""

from __future__ import annotations

from collections.abc import Callable

from pipeline.run.opening import open_case
from pipeline.run.record import STAGES, CaseRun, Progress, Stage
from pipeline.run.replay import simulate_frames
from pipeline.run.scoring import compare_frames
from pipeline.run.vessel import segment_vessel
from pipeline.run.wires import trace_frames
from pipeline.status import StageError

__all__ = ["STAGES", "CaseRun", "Progress", "Stage", "run_stages"]


def run_stages(run: CaseRun) -> None:
    """Run every stage; what goes wrong with the whole case ends in ``run.failure``, with a frame in its record."""
    steps: tuple[tuple[Stage, Callable[[CaseRun], None]], ...] = (
        ("load", open_case),
        ("segment", segment_vessel),
        ("trace", trace_frames),
        ("simulate", simulate_frames),
        ("compare", compare_frames),
    )
    for stage, step in steps:
        if not run.wants(stage):
            return
        try:
            step(run)
        except StageError as error:
            run.failure, run.failed_stage = error, stage
            for frame in run.frames:
                frame.fail_from(stage, error)
            return
