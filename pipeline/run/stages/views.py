"""compare, where the real wire is known from X-ray projections."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pipeline.arrays.grids import corners_mm
from pipeline.arrays.polyline import at_arc
from pipeline.compare import Comparison, point_to_curve
from pipeline.compare.config import CompareConfig
from pipeline.compare.nulls import NULLS, TOLD, Clues, PredictorInputs
from pipeline.compare.seen import largest_scale, require_in_order, require_not_longer
from pipeline.compare.views import Screen, counted, nulls_in, pair_in, screen_of, values_in
from pipeline.load.views import View
from pipeline.model import Array, arc_length
from pipeline.run.stages.known import Context, Frame, Known
from pipeline.run.stages.variants import simulated_rivals, variant_wires, variants_of
from pipeline.simulate import wall_of
from pipeline.status import FrameStatus
from reports.case_files import counted as number_of
from reports.case_files import listed

FAR_SHIFT_MM = 10.0
"""A fitted shift beyond which a registration is doubted: a head or a limb moves by some millimetres. A liver moves by
10 to 20 with every breath, so that this is a word and no failure."""


BESIDE_MM, NEARLY = 2.0, 0.75
"""How far from a polyline its entry is doubted, and from which share of the wire's length on: shorter ones may begin
farther in."""


def compare_in_views(run: Context, known: Known) -> tuple[Frame, ...]:
    """The frames with their errors on the planes of their views, beside those of predictors that are shifted alike."""
    clues, config = _clues(run, known), run.config.compare
    ways = [] if clues is None else variants_of(run, known)
    wires = run.share("compare", lambda i, _: variant_wires(run, known, ways[i]), len(ways))
    simulated = simulated_rivals(run, known, ways, wires)
    seen = [PredictorInputs(simulated=simulated.get(frame.index, {})) for frame in known.frames]
    tolerance = run.config.trace.length_tolerance_mm
    frames = [_compared(frame, clues, told, config, tolerance) for frame, told in zip(known.frames, seen, strict=True)]
    limited = "" if clues is None else _limited(frames, clues, config)
    views = [frame.view for frame in frames if frame.view is not None]
    how = "shifted in the plane to lie best from 40 to 110 mm behind the tip, and scored on the last 40 mm"
    run.log.chosen["projections"] = "translation fitted" if views[0].fitted else "no translation"
    run.log.assumptions.append(
        "distances are in the plane through the isocentre, parallel to the detector; each wire, predictors too, was "
        + (how if views[0].fitted else "taken where it lies: no translation was fitted")
    )
    run.log.warnings += _far_shifts(frames) + _beside_the_entry(frames)
    if not limited:
        run.log.warnings += [] if clues is None else _odd_views(frames, clues, config)
        return tuple(frames)
    # a wire cannot lie farther from its vessel's middle than the vessel's radius: the rest is a registration error
    run.log.warnings.insert(0, limited)
    run.log.chosen["label"] = limited
    return tuple(replace(frame, nulls_rms_mm={}) for frame in frames)


def _clues(run: Context, known: Known) -> Clues | None:
    """What predictors may know: the lumen, and the vessel's end that was stated beforehand."""
    views = [frame.view for frame in known.frames if frame.view is not None]
    if known.lumen is None or known.clamp is None:
        return None
    # where the real wire lay in space is not known: paths are looked for in all of the lumen
    towards = np.vstack([corners_mm(known.lumen.distance), views[0].leaf_mm])
    return Clues(known.lumen, known.clamp, run.case.wire.radius_mm, towards)


def _compared(
    frame: Frame, clues: Clues | None, seen: PredictorInputs, config: CompareConfig, tolerance_mm: float
) -> Frame:
    view, wire = frame.view, frame.simulated_wire
    if view is None or clues is None or wire is None:
        return frame
    screen = screen_seen(view)
    guesses = {name: guess(clues, frame.depth_mm, seen) for name, guess in NULLS.items() if name not in TOLD}
    known_wires = {name: guess for name, guess in guesses.items() if guess is not None}
    try:
        require_in_order(screen, view.points_px, frame.index)
        pair = pair_in(screen, np.asarray(wire.joints_mm), view.fitted, clues.lumen, clues.way, config)
        _require_to_depth(frame, view, pair.wire_mm[0], clues, tolerance_mm)
        nulls = nulls_in(screen, known_wires, view.fitted, config)
    except ValueError as error:
        return frame.failed("compare", FrameStatus.VIEW_FAILED, str(error))
    axes = screen.axes.T
    flat = tuple((curve - screen.isocentre_mm) @ axes for curve in (pair.curve_mm, pair.wire_mm))
    done = Comparison(**vars(pair), values=values_in(pair))
    return replace(frame, comparison=done, nulls_rms_mm=nulls, in_view_mm=flat)


def _require_to_depth(frame: Frame, view: View, entry_mm: Array, clues: Clues, tolerance_mm: float) -> None:
    """ValueError where the polyline is longer than a wire of the frame's depth may be seen.

    entry_mm : (3,) where the entry is seen on the plane, shifted as the wire was.
    """
    screen = screen_seen(view)
    scale, said = largest_scale(screen, corners_mm(clues.lumen.distance)), f"{tolerance_mm:g} mm"
    if view.fitted:
        # along a straight wire a shift is not known: that far the entry may be seen elsewhere
        tolerance_mm += FAR_SHIFT_MM
        said += f" and {FAR_SHIFT_MM:g} for what a fitted shift may miss"
    longest = scale * (frame.depth_mm + tolerance_mm)
    told = (
        f"and a wire {frame.depth_mm:.2f} mm deep is seen {longest:.1f} mm long at the most (up to {scale:.2f} times "
        f"enlarged, with trace.length_tolerance_mm = {said})"
    )
    require_not_longer(screen, view.points_px, entry_mm, longest, told)


def screen_seen(view: View) -> Screen:
    """The plane of a view with the polyline on it."""
    return screen_of(view.matrix, view.isocentre_mm, view.points_px)


def _odd_views(frames: Sequence[Frame], clues: Clues, config: CompareConfig) -> list[str]:
    """A warning of single views in which even the centreline lies farther from the wire than a wire can."""
    odd = []
    for frame in frames:
        if frame.ok and "centreline" in frame.nulls_rms_mm and frame.view is not None:
            off, radius = frame.nulls_rms_mm["centreline"], float(np.median(_radii(frame, clues, config)))
            if off > radius * (1.0 + frame.view.fitted):
                odd.append(f"{frame.index} ({off:.1f} mm in a lumen of {radius:.1f} mm radius)")
    if not odd:
        return []
    return [
        f"the view of frame {listed(odd)} is perhaps registration-limited: so far is the centreline from the polyline, "
        "farther than in the other frames and than a wire can be from it; check isocentre_mm, matrix or c_arm, and "
        "points_px of that frame, which is in all that is pooled"
    ]


def _beside_the_entry(frames: Sequence[Frame]) -> list[str]:
    """A warning where polylines as long as their wires do not pass the entry, which the manifest knows to a voxel.

    In a wide vessel nothing else tells a geometry that is wrong. A fitted shift moves the entry with all the rest.
    """
    known = [f.comparison for f in frames if f.ok and f.comparison and f.view is not None and not f.view.fitted]
    whole = [c for c in known if arc_length(c.curve_mm)[-1] > NEARLY * arc_length(c.wire_mm)[-1]]
    off = [float(point_to_curve(c.wire_mm[:1], c.curve_mm)[0][0]) for c in whole]
    if not off or np.median(off) <= BESIDE_MM:
        return []
    return [
        f"the polylines pass the entry, as it is projected, at {np.median(off):.1f} mm in the median of "
        f"{number_of(len(off), 'frame')} (doubted from {BESIDE_MM:g} mm on): check isocentre_mm, matrix or c_arm, and "
        "points_px, unless the polylines begin beyond the entry"
    ]


def _far_shifts(frames: Sequence[Frame]) -> list[str]:
    """A warning of shifts that few patients make: a wire that lies elsewhere would be scored as if it lay there."""
    shifts = [
        float(np.linalg.norm(shifted.wire_mm[0] - screen_seen(frame.view).flat(frame.simulated.joints_mm)[0]))
        for frame in frames
        if frame.ok and (shifted := frame.comparison) and frame.view is not None and frame.simulated is not None
    ]
    far = [mm for mm in shifts if mm > FAR_SHIFT_MM]
    if not far:
        return []
    return [
        f"the wires of {number_of(len(far), 'frame')} were shifted by up to {max(far):.0f} mm to lie on what was seen, "
        f"of which no error tells (doubted from {FAR_SHIFT_MM:g} mm on): check isocentre_mm, matrix, c_arm, points_px "
        'and the depths, unless breath moves what was seen so far; with translation = "none" it is in the errors'
    ]


def _limited(frames: Sequence[Frame], clues: Clues, config: CompareConfig) -> str:
    """A warning where even the centreline lies farther from the wire than the lumen's radius; empty elsewhere.

    Perhaps, where shifts are fitted: the wire may lie a radius off its middle in the part that is fitted, and as far on
    the other side in the part that is scored.
    """
    known = [frame for frame in frames if frame.ok and "centreline" in frame.nulls_rms_mm]
    if not known or clues.centreline is None:
        return ""
    off = float(np.sqrt(np.mean([frame.nulls_rms_mm["centreline"] ** 2 for frame in known])))
    radius = float(np.median(np.concatenate([_radii(frame, clues, config) for frame in known])))
    if off <= radius:
        return ""
    fitted = known[0].view is not None and known[0].view.fitted
    perhaps = "perhaps " * (fitted and off <= 2.0 * radius)
    return (
        f"{perhaps}registration-limited: centreline {off:.1f} mm in a lumen of {radius:.1f} mm radius; no skill can be "
        "claimed; check isocentre_mm, matrix or c_arm, and points_px: pixels, in the order in which matrix gives them"
    )


def _radii(frame: Frame, clues: Clues, config: CompareConfig) -> Array:
    """The lumen's radius along the part of its middle that was scored."""
    path = NULLS["centreline"](clues, frame.depth_mm, PredictorInputs())
    assert path is not None
    assert frame.view is not None
    part = at_arc(path, counted(path, frame.view.fitted, config))
    return np.asarray(-wall_of(clues.lumen.distance, "offset").look_up(part)[0])
