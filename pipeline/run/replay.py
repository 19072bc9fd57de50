"""simulate: the whole insertion replayed once, from the measured clamp to the depth of every frame."""

from __future__ import annotations

import numpy as np

from pipeline.run.frame import Frame
from pipeline.run.record import CaseRun
from pipeline.simulate.clamp import Entry, measured_entry
from pipeline.simulate.replay import simulate
from pipeline.status import FrameStatus, StageError


def simulate_frames(run: CaseRun) -> None:
    """Replay the whole insertion once; a frame without a known depth is passed over."""
    assert run.lumen is not None
    run.entry = _clamp(run)
    for frame in run.frames:
        frame.depth_mm = _depth(run, frame)
        if np.isnan(frame.depth_mm):
            frame.fail(
                "simulate", FrameStatus.SIMULATE_FAILED, "no depth: nothing traced and no insertion_mm given"
            )
    replay = [f for f in run.frames if not np.isnan(f.depth_mm)]
    if not replay:
        return
    depths, angles = [f.depth_mm for f in replay], [f.roll_deg for f in replay]
    try:
        solutions = simulate(
            run.case, run.entry, run.lumen, depths, angles, run.config.solver, run.config.simulate
        )
        for frame, result in zip(replay, solutions, strict=True):
            frame.simulated = result
            frame.seconds["simulate"] = result.seconds
            run.seconds["simulate"] += result.seconds
            run.count("simulate", result.work)
            if not result.converged:
                frame.fail_with("simulate", result.status, result.sentence)
            run.progress(
                "simulate", frame.index + 1, len(run.frames), f"{result.status} {result.depth_mm:.1f} mm"
            )
    except ValueError as error:
        raise StageError(FrameStatus.SIMULATE_FAILED, f"case {run.case.id!r}: {error}") from error


def _depth(run: CaseRun, frame: Frame) -> float:
    """Depth to simulate a frame at: the traced length, else the manifest's; NaN where neither is known."""
    traced = (
        frame.curve.length_mm if frame.curve is not None and len(frame.curve.points_mm) > 1 else float("nan")
    )
    if run.config.simulate.depth == "manifest" or np.isnan(traced):
        return frame.expected_mm
    return traced


def _clamp(run: CaseRun) -> Entry:
    """The clamp of the simulation: measured in the scans, or the manifest's."""
    given = Entry(np.array(run.case.entry_mm), np.array(run.case.entry_direction))
    if run.config.simulate.entry == "manifest":
        return given
    good = [f.curve for f in run.frames if f.ok and f.curve is not None]
    entry = measured_entry(good, given.entry_mm, given.direction)
    run.assumptions += [entry.note] * bool(entry.note)
    run.warnings += [entry.warning] * bool(entry.warning)
    return entry
