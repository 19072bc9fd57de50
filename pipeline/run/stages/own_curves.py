"""The user's own traced curves: begun at the entry, and judged by what a curve alone can tell of itself.

No scan has to be there for that. A curve in straight lines from voxel to voxel is too long, and so is the wire that is
simulated beside it; one of few points cuts its own corners; one in another vessel is no wire of this lumen.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from pipeline.arrays.polyline import resample, turns_deg
from pipeline.load.curves import read_curve
from pipeline.model import Array, Curve, arc_length
from pipeline.run.stages.known import Context, Frame
from pipeline.run.stages.repeated import TIP
from pipeline.segment.opened import may_lie_outside_mm, outside_mm
from pipeline.simulate.others import begun, oddity
from pipeline.status import FrameStatus
from pipeline.trace import of_length
from reports.case_files import listed
from reports.doubts import MOSTLY_LINES
from solver import Grid

OUTSIDE_VOXELS, MOST_OUTSIDE = 2.0, 0.25
"""Points so far outside the wall, and their share above which a curve is not in this lumen: segmented ones and traces
differ by a voxel; where fewer lie outside, that is said, and the lumen opened unless its wall may yield as far."""
CHORD_MM, LONGER = 2.0, 0.02
"""A curve longer by this share than arcs through its points so far apart zigzags: skeletons of voxels by 0.06 to 0.09,
points that scatter by a tenth of their distance by 0.01."""
CORNER_VOXELS = 0.25
"""How far beside a smooth curve the lines between points may pass: traces of scans are off by 0.03 to 0.11 voxel."""
FEWEST_TURNS, AGAINST = 8, -0.25
"""Turns from which a curve can be told to be jagged, and the correlation of neighbouring ones below which it is: -2/3
where points scatter, and above 0 along a bend."""
LONE, UNSEEN_RADIUS_MM = 0.9, 20.0
"""Share of a curve's length from which a piece is all of it and nothing tells how it bends, and a bend it may have."""
LEAST_BEND_MM = 0.01
"""By how much a curve that is not straight is longer than its chord: as 5 mm of a wire with a radius of 20 mm."""
STEPS_MM = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01)
MOST_NAMED = 6
_LINE = "mm in one line"
RESAMPLE = "give more; 3D Slicer saves a curve's control points alone: resample it before it is saved"


def given_curves(run: Context) -> list[Curve]:
    """The user's own curves, where the manifest names them."""
    if run.case.traces:
        run.log.assumptions.append("the traced curves are the manifest's own files")
    return [read_curve(source.path) for source in run.case.traces]


def as_given(run: Context, frame: Frame, curve: Curve, distance: Grid, scan: Grid | None) -> Frame:
    """The frame with the user's own curve, from the plane through the entry on; failed where it cannot be its wire's.

    distance : the lumen's, mm.     scan : whose voxels its numbers may be.
    """
    entry, direction = np.array(run.case.entry_mm), np.array(run.case.entry_direction)
    odd = oddity(curve.points_mm, entry, direction, depth_mm=frame.expected_mm, scan=scan)
    if odd:
        return frame.failed("trace", FrameStatus.TRACE_FAILED, f"{curve.source}: {odd}")
    points = begun(curve.points_mm, entry, direction)
    expected = None if np.isnan(frame.expected_mm) else frame.expected_mm
    stated = run.case.uncertainty.traces_mm
    sigma_mm = np.full(len(points), np.nan if stated is None else stated)
    begun_there = Curve(points, sigma_mm, source=curve.source)
    curve = of_length(begun_there, expected, run.config.trace)
    frame = replace(frame, voxels=frame.voxels or known_by_tip(points))
    return frame.traced_by(_in_lumen(_smooth(curve), distance, run.case.wall.stiffness_N_mm2))


def known_by_tip(points_mm: Array) -> str:
    """What tells a curve (n, 3) from those of other insertions, in whatever file it is: where it ends, to 0.01 mm.

    Empty for a straight one, whose end tells of its depth alone.
    """
    if arc_length(points_mm)[-1] - np.linalg.norm(points_mm[-1] - points_mm[0]) < LEAST_BEND_MM:
        return ""
    return TIP + " ".join(f"{x:.2f}" for x in np.round(points_mm[-1], 2) + 0.0)


def _smooth(curve: Curve) -> Curve:
    """The curve; one that zigzags has failed: its length, which is the frame's depth, is not the wire's."""
    share = zigzag(curve.points_mm)
    if curve.refused or share <= LONGER:
        return curve
    note = (
        f"{curve.source}: {curve.length_mm:.2f} mm long, {100 * share:.3g} % more than arcs through its points "
        f"{CHORD_MM:g} mm apart, allowed {100 * LONGER:g} %: it zigzags, as from voxel to voxel, or its "
        "points scatter; its length is taken for the wire's: smooth it"
    )
    return curve.doubted(FrameStatus.TRACE_FAILED, note)


def _in_lumen(curve: Curve, distance: Grid, stiffness_N_mm2: float) -> Curve:
    """The curve; one of which much lies outside the lumen, further than its wall may yield, has left it."""
    voxel = distance.voxel_mm
    allowed = max(OUTSIDE_VOXELS * voxel, may_lie_outside_mm(voxel, stiffness_N_mm2))
    share = float(np.mean(outside_mm(distance, resample(curve.points_mm, 0.5 * voxel)) > allowed))
    if curve.refused or share <= MOST_OUTSIDE:
        return curve
    note = (
        f"{curve.source}: {100 * share:.3g} % of the curve lie over {allowed / voxel:.2g} voxels outside the lumen, "
        f"allowed {100 * MOST_OUTSIDE:.0f} %; are lumen and curve in the same coordinates (LPS mm), and of the same "
        "phantom?"
    )
    return curve.doubted(FrameStatus.TRACE_LEFT_LUMEN, note)


def rough(curves: Mapping[int, Array], voxel_mm: float, whose: str, mend: str = "") -> list[str]:
    """Warnings of curves (n, 3), by frame, that cut the wire's corners, or are jagged. whose, mend : words for it."""
    allowed_mm = CORNER_VOXELS * voxel_mm
    told = {frame: _cut(points, allowed_mm) for frame, points in curves.items()}
    cut = {frame: text for frame, text in told.items() if text}
    longer = {n: share for n in cut if (share := jagged(curves[n]))}
    coarse = [f"frame {n}: {text}" for n, text in cut.items() if n not in longer]
    said = []
    if coarse:
        apart_mm = _apart_mm((curves[n] for n in cut if n not in longer), allowed_mm)
        mostly = f" ({MOSTLY_LINES})" * (2 * sum(_LINE in text for text in told.values()) > len(told))
        said.append(
            f"{whose} have few points{mostly}: straight lines between them pass beside a smooth wire "
            f"({listed(coarse, MOST_NAMED)}; they may pass {allowed_mm:.2f} mm beside it): "
            f"{mend or f'give a point every {apart_mm:g} mm'}"
        )
    if longer:
        each = listed([f"frame {n}: {100.0 * share:.1f} %" for n, share in longer.items()], MOST_NAMED)
        said.append(
            f"{whose} are jagged: their points scatter to both sides of a smooth wire, which makes them longer "
            f"({each}, about): arc lengths and depth offsets are off by as much: smooth them"
        )
    return said


def _cut(points_mm: Array, allowed_mm: float) -> str:
    """By how much a curve (n, 3) cuts the wire's corners, in words; empty where that is no more than is allowed.

    One straight line has no corner that could tell: it is judged by a bend that wires often have.
    """
    if len(points_mm) < 2:
        return ""
    steps = np.linalg.norm(np.diff(points_mm, axis=0), axis=1)
    length, longest = float(steps.sum()), float(steps.max())
    if longest > LONE * length:
        return f"{length:.1f} {_LINE}" if longest**2 / (8.0 * UNSEEN_RADIUS_MM) > allowed_mm else ""
    mm = corner_mm(points_mm)
    return f"{mm:.2f} mm beside it" if mm > allowed_mm else ""


def _apart_mm(curves: Iterable[Array], allowed_mm: float) -> float:
    """How far apart points (n, 3) of these curves may lie, 1 mm at most: 0.5, 0.2, 0.1 and so on.

    A line of length h passes h^2 / 8R beside a bend of radius R.
    """
    tightest = max(1.0 / UNSEEN_RADIUS_MM, *(float(_bends_per_mm(points).max()) for points in curves))
    apart = float(np.sqrt(8.0 * allowed_mm / tightest))
    return next(step for step in STEPS_MM if step <= max(apart, STEPS_MM[-1]))


def jagged(points_mm: Array) -> float:
    """The share by which a curve (n, 3) whose points scatter is longer than a smooth one; 0 for one that is smooth.

    Scatter s (of both components across) at steps h turns next tangents against each other: products of the turns at
    a point and the next are -4 s^2 / h^2 in the mean, at the next but one s^2 / h^2, and a bend adds the same to both.
    """
    steps = np.diff(points_mm, axis=0)
    turn = np.diff(steps / np.maximum(np.linalg.norm(steps, axis=1), 1e-12)[:, None], axis=0)
    if len(turn) < FEWEST_TURNS:
        return 0.0
    square, next_one, next_but_one = (
        float(np.mean(np.sum(turn[n:] * turn[: len(turn) - n], axis=1))) for n in range(3)
    )
    return (next_but_one - next_one) / 5.0 if next_one < AGAINST * square else 0.0


def zigzag(points_mm: Array) -> float:
    """The share by which a curve (n, 3) is longer than arcs through its points CHORD_MM apart; 0 for one point."""
    if len(points_mm) < 2:
        return 0.0
    coarse = resample(points_mm, CHORD_MM)
    steps = np.diff(coarse, axis=0)
    turn = np.radians(turns_deg(coarse, 1))
    # an arc that turns by t is longer than its chord by t^2 / 24
    arcs = float(np.linalg.norm(steps, axis=1).sum()) * (1.0 + float(np.mean(turn**2) if len(turn) else 0.0) / 24.0)
    return float(arc_length(points_mm)[-1]) / arcs - 1.0


def corner_mm(points_mm: Array) -> float:
    """The furthest that a line between two points (n, 3) passes beside an arc with the curve's turns at these, mm."""
    length = np.linalg.norm(np.diff(points_mm, axis=0), axis=1)
    return float(np.max(_bends_per_mm(points_mm) * length**2 / 8.0))


def _bends_per_mm(points_mm: Array) -> Array:
    """Curvature (n - 1,) of a curve (n, 3) from each point to the next, by the turns at both."""
    length = np.linalg.norm(np.diff(points_mm, axis=0), axis=1)
    bend = np.radians(turns_deg(points_mm, 1)) / (0.5 * (length[1:] + length[:-1]))
    ends = np.concatenate([bend[:1], bend, bend[-1:]]) if len(bend) else np.zeros(2)
    return np.asarray(0.5 * (ends[1:] + ends[:-1]))
