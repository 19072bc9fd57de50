"""The last objections to a frame or a curve: no wire, too much noise for it, or more wire than was found."""

from dataclasses import replace

import numpy as np

from pipeline.arrays.grids import spread
from pipeline.arrays.jets import gaussian_taps, smooth_voxels
from pipeline.arrays.polyline import tip_tangent
from pipeline.model import Array, Curve
from pipeline.status import FrameStatus
from pipeline.trace.ahead import WASHED, washed_out
from pipeline.trace.attempt import ENTRY_REACH_MM, Attempt, dense
from pipeline.trace.ends import named
from pipeline.trace.onward import FAINTEST, GOES_ON, TANGENT_MM
from pipeline.trace.subtraction import CREST_VOXELS, Subtraction
from pipeline.trace.tube import Tube
from pipeline.trace.verdict import LEAST_SEEN, note_of
from pipeline.trace.ways import MAYBE, QUICK, SURE, highest, ways_on
from pipeline.trace.whose_end import along_line, nothing_beyond, of_full_height, of_one_device, of_one_line, with_marks

FAINT_BEYOND = "faint_beyond"
"""Level of a curve beyond whose tip something as faint as a streak goes on: its share of the wire's brightness."""
STREAK, STREAK_SURE, HASTE = 0.015, 10.0, 2.0
"""Least share of the wire's brightness, and least standard deviations, of such. Beyond 118 right ends of the cases of
``tests.studies.seeing`` what had that share had 6.0 at most; an end of 3 % of the brightness of a wire 130 times as
bright as the noise has 15. In haste it has less by up to the last."""
OWN_NOISE = 0.25
"""Share of what counts as noise that changes from voxel to voxel, below which the rest is no noise: white noise has 1,
noise correlated over 1.5 voxels 0.32. Frames of another phantom or contrast than their reference had 0.19."""
BLURRED = 2.0 / 3.0
"""Share of the wire's peak that the blur in which grey is read leaves where FAINTEST holds: it leaves 0.65 of a wire as
blurred as 0.95 voxel, and 0.42 of one of 0.6 voxel, which is looked for that much lower."""


def _traces_of_wire(image: Subtraction) -> bool:
    """Whether the lumen has more bright voxels than noise makes: over 15 and over 3 times as many above 3.5 sigmas as
    there are below -3.5.
    """
    sample = smooth_voxels(image.grey, gaussian_taps(1.0), image.region.within)
    limit = 3.5 * spread(sample)
    up, down = (int(np.sum(s * (sample - np.median(sample)) > limit)) for s in (1, -1))
    return up > 3 * max(down, 5)


def _of_the_scan(image: Subtraction) -> float:
    """Standard deviation of the grey from one voxel to the next within the lumen: noise without what changes slowly."""
    flat = image.region.sample_flat  # whole runs: of ``within``, in a large lumen, no two voxels are neighbours
    flat = flat[image.region.allowed.reshape(-1)[flat] > 0]
    steps = np.diff(image.grey.reshape(-1)[flat].astype(float))[np.diff(flat) == 1]
    return spread(steps) / float(np.sqrt(2.0)) if len(steps) else float("inf")


def no_wire(image: Subtraction) -> Curve:
    """The empty curve, with status and note, of a frame in which no line passes the entry."""
    status, allowed = FrameStatus.NO_WIRE, f"a bright line in the lumen within {ENTRY_REACH_MM} mm of entry_mm"
    do = "check entry_mm, entry_direction and that the frame shows a wire"
    if _traces_of_wire(image):
        status, allowed = FrameStatus.TRACE_LOW_CONTRAST, "a contrast of 2.5 noises"
        do = f"{do}; scan with more dose; an ok frame of a smaller depth before it helps, too"
    got = f"nothing that stands out of {image.noise:.0f} grey of noise and passes the entry"
    if (own := _of_the_scan(image)) < OWN_NOISE * image.noise:
        got += (
            f" ({own:.0f} of them from voxel to voxel: the rest is no noise, but what the background does not explain)"
        )
        if not image.without_reference:
            do = f"check that the reference is of this phantom, in this place and of this contrast; {do}"
    empty = Curve(np.zeros((0, 3)), np.zeros(0), counters=image.counters, levels=image.levels)
    return empty.doubted(status, note_of(got, allowed, do))


def faint_for_its_noise(curve: Curve) -> Curve:
    """The curve, or the same as too low in contrast where correlated noise hides the wire more than white noise."""
    seen = curve.levels["cnr"] / max(1.0, curve.levels["inflation"])
    if seen > LEAST_SEEN or curve.refused or curve.counters["from_previous"]:
        return curve
    got = f"a line {seen:.1f} noises bright, noise counted as it is correlated"
    do = "check that the frame shows a wire; scan with more dose or a smoother reconstruction kernel"
    return curve.doubted(FrameStatus.TRACE_LOW_CONTRAST, note_of(got, f"{LEAST_SEEN} at least", do))


def ends_in_nothing(image: Subtraction, attempt: Attempt, curve: Curve) -> Curve:
    """The curve, or the same as ambiguous where something beyond its tip is too bright, over its length, for noise.

    Not where the tip's depth is the stated one: a wall that is off by a few hundredths of its contrast, as beside the
    stairs of a label map, is a line of 10 standard deviations, too.  With FAINT_BEYOND among its levels where that is
    sure, but no brighter than streaks of the wire are.
    """
    if curve.refused:
        return curve
    tube = attempt.tube
    left = tube.sigma**2 / (tube.sigma**2 + (CREST_VOXELS * image.voxel) ** 2)
    least, faint = FAINTEST * tube.peak * min(1.0, left / BLURRED), STREAK * tube.peak * left
    ways = _beyond(image, tube, least, faint)
    if not image.correlated and not attempt.agrees and highest(ways, least) > SURE:
        tip = named(image, dense(tube, image.voxel)[-1])
        got, allowed = f"a faint line {GOES_ON}, from {tip} mm on", "a tip with nothing beyond it"
        if attempt.missing_mm > 0.0:
            got += f", where {attempt.missing_mm:.1f} mm of the stated depth are missing"
        do = "look whether the wire's end is fainter than the rest; scan with more dose"
        return curve.doubted(FrameStatus.TRACE_AMBIGUOUS, note_of(got, allowed, do))
    if highest(ways, faint) > STREAK_SURE:
        share = float(ways[np.argmax(ways[:, 1]), 0]) / (tube.peak * left)
        return replace(curve, levels={**curve.levels, FAINT_BEYOND: share})
    return curve


def _beyond(image: Subtraction, tube: Tube, least: float, faint: float) -> Array:
    """The brightest ways on (n, 2) from a wire's tip: looked for in haste where haste finds nothing of these greys."""
    line = dense(tube, 0.5 * image.voxel)
    here = line[-1], tip_tangent(line, TANGENT_MM)
    with image.showing(tube.voxels, tube.rest):
        ways = ways_on(image, *here, QUICK)
        seen = highest(ways, least) > MAYBE or highest(ways, faint) > STREAK_SURE - HASTE
        return ways_on(image, *here) if seen else ways


def not_washed_out(image: Subtraction, tube: Tube, curve: Curve) -> Curve:
    """The curve, or the same as ambiguous where the contrast medium about its end is so thin that a wire is not seen.

    image : before its background is levelled.
    """
    if curve.refused:
        return curve
    darker = washed_out(image, dense(tube, 0.5 * image.voxel), tube.sigma)
    if darker == 0.0:
        return curve
    got = f"contrast medium about the curve's end that is darker than the reference's by {darker:.2f} of the wire"
    do = "look whether the wire goes on in thin contrast medium; fill the vessel evenly and scan again"
    return curve.doubted(FrameStatus.TRACE_AMBIGUOUS, note_of(got, f"{WASHED:g} at most", do))


def doubted(image: Subtraction, attempt: Attempt, curve: Curve) -> Curve:
    """The curve of an attempt with its doubts: no more once it is refused, all that other frames may settle."""
    curve = with_marks(image, attempt.tube, curve)  # for the other frames, whatever becomes of this one
    curve = ends_in_nothing(image, attempt, faint_for_its_noise(curve))
    if curve.refused or attempt.depth_stated:  # a stated depth says where the wire ends
        return curve
    read = along_line(image, attempt.tube)
    curve = of_one_device(image, attempt.tube, nothing_beyond(curve))
    return of_one_line(image, of_full_height(image, attempt.tube, curve, read), read)
