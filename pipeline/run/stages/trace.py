"""trace: the real wire of every frame, one crop held at a time."""

from collections.abc import Collection
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from pipeline.arrays.fingerprint import known_by
from pipeline.arrays.grids import corners_mm
from pipeline.load import Crop, Header, of_several_greys
from pipeline.model import Curve, Lumen, Volume
from pipeline.register import Anchor, Motion, anchor
from pipeline.register.drift import FIRST, REFERENCE, EarlierScan, of_drift, with_drift
from pipeline.register.frames import Alignment, alignment_of, counters_of, put_in_place, sentences_of, widened
from pipeline.run.helpers import Earlier
from pipeline.run.log import Log
from pipeline.run.projections import grey_window, projections
from pipeline.run.stages.before import NOTHING, Before
from pipeline.run.stages.beside import beside_what_is_seen
from pipeline.run.stages.brightness import of_another_brightness
from pipeline.run.stages.depths import (
    drawn_back,
    in_step,
    perhaps_turned,
    shrinking,
    standing,
    stated_elsewhere,
    to_depth,
    traced_depths,
    turned_round,
)
from pipeline.run.stages.dim_ends import barely_seen, faint_ends, own_dim_ends
from pipeline.run.stages.gaps import own_gaps
from pipeline.run.stages.given import entry_sigma_mm
from pipeline.run.stages.known import Context, Frame, Known, trusted
from pipeline.run.stages.misstated import as_steps, in_another_order
from pipeline.run.stages.own_curves import RESAMPLE, as_given, given_curves, rough
from pipeline.run.stages.repeated import alike, once, rescanned
from pipeline.run.stages.scales import on_another_scale
from pipeline.run.stages.thickness import not_too_thick, too_thin
from pipeline.run.stages.wire_free import wire_in_reference
from pipeline.run.straightened import straightened
from pipeline.segment.opened import opened
from pipeline.simulate import wall_of
from pipeline.simulate.clamp import TIP_VOXELS
from pipeline.status import FrameStatus, StageError
from pipeline.trace import DIM_FROM_TIP, of_catheter, trace
from pipeline.trace.config import TraceConfig
from pipeline.trace.saturated import cut_off, saturated


def trace_frames(run: Context, known: Known) -> Known:
    """Every frame's wire, each with the previous one as a prior."""
    given = given_curves(run)
    voxel_mm = known.vessel.distance.voxel_mm
    if not known.scans.frames:
        if not given:
            return known
        scan = None if known.scans.first is None else known.scans.first.grid
        own = [as_given(run, *pair, known.vessel.distance, scan) for pair in zip(known.frames, given, strict=True)]
        run.log.warnings += rescanned(own, run.case.calibrated_traces)
        single = once(own, run.case.calibrated_scans, run.case.calibrated_traces)
        return _with_room(run, known, _in_step(run, single, voxel_mm))
    work = _Tracing(run, known, given)
    parts = run.share("trace", work.part, len(known.frames), work.meanwhile)
    for part in parts:
        run.log.add(part.log)
    single = once([p.frame for p in parts], run.case.calibrated_scans, run.case.calibrated_traces)
    frames, assumed = own_dim_ends(single, voxel_mm)
    run.log.assumptions += assumed
    frames, doubtful_gaps = own_gaps(frames, voxel_mm)
    run.log.warnings += doubtful_gaps
    frames = _in_step(run, turned_round(frames), voxel_mm)
    run.log.warnings += [*faint_ends(frames), *alike(frames), *rescanned(frames, run.case.calibrated_traces)]
    run.log.warnings += barely_seen(frames) if run.case.wire.opacity is None else []
    radius_mm = run.case.wire.radius_mm
    run.log.warnings += [*too_thin(frames, known.vessel, radius_mm), *of_another_brightness(frames, radius_mm)]
    if not given:
        run.log.warnings += cut_off(trusted(frames))
    off_scans, elsewhere = beside_what_is_seen(frames, [part.seen for part in parts], run.config.trace, voxel_mm)
    run.log.warnings += off_scans
    run.log.warnings += work.wire_in_reference
    run.log.warnings += _in_plane(frames, run.config.trace)
    registered = {frame.index: frame.registration for frame in frames}
    assumed, doubtful = sentences_of(work.alignment, registered, wall_right=not known.lumen_doubt)
    run.log.assumptions += assumed
    run.log.warnings += doubtful
    run.log.warnings += of_drift({f.index: f.curve for f in frames if f.curve is not None}, work.earlier_scan)
    frames = [_first_said(frame, known.lumen_doubt) for frame in frames]
    return _with_room(run, replace(known, off_the_scans=bool(off_scans)), frames, elsewhere)


def _in_step(run: Context, frames: list[Frame], voxel_mm: float) -> list[Frame]:
    """The frames, those out of step not to be trusted; warnings of what lengths and own curves tell of themselves."""
    tolerance_mm = run.config.trace.length_tolerance_mm
    depths_mm = traced_depths(frames, run.case.entry_mm, run.case.entry_direction)
    given = frames, depths_mm, tolerance_mm
    swapped = in_another_order(*given) or as_steps(*given)
    run.log.warnings += swapped
    frames = frames if swapped else perhaps_turned(frames)
    common_mm = float(np.hypot(entry_sigma_mm(run.case, voxel_mm), TIP_VOXELS * voxel_mm))
    # a wrong scale moves the median, too: one cause is told
    scaled = [] if swapped else on_another_scale(frames, depths_mm)
    run.log.warnings += scaled or stated_elsewhere(frames, depths_mm, common_mm, run.case.insertion_sigma_mm)
    frames = in_step(to_depth(frames, depths_mm, tolerance_mm), voxel_mm)
    run.log.warnings += [*shrinking(frames, voxel_mm), *standing(frames, voxel_mm)]
    run.log.warnings += [] if swapped else drawn_back(frames, voxel_mm)
    if run.case.traces:
        own = {index: curve.points_mm for index, curve in trusted(frames).items()}
        run.log.warnings += rough(own, voxel_mm, "the manifest's own curves", RESAMPLE)
    return frames


def _first_said(frame: Frame, lumen_doubt: str) -> Frame:
    """The frame; one not traced in a lumen that is far off says so first: the reference was blamed, or the wire."""
    if frame.stage != "trace" or not lumen_doubt:
        return frame
    return replace(frame, message=f"{lumen_doubt}; look at that first. {frame.message}")


def _with_room(run: Context, known: Known, frames: list[Frame], doubted: Collection[int] = ()) -> Known:
    """The case with its frames, and a lumen that has room for their traces, but for those of doubted numbers."""
    wire, wall, given = run.case.wire, run.case.wall, run.case.lumen is not None
    curves = [curve for number, curve in trusted(frames).items() if number not in doubted]
    lumen = opened(known.vessel, curves, wire.radius_mm, wall.stiffness_N_mm2, given=given)
    run.log.warnings += lumen.warnings[len(known.vessel.warnings) :]
    run.lumen_known(lumen)
    return replace(known, frames=tuple(frames), lumen=lumen)


class _Part(NamedTuple):
    """The result of one frame.

    window : grey values of all pictures, set by the first frame with a trusted trace; None until then.     seen : the
    wire as the scan shows it, where the curve is the user's own.
    """

    frame: Frame
    window: tuple[float, float] | None
    log: Log
    seen: Curve | None = None


class _Tracing:
    """What all frames share: the box around the lumen, the wire-free scan there, and the alignment of the phantom."""

    def __init__(self, run: Context, known: Known, given: list[Curve]) -> None:
        self.run, self.lumen, self.load, settings = run, known.vessel, run.config.load, run.config.trace
        self.frames, self.headers, self.given = known.frames, known.scans.frames, given
        self.corners = corners_mm(self.lumen.distance)
        self.box = known.scans.frames[0].box_of(self.corners)
        empty = known.scans.reference
        self.reference = None if empty is None else run.load(Crop(empty, self.box, self.load))
        with run.log.timed("trace"):
            self.alignment: Alignment = alignment_of(
                self.lumen,
                self.reference,
                settings.register_skip_voxels,
                switched_on=settings.register == "auto",
                own_curves=bool(given),
            )

    @cached_property
    def wire_in_reference(self) -> list[str]:
        """A warning where the reference shows a wire, too."""
        return wire_in_reference(self.run, self.reference, self.lumen)

    @property
    def earlier_scan(self) -> EarlierScan:
        """The scan that shows whether the phantom moved, in words."""
        return FIRST if self.reference is None else REFERENCE

    @cached_property
    def structures(self) -> Anchor | None:
        """What the reference, or else the first frame, shows of the phantom; None where nobody asks whether it moved.

        No file is counted as read once more for it.
        """
        if self.alignment.anchor is not None or self.given:
            return None
        if self.reference is not None:
            return anchor(self.reference, self.lumen)
        try:
            return anchor(Crop(self.headers[0], self.box, self.load).load(), self.lumen)
        except StageError:  # said where it is read to be traced
            return None

    def meanwhile(self) -> None:
        """Make what is needed soon, while helpers trace; the wall takes a second and more with 256^3 voxels."""
        if self.run.goes_to("simulate"):
            self.run.kernels()
            wall_of(self.lumen.distance, self.run.config.solver.hull)
        _ = self.wire_in_reference

    def part(self, number: int, earlier: Earlier[_Part]) -> _Part:
        """Trace one frame; it has failed where its scan cannot be read."""
        run, frame = self.run.part(), self.frames[number]
        try:
            done = self.look(run, frame, self.headers[number], earlier)
        except StageError as error:
            return _Part(frame.failed("load", error), None, run.log)
        length = 0.0 if done.frame.curve is None else done.frame.curve.length_mm
        run.log.progress("trace", number + 1, len(self.frames), f"{done.frame.status} {length:.1f} mm")
        return done

    def look(self, run: Context, frame: Frame, header: Header, earlier: Earlier[_Part]) -> _Part:
        """Read, align and trace one frame; LoadError where it cannot be read."""
        log = run.log
        volume = run.load(Crop(header, self.box, self.load), frame.index)
        if not self.given:  # beside the user's own curve it is only looked at
            volume = of_several_greys(volume, header.source)

        def read_moved(motion: Motion) -> Volume:
            box = header.box_of(motion.moved(self.corners))
            return volume if box == self.box else Crop(header, box, self.load).load()

        with log.timed("trace", frame.index):
            here, shown, registration = put_in_place(volume, self.alignment, read_moved)
        log.count("trace", counters_of(registration))
        frame = replace(frame, registration=registration, voxels=known_by(volume))
        seen = widened(self.follow(run, frame, here, earlier), registration)
        if frame.index or self.reference is not None:
            with log.timed("trace", frame.index):
                seen = with_drift(seen, volume, self.structures, self.earlier_scan)
        done = _of_scan(run, frame, seen, self.lumen)
        if self.given:
            done = as_given(run, frame, self.given[frame.index], self.lumen.distance, header.grid)
        before = (earlier(k) for k in range(frame.index))
        window = next((part.window for part in before if part.window), None)
        if window is None and done.trusted_curve is not None:
            window = grey_window(shown, done.trusted_curve.points_mm)
        done = _pictured(done, shown, window or grey_window(shown))
        return _Part(done, window, log, seen if self.given else None)

    def follow(self, run: Context, frame: Frame, here: Volume, earlier: Earlier[_Part]) -> Curve:
        """The wire that the scan of a frame shows."""
        seen = run.stored(
            "trace",
            trace,
            here,
            self.lumen,
            run.case.entry_mm,
            run.case.entry_direction,
            of_frame=frame.index,
            reference=self.reference,
            previous=Before(lambda: _last_curve(frame.index, earlier)),
            expected_mm=None if np.isnan(frame.expected_mm) else frame.expected_mm,
            opacity=run.case.wire.opacity,
            config=run.config.trace,
        )
        return saturated(seen, here)


def _of_scan(run: Context, frame: Frame, curve: Curve, lumen: Lumen) -> Frame:
    """The frame with the wire that its scan shows."""
    if not frame.catheter_mm > 0.0:
        curve = not_too_thick(curve, lumen, run.case.wire.radius_mm)
    if run.case.catheter is not None and np.isnan(frame.expected_mm):
        curve = of_catheter(curve, frame.catheter_mm)
    return frame.traced_by(curve)


def _pictured(frame: Frame, shown: Volume, window: tuple[float, float]) -> Frame:
    """The frame with its scan projected, and pulled straight along the traced wire where it has one."""
    frame = replace(frame, projections=projections(shown, window))
    if frame.curve is None or not frame.traced:
        return frame
    return replace(frame, straightened=straightened(shown, frame.curve.points_mm, window))


def _last_curve(number: int, earlier: Earlier[_Part]) -> Curve:
    """The last good curve before this frame, which tells which of two strands is the wire's; NOTHING without one."""
    seen = (earlier(k).frame.curve for k in reversed(range(number)))
    curves = (curve.without(DIM_FROM_TIP) for curve in seen if curve is not None)
    return next((curve for curve in curves if curve.status is FrameStatus.OK and len(curve.points_mm)), NOTHING)


def _in_plane(frames: list[Frame], settings: TraceConfig) -> list[str]:
    """A warning where more of the traced wire runs in the plane of the scanner's rotation than by chance.

    Of evenly distributed directions a share of sin(limit_deg) lies that near to a plane, 0.17 at 10 degrees. A bend may
    pass through the plane (5 % in half of the catalogue's scenes) without a warning.
    """
    curves = [f.curve for f in frames if f.curve is not None and len(f.curve.points_mm)]
    marks = np.concatenate([np.asarray(c.in_plane) for c in curves]) if curves else np.zeros(0, bool)
    limit_deg = settings.in_plane_deg
    if not marks.any() or marks.mean() <= np.sin(np.radians(limit_deg)):
        return []
    axis = (
        "" if settings.rotation_axis else " (across the scan's third axis, unless trace.rotation_axis says otherwise)"
    )
    return [
        f"{100 * marks.mean():.0f} % of the traced points run within {limit_deg:g} degrees of the plane of rotation"
        f"{axis}, where cone-beam scans streak and resolve the rotation axis least (trace_flags 2 in frames.h5)"
    ]
