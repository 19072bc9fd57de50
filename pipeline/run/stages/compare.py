"""compare: errors of every frame beside those of the trivial predictors."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pipeline.compare import compare, compare_truth
from pipeline.compare.metrics import rms
from pipeline.compare.nulls import Clues, PredictorInputs, score
from pipeline.model import Array, Curve
from pipeline.run.log import Log
from pipeline.run.stages.beside import MOST_NAMED
from pipeline.run.stages.contradicted import contradicted, from_traces
from pipeline.run.stages.entries import four_entries, replayed_entries
from pipeline.run.stages.known import Context, Frame, Known
from pipeline.run.stages.own_curves import rough
from pipeline.run.stages.variants import simulated_rivals, variant_wires, variants_of
from pipeline.run.stages.views import compare_in_views
from pipeline.simulate.clamp import ahead_of
from pipeline.status import FrameStatus
from reports.case_files import counted, listed
from reports.doubts import MADE_FROM_TRACES
from solver import Solution


def compare_frames(run: Context, known: Known) -> Known:
    """Errors of every frame with both curves, beside those of the trivial predictors."""
    if run.case.projections:
        with run.log.timed("compare"):
            return replace(known, frames=compare_in_views(run, known))
    clues = known.clues
    if clues is None:
        return replace(known, frames=_all_compared(run, known, None, {}, ())[0])
    with run.log.timed("compare"):
        entered, simulated = _simulated_otherwise(run, known, clues)
        clues.known_ways()
    frames, entries = _all_compared(run, known, clues, simulated, entered)
    known = replace(known, frames=frames, entries=entries)
    run.log.warnings += [
        *_too_near(known.frames, run.config.compare.sample_mm, handed=run.case.simulated is not None),
        *_truth_elsewhere(known.frames, float(max(known.vessel.distance.spacing_mm))),
        *_rough_truth(known),
    ]
    return known


def _simulated_otherwise(
    run: Context, known: Known, clues: Clues
) -> tuple[list[list[Solution]], Mapping[int, Mapping[str, Array]]]:
    """The wires from four entries (``entries``), and by frame those of the simulated predictors (``variants``).

    While helpers simulate, this process finds what the clues of all frames share.
    """
    ways = variants_of(run, known)
    # another simulator's wires say nothing about what this one is told, nor do traces that lie off the scans
    told = run.case.simulated is None and not known.off_the_scans

    def one(number: int, _earlier: object) -> Any:
        if not number:
            return replayed_entries(run, known)
        wires = variant_wires(run, known, ways[number - 1])
        return wires, from_traces(known, wires, run.config.compare) if told else []

    entered, *others = run.share("compare", one, 1 + len(ways), clues.known_ways)
    if told:
        run.log.warnings += contradicted(run, known, ways, [off for _, off in others])
    return entered, simulated_rivals(run, known, ways, [wires for wires, _ in others])


Row = dict[str, Any]


def _all_compared(
    run: Context,
    known: Known,
    clues: Clues | None,
    simulated: Mapping[int, Mapping[str, Array]],
    entered: Sequence[Sequence[Solution]],
) -> tuple[tuple[Frame, ...], tuple[Row, ...]]:
    """The frames with their errors, and the rows of the four entries, which take as long as a dozen frames.

    simulated : by frame, the wires of the simulated predictors.     entered : the wires from four entries, if any.
    """
    before = [*_trusted_before(known.frames)]
    after = [*_trusted_before(known.frames[::-1])][::-1]

    def one(number: int, _earlier: object) -> tuple[Frame, Log]:
        part, frame = run.part(), known.frames[number]
        with part.log.timed("compare", frame.index):
            tip = frame.curve.points_mm[-1] if frame.curve is not None and frame.traced else None
            seen = PredictorInputs(before[number], after[number], tip, simulated.get(frame.index, {}))
            done = _compared(part, known, frame, clues, seen)
            if frame.truth_mm is not None:
                truth = compare_truth(frame.truth_mm, frame.curve, frame.simulated, run.config.compare)
                done = replace(done, truth=truth)
        return done, part.log

    def entries(part: Context) -> tuple[tuple[Row, ...], Log]:
        with part.log.timed("compare"):
            rows = four_entries(part, known, entered, clues.way) if clues and entered else ()
        return rows, part.log

    def both(number: int, earlier: object) -> Any:
        """The entries first: a part so long would keep one core busy at the end."""
        return one(number - 1, earlier) if number else entries(run.part())

    found = run.share("compare", both, 1 + len(known.frames), inherited=(known.lumen, clues and clues.way))
    for _, log in found:
        run.log.add(log)
    (rows, _), *parts = found
    return tuple(frame for frame, _ in parts), rows


NEAREST = 0.2
"""Share of a trace's standard deviation below which no wire lies near it that does not know it: the nearest of the
solver's own, in 82 frames of the catalogue and a bend, lies 0.59 of it off."""


LEAST_MM, APART_MM = 10.0, 1.0
"""Length of such frames from which that is no chance: with 2 mm in each of three frames it is one in 1.5 % of the cases
of a perfect simulator. Points that are farther apart than a trace's errors reach count as many as they are."""
NEAREST_MM, OWN_NEAREST_MM = 0.01, 0.001
"""The same where the curves are the user's own, whose standard deviation nobody measured: no scan shows a wire so well.
Those of another program of the same physics may be as near to the solver's own wires (a rod without segments 0.003 to
0.04)."""
TRUTH_VOXELS, TRUTH_TIP_VOXELS, TRUTH_TIPS_VOXELS = 0.3, 3.0, 1.5
"""Distance of traced wires from the true ones, median of the frames' means, of the tips in any frame, and in half of
them, voxels, from which they are not the same wires: traces lie within 0.1 voxel of the true wire, tips within one."""
TIP_SIGMAS = 5.0
"""The same for tips in their own standard deviations."""


def _truth_elsewhere(frames: Sequence[Frame], voxel_mm: float) -> list[str]:
    """A warning where the true wires of a synthetic study lie elsewhere than the traced ones."""
    known = [f for f in frames if f.trusted_curve is not None and "trace_mean_mm" in f.truth]
    off = float(np.median([f.truth["trace_mean_mm"] for f in known] or 0.0))
    tips = _tips_elsewhere(known, TRUTH_TIP_VOXELS * voxel_mm)
    if not tips and 2 * len(often := _tips_elsewhere(known, TRUTH_TIPS_VOXELS * voxel_mm)) >= len(known):
        tips = often
    said = []
    if off > TRUTH_VOXELS * voxel_mm:
        said.append(f"the true wires lie {off:.2g} mm from the traced ones (median of the frames)")
    elif tips:
        each = listed([f"frame {index}: {mm:.1f} mm" for index, mm in tips.items()], MOST_NAMED)
        said.append(f"true wires end elsewhere than the traced ones ({each})")
    return [
        f"{text}: is truth in mm, in LPS, and of these frames? the columns of the truth say nothing before that"
        for text in said
    ]


def _tips_elsewhere(frames: Sequence[Frame], least_mm: float) -> dict[int, float]:
    """By frame, how far the traced tip lies from the true one, mm, where that is more than it is known to."""
    off = {f.index: (f.truth["trace_tip_mm"], f.curve.tip_sigma_mm) for f in frames if f.curve is not None}
    return {index: mm for index, (mm, sigma) in off.items() if mm > max(least_mm, TIP_SIGMAS * sigma)}


def _rough_truth(known: Known) -> list[str]:
    """A warning of true wires whose points are so far apart that they cut corners."""
    wires = {f.index: f.truth_mm for f in known.frames if f.truth_mm is not None}
    return rough(wires, known.vessel.distance.voxel_mm, "the true wires")


def _too_near(frames: Sequence[Frame], sample_mm: float, *, handed: bool) -> list[str]:
    """A warning where wires lie nearer to the traces than these can be known, be it in some of the frames alone.

    sample_mm : how far apart errors are taken.
    handed : the wires are another simulator's. Of the solver's own, traces that were made from them are looked for.
    """
    seen = [(f.index, f.comparison.error_mm, f.curve) for f in frames if f.ok and f.comparison and f.curve]
    each = {n: (rms(error), float(np.median(curve.sigma_mm))) for n, error, curve in seen}
    least = {n: _nearest_mm(each[n][1], own=bool(curve.source), handed=handed) for n, _, curve in seen}
    near = {n: (mm, sigma) for n, (mm, sigma) in each.items() if mm < least[n]}
    if min(sample_mm, APART_MM) * sum(len(error) for n, error, _ in seen if n in near) < LEAST_MM:
        return []
    off, sigma = np.max(list(near.values()), axis=0)
    some = f"in {counted(len(near), 'frame')} ({listed([*map(str, near)], MOST_NAMED)}) " * (len(near) < len(each))
    known_to = f"which are known to {sigma:.2g} mm: " if sigma > 0.0 else ""
    return [
        f"{some}the simulated wires lie within {off:.2g} mm (rms) of the traced ones, {known_to}{MADE_FROM_TRACES}, "
        "or traces from the wires, are so near; their errors say nothing about a simulator"
    ]


def _nearest_mm(sigma_mm: float, *, own: bool, handed: bool) -> float:
    """How near a wire may lie to a trace of this standard deviation at the least. own : the trace is the user's own."""
    if own:
        return NEAREST_MM if handed else OWN_NEAREST_MM
    return NEAREST * sigma_mm if handed else 0.0


def _trusted_before(frames: tuple[Frame, ...]) -> Iterator[Array | None]:
    """For each frame the last trusted trace of the frames before it."""
    last: Curve | None = None
    for frame in frames:
        yield None if last is None else last.points_mm
        last = frame.trusted_curve or last


def _compared(run: Context, known: Known, frame: Frame, clues: Clues | None, seen: PredictorInputs) -> Frame:
    if frame.ok and not run.case.compared:
        only = FrameStatus.SIMULATED
        return replace(frame, status=only.identifier, sentence=only.value)
    wire = frame.simulated_wire
    if frame.curve is None or not frame.traced or wire is None:
        return frame
    settings, curve = run.config.compare, frame.curve
    ahead = 0.0 if known.clamp is None else ahead_of(known.clamp, curve)
    errors = compare(wire, curve, known.vessel, settings, None if clues is None else clues.way, ahead)
    if clues is None:
        return replace(frame, comparison=errors)
    nulls = score(clues, frame.depth_mm, seen, curve.points_mm, settings)
    return replace(frame, comparison=errors, nulls_rms_mm=nulls)
