"""The beginning of simulate: where the wire is held, by the manifest or by the scans."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from pipeline.model import Clamp
from pipeline.run.calibrated import data_of
from pipeline.run.log import Log
from pipeline.run.stages.given import manifest_clamp, seen_in
from pipeline.run.stages.known import Context, Frame, Known
from pipeline.run.stages.load import open_case
from pipeline.run.stages.roll import with_fitted_roll
from pipeline.run.stages.segment import segment_vessel
from pipeline.run.stages.trace import trace_frames
from pipeline.run.stages.way import passed_at
from pipeline.simulate import altered, insertion_of, together
from pipeline.simulate.clamp import TracedFrame, estimated_clamp
from pipeline.simulate.departures import beside, departed
from pipeline.simulate.evidence import UNKNOWN_VOXELS
from pipeline.simulate.resolution import lengths_mm
from pipeline.simulate.way import Stop, Way
from pipeline.status import FrameStatus, StageError
from pipeline.study.manifest import Case
from solver import Solution

SHORT_MM = 0.125
"""Segments short enough for a wire's first 10 mm, whatever it does farther on."""


def clamp_of(run: Context, known: Known) -> Clamp:
    """The clamp of the simulation: estimated from the scans, or the manifest's."""
    given, prior, voxel_mm = manifest_clamp(run, known)
    seen = seen_in(known.frames)
    passed = beside([frame.curve for frame in seen], given, prior.sigma_mm, voxel_mm) if not known.off_the_scans else ""
    if run.config.simulate.entry == "manifest":
        run.log.warnings += [passed] * bool(passed)
        if run.case.entry_case is not None:
            unused = (
                f'entry = "case:{run.case.entry_case.id}" is not used: simulate.entry = manifest takes this case\'s own'
            )
            run.log.assumptions.append(unused)
        return given
    if run.case.entry_case is not None:
        return _of_another(run, run.case.entry_case, given, known.frames)
    replays = partial(_replayed, run, known), partial(_replayed, run, known, most_mm=SHORT_MM)
    clamp = estimated_clamp(seen, given, prior, replays, voxel_mm)
    # stated better than traces show it, an entry hardly moves, which is no departure from what is stated
    if prior.sigma_mm < UNKNOWN_VOXELS * voxel_mm and not departed(given, clamp, prior.sigma_mm, 0.0):
        clamp = replace(clamp, warning="; ".join(filter(None, (clamp.warning, passed))))
    run.log.assumptions += [clamp.note] * bool(clamp.note)
    # of traces that lie off the scans no entry or roll can be told: these are to be mended first
    run.log.warnings += [clamp.warning] * (bool(clamp.warning) and not known.off_the_scans)
    return clamp


def _of_another(run: Context, other: Case, given: Clamp, own: Sequence[Frame]) -> Clamp:
    """The clamp estimated from another insertion with the same fixation; this case's ``own`` scans are not used."""
    silent = Context(other, run.config, run.store, Log(lambda *_: None))
    known = with_fitted_roll(silent, trace_frames(silent, segment_vessel(silent, open_case(silent, Known()))))
    clamp = clamp_of(silent, known)
    exact = "its manifest states it exactly" * (not np.any(clamp.covariance))
    told = clamp.note or exact or "its manifest's, of which there is a warning" * bool(clamp.warning)
    if not told:  # what its manifest states is no better known here than what this case's own does
        why = f'entry = "case:{other.id}", but no frame of that case shows where its wire is held'
        raise StageError(FrameStatus.SIMULATE_FAILED, f"case {run.case.id!r}: {why}; name another, or take it off")
    mine, others = ({*data_of(case), *(f.voxels for f in of)} for case, of in ((run.case, own), (other, known.frames)))
    shares = "has scans of this case" if mine & others - {""} else ""
    if run.case.group == other.group:
        shares = f"is of the same insertion (group {other.group!r})"
    if shares:
        todo = "the clamp is not blind to it; name a case of another insertion"
        run.log.warnings.append(f"the clamp is that of case {other.id!r}, which {shares}: {todo}")
    else:
        blind = "the clamp is blind to this case's scans, it is that of case"
        run.log.assumptions.append(f"{blind} {other.id!r}: {told}")
    run.log.warnings += [f"of case {other.id!r}: {clamp.warning}"] * bool(clamp.warning)
    return replace(clamp, material_axis=given.material_axis, down=given.down, fitted=(), left_out=())


def _replayed(
    run: Context,
    known: Known,
    clamps: Sequence[Clamp],
    seen: Sequence[TracedFrame],
    depths: Sequence[Sequence[float]],
    most_mm: float = np.inf,
) -> list[list[Solution]]:
    """The wire of every frame from several clamps, with the longest segments, of ``most_mm`` at most."""
    case, config, lumen = run.case, run.config, known.vessel
    longest = lengths_mm(config.solver.segment_mm, altered(case.wire, config.simulate).rest_curvature_per_mm)[0]
    settings = config.solver.quick(min(longest, most_mm))
    insertions = [
        insertion_of(case.wire, case.wall, lumen, clamp, settings, config.simulate, case.catheter) for clamp in clamps
    ]
    through = _passed(run, known, seen)
    stops = [[Stop(f.index, mm, f.roll_deg, f.catheter_mm) for f, mm in zip(seen, way, strict=True)] for way in depths]
    return together(insertions, [Way.reading(way, through, sheathed=case.catheter is not None) for way in stops])


def _passed(run: Context, known: Known, seen: Sequence[TracedFrame]) -> list[Stop]:
    """The frames gone through between those that are fitted, which are the least deep where there are many.

    Of deeper ones neither the traced nor the refused ones are then gone through.
    """
    every = {frame.index for frame in seen_in(known.frames)}
    through = passed_at(known.frames, every, run.config.simulate.depth, manifest_clamp(run, known)[0])
    deepest = max(frame.curve.length_mm for frame in seen) if len(seen) < len(every) else np.inf
    return [stop for stop in through if stop.depth_mm <= deepest]
