"""The predictor ``another``: how the wire lay in other insertions into the same phantom at the nearest depth.

It needs the traces of all cases, so it is computed after them and stands in overall.csv alone.
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
from reports.frames_file import read_arrays

SAME_ENTRY_MM = 2.0
"""Traces that begin farther apart count their depths from different places and are not compared."""
STEP_MM = 0.5
MOST_OTHERS = 24
"""Most traces in a guess, those of the nearest depths: with all of 500 cases in one phantom it would take ten minutes,
and the root mean square over 24 is known to about a seventh of itself (1 / sqrt(48))."""
NOTHING: Array = np.zeros(0)
Trace = tuple[float, Array, float]
"""The depth in mm, the traced wire (n, 3) and the arc length in mm from which on it counts."""
Traces = Mapping[int, Trace]
"""Traces by frame."""


def with_another(out: Path, found: Sequence[Found]) -> list[Found]:
    """The cases, with the predictor's error added to the frames' rows where other insertions share the phantom."""
    phantoms = [case.result.phantom for case in found]
    shared = [case for case in found if case.result.phantom and phantoms.count(case.result.phantom) > 1]
    traces = {case.result.case: _traces(out, case) for case in shared}
    return [_with_another(case, shared, traces) if case in shared else case for case in found]


def _traces(out: Path, case: Found) -> Traces:
    path, found = out / "cases" / case.result.case / "frames.h5", {}
    kept = read_arrays(path, "traced_mm", "arc_mm") if path.exists() else {}
    for number, frame in case.frames.items():
        curve, arc = (kept.get(number, {}).get(name, NOTHING) for name in ("traced_mm", "arc_mm"))
        if len(curve) > 1:
            found[number] = (float(frame.row["insertion_mm"]), curve, float(arc[0]) if len(arc) else 0.0)
    return found


def _with_another(case: Found, shared: Sequence[Found], traces: Mapping[str, Traces]) -> Found:
    """The case, with the RMS distance of other insertions' nearest traces to the frame's own trace in each row."""
    mine = {frame.insertion for frame in case.frames.values()}
    phantom = [c for c in shared if c.result.phantom == case.result.phantom]
    kin = [c for c in phantom if mine.isdisjoint(frame.insertion for frame in c.frames.values())]
    others, frames = Others([list(traces[c.result.case].values()) for c in kin]), dict(case.frames)
    for number, (depth, curve, start) in traces[case.result.case].items():
        arc = samples(depth, STEP_MM)
        near = [at_arc(wire, arc[arc >= start - 1e-9]) for wire in others.nearest(depth, curve)]
        if near:
            mean = np.mean(point_to_curve(np.concatenate(near), curve)[0] ** 2)
            row = {**frames[number].row, f"null_{ANOTHER}_rms_mm": float(np.sqrt(mean))}
            frames[number] = frames[number]._replace(row=row)
    return replace(case, frames=frames)


class Others:
    """The traces of other cases in one flat list, each with the number of its case."""

    def __init__(self, insertions: Sequence[Sequence[Trace]]) -> None:
        self.traces = [(owner, *trace) for owner, traces in enumerate(insertions) for trace in traces]
        self.depths_mm = np.array([depth for _, depth, _, _ in self.traces])

    def nearest(self, depth_mm: float, curve: Array) -> list[Array]:
        """The trace of nearest depth of each other case, unless it begins elsewhere; at most MOST_OTHERS."""
        near: list[Array] = []
        seen: set[int] = set()
        for place in np.argsort(np.abs(self.depths_mm - depth_mm), kind="stable"):
            owner, _, wire, _ = self.traces[place]
            if owner not in seen and math.dist(wire[0], curve[0]) < SAME_ENTRY_MM:
                near.append(wire)
            seen.add(owner)
            if len(near) == MOST_OTHERS:
                break
        return near
