"""trace: the real wire of every frame, one crop held at a time."""

from __future__ import annotations

import numpy as np

from pipeline.load import Header, scans
from pipeline.model import Curve, Volume
from pipeline.register.frames import counters_of, place_of, put_in_place, said
from pipeline.run.cache import key_of
from pipeline.run.frame import Frame
from pipeline.run.opening import header_hash
from pipeline.run.record import CaseRun
from pipeline.run.stored import pack_curve, unpack_curve
from pipeline.status import FrameStatus, StageError
from pipeline.trace import trace


def trace_frames(run: CaseRun) -> None:
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
        run.count("load", scans.load_counters(run.headers.reference, box))
    given = _given_traces(run)
    with run.timed("trace"):
        place = place_of(run.lumen, box, reference, run.config.load, run.config.trace, bool(given))
    window: tuple[float, float] | None = None
    for frame, header in zip(run.frames, run.headers.frames, strict=True):
        try:
            with run.timed("load", frame):
                volume = scans.load_crop(header, box, run.config.load)
            run.count("load", scans.load_counters(header, box))
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
    run.warnings += _in_plane(run)
    assumed, doubtful = said(place, run.frames)
    run.assumptions += assumed
    run.warnings += doubtful


def _in_plane(run: CaseRun) -> list[str]:
    """A warning where traced wire runs in the plane of the scanner's rotation, with how much of it does."""
    curves = [f.curve for f in run.frames if f.curve is not None and len(f.curve.points_mm)]
    marks = np.concatenate([np.asarray(c.in_plane) for c in curves]) if curves else np.zeros(0, bool)
    if not marks.any():
        return []
    limit = run.config.trace.in_plane_deg
    return [
        f"{100 * marks.mean():.0f} % of the traced points run within {limit:g} degrees of the plane of rotation, "
        "where cone-beam scans streak and resolve the rotation axis least (trace_flags 2 in frames.h5)"
    ]


def _given_traces(run: CaseRun) -> list[Curve]:
    """The user's own curves, where the manifest names them."""
    if not run.case.traces:
        return []
    from pipeline.load.traces import read_curve

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
    own = (header_hash(run, header), header_hash(run, scan), reference is None, pose)
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
