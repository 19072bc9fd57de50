"""One case through the stages: load -> segment -> trace -> simulate -> compare.

A step takes what is known of the case and returns more; what it writes down on the way goes to the log.
"""

from collections.abc import Callable
from dataclasses import replace

from pipeline.run.log import Stage
from pipeline.run.stages.budget import budgeted
from pipeline.run.stages.compare import compare_frames
from pipeline.run.stages.known import Context, Known
from pipeline.run.stages.load import open_case
from pipeline.run.stages.others import of_their_run
from pipeline.run.stages.segment import scan_at_entry, segment_vessel
from pipeline.run.stages.simulate import simulate_frames
from pipeline.run.stages.trace import trace_frames
from pipeline.status import StageError

__all__ = ["Context", "Known", "run_stages"]

Step = Callable[[Context, Known], Known]
OF_WIRES = ("simulate", "compare")
"""Stages whose warnings concern the simulated wires; others' are of scans, traces and lumen, which a score has anew."""
STEPS: dict[Stage, Step] = {
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
            known = _noted(stage, step, run, known)
            known = budgeted(run, known) if stage == "compare" else known
        except StageError as error:
            unseen = scan_at_entry(run, known) if known.lumen is None else None
            return replace(known.failed(stage, error), at_entry=unseen)
    inherited = of_their_run(run)
    run.log.warnings += inherited
    run.log.of_wires += inherited
    return known


def _noted(stage: Stage, step: Step, run: Context, known: Known) -> Known:
    """What is known after a step; what it warns of the simulated wires is noted apart."""
    before = len(run.log.warnings)
    known = step(run, known)
    run.log.of_wires += run.log.warnings[before:] if stage in OF_WIRES else []
    return known
