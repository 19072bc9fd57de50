"""One case through the stages: load -> segment -> trace -> simulate -> compare.

A step takes what is known of the case and returns more; what it writes down on the way goes to the log.
"""

from collections.abc import Callable
from dataclasses import replace

from pipeline.run.log import Stage
from pipeline.run.stages.compare import compare_frames
from pipeline.run.stages.known import Context, Known
from pipeline.run.stages.load import open_case
from pipeline.run.stages.others import of_their_run
from pipeline.run.stages.segment import scan_at_entry, segment_vessel
from pipeline.run.stages.simulate import simulate_frames
from pipeline.run.stages.trace import trace_frames
from pipeline.status import StageError

__all__ = ["Context", "Known", "run_stages"]

STEPS: dict[Stage, Callable[[Context, Known], Known]] = {
    "load": open_case,
    "segment": segment_vessel,
    "trace": trace_frames,
    "simulate": simulate_frames,
    "compare": compare_frames,
}


def run_stages(run: Context) -> Known:
    """Run the stages of a case; a StageError, which is of the whole case, ends them and becomes the failure."""
    known = Known()
    for stage, step in STEPS.items():
        if not run.goes_to(stage):
            break
        run.log.begins(stage)
        try:
            known = step(run, known)
        except StageError as error:
            unseen = scan_at_entry(run, known) if known.lumen is None else None
            return replace(known.failed(stage, error), at_entry=unseen)
    run.log.warnings += of_their_run(run)
    return known
