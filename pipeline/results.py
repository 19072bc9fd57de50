"""The result files of one case: errors.csv, points.csv.gz, frames.h5, result.json and the view folder."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from skimage.measure import marching_cubes

from pipeline.case import CaseRun
from pipeline.frame import Frame
from pipeline.in_place import record
from pipeline.model import Lumen, Volume, arc_length
from pipeline.scans import projections, voxels
from pipeline.summary import NULLS, skill_of
from reports import export, frames_file, tables
from reports.atomic import write_text
from reports.schema import ERRORS, POINTS

NAN = float("nan")


def error_row(frame: Frame) -> dict[str, Any]:
    """One row of errors.csv."""
    row: dict[str, Any] = {
        "frame": frame.index,
        "status": frame.status,
        "insertion_mm": frame.depth_mm,
        "roll_deg": frame.roll_deg,
        **{
            f"{stage}_s": frame.seconds.get(stage, NAN)
            for stage in ("load", "segment", "trace", "simulate", "compare")
        },
        **{f"null_{name}_rms_mm": frame.nulls_rms_mm.get(name, NAN) for name in NULLS},
        **asdict(frame.truth),
    }
    if frame.comparison is not None:
        c = frame.comparison
        row |= {
            name: getattr(c, name)
            for name in (
                "rms_mm", "mean_mm", "p95_mm", "max_mm", "back_rms_mm", "hausdorff_mm", "arc_rms_mm", "arc_max_mm",
                "tip_mm", "tip_angle_deg", "branch_ok", "coverage",
            )
        }  # fmt: skip
        row["skill"] = skill_of(c.rms_mm, frame.nulls_rms_mm.get("centreline", NAN))
    if frame.curve is not None and len(frame.curve.sigma_mm):
        row["trace_sigma_mm"] = float(np.sqrt(np.mean(np.asarray(frame.curve.sigma_mm) ** 2)))
    if frame.simulated is not None:
        s = frame.simulated
        row |= {"max_penetration_mm": s.max_penetration_mm, "push_force_N": s.push_force_N}
        row |= {"joints": len(s.joints_mm), "iterations": s.iterations}
    return row


def _contact_at(frame: Frame, arc_mm: Any) -> Any:
    """Magnitude of the contact force of the joint nearest to each sample."""
    assert frame.simulated is not None
    force = np.linalg.norm(frame.simulated.contact_force_N, axis=1)
    arc = arc_length(frame.simulated.joints_mm)
    return force[np.abs(np.asarray(arc_mm)[:, None] - arc[None, :]).argmin(axis=1)]


def point_columns(frames: list[Frame]) -> dict[str, Any]:
    """points.csv.gz as columns."""
    parts: dict[str, list[Any]] = {}
    for frame in frames:
        c = frame.comparison
        if c is None:
            continue
        columns = {
            "frame": np.full(len(c.arc_mm), frame.index),
            "arc_mm": c.arc_mm,
            "x_mm": c.sample_mm[:, 0],
            "y_mm": c.sample_mm[:, 1],
            "z_mm": c.sample_mm[:, 2],
            "error_mm": c.error_mm,
            "foot_arc_mm": c.foot_arc_mm,
            "contact_force_N": _contact_at(frame, c.arc_mm),
        }
        for name, values in columns.items():
            parts.setdefault(name, []).append(values)
    return {name: np.concatenate(values) for name, values in parts.items()}


def _scan_of(lumen: Lumen) -> frames_file.ScanCrop:
    """Geometry of the crop, with the lumen's silhouettes for outlines."""
    grid = lumen.distance
    inside = Volume(
        (np.asarray(grid.values) < 0).astype(np.uint8), grid.spacing_mm, grid.origin_mm, grid.direction
    )
    silhouettes = dict(enumerate(projections(inside, (0.0, 1.0))))
    return frames_file.ScanCrop(grid.spacing_mm, grid.origin_mm, grid.direction, grid.shape, silhouettes)


def _arrays_of(frame: Frame) -> frames_file.FrameArrays:
    curve, wire, errors = frame.curve, frame.simulated, frame.comparison
    return frames_file.FrameArrays(
        frame.index,
        traced_mm=None if curve is None else curve.points_mm,
        trace_sigma_mm=None if curve is None else curve.sigma_mm,
        trace_flags=None if curve is None else np.asarray(curve.flagged) + 2.0 * np.asarray(curve.in_plane),
        simulated_mm=None if wire is None else wire.joints_mm,
        contact_force_N=None if wire is None else wire.contact_force_N,
        error_mm=None if errors is None else errors.error_mm,
        arc_mm=None if errors is None else errors.arc_mm,
        truth_mm=frame.truth_mm,
        mips=dict(enumerate(frame.projections)),
    )


def _write_view(folder: Path, run: CaseRun) -> None:
    """Files for 3D Slicer and ParaView, LPS mm."""
    if run.lumen is not None:
        grid = run.lumen.distance
        inside = (np.asarray(grid.values) < 0).astype(np.uint8)
        export.write_segmentation_nrrd(
            folder / "lumen.seg.nrrd", inside, grid.spacing_mm, grid.origin_mm, grid.direction, ("lumen",)
        )
        if inside.any() and not inside.all():
            vertices, triangles, _, _ = marching_cubes(
                np.array(grid.values, dtype=np.float32), 0.0
            )  # a copy: it wants to write
            export.write_surface_vtp(folder / "lumen.vtp", grid.to_mm(vertices), triangles)
    for frame in run.frames:
        _write_wires(folder, frame)


def _write_wires(folder: Path, frame: Frame) -> None:
    name = f"{frame.index:03d}"
    if frame.curve is not None and len(frame.curve.points_mm) > 1:
        export.write_markups_curve(
            folder / f"wire_traced_{name}.mrk.json", frame.curve.points_mm, f"traced {name}"
        )
    if frame.simulated is None:
        return
    joints = frame.simulated.joints_mm
    export.write_markups_curve(
        folder / f"wire_simulated_{name}.mrk.json", joints, f"simulated {name}", colour=(0.835, 0.369, 0.0)
    )
    arrays: dict[str, Any] = {"contact_force_N": frame.simulated.contact_force_N}
    points = joints
    if frame.comparison is not None:
        points = frame.comparison.sample_mm
        arrays = {
            "error_mm": frame.comparison.error_mm,
            "arc_mm": frame.comparison.arc_mm,
            "contact_force_N": _contact_at(frame, frame.comparison.arc_mm),
        }
    export.write_polyline_vtp(folder / f"wire_simulated_{name}.vtp", points, arrays)


def jsonable(value: Any) -> Any:
    """Plain JSON: NaN and infinities become null and "inf", arrays lists, paths strings."""
    if is_dataclass(value) and not isinstance(value, type):
        return jsonable(asdict(value))
    if isinstance(value, dict):
        return {str(k): jsonable(v) for k, v in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [jsonable(v) for v in value]
    if isinstance(value, (np.generic,)):
        return jsonable(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value if isinstance(value, (str, int, float, bool, type(None))) else str(value)


def write_json(path: Path, value: Any) -> None:
    """Write indented JSON, atomically."""
    write_text(path, json.dumps(jsonable(value), indent=1, ensure_ascii=False) + "\n")


def result_of(
    run: CaseRun, row: dict[str, Any], settings: dict[str, Any], extra: dict[str, Any]
) -> dict[str, Any]:
    """Content of result.json."""
    headers = [] if run.headers is None else [h for h in (run.headers.reference, *run.headers.frames) if h]
    text = {"case", "group", "role", "status"}
    return {
        "schema": 1,
        "case": run.case.id,
        "role": run.case.role,
        "group": run.case.group,
        "status": row["status"],
        "sentence": str(run.failure) if run.failure else _first_sentence(run.frames),
        "frames": [
            {k: getattr(f, k) for k in ("status", "sentence", "stage", "message")}
            | {"frame": f.index, "registration": record(f.registration), "trace": _marked(f)}
            for f in run.frames
        ],
        "counts": {"ok": row["frames_ok"], "failed": row["frames_failed"]},
        "statistics": {k: v for k, v in row.items() if k not in text},
        "seconds": run.seconds,
        "assumptions": run.assumptions,
        "warnings": run.warnings,
        "wire": asdict(run.case.wire),
        "wall": run.case.wall.model_dump(),
        "entry": _clamps(run),
        "geometry": voxels(headers),
        "inputs": [
            {"path": path, "sha256": digest, "bytes": Path(path).stat().st_size}
            for path, digest in run.hashes.items()
        ],
        "counters": run.counters,
        "config": settings,
        **extra,
    }


def _marked(frame: Frame) -> dict[str, float]:
    """Shares of a frame's traced points that are flagged, and that run nearly in the plane of rotation."""
    if frame.curve is None or len(frame.curve.points_mm) == 0:
        return {}
    marks = {"flagged": frame.curve.flagged, "in_plane": frame.curve.in_plane}
    return {name: float(np.mean(np.asarray(values))) for name, values in marks.items()}


def _clamps(run: CaseRun) -> dict[str, Any]:
    """The clamp as the manifest has it and as it was used."""
    given = {"entry_mm": run.case.entry_mm, "entry_direction": run.case.entry_direction}
    used = {} if run.entry is None else {"used_mm": run.entry.entry_mm, "used_direction": run.entry.direction}
    return given | used


def _first_sentence(frames: list[Frame]) -> str:
    return next((f.sentence for f in frames if not f.ok), "every frame is ok")


def write_tables(folder: Path, run: CaseRun, view: bool = True) -> None:
    """Everything of a case but result.json, which is written last: its presence says that the case is complete."""
    tables.write(folder / "errors.csv", ERRORS, [error_row(f) for f in run.frames])
    columns = point_columns(run.frames)
    if columns:
        tables.write(folder / "points.csv.gz", POINTS, columns)
    scan = None if run.lumen is None else _scan_of(run.lumen)
    frames_file.write_frames(folder / "frames.h5", scan, map(_arrays_of, run.frames))
    if view:
        _write_view(folder / "view", run)


def failure_rows(run: CaseRun) -> list[dict[str, Any]]:
    """Rows of failures.csv: the case itself, or each frame that is not ok."""
    log = f"cases/{run.case.id}/log.txt"
    if run.failure is not None:
        status = run.failure.status
        row = {"case": run.case.id, "stage": run.failed_stage, "status": status.identifier, "log": log}
        return [row | {"sentence": status.value, "message": str(run.failure)}]
    return [
        {
            "case": run.case.id,
            "frame": f.index,
            "stage": f.stage,
            "status": f.status,
            "sentence": f.sentence,
            "message": f.message,
            "log": log,
        }
        for f in run.frames
        if not f.ok
    ]
