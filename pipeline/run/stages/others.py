"""simulate, where another simulator did it: each frame takes that simulator's wire, or has failed."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from pipeline.arrays.grids import spelt
from pipeline.arrays.polyline import at_arc, resample, tangents
from pipeline.compare.metrics import point_to_curve, rms
from pipeline.load.wires import OtherFile, read_wires, warned_beside
from pipeline.model import Array, OtherWire, Wire, arc_length
from pipeline.run.stages.in_itself import not_in_itself
from pipeline.run.stages.known import Context, Frame, Known
from pipeline.run.stages.own_curves import rough
from pipeline.segment.opened import may_lie_outside_mm
from pipeline.simulate import wall_of
from pipeline.simulate.others import (
    MIRROR,
    begun,
    not_to_depth,
    numbered_otherwise,
    oddity,
    out_of_order,
    quarter_mm,
    tightest_bend,
)
from pipeline.status import FrameStatus
from pipeline.study.manifest import Case
from reports.case_files import counted, listed
from reports.doubts import OF_THEIR_RUN
from solver.self_contact import self_overlap_mm

STEP_MM = 0.25
LEAST_ASIDE_MM, LEAST_ASIDE_VOXELS, MOST_LEFT = 0.5, 0.5, 0.35
"""Shift of all wires against the traced ones from which it is told, whichever is less, and the share of it that may be
left without it. From a voxel's corner to its middle it is half a voxel along each axis."""
SHIFT_ROUNDS, LOOSE = 4, 0.1
"""Rounds in which the shift is found, and the share of the best known direction's weight below which a direction is not
known: in a straight tube a wire that is pushed too far would lie aside along it."""
LATE_MM = 1.0
"""How far beyond the clamp's plane a wire may begin unsaid: a straight line to it passes 0.05 mm beside a bend of 10 mm
radius."""
MOST_OUTSIDE = 0.2
"""Share of a wire outside the lumen from which on it is asked whether its x and y are turned."""
MOST_NAMED = 6
FAR_RADII = 3.0
"""How many of its radii a wire's axis may lie beyond the wall unsaid: a tip 0.9 mm beyond it, in all frames, was."""


def frames_of_others(run: Context, known: Known) -> tuple[Frame, ...]:
    """The frames, each with its wire; one that has none, or none that can be used, has failed."""
    case, log = run.case, run.log
    assert case.simulated is not None
    with log.timed("simulate"):
        files = read_wires(case.simulated.files, len(known.frames), case.simulated.space, case.simulated.unit)
        pairs = list(zip(known.frames, files, strict=True))
        lengths = np.array([_length_mm(known, file) for file in files])
        depths = np.array([frame.depth_mm for frame in known.frames])
        near = np.abs(lengths - depths) <= run.config.trace.length_tolerance_mm
        fit = {file.unit for file, so in zip(files, near, strict=True) if so}
        lag = bool(numbered_otherwise(lengths, depths))
        frames = [_taken(run, known, *pair, others_fit=pair[1].unit in fit, lagging=lag) for pair in pairs]
    log.assumptions.append(
        f"the simulated wires are another simulator's: {_listed(files)}; their depth counts from the clamp's plane"
    )
    wires = {f.index: f.simulated.joints_mm for f in frames if f.simulated is not None}
    voxel_mm = known.vessel.distance.voxel_mm
    log.warnings += _in_another_order(frames)
    log.warnings += [*_outside(known, wires, case), *_aside(frames, _seen_in_mm(known))]
    late = _begun_late(known, files, wires)
    log.warnings += _told_late(late)
    log.warnings += rough({n: wires[n][n in late :] for n in wires}, voxel_mm, "the simulated wires")
    log.warnings += _kinked(wires, case.wire)
    return tuple(frames)


def of_their_run(run: Context) -> list[str]:
    """What the run that made these wires was warned of them and this one was not: a roll that it found wrong, say."""
    if run.case.simulated is None or not run.goes_to("simulate"):
        return []
    said = (text.removeprefix(OF_THEIR_RUN) for text in warned_beside(run.case.simulated.files))
    return [f"{OF_THEIR_RUN}{text}" for text in said if text not in run.log.warnings]


def _listed(files: Sequence[OtherFile]) -> str:
    names = [file.name for file in files]
    return f"frame 0 is {names[0]}, frame {len(names) - 1} is {names[-1]}"


def _in_another_order(frames: Sequence[Frame]) -> list[str]:
    """A warning where wires get shorter from a frame to the next deeper one, or have the depths of other frames."""
    lengths = [np.nan if f.simulated is None else float(arc_length(f.simulated.joints_mm)[-1]) for f in frames]
    depths = np.array([f.depth_mm for f in frames])
    found = out_of_order(np.array(lengths), depths)
    if not found:
        lag = numbered_otherwise(np.array(lengths), depths)
        return [
            f"wires have the depths of other frames, that of frame n the depth of frame n {'+' if lag > 0 else '-'} "
            f"{abs(lag)}: are the files numbered as the frames are, and depths counted from the same place?"
        ] * bool(lag)
    here, deeper = (f"{lengths[n]:.2f} mm long in frame {n}, {frames[n].depth_mm:.2f} mm deep" for n in found[0])
    return [
        f"the wires are not in the order of the frames: {here}, and {deeper} ({len(found)} of {len(frames) - 1} steps "
        "are so); is each file that of its frame?"
    ]


def _length_mm(known: Known, file: OtherFile) -> float:
    """A wire's length from the clamp on; NaN where there is none."""
    if file.points_mm is None:
        return float("nan")
    return float(arc_length(begun(file.points_mm, known.held.entry_mm, known.held.direction))[-1])


def _taken(run: Context, known: Known, frame: Frame, file: OtherFile, *, others_fit: bool, lagging: bool) -> Frame:
    case, clamp = run.case, known.held
    if file.points_mm is None:
        status = FrameStatus.CURVE_MISSING if file.missing else FrameStatus.CURVE_UNUSABLE
        return frame.failed("simulate", status, f"{file.name}: {file.problem}")
    entry, direction = np.array(case.entry_mm), np.array(case.entry_direction)
    odd = oddity(file.points_mm, entry, direction, file.unit, frame.depth_mm)
    if odd:
        return frame.failed("simulate", FrameStatus.CURVE_UNUSABLE, f"{file.name}: {odd}")
    points = begun(file.points_mm, clamp.entry_mm, clamp.direction)
    deepest = float(_clearance(known, points).max()) + case.wire.radius_mm
    found = replace(frame, simulated=OtherWire(points, max(deepest, 0.0)))
    radius = case.wire.radius_mm
    own, sentence, message = file.refused
    if own and found.ok:  # as in the run that it comes from
        said = f"{file.name}: {message or sentence}"
        return replace(found, status=own, sentence=sentence, stage="simulate", message=said)
    found = not_in_itself(found, self_overlap_mm(points, radius), radius, f"{file.name}: the wire")
    length = float(arc_length(points)[-1])
    tolerance_mm, told = run.config.trace.length_tolerance_mm, {"others_fit": others_fit, "lagging": lagging}
    wrong = not_to_depth(length, frame.depth_mm, tolerance_mm, file.unit, **told)
    return found.failed("simulate", FrameStatus.NOT_TO_DEPTH, f"{file.name}: {wrong}") if wrong else found


def _kinked(wires: Mapping[int, Array], wire: Wire) -> list[str]:
    """A warning where wires (n, 3), by frame, turn as no wire of this radius does."""
    bends = {n: tightest_bend(wires[n], wire.radius_mm, wire.rest_curvature_per_mm) for n in wires}
    found = {n: bend for n, bend in bends.items() if bend is not None}
    if not found:
        return []
    worst = max(found, key=lambda n: found[n][0])
    angle, place = found[worst]
    reach, where = quarter_mm(wire.radius_mm), spelt(place)
    return [
        f"{counted(len(found), 'frame')}: wires turn as none of radius_mm = {wire.radius_mm:g} does: in frame {worst} "
        f"by {angle:.0f} degrees within {reach:.1f} mm, near [{where}] mm; is the wire folded there?"
    ]


def _clearance(known: Known, points: Array) -> Array:
    """Distance (n,) of equal steps along a wire to the lumen's wall, mm, negative inside."""
    return wall_of(known.vessel.distance, "offset").look_up(resample(points, STEP_MM))[0]


def _begun_late(known: Known, files: Sequence[OtherFile], wires: Mapping[int, Array]) -> dict[int, float]:
    """By frame, of those with a wire, how far beyond the clamp's plane it begins, mm, where that is over LATE_MM."""
    entry, along = known.held.entry_mm, known.held.direction
    read = {f.index: file.points_mm for f, file in zip(known.frames, files, strict=True)}
    begins = {n: float((points[0] - entry) @ along) for n in wires if (points := read[n]) is not None}
    return {n: mm for n, mm in begins.items() if mm > LATE_MM}


def _told_late(late: Mapping[int, float]) -> list[str]:
    """A warning of wires whose first part is missing."""
    if not late:
        return []
    each = listed([f"frame {n}: {mm:.1f} mm" for n, mm in late.items()], MOST_NAMED)
    return [
        f"wires begin beyond the clamp's plane ({each}): up to there they count as straight lines along its direction; "
        "write the wire from the clamp on"
    ]


def _seen_in_mm(known: Known) -> float:
    """The voxels that the wires are seen in, mm; inf where there are no scans."""
    return float(known.scans.first.grid.voxel_mm) if known.scans.first is not None else np.inf


def _aside(frames: Sequence[Frame], voxel_mm: float) -> list[str]:
    """A warning where all wires lie aside from the traced ones by one and the same shift, and near without it."""
    pairs = [(f.curve.points_mm, f.simulated.joints_mm) for f in frames if f.curve and f.traced and f.simulated]
    if not pairs:
        return []
    shift, left = _shift_between(pairs)
    size = float(np.linalg.norm(shift))
    if size < min(LEAST_ASIDE_MM, LEAST_ASIDE_VOXELS * voxel_mm) or left > MOST_LEFT * size:
        return []
    place = spelt(shift, 2)
    corner = " (a voxel's corner lies half a voxel from its middle along each axis)" * (size < 2.0 * voxel_mm < np.inf)
    return [
        f"the wires lie ({place}) mm aside from the traced ones, alike in {counted(len(pairs), 'frame')} (without that "
        f"{left:.2g} mm rms are left): is their origin that of the scans{corner}?"
    ]


def _shift_between(pairs: Sequence[tuple[Array, Array]]) -> tuple[Array, float]:
    """The shift (3,) from curves to wires, (n, 3) each, that is common to all pairs, and the distance without it, rms.

    By what lies across the curve: a wire that is shifted along itself is cut at the clamp's plane, so that places of
    the same arc length are others. Along straight curves none is found.
    """
    shift, left = np.zeros(3), np.inf
    for _ in range(SHIFT_ROUNDS):
        offs, ways = [], []
        for curve, wire in pairs:
            points = resample(wire, STEP_MM) - shift
            feet = point_to_curve(points, curve)[1]
            between = (feet > 0.0) & (feet < float(arc_length(curve)[-1]))  # beyond its ends a curve is no line
            offs.append((points - at_arc(curve, feet))[between])
            ways.append(tangents(curve, feet[between], STEP_MM))
        off, way = np.concatenate(offs), np.concatenate(ways)
        if not len(off):
            return np.zeros(3), np.inf
        across = np.eye(3) - way[:, :, None] * way[:, None, :]
        off = np.einsum("nij,nj->ni", across, off)
        left = rms(np.linalg.norm(off, axis=1))
        shift = shift + np.linalg.pinv(across.sum(axis=0), rcond=LOOSE, hermitian=True) @ off.sum(axis=0)
    return shift, left


def _outside(known: Known, wires: Mapping[int, Array], case: Case) -> list[str]:
    """Warnings where wires (n, 3), by frame, lie outside the lumen, and whether they would not with x and y turned."""
    radius_mm, beyond = case.wire.radius_mm, {n: _clearance(known, wire) for n, wire in wires.items()}
    outside = {n: np.mean(mm > radius_mm) for n, mm in beyond.items()}
    outside = {n: share for n, share in outside.items() if share > MOST_OUTSIDE}
    if not outside:
        may = may_lie_outside_mm(known.vessel.distance.voxel_mm, case.wall.stiffness_N_mm2)
        return _through_wall(beyond, max(FAR_RADII * radius_mm, may))
    worst = max(outside, key=lambda n: float(outside[n]))
    turned = Counter(np.mean(_clearance(known, wires[n] * MIRROR) > radius_mm) < 0.5 * outside[n] for n in outside)
    hint = "; with x and y turned most would not: are they RAS?" if turned[True] > turned[False] else ""
    what = f"{100 * outside[worst]:.0f} % of the wire lies outside the lumen by more than its radius"
    several = f"{counted(len(outside), 'frame')}, the worst is " * (len(outside) > 1)
    return [f"{several}frame {worst}: {what}{hint}"]


def _through_wall(beyond: Mapping[int, Array], allowed_mm: float) -> list[str]:
    """A warning where a part of a wire, as its tip, lies beyond the wall. beyond : by frame, mm, in equal steps."""
    through = {n: mm for n, mm in beyond.items() if mm.max() > allowed_mm}
    if not through:
        return []
    worst = max(through, key=lambda n: float(through[n].max()))
    mm = through[worst]
    several = f"{counted(len(through), 'frame')}, the worst is " * (len(through) > 1)
    tip = f", its tip {mm[-1]:.2f} mm" * bool(mm[-1] > allowed_mm)
    return [
        f"{several}frame {worst}: the wire lies up to {mm.max():.2f} mm beyond the lumen's wall{tip} (expected "
        f"{allowed_mm:.2f} mm at most): has it left the vessel, or is this another lumen than its own?"
    ]
