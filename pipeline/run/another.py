"""Another insertion at the same depth, as a predictor: whoever has pushed the wire in once knows how it lay then.

It is known once all cases are done, so it is no part of a case: it stands in overall.csv alone.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline.arrays.polyline import to_length
from pipeline.compare.metrics import point_to_curve
from pipeline.compare.nulls import ANOTHER
from pipeline.model import Array
from pipeline.run.overall import Found
from reports.frames_file import read_frame

SAME_ENTRY_MM = 2.0
"""Insertions whose traces begin farther apart count their depths from different places."""
STEP_MM = 0.5
Traces = Mapping[int, tuple[float, Array]]
"""By frame, the depth in mm and the traced wire (n, 3)."""


def with_another(out: Path, found: Sequence[Found]) -> list[Found]:
    """The cases, their frames' rows with what the traces of other insertions into the same phantom leave."""
    phantoms = [case.result.phantom for case in found]
    shared = [case for case in found if case.result.phantom and phantoms.count(case.result.phantom) > 1]
    traces = {case.result.case: _traces(out, case) for case in shared}
    return [_with_another(case, shared, traces) if case in shared else case for case in found]


def _traces(out: Path, case: Found) -> Traces:
    path, found = out / "cases" / case.result.case / "frames.h5", {}
    for number, frame in case.frames.items():
        curve = read_frame(path, number).traced_mm if path.exists() else None
        if curve is not None and len(curve) > 1:
            found[number] = (float(frame.row["insertion_mm"]), curve)
    return found


def _with_another(case: Found, shared: Sequence[Found], traces: Mapping[str, Traces]) -> Found:
    """The case; each frame's guess is the mean over other insertions of what theirs at the nearest depth leaves."""
    kin = [c for c in shared if c.result.phantom == case.result.phantom and c.result.group != case.result.group]
    frames = dict(case.frames)
    for number, (depth, curve) in traces[case.result.case].items():
        near = [_nearest(traces[other.result.case], depth, curve) for other in kin]
        squares = [float(np.mean(point_to_curve(wire, curve)[0] ** 2)) for wire in near if wire is not None]
        if squares:
            row = {**frames[number].row, f"null_{ANOTHER}_rms_mm": float(np.sqrt(np.mean(squares)))}
            frames[number] = frames[number]._replace(row=row)
    return replace(case, frames=frames)


def _nearest(traces: Traces, depth_mm: float, curve: Array) -> Array | None:
    """The trace of the nearest depth, cut or continued; None where there is none, or its entry lies elsewhere."""
    if not traces:
        return None
    _, wire = min(traces.values(), key=lambda item: abs(item[0] - depth_mm))
    return to_length(wire, depth_mm, STEP_MM) if np.linalg.norm(wire[0] - curve[0]) < SAME_ENTRY_MM else None
