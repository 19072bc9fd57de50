"""Another insertion at the same depth, as a predictor: whoever has pushed the wire in once knows how it lay then.

It is known once all cases are done, so it is no part of a case: it stands in overall.csv alone.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline.arrays.polyline import at_arc, samples
from pipeline.compare.metrics import point_to_curve
from pipeline.compare.nulls import ANOTHER
from pipeline.model import Array
from pipeline.run.overall import Found
from reports.frames_file import read_frame

SAME_ENTRY_MM = 2.0
"""Insertions whose traces begin farther apart count their depths from different places."""
STEP_MM = 0.5
Traces = Mapping[int, tuple[float, Array, float]]
"""By frame, the depth in mm, the traced wire (n, 3) and the arc length in mm from which on it counts."""


def with_another(out: Path, found: Sequence[Found]) -> list[Found]:
    """The cases, their frames' rows with what the traces of other insertions into the same phantom leave."""
    phantoms = [case.result.phantom for case in found]
    shared = [case for case in found if case.result.phantom and phantoms.count(case.result.phantom) > 1]
    traces = {case.result.case: _traces(out, case) for case in shared}
    return [_with_another(case, shared, traces) if case in shared else case for case in found]


def _traces(out: Path, case: Found) -> Traces:
    path, found = out / "cases" / case.result.case / "frames.h5", {}
    for number, frame in case.frames.items():
        arrays = read_frame(path, number) if path.exists() else None
        if arrays is not None and arrays.traced_mm is not None and len(arrays.traced_mm) > 1:
            start = 0.0 if arrays.arc_mm is None or not len(arrays.arc_mm) else float(arrays.arc_mm[0])
            found[number] = (float(frame.row["insertion_mm"]), arrays.traced_mm, start)
    return found


def _with_another(case: Found, shared: Sequence[Found], traces: Mapping[str, Traces]) -> Found:
    """The case; each frame's guess is the mean over other insertions of what theirs at the nearest depth leaves."""
    kin = [c for c in shared if c.result.phantom == case.result.phantom and c.result.group != case.result.group]
    frames = dict(case.frames)
    for number, (depth, curve, start) in traces[case.result.case].items():
        near = [_nearest(traces[other.result.case], depth, curve, start) for other in kin]
        squares = [float(np.mean(point_to_curve(wire, curve)[0] ** 2)) for wire in near if wire is not None]
        if squares:
            row = {**frames[number].row, f"null_{ANOTHER}_rms_mm": float(np.sqrt(np.mean(squares)))}
            frames[number] = frames[number]._replace(row=row)
    return replace(case, frames=frames)


def _nearest(traces: Traces, depth_mm: float, curve: Array, start_mm: float) -> Array | None:
    """The trace of the nearest depth from ``start_mm`` on; None where there is none, or its entry lies elsewhere."""
    if not traces:
        return None
    _, wire, _ = min(traces.values(), key=lambda item: abs(item[0] - depth_mm))
    arc = samples(depth_mm, STEP_MM)
    return at_arc(wire, arc[arc >= start_mm - 1e-9]) if np.linalg.norm(wire[0] - curve[0]) < SAME_ENTRY_MM else None
