"""Another insertion at the same depth, as a predictor: whoever has pushed the wire in once knows how it lay then.

It is known once all cases are done, so it is no part of a case: it stands in overall.csv alone.
"""

import math
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
MOST_OTHERS = 24
"""Insertions that a guess is the mean of, those that stopped nearest to the depth: with all of 500 cases in one phantom
it would take ten minutes, and the mean of so many is known to a seventh of their spread."""
Trace = tuple[float, Array, float]
"""The depth in mm, the traced wire (n, 3) and the arc length in mm from which on it counts."""
Traces = Mapping[int, Trace]
"""By frame."""


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
    mine = {frame.insertion for frame in case.frames.values()}
    phantom = [c for c in shared if c.result.phantom == case.result.phantom]
    kin = [c for c in phantom if mine.isdisjoint(frame.insertion for frame in c.frames.values())]
    others, frames = [list(traces[c.result.case].values()) for c in kin], dict(case.frames)
    for number, (depth, curve, start) in traces[case.result.case].items():
        arc = samples(depth, STEP_MM)
        near = [at_arc(wire, arc[arc >= start - 1e-9]) for wire in _nearest(others, depth, curve)]
        if near:
            mean = np.mean([np.mean(point_to_curve(wire, curve)[0] ** 2) for wire in near])
            row = {**frames[number].row, f"null_{ANOTHER}_rms_mm": float(np.sqrt(mean))}
            frames[number] = frames[number]._replace(row=row)
    return replace(case, frames=frames)


def _nearest(others: Sequence[Sequence[Trace]], depth_mm: float, curve: Array) -> list[Array]:
    """Of each other insertion the trace of the nearest depth, of those that begin where the curve does."""
    each = [min(traces, key=lambda trace: abs(trace[0] - depth_mm)) for traces in others if traces]
    same = [(abs(depth - depth_mm), wire) for depth, wire, _ in each if math.dist(wire[0], curve[0]) < SAME_ENTRY_MM]
    return [wire for _, wire in sorted(same, key=lambda item: item[0])[:MOST_OTHERS]]
