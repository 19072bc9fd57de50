"""One case through the stages: load -> segment -> trace -> simulate -> compare."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, Literal

import numpy as np

from pipeline import nulls, scans
from pipeline.cache import Store, file_hash, key_of
from pipeline.compare import compare, compare_truth, point_to_curve, rms
from pipeline.config import Config
from pipeline.curves import to_length
from pipeline.entry import Entry, measured_entry
from pipeline.frame import Frame
from pipeline.in_place import counters_of, place_of, put_in_place, said
from pipeline.load import Header, LoadError
from pipeline.manifest import Case
from pipeline.model import Curve, Lumen, Volume
from pipeline.segment import segment
from pipeline.simulate import rolls, simulate
from pipeline.status import FrameStatus, StageError
from pipeline.stored import pack_curve, pack_lumen, unpack_curve, unpack_lumen
from pipeline.trace import trace
from pipeline.truth import read_truth

Stage = Literal["load", "segment", "trace", "simulate", "compare", "report"]
STAGES: tuple[Stage, ...] = ("load", "segment", "trace", "simulate", "compare", "report")
Progress = Callable[[str, int, int, str], None]
"""Called with stage, steps done, steps in all, and a short text."""


@dataclass
class CaseRun:
    """A case on its way through the stages: settings in, records out."""

    case: Case
    config: Config
    store: Store
    progress: Progress
    until: Stage = "report"
    frames: list[Frame] = field(default_factory=list)
    headers: scans.Scans | None = None
    lumen: Lumen | None = None
    entry: Entry | None = None
    hashes: dict[str, str] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STAGES, 0.0))
    counters: dict[str, dict[str, float]] = field(default_factory=lambda: {stage: {} for stage in STAGES})
    assumptions: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    failure: StageError | None = None
    failed_stage: str = ""

    @contextmanager
    def timed(self, stage: Stage, frame: Frame | None = None) -> Any:
        """Add the time of a block to a stage, and to a frame where one is given."""
        clock = perf_counter()
        try:
            yield
        finally:
            spent = perf_counter() - clock
            self.seconds[stage] += spent
            if frame is not None:
                frame.seconds[stage] = frame.seconds.get(stage, 0.0) + spent

    def count(self, stage: Stage, counters: Any) -> None:
        """Add a stage's counters to the case's."""
        total = self.counters[stage]
        for name, value in counters.items():
            total[name] = total.get(name, 0.0) + float(value)

    def wants(self, stage: Stage) -> bool:
        """Whether ``--until`` lets this stage run."""
        return STAGES.index(stage) <= STAGES.index(self.until)


def run_stages(run: CaseRun) -> None:
    """Run every stage; what goes wrong with the whole case ends in ``run.failure``, with a frame in its record."""
    steps: tuple[tuple[Stage, Callable[[CaseRun], None]], ...] = (
        ("load", _open),
        ("segment", _segment),
        ("trace", _trace_frames),
        ("simulate", _simulate_frames),
        ("compare", _compare_frames),
    )
    for stage, step in steps:
        if not run.wants(stage):
            return
        try:
            step(run)
        except StageError as error:
            run.failure, run.failed_stage = error, stage
            for frame in run.frames:
                frame.fail_from(stage, error)
            return


def _open(run: CaseRun) -> None:
    """Headers, hashes, truth and the list of frames."""
    case = run.case
    run.frames = [Frame(i) for i in range(case.frame_count)]
    with run.timed("load"):
        run.headers = scans.read_headers(case, run.config.load)
        count = len(run.headers.frames) or case.frame_count
        run.frames = [Frame(i) for i in range(count)]
        for header in filter(None, (run.headers.reference, *run.headers.frames)):
            path = header.source.path
            run.hashes.setdefault(str(path), file_hash(path))
    run.assumptions += run.headers.assumed
    for name, values in (("insertion_mm", case.insertion_mm), ("roll_deg", case.roll_deg)):
        if isinstance(values, tuple) and len(values) != count:
            msg = f"case {case.id!r}: {name} has {len(values)} entries for {count} frames; give one per frame"
            raise LoadError(msg)
    truth = read_truth(case.truth, count) if case.truth else [None] * count
    angles = rolls(case, count, run.config.simulate)
    for frame in run.frames:
        frame.truth_mm, frame.roll_deg = truth[frame.index], angles[frame.index]
        if case.insertion_mm:
            frame.expected_mm = case.insertion_mm[frame.index]


def _header_hash(run: CaseRun, header: Header) -> list[Any]:
    """What a stage result depends on in one scan: its content, the item in it, and an overridden spacing."""
    return [run.hashes[str(header.source.path)], header.source.dataset, header.source.item, header.spacing_mm]


def _segment(run: CaseRun) -> None:
    """The lumen: the user's own, the stored one, or segmented from the wire-free scan."""
    if run.case.lumen is not None:
        from pipeline.lumen_input import read_lumen

        with run.timed("segment"):
            run.lumen = read_lumen(run.case.lumen.path, run.case, run.config)
        return
    assert run.headers is not None
    header = run.headers.first
    assert header is not None, "the manifest guarantees frames, a reference or a lumen"
    if run.headers.reference is None:
        run.assumptions.append(
            "no reference scan: the lumen was segmented from frame 0, which has a wire in it"
        )
    key = key_of(
        "segment", _header_hash(run, header), run.case.lumen_seed_mm, run.config.segment, run.config.load
    )
    stored = run.store.get("segment", key)
    if stored is not None:
        run.lumen = unpack_lumen(*stored)
        run.counters["segment"]["reused"] = 1
    else:
        with run.timed("load"):
            volume = scans.load_crop(header, header.box, run.config.load)
        with run.timed("segment"):
            run.lumen = segment(volume, np.array(run.case.lumen_seed_mm), run.config.segment)
        run.store.put("segment", key, *pack_lumen(run.lumen))
    run.count("segment", run.lumen.counters)
    run.warnings += run.lumen.warnings
    run.progress("segment", 1, 1, f"{int(np.count_nonzero(run.lumen.mask.values))} voxels")


def _trace_frames(run: CaseRun) -> None:
    """Every frame's wire, each with the previous one as a prior; one crop is held at a time."""
    assert run.headers is not None
    assert run.lumen is not None
    if not run.headers.frames:
        return
    box = scans.lumen_box(run.headers.frames[0], run.lumen)
    reference: Volume | None = None
    if run.headers.reference is not None:
        with run.timed("load"):
            reference = scans.load_crop(run.headers.reference, box, run.config.load)
    given = _given_traces(run)
    with run.timed("trace"):
        place = place_of(run.lumen, box, reference, run.config.load, run.config.trace, bool(given))
    window: tuple[float, float] | None = None
    for frame, header in zip(run.frames, run.headers.frames, strict=True):
        try:
            with run.timed("load", frame):
                volume = scans.load_crop(header, box, run.config.load)
        except StageError as error:
            frame.fail_from("load", error)
            continue
        with run.timed("trace", frame):
            volume, shown, frame.registration = put_in_place(volume, header, place)
        run.count("trace", counters_of(frame.registration))
        window = window or scans.grey_window(shown)
        frame.projections = scans.projections(shown, window)
        with run.timed("trace", frame):
            frame.curve = given[frame.index] if given else _trace(run, frame, header, volume, reference)
        _judge_trace(run, frame)
        run.progress(
            "trace", frame.index + 1, len(run.frames), f"{frame.status} {frame.curve.length_mm:.1f} mm"
        )
    assumed, doubtful = said(place, run.frames)
    run.assumptions += assumed
    run.warnings += doubtful


def _given_traces(run: CaseRun) -> list[Curve]:
    """The user's own curves, where the manifest names them."""
    if not run.case.traces:
        return []
    from pipeline.trace_input import read_curve

    run.assumptions.append("the traced curves are the manifest's own files; no tracing was done")
    return [read_curve(path) for path in run.case.traces]


def _trace(run: CaseRun, frame: Frame, header: Header, volume: Volume, reference: Volume | None) -> Curve:
    assert run.lumen is not None
    assert run.headers is not None
    before = [f.curve for f in run.frames[: frame.index] if f.curve is not None and len(f.curve.points_mm)]
    previous = before[-1] if before else None
    scan = run.headers.first
    assert scan is not None
    pose = (run.case.entry_mm, run.case.entry_direction, run.case.lumen_seed_mm, frame.expected_mm)
    own = (_header_hash(run, header), _header_hash(run, scan), reference is None, pose)
    prior = None if previous is None else [previous.points_mm, previous.status.name]
    key = key_of("trace", own, prior, run.config.segment, run.config.trace, run.config.load)
    stored = run.store.get("trace", key)
    if stored is not None:
        run.count("trace", {"reused": 1})
        return unpack_curve(*stored)
    curve = trace(
        volume,
        run.lumen,
        np.array(run.case.entry_mm),
        np.array(run.case.entry_direction),
        reference=reference,
        previous=previous,
        expected_mm=None if np.isnan(frame.expected_mm) else frame.expected_mm,
        config=run.config.trace,
    )
    run.count("trace", curve.counters)
    run.store.put("trace", key, *pack_curve(curve))
    return curve


def _judge_trace(run: CaseRun, frame: Frame) -> None:
    """Turn the tracer's verdict, and a length that disagrees with the manifest, into the frame's status."""
    assert frame.curve is not None
    if frame.curve.status is not FrameStatus.OK:
        frame.fail("trace", frame.curve.status, frame.curve.note)
        return
    gap = abs(frame.curve.length_mm - frame.expected_mm)
    if gap > run.config.trace.length_tolerance_mm:
        frame.fail(
            "trace",
            FrameStatus.LENGTH_MISMATCH,
            f"trace: case {run.case.id!r} frame {frame.index}: traced {frame.curve.length_mm:.2f} mm, insertion_mm "
            f"says {frame.expected_mm:.2f} mm, allowed {run.config.trace.length_tolerance_mm} mm apart; look at the "
            "picture, then correct the manifest or trace.length_tolerance_mm",
        )


def _depth(run: CaseRun, frame: Frame) -> float:
    """Depth to simulate a frame at: the traced length, else the manifest's; NaN where neither is known."""
    traced = (
        frame.curve.length_mm if frame.curve is not None and len(frame.curve.points_mm) > 1 else float("nan")
    )
    if run.config.simulate.depth == "manifest" or np.isnan(traced):
        return frame.expected_mm
    return traced


def _clamp(run: CaseRun) -> Entry:
    """The clamp of the simulation: measured in the scans, or the manifest's."""
    given = Entry(np.array(run.case.entry_mm), np.array(run.case.entry_direction))
    if run.config.simulate.entry == "manifest":
        return given
    good = [f.curve for f in run.frames if f.ok and f.curve is not None]
    entry = measured_entry(good, given.entry_mm, given.direction)
    run.assumptions += [entry.note] * bool(entry.note)
    run.warnings += [entry.warning] * bool(entry.warning)
    return entry


def _simulate_frames(run: CaseRun) -> None:
    """Replay the whole insertion once; a frame without a known depth is passed over."""
    assert run.lumen is not None
    run.entry = _clamp(run)
    for frame in run.frames:
        frame.depth_mm = _depth(run, frame)
        if np.isnan(frame.depth_mm):
            frame.fail(
                "simulate", FrameStatus.SIMULATE_FAILED, "no depth: nothing traced and no insertion_mm given"
            )
    replay = [f for f in run.frames if not np.isnan(f.depth_mm)]
    if not replay:
        return
    depths, angles = [f.depth_mm for f in replay], [f.roll_deg for f in replay]
    try:
        solutions = simulate(
            run.case, run.entry, run.lumen, depths, angles, run.config.solver, run.config.simulate
        )
        for frame, result in zip(replay, solutions, strict=True):
            frame.simulated = result
            frame.seconds["simulate"] = result.seconds
            run.seconds["simulate"] += result.seconds
            run.count("simulate", result.work)
            if not result.converged:
                frame.fail_with("simulate", result.status, result.sentence)
            run.progress(
                "simulate", frame.index + 1, len(run.frames), f"{result.status} {result.depth_mm:.1f} mm"
            )
    except ValueError as error:
        raise StageError(FrameStatus.SIMULATE_FAILED, f"case {run.case.id!r}: {error}") from error


def _compare_frames(run: CaseRun) -> None:
    """Errors of every frame with both curves, beside those of the trivial predictors."""
    assert run.lumen is not None
    traced = [f for f in run.frames if f.curve is not None and len(f.curve.points_mm) > 1]
    with run.timed("compare"):
        static = _static_nulls(run, traced)
    curves = [f.curve for f in run.frames]
    for frame in run.frames:
        with run.timed("compare", frame):
            if run.headers is not None and not run.headers.frames:
                if frame.ok:
                    frame.status, frame.sentence = (
                        FrameStatus.SIMULATED.identifier,
                        FrameStatus.SIMULATED.value,
                    )
            elif frame in traced and frame.simulated is not None:
                assert frame.curve is not None
                frame.comparison = compare(frame.simulated, frame.curve, run.lumen, run.config.compare)
                _score_nulls(run, frame, static, nulls.previous(curves, frame.index, frame.depth_mm))
            if frame.truth_mm is not None:
                frame.truth = compare_truth(frame.truth_mm, frame.curve, frame.simulated, run.config.compare)


def _static_nulls(run: CaseRun, traced: list[Frame]) -> nulls.Nulls | None:
    if not traced:
        return None
    assert run.lumen is not None
    deepest = max(traced, key=lambda f: f.curve.length_mm if f.curve else 0.0)
    assert deepest.curve is not None
    assert run.entry is not None
    return nulls.build(
        run.lumen, run.entry.entry_mm, run.entry.direction, deepest.curve.points_mm, run.case.wire.radius_mm
    )


def _score_nulls(run: CaseRun, frame: Frame, static: nulls.Nulls | None, previous: Any) -> None:
    assert frame.curve is not None
    guesses = {"previous": previous}
    if static is not None:
        guesses |= {name: static.at_depth(name, frame.depth_mm) for name in ("centreline", "shortest")}
        guesses["min_bending"] = static.min_bending(frame.depth_mm)
    step = run.config.compare.sample_mm
    for name, guess in guesses.items():
        if guess is not None:
            points = to_length(guess, frame.depth_mm, step)
            frame.nulls_rms_mm[name] = rms(point_to_curve(points, frame.curve.points_mm)[0])
