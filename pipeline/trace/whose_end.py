"""Is a curve's end that of the wire? A catheter may reach beyond the wire, a marker may lie beyond what is seen.

Asked of frames without a stated depth alone: where there is one, it says where the wire ends. What is as bright as the
wire beyond its end is looked for in all, for what it says of the others.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import ndtr

from pipeline.arrays.grids import unflattened
from pipeline.arrays.jets import gaussian_taps, smooth_voxels
from pipeline.model import Array, Curve, arc_length
from pipeline.status import FrameStatus
from pipeline.trace.attempt import dense
from pipeline.trace.profile import BAND_VOXELS, INDEPENDENT_VOXELS, LEAST_LEVEL, UNEVEN
from pipeline.trace.steps import Steps
from pipeline.trace.subtraction import CREST_VOXELS, Subtraction
from pipeline.trace.tube import Tube
from pipeline.trace.verdict import note_of

MARK_BLUR = 1.0
"""Voxels by which grey is blurred where a mark is looked for: half as wide as a band of 1 mm is long."""
MARK_SHARE, MARK_SIGMAS = 0.35, 5.0
"""Share of the wire's own height, and standard deviations of noise, from which something is a mark: a lumen has some
thousand places that do not depend on each other, of which noise alone makes one in 3,000 a mark."""
MARK_OFF = 4.0
"""Least distance of a mark from the tip in voxels: what is nearer belongs to the tip."""
BODY_MM = 3.0
"""Length from which a piece is the wire's body, and no marker band."""
DIM_FROM_TIP = "dim_from_tip_mm"
"""Level of a curve that is doubted for a dim part: how far from its end that part begins."""
BEYOND_GAP = "beyond_gap_mm"
"""Level of a curve with a gap in it: how much of it lies beyond."""
GAP = "gap_mm"
"""Level of such a curve: how long the gap is."""
GAP_SHARE, SIDE_MM, MARK_MM = 0.6, 1.5, 0.75
"""Share of the line's grey on either side below which it has a gap, and how much line there is before it and beyond it
at the least: blur leaves 0.3 to 0.5 in a gap of 1.5 mm (voxels of 0.5 mm), and beyond it a marker of 1 mm may lie."""
FADE_MM, BODY_FROM, FADE_SIGMA_MM = 2.5, (4.0, 12.0), 0.75
"""Length of the end that is held against the line 4 to 12 mm before it, and what is not known of a tip that fades: of a
wire whose brightness falls to 0.3 over 3 mm the end seen is 1.1 to 1.8 mm short."""
FEWEST = (4, 2)
"""Samples of body and end that there must be, half a voxel apart."""
FADES, FADES_SIGMAS = 0.1, 3.0
"""Share of its brightness, and standard deviations, by which an end fades: of 50 right ones none was beyond 0.08 and
1.5; jets ahead of the tip had 0.12 to 0.15, and 3.4 to 4.6."""
BRIGHTER = 0.75
"""Which of the line's greys beyond a gap is held against it, by its rank."""
LEAST_BEYOND_MM, MOST_BEYOND_MM = 2.0, 15.0
"""Lengths beyond a gap between which a line is one wire without more: coils and marked tips are no longer, and what is
no longer than a marker band may be that of a catheter (a band of 1 mm is 1.5 mm of line)."""


def _marks_beyond(image: Subtraction, tube: Tube, line: Array) -> Array:
    """Places (n, 3) in the lumen beyond the tip that are as bright as the wire.

    A band of 1 mm that lies behind a stretch that nobody sees is too short to be found as a crest.
    """
    h, blur = image.voxel, MARK_BLUR * image.voxel
    levels = tube.steps.levels
    # a mark is held against the wire's body, which a coil of platinum outshines
    least = MARK_SHARE * tube.peak * min(1.0, float(levels[levels > LEAST_LEVEL].min(initial=1.0)))
    flat = image.region.inner
    flat = flat[image.grey.reshape(-1)[flat] > least]
    seen = smooth_voxels(image.grey, gaussian_taps(MARK_BLUR), flat)
    least *= tube.sigma**2 / (tube.sigma**2 + blur**2)
    flat, seen = flat[seen > least], seen[seen > least]
    bright = flat[seen > MARK_SIGMAS * image.noise_in(MARK_BLUR)] if len(flat) else flat
    if not len(bright):
        return np.zeros((0, 3))
    found = unflattened(bright, image.grey.shape) * image.spacing
    away, nearest = cKDTree(line).query(found)
    return np.asarray(found[(nearest == len(line) - 1) & (away > MARK_OFF * h)])


def with_marks(image: Subtraction, tube: Tube, curve: Curve) -> Curve:
    """The curve with the places beyond its tip that are as bright as the wire."""
    with image.showing(tube.voxels, tube.rest):
        marks = _marks_beyond(image, tube, dense(tube, 0.5 * image.voxel))
    return replace(curve, marks_mm=image.world(marks))


def nothing_beyond(curve: Curve) -> Curve:
    """The curve, or the same as ambiguous where it has marks beyond its tip."""
    if not len(curve.marks_mm):
        return curve
    away_mm = float(np.linalg.norm(curve.marks_mm - curve.points_mm[-1], axis=1).min())
    got = f"something as bright as the wire in the lumen {away_mm:.1f} mm beyond its tip"
    do = "look whether that is a marker at the wire's end, or another device; state insertion_mm"
    return curve.doubted(FrameStatus.TRACE_AMBIGUOUS, note_of(got, "a tip with nothing beyond it", do))


def dim_from_tip_mm(steps: Steps, length_mm: float, voxel: float) -> float:
    """Length (mm) of the end of a line that is far dimmer than the body before it; 0 where none is.

    A catheter of up to 1.2 times the wire's own brightness looks so where the wire in it has ended; where a wire comes
    out of such a catheter, the line gets dimmer by less. What is dimmer than LEAST_LEVEL is a gap; and where the line
    is body again for longer than a marker is, nothing has ended.
    """
    if steps.stated:
        return 0.0
    starts = np.concatenate([[0.0], steps.edges]) * length_mm
    body, first = 0.0, length_mm
    for start, size, level in zip(starts, np.diff(starts, append=length_mm), steps.levels, strict=True):
        if level < UNEVEN[0] * body:
            dim = level > LEAST_LEVEL and size > BAND_VOXELS * voxel
            first = min(first, float(start)) if dim else first
        elif size > BODY_MM:
            body, first = float(level), length_mm
    return length_mm - first


def of_one_device(image: Subtraction, tube: Tube, curve: Curve) -> Curve:
    """The curve, or the same as ambiguous where its last part may be a catheter's that reaches beyond the wire.

    Frames at other depths tell: a wire's own dim end stays as long, what a catheter shows beyond the wire does not.
    """
    from_tip = dim_from_tip_mm(tube.steps, tube.length_mm, image.voxel)
    if not from_tip or curve.refused:
        return curve
    got = f"a line whose last {from_tip:.1f} mm are far dimmer than what is before"
    do = "state the wire's opacity if its end is so, insertion_mm, or the catheter and its insertion_mm"
    note = note_of(got, "one brightness, or frames at other depths that show the same end", do)
    curve = replace(curve, levels={**curve.levels, DIM_FROM_TIP: from_tip})
    return curve.doubted(FrameStatus.TRACE_AMBIGUOUS, note, of=DIM_FROM_TIP)


def along_line(image: Subtraction, tube: Tube) -> tuple[Array, Array]:
    """Arc length (n,) in mm along a tube's line, half a voxel from one sample to the next, and its grey."""
    line = dense(tube, 0.5 * image.voxel)
    return arc_length(line), image.along(line)


def _fade(image: Subtraction, tube: Tube, arc: Array, grey: Array) -> tuple[float, float]:
    """By which share of its brightness a line is dimmer in its last FADE_MM than a wire that ends there at once, and in
    standard deviations of that mean; 0 where the line is too short, or has steps in its brightness anyway.
    """
    from_tip, blur = arc[-1] - arc, float(np.hypot(CREST_VOXELS * image.voxel, tube.sigma))
    body, end = (from_tip > BODY_FROM[0]) & (from_tip < BODY_FROM[1]), (from_tip > blur) & (from_tip < FADE_MM)
    if len(tube.steps.edges) or body.sum() < FEWEST[0] or end.sum() < FEWEST[1]:
        return 0.0, 0.0
    usual = max(float(np.median(grey[body])), 1e-9)
    share = float(np.mean(ndtr(from_tip[end] / blur) - grey[end] / usual))
    independent = max(1.0, (FADE_MM - blur) / (INDEPENDENT_VOXELS * image.voxel))
    return share, share / (image.noise_in(CREST_VOXELS) / usual / np.sqrt(independent))


def of_full_height(image: Subtraction, tube: Tube, curve: Curve, read: tuple[Array, Array]) -> Curve:
    """The curve, or the same as ambiguous where its end fades: a wire ground thin, or a jet of contrast medium ahead.

    Frames at other depths tell, as of a dim end. Where it fades the tip is that much less sure. read : of
    ``along_line``.
    """
    share, sigmas = _fade(image, tube, *read)
    if curve.refused or not (share > FADES and sigmas > FADES_SIGMAS):
        return curve
    got = f"a line that fades by {100 * share:.0f} % in its last {FADE_MM:g} mm"
    do = "look where the wire ends; state its opacity if its end is so, or insertion_mm"
    note = note_of(got, f"{100 * FADES:.0f} % at most, or frames at other depths that show the same end", do)
    tip_sigma_mm = float(np.hypot(curve.tip_sigma_mm, FADE_SIGMA_MM))
    curve = replace(curve, tip_sigma_mm=tip_sigma_mm, levels={**curve.levels, DIM_FROM_TIP: FADE_MM})
    return curve.doubted(FrameStatus.TRACE_AMBIGUOUS, note, of=DIM_FROM_TIP)


def first_gap_mm(grey: Array, arc: Array, noise: float) -> tuple[float, float]:
    """Where a line's first gap begins and ends, mm; infinite where it has none.

    grey, arc : (n,) along the line.  noise : standard deviation of the grey.  A gap is darker than most of the line
    before it and the brighter part of the line beyond it: half of a blurred marker is its two flanks.
    """
    dark = grey + 2.0 * noise < GAP_SHARE * grey.max()  # no median is above that: a quarter of tracing was medians
    for n in np.flatnonzero(dark & (arc > SIDE_MM) & (arc < arc[-1] - MARK_MM)):
        least = GAP_SHARE * min(np.median(grey[:n]), np.quantile(grey[n:], BRIGHTER))
        if grey[n] + 2.0 * noise < least:
            return float(arc[n]), float(arc[n + int(np.argmax(grey[n:] > least))])
    return np.inf, np.inf


def of_one_line(image: Subtraction, curve: Curve, read: tuple[Array, Array]) -> Curve:
    """The curve with how much of it lies beyond a gap, ambiguous where that is longer than a wire's tip, or a mark.

    A second device that faces the wire's tip looks like the wire beyond a gap, and so does the marker at the end of a
    catheter that reaches beyond the wire. Frames at other depths tell: a gap of the wire's own goes with the tip, one
    that a streak makes stays where it is. read : of ``along_line``.
    """
    arc, grey = read
    begins_mm, ends_mm = first_gap_mm(grey, arc, image.noise_in(CREST_VOXELS))
    beyond_mm = float(arc[-1]) - ends_mm
    if np.isinf(ends_mm) or curve.refused:
        return curve
    curve = replace(curve, levels={**curve.levels, BEYOND_GAP: beyond_mm, GAP: ends_mm - begins_mm})
    # in a modelled background a stenosis looks like a gap; so near to the tip there is hardly one
    if beyond_mm >= LEAST_BEYOND_MM and (beyond_mm < MOST_BEYOND_MM or image.modelled):
        return curve
    got = f"a line with {beyond_mm:.1f} mm of it beyond a gap"
    allowed = f"{LEAST_BEYOND_MM:g} to {MOST_BEYOND_MM:g} mm, or frames at other depths that show the same gap"
    do = "look whether a second device faces the wire's tip there, or a marker is a catheter's; state insertion_mm"
    return curve.doubted(FrameStatus.TRACE_AMBIGUOUS, note_of(got, allowed, do), of=BEYOND_GAP)
