"""simulate: the whole insertion replayed once, from the clamp to the depth of every frame."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from pipeline.model import OverWire
from pipeline.run.log import Log
from pipeline.run.stages.clamp import clamp_of
from pipeline.run.stages.clues import beside_clues, clues_of
from pipeline.run.stages.covered import along, deep_in_itself_mm, too_thick
from pipeline.run.stages.in_itself import not_in_itself, not_passed
from pipeline.run.stages.known import Context, Frame, Known
from pipeline.run.stages.others import frames_of_others
from pipeline.run.stages.roll import with_fitted_roll
from pipeline.run.stages.turned_back import turned_back
from pipeline.run.stages.way import way_of, with_depths
from pipeline.simulate import LEVELS, altered, insertion_of, simulate, wall_of
from pipeline.simulate.resolution import LARGEST_JOINT_TURN_DEG, Resolved, lengths_mm, resolve
from pipeline.status import FrameStatus, StageError
from reports.case_files import counted
from solver import Snap, Solution

NEARLY_MM = 1.0
"""How much deeper than the traced wire a catheter may be stated without a warning."""


def simulate_frames(run: Context, known: Known) -> Known:
    """Replay the insertion; a frame without a known depth is left out.

    Raises StageError where the solver refuses its inputs.
    """
    run.kernels()
    try:
        return _simulated(run, known)
    except ValueError as error:
        raise StageError(FrameStatus.SIMULATE_FAILED, f"case {run.case.id!r}: {error}") from error


def _simulated(run: Context, known: Known) -> Known:
    with run.log.timed("clamp"):
        known = with_fitted_roll(run, known)
        clamp = clamp_of(run, known)
    frames = with_depths(known.frames, run.config.simulate.depth, clamp)
    known = replace(known, frames=tuple(frames), clamp=clamp)
    known = replace(known, clues=clues_of(run, known))
    if run.case.simulated is None:
        return _replayed(run, known)
    try:
        # the simulated predictors need a segment length: that of this project's own solver
        with run.log.timed("simulate"):
            segment = _replayed(replace(run, log=Log(lambda *_: None)), known).segment_mm
    except (StageError, ValueError):
        segment = float("nan")
    return replace(known, frames=frames_of_others(run, known), segment_mm=segment)


def _replayed(run: Context, known: Known) -> Known:
    """The solver's own wires."""
    case, log = run.case, run.log
    frames = list(known.frames)
    replay = [frame for frame in frames if not np.isnan(frame.depth_mm)]
    if case.catheter is not None:
        log.warnings += [_cut_short(f) for f in replay if f.catheter_mm > f.depth_mm + NEARLY_MM]
    resolved = _resolved(run, known, replay)
    log.assumptions.append(f"segments of {resolved.segment_mm:g} mm: {resolved.reason}")
    log.chosen["segment_mm"] = f"{resolved.segment_mm:g}: {resolved.reason}"
    bounds = zip(resolved.num_mm, resolved.num_push_N, strict=True)
    for frame, wire, (num_mm, num_push_N) in zip(replay, resolved.wires, bounds, strict=True):
        log.warnings += [_told(frame.index, snap) for snap in wire.snaps]
        found = replace(frame, simulated=wire, num_mm=float(num_mm), num_push_N=float(num_push_N))
        frames[frame.index] = judged(found, wire, case.wire.radius_mm, case.catheter)
    log.warnings += _doubtful(run, known, list(zip(replay, resolved.wires, strict=True)))
    return replace(known, frames=tuple(frames), segment_mm=resolved.segment_mm)


def _doubtful(run: Context, known: Known, both: Sequence[tuple[Frame, Solution]]) -> list[str]:
    """Warnings of a doubtful wall, and of frames' wires that have turned round, are pressed deep or find no room."""
    case, wall = run.case, wall_of(known.vessel.distance, run.config.solver.hull)
    untraced = {frame.index: wire.joints_mm for frame, wire in both if frame.curve is None and wire.converged}
    said = [f"simulate: the lumen's signed distance: {wall.doubts}"] * bool(wall.doubts)
    said += turned_back(wall, known.held.entry_mm, untraced) + _pressed_deep(both, case.wire.radius_mm)
    said += too_thick("wire", case.wire.radius_mm, {frame.index: along(wire) for frame, wire in both}, wall)
    if case.catheter is not None:
        covered = {frame.index: along(wire, frame.catheter_mm) for frame, wire in both}
        said += too_thick("catheter", case.catheter.radius_mm, covered, wall)
    return said


def _resolved(run: Context, known: Known, frames: Sequence[Frame]) -> Resolved:
    """The wires of frames, with segments as short as needed; ValueError where the solver refuses its inputs."""
    config = run.config
    lengths = lengths_mm(config.solver.segment_mm, altered(run.case.wire, config.simulate).rest_curvature_per_mm)
    # the first two lengths are needed in any case: side by side, where there are cores, the longer work first
    tries = [*((shorter, True) for shorter in lengths[1:2]), (lengths[0], len(lengths) == 1)]
    wall_of(known.vessel.distance, config.solver.hull)  # made here, so that helpers inherit it
    found = beside_clues(run, known, lambda i: _inserted(run, known, frames, *tries[i]), len(tries))
    ahead = dict(zip(tries, found, strict=True))

    def insert(segment_mm: float, refined: bool) -> list[Solution]:
        """The wire of every frame with segments of one length."""
        asked = segment_mm, refined
        wires, log = ahead[asked] if asked in ahead else _inserted(run, known, frames, *asked)
        run.log.add(log)
        return wires

    return resolve(insert, lengths)


def _inserted(
    run: Context, known: Known, frames: Sequence[Frame], segment_mm: float, refined: bool
) -> tuple[list[Solution], Log]:
    """The wires of frames with segments of one length, and a log. refined : repeat rough steps with shorter ones."""
    case, config, part = run.case, run.config, run.part()
    finest_mm = config.solver.finest_mm if refined else config.solver.step_mm
    settings = replace(config.solver, segment_mm=segment_mm, finest_mm=finest_mm)
    shared = known.vessel, known.held, settings, config.simulate, case.catheter
    found = simulate(insertion_of(case.wire, case.wall, *shared), way_of(run, known.frames, frames))
    return list(_noted(part.log, frames, found, len(known.frames))), part.log


def judged(frame: Frame, wire: Solution, radius_mm: float, catheter: OverWire | None = None) -> Frame:
    """The frame, failed where its wire is not at rest, cannot follow a bend, or lies or lay in itself."""
    if not wire.converged:
        return frame.failed("simulate", wire.status)
    turn = wire.largest_turn_deg
    if turn > LARGEST_JOINT_TURN_DEG:
        return frame.failed("simulate", FrameStatus.UNDER_RESOLVED, f"a joint is turned by {turn:.0f} degrees")
    frame = not_passed(not_in_itself(frame, wire.self_overlap_mm, radius_mm), wire)
    if catheter is None:
        return frame
    what = f"the catheter of radius_mm = {catheter.radius_mm:g}"
    return not_in_itself(frame, deep_in_itself_mm(catheter, frame.catheter_mm, wire), catheter.radius_mm, what)


def _noted(log: Log, frames: Sequence[Frame], found: Iterator[Solution], total: int) -> Iterator[Solution]:
    """Pass the wires on, each with its time and its work counted and a line in the log."""
    clock = perf_counter()
    for frame, wire in zip(frames, found, strict=True):
        log.spent("simulate", perf_counter() - clock, frame.index)
        work = dict(wire.work)
        levels = {name: work.pop(name) for name in LEVELS}
        log.count("simulate", work, levels)
        log.progress("simulate", frame.index + 1, total, f"{wire.status.identifier} {wire.depth_mm:.1f} mm")
        yield wire
        clock = perf_counter()


def _cut_short(frame: Frame) -> str:
    """A warning: the catheter is stated to reach beyond the wire's tip."""
    return (
        f"frame {frame.index}: the catheter's tip is stated at {frame.catheter_mm:.1f} mm, the wire's lies at "
        f"{frame.depth_mm:.1f} mm: simulated as if both ended there; check insertion_mm of the catheter"
    )


def _pressed_deep(both: Sequence[tuple[Frame, Solution]], radius_mm: float) -> list[str]:
    """A warning where wires at rest lie deeper in the wall than their radius."""
    deep = {frame.index: wire.max_penetration_mm for frame, wire in both if wire.converged}
    deep = {frame: depth for frame, depth in deep.items() if depth > radius_mm > 0.0}
    if not deep:
        return []
    worst = max(deep, key=lambda frame: deep[frame])
    return [
        f"{counted(len(deep), 'frame')}: the simulated wire is pressed deeper into the wall than its radius of "
        f"{radius_mm:g} mm, in frame {worst} by {deep[worst]:.2f} mm: the wall gives way more than a vessel may; "
        "raise wall.stiffness_N_mm2, or check lumen and entry"
    ]


def _told(frame: int, snap: Snap) -> str:
    """A snap of the simulated wire in words."""
    hangs = "what is seen here and shortly after hangs on small causes"
    if snap.other_mm > 0.0:
        hangs = f"the other side, {snap.other_mm:.2f} mm off, was as good: what follows holds for this one"
    return (
        f"frame {frame}: the simulated wire gave way between {snap.from_mm:.2f} and {snap.to_mm:.2f} mm "
        f"({1e3 * snap.released_N_mm:.3g} µJ released, a joint moved by {snap.moved_mm:.2f} mm); {hangs}"
    )
