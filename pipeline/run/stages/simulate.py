"""simulate: the whole insertion replayed once, from the clamp to the depth of every frame."""

from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from pipeline.model import Clamp
from pipeline.run.stages.known import Context, Frame, Known
from pipeline.simulate import LEVELS, insertion_of, measured_clamp, simulate
from pipeline.status import FrameStatus, StageError
from solver import Snap


def simulate_frames(run: Context, known: Known) -> Known:
    """Replay the insertion; a frame without a known depth is passed over."""
    assert known.lumen is not None
    case, config, log = run.case, run.config, run.log
    clamp = _clamp(run, known.frames)
    frames = [_with_depth(frame, config.simulate.depth) for frame in known.frames]
    replay = [frame for frame in frames if not np.isnan(frame.depth_mm)]
    try:
        insertion = insertion_of(case.wire, case.wall, known.lumen, clamp, config.solver, config.simulate)
        found = simulate(insertion, [f.depth_mm for f in replay], [f.roll_deg for f in replay])
        clock = perf_counter()
        for frame, wire in zip(replay, found, strict=True):
            log.spent("simulate", perf_counter() - clock, frame.index)
            work = dict(wire.work)
            levels = {name: work.pop(name) for name in LEVELS}
            log.count("simulate", work, levels)
            log.warnings += [_told(frame.index, snap) for snap in wire.snaps]
            done = replace(frame, simulated=wire)
            frames[frame.index] = done if wire.converged else done.failed("simulate", wire.status)
            said = f"{wire.status.identifier} {wire.depth_mm:.1f} mm"
            log.progress("simulate", frame.index + 1, len(frames), said)
            clock = perf_counter()
    except ValueError as error:
        raise StageError(FrameStatus.SIMULATE_FAILED, f"case {case.id!r}: {error}") from error
    return replace(known, frames=tuple(frames), entry=clamp)


def _told(frame: int, snap: Snap) -> str:
    """An event in words."""
    return (
        f"frame {frame}: the simulated wire gave way between {snap.from_mm:.2f} and {snap.to_mm:.2f} mm "
        f"({1e3 * snap.released_N_mm:.3g} µJ released, a joint moved by {snap.moved_mm:.2f} mm); what is seen here and "
        "shortly after hangs on small causes"
    )


def _clamp(run: Context, frames: Sequence[Frame]) -> Clamp:
    """The clamp of the simulation: measured in the scans, or the manifest's."""
    case = run.case
    axis = None if case.material_axis is None else np.array(case.material_axis)
    given = Clamp(np.array(case.entry_mm), np.array(case.entry_direction), axis)
    if run.config.simulate.entry == "manifest":
        return given
    clamp = measured_clamp([curve for f in frames if (curve := f.trusted_curve) is not None], given)
    run.log.assumptions += [clamp.note] * bool(clamp.note)
    run.log.warnings += [clamp.warning] * bool(clamp.warning)
    return clamp


def _with_depth(frame: Frame, source: str) -> Frame:
    """The frame with the depth to simulate: the traced length, else the manifest's; failed where neither is known."""
    depth = frame.expected_mm
    if source == "traced" and frame.curve is not None and frame.traced:
        depth = frame.curve.length_mm
    found = replace(frame, depth_mm=depth)
    if not np.isnan(depth):
        return found
    return found.failed("simulate", FrameStatus.SIMULATE_FAILED, "no depth: nothing traced and no insertion_mm given")
