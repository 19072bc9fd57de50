"""The files of a case beside result.json.

A frame as a row of errors.csv, its points as points.csv.gz, the case as a row of summary.csv; frames.h5. LPS mm.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.compare.metrics import rms
from pipeline.compare.pooled import Row, Scored, is_pooled, pooled, skill_of, within
from pipeline.model import Clamp, Volume
from pipeline.run.log import TIMED, Log
from pipeline.run.projections import projections
from pipeline.run.stages import Known
from pipeline.run.stages.known import Frame
from pipeline.run.view import contact_at
from pipeline.status import FrameStatus
from pipeline.study.manifest import Case
from reports import frames_file
from solver import Solution

BEYOND = 2.0
"""An error of more than this many u is attributed to the model."""


def summary_row(case: Case, known: Known, errors: Sequence[Row]) -> dict[str, Any]:
    """The row of a case in summary.csv. errors : its rows of errors.csv."""
    failed = next((f for f in known.frames if not f.ok), None)
    good = "ok" if case.compared else FrameStatus.SIMULATED.identifier
    status = known.failure.status.identifier if known.failure else good if failed is None else failed.status
    planned = [frame for frame in known.frames if frame.status != FrameStatus.ROLL_FITTED.identifier]
    count = sum(frame.ok for frame in planned)
    head: dict[str, Any] = {"case": case.id, "group": case.group, "role": case.role, "status": status}
    head |= {"frames": len(planned), "frames_ok": count, "frames_failed": len(planned) - count}
    head["frames_fitted"] = len(known.frames) - len(planned)
    pairs = [(row, f.comparison) for row, f in zip(errors, known.frames, strict=True) if f.comparison is not None]
    scored = [
        Scored(row, c.error_mm, c.arc_mm, case.group, case=case.id) for row, c in pairs if is_pooled(row, c.error_mm)
    ]
    if case.compared:
        head["within_1mm"] = within(errors, len(planned))
    wires = [wire for frame in known.frames if (wire := frame.simulated_wire) is not None]
    if wires:
        head["max_penetration_mm"] = max(wire.max_penetration_mm for wire in wires)
    solved = [wire.push_force_N for wire in wires if isinstance(wire, Solution)]
    head |= {"push_force_max_N": max(solved)} if solved else {}
    if np.isfinite(known.ends_rank):
        head["ends_rank"] = known.ends_rank
    return head | pooled(scored)


def timing_rows(case: str, log: Log, **whole: float) -> list[dict[str, Any]]:
    """Rows of timings.csv: the case, with its values ``whole`` (total time, peak memory), then its frames."""
    rows = {frame: {"case": case, "frame": frame} for frame in sorted({index for index, _ in log.frame_seconds})}
    for (index, stage), seconds in log.frame_seconds.items():
        rows[index] |= {f"{stage}_s": seconds}
    return [{"case": case, **{f"{stage}_s": log.seconds[stage] for stage in TIMED}, **whole}, *rows.values()]


def error_row(frame: Frame, clamp: Clamp | None = None) -> dict[str, Any]:
    """One row of errors.csv. clamp : that of the case; None where it is not known."""
    row: dict[str, Any] = {
        "frame": frame.index,
        "status": frame.status,
        "insertion_mm": frame.depth_mm,
        "roll_deg": frame.roll_deg,
    }
    if clamp is not None:
        row["clamp_note"] = next((name for name in ("fitted", "left_out") if frame.index in getattr(clamp, name)), None)
    row |= {f"null_{name}_rms_mm": value for name, value in frame.nulls_rms_mm.items()}
    row |= frame.truth
    if frame.comparison is not None:
        row |= frame.comparison.values
        null = frame.nulls_rms_mm.get("centreline", float("nan"))
        row["skill"] = skill_of(float(frame.comparison["rms_mm"]), null)
    if frame.curve is not None and len(frame.curve.sigma_mm):
        row |= {"trace_sigma_mm": rms(frame.curve.sigma_mm), "tip_sigma_mm": frame.curve.tip_sigma_mm}
    if frame.simulated is not None:
        row["joints"] = len(frame.simulated.joints_mm)
    wire = frame.simulated_wire
    if wire is not None:
        row["max_penetration_mm"] = wire.max_penetration_mm
    if isinstance(wire, Solution):
        row |= {"push_force_N": wire.push_force_N, "num_push_N": frame.num_push_N}
        row |= {"iterations": wire.iterations, "num_mm": frame.num_mm}
        row |= {"snaps": len(wire.snaps), "uncertain": frame.uncertain, "least_pivot": wire.least_pivot}
    return row | budget_of(frame)


def budget_of(frame: Frame) -> dict[str, Any]:
    """What the ensemble says of a frame, as fields of errors.csv."""
    budget = frame.budget
    if budget is None:
        return {}
    row: dict[str, Any] = {"u_input_mm": rms(budget.input_mm), "energy_score_mm": budget.energy_score_mm}
    row["released"] = budget.released or None
    if budget.whole_mm is not None:
        row["u_val_mm"] = rms(budget.whole_mm)
    if budget.shapes is not None:
        real = budget.shapes.real
        row |= {"release": budget.shapes.simulated, "release_real": real, "log_score_bits": -float(np.log2(real))}
    elif budget.ratio is not None:
        row["share_beyond_2u"] = float(np.mean(budget.ratio > BEYOND))
    if frame.solved is not None and frame.solved.snaps:
        row["released_at_mm"] = frame.solved.snaps[0].from_mm
    return row


def with_strongest(errors: Sequence[dict[str, Any]], summary: Row) -> list[dict[str, Any]]:
    """The rows of errors.csv with their skill against the case's strongest predictor."""
    name = summary.get("strongest_null")
    if not name:
        return list(errors)
    nulls = [row.get(f"null_{name}_rms_mm", float("nan")) for row in errors]
    skills = [skill_of(row.get("rms_mm", float("nan")), null) for row, null in zip(errors, nulls, strict=True)]
    return [row | {"skill_strongest": skill, "strongest_null": name} for row, skill in zip(errors, skills, strict=True)]


def point_columns(frames: Sequence[Frame]) -> dict[str, NDArray[Any]]:
    """points.csv.gz as columns; empty where nothing was compared."""
    parts = [_points(frame) for frame in frames if frame.comparison is not None]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]} if parts else {}


def _points(frame: Frame) -> dict[str, NDArray[Any]]:
    assert frame.comparison is not None
    c = frame.comparison
    return {
        "frame": np.full(len(c.arc_mm), frame.index),
        "status": np.full(len(c.arc_mm), frame.status),
        "arc_mm": c.arc_mm,
        **{f"{axis}_mm": c.sample_mm[:, i] for i, axis in enumerate("xyz")},
        "error_mm": c.error_mm,
        "foot_arc_mm": c.foot_arc_mm,
        "contact_force_N": contact_at(frame, c.arc_mm),
        **_over_u(frame, len(c.arc_mm)),
    }


def _over_u(frame: Frame, count: int) -> dict[str, NDArray[Any]]:
    """u_val and the error over it at the points of a frame; NaN where there is no budget."""
    budget, nothing = frame.budget, np.full(count, np.nan)
    u, ratio = (None, None) if budget is None else (budget.u_mm, budget.ratio)
    return {"u_val_mm": nothing if u is None else u, "error_over_u": nothing if ratio is None else ratio}


def message_of(frame: Frame, known: Known) -> str:
    """What went wrong with a frame, and the name of its scan: the frame's number alone does not tell the file."""
    if not frame.message or frame.index >= len(known.scans.frames):
        return frame.message
    source = known.scans.frames[frame.index].source
    name = str(replace(source, path=Path(source.path.name)))
    return frame.message if name in frame.message else f"{frame.message} (scan {name})"


def failure_rows(case: str, known: Known) -> list[dict[str, Any]]:
    """Rows of failures.csv: the case itself, or each frame that is not ok."""
    log = f"cases/{case}/log.txt"
    if known.failure is not None:
        status = known.failure.status
        row = {"case": case, "stage": known.failed_stage, "status": status.identifier, "log": log}
        return [row | {"sentence": status.value, "message": str(known.failure)}]
    return [
        {"case": case, "frame": f.index, "stage": f.stage, "status": f.status, "sentence": f.sentence}
        | {"message": message_of(f, known), "log": log}
        for f in known.frames
        if not f.ok
    ]


def write_frames(path: Path, known: Known) -> None:
    """Write frames.h5: each frame's curves and projections; the lumen's outline, without one the scan at the entry."""
    scan = known.at_entry
    if known.lumen is not None:
        grid = known.lumen.distance
        inside = Volume((grid.values < 0).astype(np.uint8), grid.spacing_mm, grid.origin_mm, grid.direction)
        outlines = dict(enumerate(projections(inside, (0.0, 1.0))))
        scan = frames_file.ScanCrop(grid.spacing_mm, grid.origin_mm, grid.direction, grid.shape, outlines)
    frames_file.write_frames(path, scan, map(_arrays_of, known.frames))


def _arrays_of(frame: Frame) -> frames_file.FrameArrays:
    curve, wire, errors = frame.curve, frame.simulated, frame.comparison
    return frames_file.FrameArrays(
        frame.index,
        status=frame.status,
        traced_mm=None if curve is None else curve.points_mm,
        trace_sigma_mm=None if curve is None else curve.sigma_mm,
        trace_flags=None if curve is None else np.asarray(curve.flagged) + 2.0 * np.asarray(curve.in_plane),
        simulated_mm=None if wire is None else wire.joints_mm,
        contact_force_N=None if frame.solved is None else frame.solved.contact_force_N,
        error_mm=None if errors is None else errors.error_mm,
        arc_mm=None if errors is None else errors.arc_mm,
        median_mm=None if frame.budget is None else frame.budget.median_mm,
        covariance_mm2=None if frame.budget is None else frame.budget.covariance_mm2,
        truth_mm=frame.truth_mm,
        seen_in_view_mm=frame.in_view_mm[0] if frame.in_view_mm else None,
        simulated_in_view_mm=frame.in_view_mm[1] if frame.in_view_mm else None,
        mips=dict(enumerate(frame.projections)),
        straightened=frame.straightened,
    )
