"""Four entries: the clamp from the scans or the manifest, each with depths from the traces or the manifest.

Side by side their errors tell how much of an error was in what the user stated, and how much was taken from the scans.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pipeline.compare.metrics import DISTAL_MM, Pair, VesselAxis, distal, pair_of, rms
from pipeline.model import Clamp
from pipeline.run.stages.given import manifest_clamp
from pipeline.run.stages.known import Context, Frame, Known
from pipeline.run.stages.way import passed_at, stop_of
from pipeline.simulate import insertion_of, together
from pipeline.simulate.clamp import depth_from
from pipeline.simulate.way import Way
from solver import Solution

Entry = tuple[Clamp, str]
"""A clamp, and where depths come from."""


def _frames(known: Known) -> list[Frame]:
    """The frames that are compared: ok, traced and simulated."""
    return [f for f in known.frames if f.ok and f.traced and f.simulated_wire is not None]


def _entries(run: Context, known: Known) -> dict[tuple[str, str], Entry]:
    """The four entries by the names of clamp and depth; empty where one of them cannot be had or none is asked for."""
    wires = run.case.frames or run.case.traces
    stated = run.case.insertion_mm is not None and wires and run.config.compare.simulated_nulls
    if not _frames(known) or not stated or known.clamp is None or run.config.simulate.entry == "manifest":
        return {}
    clamps = {"estimated": known.clamp, "manifest": manifest_clamp(run, known)[0]}
    return {(name, depth): (clamp, depth) for name, clamp in clamps.items() for depth in ("traced", "manifest")}


def replayed_entries(run: Context, known: Known) -> list[list[Solution]]:
    """The wires of each frame from four entries, with the segments of the case."""
    case, config = run.case, run.config
    entries = _entries(run, known).values()
    if not entries:
        return []
    solver = replace(config.solver, segment_mm=known.segment_mm)
    shared = solver, config.simulate, case.catheter
    insertions = [insertion_of(case.wire, case.wall, known.vessel, clamp, *shared) for clamp, _ in entries]
    return together(insertions, [_way(run, known, *entry) for entry in entries])


def _way(run: Context, known: Known, clamp: Clamp, depth: str) -> Way:
    """The way of the hand from one of the entries."""
    own = [replace(frame, depth_mm=_depth(frame, clamp, depth)) for frame in _frames(known)]
    through = passed_at(known.frames, {frame.index for frame in own}, depth, clamp)
    return Way.reading(map(stop_of, own), through, sheathed=run.case.catheter is not None)


def four_entries(
    run: Context, known: Known, wires: Sequence[Sequence[Solution]], way: VesselAxis
) -> tuple[dict[str, Any], ...]:
    """Rows of entries.csv, over the frames that are ok and come to rest in all four; none where there are not four.

    wires : of ``replayed_entries``.
    """
    frames = _frames(known)
    kept = [i for i in range(len(frames)) if all(one[i].converged for one in wires)]
    pairs = [[_pair(run, known, frames[i], one[i], way) for i in kept] for one in wires]
    return tuple(_row(*names, own) for names, own in zip(_entries(run, known), pairs, strict=True) if own)


def _depth(frame: Frame, clamp: Clamp, depth: str) -> float:
    assert frame.curve is not None
    return depth_from(clamp, frame.curve) if depth == "traced" else frame.expected_mm


def _pair(run: Context, known: Known, frame: Frame, wire: Solution, way: VesselAxis) -> Pair:
    assert frame.curve is not None
    return pair_of(wire, frame.curve, known.vessel, run.config.compare, way)


def _row(clamp: str, depth: str, pairs: Sequence[Pair]) -> dict[str, Any]:
    ends = [distal(pair.error_mm, pair.arc_mm, DISTAL_MM["distal10_rms_mm"]) for pair in pairs]
    return {
        "clamp": clamp,
        "depth": depth,
        "frames": len(pairs),
        "rms_mm": rms(np.concatenate([pair.error_mm for pair in pairs])),
        "distal10_rms_mm": rms(np.concatenate(ends)),
        "tip_median_mm": float(np.median([np.linalg.norm(pair.wire_mm[-1] - pair.curve_mm[-1]) for pair in pairs])),
    }
