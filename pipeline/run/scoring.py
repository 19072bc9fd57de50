"""compare: errors of every frame beside those of the trivial predictors."""

from __future__ import annotations

from typing import Any

from pipeline.arrays.polyline import to_length
from pipeline.compare import compare, compare_truth, nulls, point_to_curve, rms
from pipeline.run.frame import Frame
from pipeline.run.record import CaseRun
from pipeline.status import FrameStatus


def compare_frames(run: CaseRun) -> None:
    """Errors of every frame with both curves, beside those of the trivial predictors."""
    assert run.lumen is not None
    traced = [f for f in run.frames if f.curve is not None and len(f.curve.points_mm) > 1]
    with run.timed("compare"):
        static = _static_nulls(run, traced)
    curves = [f.curve for f in run.frames]
    for frame in run.frames:
        with run.timed("compare", frame):
            if run.headers is not None and not run.headers.frames:
                if frame.ok:
                    frame.status, frame.sentence = (
                        FrameStatus.SIMULATED.identifier,
                        FrameStatus.SIMULATED.value,
                    )
            elif frame in traced and frame.simulated is not None:
                assert frame.curve is not None
                frame.comparison = compare(frame.simulated, frame.curve, run.lumen, run.config.compare)
                _score_nulls(run, frame, static, nulls.previous(curves, frame.index, frame.depth_mm))
            if frame.truth_mm is not None:
                frame.truth = compare_truth(frame.truth_mm, frame.curve, frame.simulated, run.config.compare)


def _static_nulls(run: CaseRun, traced: list[Frame]) -> nulls.Nulls | None:
    if not traced:
        return None
    assert run.lumen is not None
    deepest = max(traced, key=lambda f: f.curve.length_mm if f.curve else 0.0)
    assert deepest.curve is not None
    assert run.entry is not None
    return nulls.build(
        run.lumen, run.entry.entry_mm, run.entry.direction, deepest.curve.points_mm, run.case.wire.radius_mm
    )


def _score_nulls(run: CaseRun, frame: Frame, static: nulls.Nulls | None, previous: Any) -> None:
    assert frame.curve is not None
    guesses = {"previous": previous}
    if static is not None:
        guesses |= {name: static.at_depth(name, frame.depth_mm) for name in ("centreline", "shortest")}
        guesses["min_bending"] = static.min_bending(frame.depth_mm)
    step = run.config.compare.sample_mm
    for name, guess in guesses.items():
        if guess is not None:
            points = to_length(guess, frame.depth_mm, step)
            frame.nulls_rms_mm[name] = rms(point_to_curve(points, frame.curve.points_mm)[0])
