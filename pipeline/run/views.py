"""frames.h5, and the files of a case that 3D Slicer and ParaView open; LPS mm."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from skimage.measure import marching_cubes

from pipeline.model import Lumen, Volume
from pipeline.run.rows import contact_at
from pipeline.run.stages import Known
from pipeline.run.stages.known import Frame
from pipeline.run.stages.trace import projections
from reports import export, frames_file

SIMULATED_COLOUR = (0.835, 0.369, 0.0)


def write_frames(path: Path, known: Known) -> None:
    """frames.h5: curves of every frame, projections of its scan, and the lumen's outline."""
    scan = None if known.lumen is None else _scan_of(known.lumen)
    frames_file.write_frames(path, scan, map(_arrays_of, known.frames))


def write_view(folder: Path, known: Known) -> None:
    """The lumen and every frame's wires, each in a file."""
    if known.lumen is not None:
        _write_lumen(folder, known.lumen)
    for frame in known.frames:
        _write_wires(folder, frame)


def _scan_of(lumen: Lumen) -> frames_file.ScanCrop:
    """Geometry of the crop, with the lumen's silhouettes for outlines."""
    grid = lumen.distance
    inside = Volume((grid.values < 0).astype(np.uint8), grid.spacing_mm, grid.origin_mm, grid.direction)
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


def _write_lumen(folder: Path, lumen: Lumen) -> None:
    grid = lumen.distance
    inside = (grid.values < 0).astype(np.uint8)
    export.write_segmentation_nrrd(
        folder / "lumen.seg.nrrd", inside, grid.spacing_mm, grid.origin_mm, grid.direction, ("lumen",)
    )
    if inside.any() and not inside.all():
        # a copy, since marching cubes wants to write
        vertices, triangles, _, _ = marching_cubes(np.array(grid.values, dtype=np.float32), 0.0)
        export.write_surface_vtp(folder / "lumen.vtp", grid.to_mm(vertices), triangles)


def _write_wires(folder: Path, frame: Frame) -> None:
    name = f"{frame.index:03d}"
    if frame.curve is not None and frame.traced:
        path = folder / f"wire_traced_{name}.mrk.json"
        export.write_markups_curve(path, frame.curve.points_mm, f"traced {name}")
    if frame.simulated is None:
        return
    points = joints = frame.simulated.joints_mm
    path = folder / f"wire_simulated_{name}.mrk.json"
    export.write_markups_curve(path, joints, f"simulated {name}", colour=SIMULATED_COLOUR)
    arrays: dict[str, Any] = {"contact_force_N": frame.simulated.contact_force_N}
    if frame.comparison is not None:
        errors = frame.comparison
        points = errors.sample_mm
        arrays = {"error_mm": errors.error_mm, "arc_mm": errors.arc_mm}
        arrays["contact_force_N"] = contact_at(frame, errors.arc_mm)
    export.write_polyline_vtp(folder / f"wire_simulated_{name}.vtp", points, arrays)
