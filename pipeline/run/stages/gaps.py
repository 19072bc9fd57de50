"""Gaps in traced wires: the wire's own, a streak's, or what lies between its tip and a second device that faces it.

A wire's own gap goes with its tip, a streak makes one that stays where it is. What already lay ahead of the wire's tip
in another frame, and stayed there while the wire came nearer, is no part of it: a line, or the marker of a catheter.
Nor is what stays where it is while the wire comes nearer to it, or what a deeper wire goes past.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.model import Array, Curve, arc_length
from pipeline.run.stages.known import Frame
from pipeline.status import FrameStatus
from pipeline.trace import BEYOND_GAP, GAP
from reports.case_files import frames_named, listed

FEWEST = 3
"""Frames that must agree on a gap."""
AGREE_VOXELS = 4.0
"""How much the places of their gaps may differ: a gap of 1.5 mm is seen anywhere within it."""
MOVED_MM = 5.0
"""By how much the wire must have been pushed between the first and the last of them."""
CAME_NEARER_MM = 2.0
"""By how much the wire before the gap must have come nearer to a line that stayed where it was."""
STAYED_VOXELS, STAYED_MM = 2.0, 2.5
"""How closely, and over what length, the line beyond a gap must lie where another frame has one off its wire."""
END_MM = 2.0
"""Length of a curve's end that may be a marker that lay there before, and what a marked tube shows around it."""


def own_gaps(frames: Sequence[Frame], voxel_mm: float) -> tuple[list[Frame], list[str]]:
    """The frames, cleared of the doubt about a gap where they agree on it; and warnings of gaps that are no streak's.

    Of gaps, frames with a stated depth are left out: it says where the wire ends. So are frames that are refused for
    something else, and copies of others: they agree with none.
    """
    out = list(frames)
    seen = {n: c for n, f in enumerate(out) if np.isnan(f.expected_mm) and (c := f.open_curve) is not None}
    with_gap = [n for n, curve in seen.items() if BEYOND_GAP in curve.levels]
    curves = [seen[n] for n in with_gap]
    length = np.array([curve.length_mm for curve in curves])
    beyond = np.array([curve.levels[BEYOND_GAP] for curve in curves])
    with_tip, stays = (_same(place, length, voxel_mm) for place in (beyond, length - beyond))
    agreed = with_tip | stays
    for n in np.flatnonzero(agreed):
        out[with_gap[n]] = out[with_gap[n]].cleared(curves[n].without(BEYOND_GAP))
    out, touching = _left_behind(_faced(out, voxel_mm), voxel_mm)
    curved = [(f.index, f.curve) for f in frames if f.curve is not None]
    marked = [(curve.length_mm, index, curve.marks_mm) for index, curve in curved if len(curve.marks_mm)]
    out = [_past_marks(frame, marked, voxel_mm) for frame in out]
    odd = [f"{out[with_gap[n]].index} ({beyond[n]:.1f} mm)" for n in np.flatnonzero(~agreed) if out[with_gap[n]].ok]
    said = touching + _pushed_along([out[with_gap[n]] for n in np.flatnonzero(with_tip & ~stays)])
    if not odd:
        return out, said
    return out, [
        *said,
        f"{frames_named(odd)}: so much of the traced wire lies beyond a gap in it, and a second device that faces "
        f"the wire's tip would look the same: look at the picture, or state insertion_mm",
    ]


def _same(place: Array, length: Array, voxel_mm: float) -> NDArray[np.bool_]:
    """Which gaps lie at one place (n,), in frames enough, whose wires (n,) mm long have been pushed between them."""
    same = np.abs(place - np.median(place)) < AGREE_VOXELS * voxel_mm if len(place) else np.zeros(0, bool)
    return same & (same.sum() >= FEWEST and np.ptp(length[same]) > MOVED_MM)


def _pushed_along(frames: Sequence[Frame]) -> list[str]:
    """A warning of frames whose gaps go with their tips: a device that is pushed with the wire looks so, too."""
    levels = {f.index: f.curve.levels for f in frames if f.ok and f.curve is not None}
    if not levels:
        return []
    beyond, gap = (float(np.median([of[name] for of in levels.values()])) for name in (BEYOND_GAP, GAP))
    return [
        f"{frames_named([*levels])}: the last {beyond:.1f} mm of the traced wire lie beyond a gap that goes "
        "with its tip: taken for the wire's own; were they a second device that was pushed with the wire, its tip "
        f"would lie {beyond + gap:.1f} mm before: look at the picture, or state insertion_mm"
    ]


def _left_behind(frames: list[Frame], voxel_mm: float) -> tuple[list[Frame], list[str]]:
    """The frames; those fail that end at one point, and in one line, of which the wire before the gap came nearer.

    And a warning of frames that end there, too, and are ok: the wire may have come up to what lies there.

    A wire that is pushed or drawn takes its end along; what stays has broken off, or is another device. Frames of 9, 12
    and 15 mm of wire ended at 29 mm, where a second wire began at 17 mm, and were ok.
    """
    seen = {n: f.trusted_curve for n, f in enumerate(frames) if np.isnan(f.expected_mm)}
    curves = {n: curve for n, curve in seen.items() if curve is not None}
    out, ends_there = list(frames), set[int]()
    for n, curve in curves.items():
        end, lies = curve.points_mm[-1], curve.levels.get(BEYOND_GAP, np.nan)
        there = [m for m, c in curves.items() if np.linalg.norm(c.points_mm[-1] - end) < STAYED_VOXELS * voxel_mm]
        before = [
            c.length_mm - c.levels[BEYOND_GAP] - c.levels[GAP]
            for c in (curves[m] for m in there)
            if abs(c.levels.get(BEYOND_GAP, np.nan) - lies) < AGREE_VOXELS * voxel_mm
        ]
        if len(there) >= FEWEST and before and np.ptp(before) > CAME_NEARER_MM:
            note = (
                f"trace: wire: got an end at one point in {len(there)} frames "
                f"({listed([str(frames[m].index) for m in there])}), in {lies:.1f} mm of line that stay where they are "
                f"while the wire before them ends {min(before):.1f} mm deep in one and {max(before):.1f} mm in "
                "another; expected an end that moves with the wire; what lies there has broken off, or is another "
                "device: look at the picture, or state insertion_mm"
            )
            out[n] = frames[n].failed("trace", FrameStatus.TRACE_AMBIGUOUS, note)
            ends_there |= {*there}
    return out, _touching([out[m] for m in sorted(ends_there)])


def _touching(frames: Sequence[Frame]) -> list[str]:
    """A warning of those frames that are ok though they end where others are refused for a line that stays."""
    stays, untold = ([str(f.index) for f in frames if f.ok is ok] for ok in (False, True))
    if not untold:
        return []
    return [
        f"{frames_named(untold)}: the traced wire ends where a line stays where it is in {frames_named(stays)}; how "
        "much of it is that line does not show: look at the picture, or state insertion_mm"
    ]


def _faced(frames: list[Frame], voxel_mm: float) -> list[Frame]:
    """The frames; one fails whose curve goes on along a line that another frame shows off its wire and ahead of it."""
    out = list(frames)
    for n, frame in enumerate(frames):
        curve = frame.trusted_curve
        if curve is None or np.isfinite(frame.expected_mm) or BEYOND_GAP not in curve.levels:
            continue
        for other in frames:
            if other is not frame and other.curve is not None and _lay_there(curve, other.curve, voxel_mm):
                note = (
                    f"trace: wire: got {curve.levels[BEYOND_GAP]:.1f} mm of line beyond a gap, which lies there in "
                    f"frame {other.index}, of {other.curve.length_mm:.1f} mm of wire; expected a line that moves with "
                    "the wire; look for a second device that faces the wire's tip; state insertion_mm"
                )
                out[n] = frame.failed("trace", FrameStatus.TRACE_AMBIGUOUS, note)
                break
    return out


def _lay_there(curve: Curve, other: Curve, voxel_mm: float) -> bool:
    """Whether the line beyond a curve's gap lies there, off a wire that ends well before that gap, or goes past it."""
    ends_mm = curve.length_mm - curve.levels[BEYOND_GAP]
    before, past = ends_mm - curve.levels[GAP] - CAME_NEARER_MM, curve.length_mm + CAME_NEARER_MM
    if not len(other.elsewhere_mm) or before < other.length_mm < past:
        return False
    arc = arc_length(curve.points_mm)
    off = cKDTree(other.elsewhere_mm).query(curve.points_mm[arc > ends_mm])[0]
    return bool(np.mean(off < STAYED_VOXELS * voxel_mm) * (arc[-1] - ends_mm) > STAYED_MM)


def _past_marks(frame: Frame, marked: Sequence[tuple[float, int, Array]], voxel_mm: float) -> Frame:
    """The frame; failed where its curve ends at a mark that stands there in frames of two smaller depths.

    One frame alone may show its own tip beyond what is not seen of its wire; a catheter that is stated explains it.
    marked : length of wire, mm, number, and marks (n, 3), LPS mm, of all frames that show some.
    """
    curve = frame.trusted_curve
    if curve is None or frame.catheter_mm > 0.0:
        return frame
    arc = arc_length(curve.points_mm)
    end = cKDTree(curve.points_mm[arc > arc[-1] - END_MM])
    seen = {
        length_mm: number
        for length_mm, number, marks in marked
        if length_mm < arc[-1] - CAME_NEARER_MM and np.any(end.query(marks)[0] < STAYED_VOXELS * voxel_mm)
    }
    if not seen or max(seen) - min(seen) < CAME_NEARER_MM:
        return frame
    note = (
        f"trace: wire: got an end where something as bright as the wire lies in frames {seen[min(seen)]} and "
        f"{seen[max(seen)]}, beyond {min(seen):.1f} and {max(seen):.1f} mm of wire; expected an end with nothing there "
        "before; look for a catheter's marker; state the catheter and its insertion_mm"
    )
    return frame.failed("trace", FrameStatus.TRACE_AMBIGUOUS, note)
