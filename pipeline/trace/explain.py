"""From a subtraction to the wire's curve: fit the wire in one way or several, judge each, take the best.

This is one tracing back end; another one is a function with the arguments and the result of :func:`explained`.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Array, Curve, arc_length
from pipeline.status import FrameStatus
from pipeline.trace.attempt import (
    ENTRY_REACH_MM,
    MOST_SHARP_DEG,
    Attempt,
    EntryPose,
    again,
    beside,
    cold,
    dense,
    misfit,
    prolonged,
    sharpest_deg,
    warm,
)
from pipeline.trace.bends import bent, hook_error
from pipeline.trace.config import TraceConfig
from pipeline.trace.crests import SEED_SIGMAS, STRICT_BEND
from pipeline.trace.doubts import doubted, no_wire, not_washed_out
from pipeline.trace.fall import fall_mm
from pipeline.trace.noise import inflation
from pipeline.trace.subtraction import Subtraction, levelled
from pipeline.trace.tube import DIM_END, Tube, point_sigmas
from pipeline.trace.verdict import SURE_CNR, Verdict, judge, note_of, shares_of

SAMPLE_VOXELS = 1.0
"""Spacing of the curve's points."""
FINE_VOXELS = 0.55
"""Blur in which crests are looked for where strands may cross: they stay apart longest."""
WIDE_VOXELS = 1.2
"""Blur in which crests are looked for when the finest one gave doubts: right between contrasts of 2.5 and 5."""
WIDE_SIGMAS = 4.0
"""Height, in standard deviations of noise, at which they start there: noise gives some, too short to matter."""
MOST_PIECES = 4
"""Times that wire is looked for beyond the tip."""
BEND_SHARE = 0.0125
"""Error per axis over the fourth differences of the control points nearby (0.010 to 0.016 on tuning seeds): straight
wires have 1 voxel of them, hooks of 3 to 7 voxels 10 to 20 at their tips, which are 0.1 to 0.2 voxel off."""
WALL_ERROR, WALL_REACH = 0.13, 5.0
"""Error (voxel) of a wire beside a wall that no reference shows, and the distance (voxel) at which it is gone."""
BULGE_ERROR, BULGE_REACH = 0.35, 2.7
"""The same of a wire on the wall of a lumen that was segmented with the wire in it: the wall bulges out by 1.2 voxels
beside a bright wire, and what is taken for background there pulls the line inwards, by 0.27 to 0.44 voxel."""
PLAIN_TIP, BRIGHT_TIP, DIM_TIP = 0.08, 0.16, 0.25
"""Error (voxel) of the tip that is not due to noise: of a plain wire, of one with a bright coil or band, of one with
a dim end. With 0.08 a platinum tip was 2.5 times its sigma off, with 0.25 a fifth of it."""
BLUNT_TIP = 0.2
"""The same of a thick wire, whose end is flatter than its blur, as a share of half its radius (without it, the sigma of
0.9 mm wires was 2 times too small)."""
TIPS_MM = 1.5
"""Most that two fits of one wire, before and after its background is told from it, may end apart."""
AGREES_MM, AGREES_VOXELS = 1.0, 3.0
"""How near a stated depth a length confirms it: twice the standard deviation that a depth has by default, but no more
than a few voxels: 10 of 0.1 mm would be a faint end that was cut off."""
BRIDGE_SIGMA_VOXELS = 0.5
"""Standard deviation across the wire that a point on a bridged gap gets at least."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """An attempt, the curve read off it (local points, their sigma, the tip's) and the verdict."""

    attempt: Attempt
    points: Array
    sigma: Array
    tip_sigma: float
    length_mm: float
    verdict: Verdict


def _entry_parameter(tube: Tube, entry: EntryPose) -> float:
    """Parameter at which the curve crosses the entry plane nearest the entry; 0 when it starts beyond it."""
    u = np.linspace(0, tube.intervals, 40 * tube.intervals + 1)
    offset = tube.at(u) - entry.point
    along, near = offset @ entry.direction, np.linalg.norm(offset, axis=1)
    crossing = np.flatnonzero((along[:-1] < 0) & (along[1:] >= 0) & (near[:-1] < ENTRY_REACH_MM))
    if len(crossing) == 0:
        return 0.0
    n = int(crossing[np.argmin(near[crossing])])
    share = along[n] / (along[n] - along[n + 1])
    return float(u[n] + share * (u[n + 1] - u[n]))


def _even_parameters(tube: Tube, start: float, step: float) -> Array:
    """Parameters from ``start`` to the end at about equal steps of arc."""
    u = np.linspace(start, tube.intervals, 20 * tube.intervals + 2)
    arc = arc_length(tube.at(u))
    return np.interp(np.linspace(0, arc[-1], max(3, round(arc[-1] / step) + 1)), arc, u)


def _on_bridges(points: Array, attempt: Attempt, reach: float) -> NDArray[np.bool_]:
    """Points of the curve that lie on a bridge."""
    gaps = attempt.path.points[attempt.path.bridged]
    if len(gaps) == 0:
        return np.zeros(len(points), bool)
    return np.asarray(np.min(np.sum((points[:, None] - gaps[None]) ** 2, axis=2), axis=1) < reach**2)


def _read_off(image: Subtraction, attempt: Attempt | None, entry: EntryPose) -> list[Candidate]:
    """The curve of an attempt with its verdict; nothing for no attempt."""
    if attempt is None:
        return []
    u = _even_parameters(attempt.tube, _entry_parameter(attempt.tube, entry), SAMPLE_VOXELS * image.voxel)
    points = attempt.tube.at(u)
    length = float(arc_length(image.world(points))[-1])
    late = float((points[0] - entry.point) @ entry.direction)
    stated = entry.expected_mm
    missing = np.nan if stated is None else stated - length
    agrees = abs(missing) < min(AGREES_MM, AGREES_VOXELS * image.voxel)
    short = hardly_begun(length, stated)
    attempt = replace(attempt, missing_mm=missing, short=short, agrees=agrees, late_mm=late)
    verdict = judge(image, attempt, points, _on_bridges(points, attempt, image.voxel), length)
    return [Candidate(attempt, points, *point_sigmas(attempt.tube, u), length, verdict)]


HARDLY_BEGUN = 0.25
"""Share of the stated depth below which a trace may have been followed the wrong way."""


def hardly_begun(length_mm: float, expected_mm: float | None) -> bool:
    """Whether a length is next to nothing of the expected depth, farther off it than an entry is looked for."""
    return expected_mm is not None and length_mm < min(HARDLY_BEGUN * expected_mm, expected_mm - ENTRY_REACH_MM)


def missed_mm(length_mm: float, expected_mm: float | None, config: TraceConfig) -> float:
    """By how much (mm) a length misses the expected depth beyond the tolerance; 0 where none is expected."""
    if expected_mm is None:
        return 0.0
    return max(0.0, abs(length_mm - expected_mm) - config.length_tolerance_mm)


def _doubtful(image: Subtraction, found: list[Candidate], entry: EntryPose, config: TraceConfig) -> bool:
    """Whether another explanation should be tried."""
    if not found:
        return True
    best, attempt = found[0], found[0].attempt
    weak = attempt.cnr(image) < SURE_CNR or best.verdict.status is not FrameStatus.OK
    unclear = best.verdict.faint_mm + best.verdict.double_mm
    doubts = unclear > 1.5 or attempt.leftover_mm > 1.5 or attempt.path.bridges > 0
    return weak or doubts or missed_mm(best.length_mm, entry.expected_mm, config) > 0


def _best(image: Subtraction, found: list[Candidate], entry: EntryPose, config: TraceConfig) -> Candidate:
    """The candidate that leaves least unexplained: misfit, with a length far from the expected one held against it.

    A millimetre missing or too much costs half of what a millimetre of wire explains, a flagged one a tenth. A fit that
    has folded explains more than it should: it counts where there is no other.
    """
    found = [c for c in found if sharpest_deg(image, c.attempt.tube) < MOST_SHARP_DEG] or found
    if len(found) == 1:
        return found[0]
    costs = np.array(misfit(image, [c.attempt for c in found]))
    h = image.voxel
    for n, c in enumerate(found):
        worth = c.attempt.cnr(image) ** 2 * np.pi * (c.attempt.tube.sigma / h) ** 2 / h
        doubtful = float(c.verdict.flagged.sum()) * h
        costs[n] += worth * (0.5 * missed_mm(c.length_mm, entry.expected_mm, config) + 0.1 * doubtful)
    return found[int(np.argmin(costs))]


def best_of(image: Subtraction, entry: EntryPose, previous: Curve | None, config: TraceConfig) -> Candidate | None:
    """The curve of one frame: from the frame alone; where that leaves doubts also wider and from the frame before."""
    gap = config.longest_gap_mm
    found = _read_off(image, cold(image, entry, config.ridge_voxels, SEED_SIGMAS, gap), entry)
    if _doubtful(image, found, entry, config):
        if not found or found[0].attempt.cnr(image) > SURE_CNR:
            found += _read_off(image, cold(image, entry, FINE_VOXELS, SEED_SIGMAS, gap, STRICT_BEND), entry)
        wide = cold(image, entry, WIDE_VOXELS, WIDE_SIGMAS, gap)
        if wide is not None and found and found[0].attempt.cnr(image) > SURE_CNR:
            wide = beside(image, wide, found[0].attempt.pieces)  # in the wide blur two wires may share a crest
        found += _read_off(image, wide, entry)
        if previous is not None and len(previous.points_mm):
            found += _read_off(image, warm(image, entry, previous, config.ridge_voxels, gap), entry)
    return _prolonged(image, _best(image, found, entry, config), entry) if found else None


def _prolonged(image: Subtraction, best: Candidate, entry: EntryPose) -> Candidate:
    """The candidate with all that goes on beyond its tip."""
    for _ in range(MOST_PIECES):
        more = _read_off(image, prolonged(image, best.attempt, entry), entry)
        if not more:
            break
        best = more[0]
        if best.attempt.goes_on:
            break
    return best


def _model_error(image: Subtraction, best: Candidate) -> Array:
    """Errors (n,), mm, that the model adds to those by noise: bends shorter than its knots, hooks, a modelled wall."""
    tube = best.attempt.tube
    rough = np.mean(np.diff(tube.controls, n=4, axis=0) ** 2, axis=1) if len(tube.controls) > 4 else np.zeros(1)
    knots = shares_of(tube, best.points) * tube.intervals
    bends = BEND_SHARE * np.sqrt(np.interp(knots, 1.0 + np.arange(len(rough)), rough))
    bends = np.hypot(bends, hook_error(image, best.attempt, best.points))
    if not image.without_reference:
        return np.asarray(bends)
    depth = -image.depth_at(best.points) / image.voxel
    wall = WALL_ERROR * np.clip((WALL_REACH - depth) / 3.0, 0.0, 1.0)
    bulge = BULGE_ERROR * np.clip((BULGE_REACH - depth) / 1.2, 0.0, 1.0)
    return np.asarray(np.hypot(bends, image.voxel * np.hypot(wall, bulge)))


def _own_tip(image: Subtraction, tube: Tube) -> float:
    """The part of the tip's error that is not due to noise, mm."""
    own = DIM_TIP if tube.steps.levels[-1] < DIM_END else BRIGHT_TIP if len(tube.steps.edges) else PLAIN_TIP
    half_radius = float(np.sqrt(max(0.0, tube.sigma**2 - image.wall_blur_mm**2)))
    return max(own * image.voxel, BLUNT_TIP * half_radius, fall_mm(image, tube))


def _curve(image: Subtraction, best: Candidate) -> Curve:
    """The curve in LPS mm with its uncertainty: the fit's, scaled by the noise met, wider where it was bridged."""
    attempt, verdict, tube = best.attempt, best.verdict, best.attempt.tube
    across, along = inflation(image, best.points, tube)
    bias = _model_error(image, best)
    sigma = np.hypot(across * best.sigma, bias)
    tip_sigma = float(np.hypot(along[-1] * best.tip_sigma, _own_tip(image, tube)))
    sigma = np.where(verdict.flagged, np.maximum(sigma, BRIDGE_SIGMA_VOXELS * image.voxel), sigma)
    counters = image.counters | {
        "pieces": float(len(attempt.pieces)), "bridges": float(attempt.path.bridges),
        "leftover_mm": attempt.leftover_mm,
        "iterations": float(tube.iterations), "from_previous": float(attempt.from_previous),
        "faint_mm": verdict.faint_mm, "double_mm": verdict.double_mm,
    }  # fmt: skip
    levels = image.levels | {
        "residual_rms": tube.residual_rms, "blur_mm": tube.sigma, "knot_mm": tube.knot_mm, "cnr": attempt.cnr(image),
        "inflation": float(np.median(across)), "inflation_tip": float(along[-1]),
    }  # fmt: skip
    inside, outside = image.wall_greys
    curve = Curve(
        image.world(best.points), sigma, tip_sigma, verdict.flagged,
        counters=counters, levels=levels, elsewhere_mm=image.world(attempt.elsewhere),
        brightness=tube.brightness(shares_of(tube, best.points)), contrast=inside - outside,
    )  # fmt: skip
    return curve if verdict.status is FrameStatus.OK else curve.doubted(verdict.status, verdict.note)


def _agreed(first: Candidate, second: Candidate, *, modelled: bool) -> Candidate:
    """The second fit of a wire; ambiguous where it ends elsewhere than the first: in noise it was once cut by 7.5 mm.

    modelled : whether the background is modelled, as there is no reference scan that fits the frame.
    """
    apart = abs(first.length_mm - second.length_mm)
    if apart < TIPS_MM or second.verdict.status is not FrameStatus.OK:
        return second
    note = note_of(
        f"tips {apart:.1f} mm apart in two fits",
        f"{TIPS_MM} mm at most",
        "look where the wire ends" + ", or give a reference scan without wire that fits the frame" * modelled,
    )
    return replace(second, verdict=replace(second.verdict, status=FrameStatus.TRACE_AMBIGUOUS, note=note))


def explained(image: Subtraction, entry: EntryPose, previous: Curve | None, config: TraceConfig) -> Curve:
    """The wire of one frame from the plane of entry to the tip, LPS mm; what went wrong is its status and note.

    previous : consulted only where the frame alone leaves doubts.
    """
    seen = levelled(image, np.zeros((0, 3)), image.voxel) if image.uneven else image
    best = best_of(seen, entry, previous, config)
    if best is None:
        return no_wire(image)
    attempt, as_seen = best.attempt, image
    if image.modelled:
        # the lumen's own grey under the wire is taken from beside it, and the fit done again
        image = levelled(image, dense(attempt.tube, image.voxel), attempt.tube.sigma)
        attempt = again(image, attempt, entry)
    attempt = bent(image, attempt, entry)
    if attempt is not best.attempt:
        best = _agreed(best, _read_off(image, attempt, entry)[0], modelled=image.modelled)
    return doubted(image, best.attempt, not_washed_out(as_seen, best.attempt.tube, _curve(image, best)))
