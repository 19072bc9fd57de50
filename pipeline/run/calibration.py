"""``wireval calibrate``: trace the cases of role calibration and fit the parameters (files: ``calibration_files``)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri, stdtrit

from pipeline.calibrate.design import Predicted, predicted, straight_to
from pipeline.calibrate.estimates import Calibration, calibrated
from pipeline.calibrate.residuals import Evidence
from pipeline.calibrate.trials import Trial, depths_at
from pipeline.calibrate.unknowns import Unknown, unknowns
from pipeline.model import Array
from pipeline.run.cache import Store
from pipeline.run.inputs import Inputs
from pipeline.run.log import Log
from pipeline.run.outputs import failure_rows
from pipeline.run.stages import Context, run_stages
from pipeline.run.stages.given import trial_of
from pipeline.run.stages.known import Frame, Known, trusted
from pipeline.run.stages.load import each_frame
from pipeline.run.stages.repeated import copies, kept, scanned_twice
from pipeline.status import InputError
from pipeline.study.manifest import Case
from pipeline.study.parameters import same_wall
from pipeline.study.settings import Config
from reports.alike import alike, line_of
from reports.case_files import counted

SAME_MM = 0.5
"""Standard deviation between insertions, mm, of the offset of stated depths, where one insertion alone states any."""
LEAST_FRAMES = 3
PLANNED = "it has neither frames nor traces to fit to; what such a study would show is predicted with --design"
OWN_CLAMP = (
    '{}: entry = "{}" is for runs: its clamp is fitted with the parameters, from its own entry_mm and entry_direction'
)
Say = Callable[[str], None]


class CalibrationError(InputError):
    """There is nothing to calibrate with."""

    place = "the calibration"


@dataclass(frozen=True, eq=False)
class Gathered:
    """Calibration cases as they are fitted.

    stated_mm : the depth that the manifest states for each fitted frame, NaN where none.     voxels, traced_mm : by
    which each case's scans are known again, and points (n, 3) on their traces, by which those are known that were
    written again.     left_out : cases that cannot be used, and why.     warnings : of frames that count twice.
    notes : assumptions and warnings of all cases.
    """

    cases: tuple[Case, ...]
    trials: tuple[Trial, ...]
    stated_mm: tuple[Array, ...]
    voxels: tuple[tuple[str, ...], ...]
    traced_mm: tuple[tuple[Array, ...], ...]
    left_out: tuple[str, ...]
    warnings: tuple[str, ...]
    notes: tuple[str, ...]


def chosen(cases: Sequence[Case]) -> tuple[Case, ...]:
    """The cases to calibrate with; CalibrationError where there is none, or where they cannot be fitted together."""
    found = tuple(case for case in cases if case.role == "calibration")
    if not found:
        raise CalibrationError(['no case has role = "calibration"; mark the insertions to calibrate with so'])
    names = sorted({case.wire.name for case in found})
    if len(names) > 1:
        what = f"the calibration cases have {len(names)} wires ({', '.join(names)})"
        raise CalibrationError([f"{what}; calibrate one wire at a time: a manifest for each"])
    frictions = {f"{case.wall.friction:g}": case.id for case in found}
    if len(frictions) > 1:
        stated = ", ".join(f"{friction} of {case!r}" for friction, case in frictions.items())
        what = f"the calibration cases state {len(frictions)} coefficients of friction ({stated}), and one is fitted"
        raise CalibrationError([f"{what}; state one, or calibrate a manifest for each"])
    walls = sorted({case.wall.stiffness_N_mm2 for case in found})
    near = [(soft, hard) for soft, hard in pairwise(walls) if same_wall(soft, hard)]
    if near:
        what = "the calibration cases state walls of {!r} and {!r} N/mm2, which nothing tells apart".format(*near[0])
        raise CalibrationError([f"{what}; state one stiffness_N_mm2 for both"])
    given = [case.id for case in found if case.parameters is not None]
    if given:
        what = f"case {given[0]!r} has parameters already, which a calibration would be made on top of"
        raise CalibrationError([f"{what}; take the key parameters off cases of role calibration"])
    return found


def gathered(cases: Sequence[Case], config: Config, store: Store, say: Say) -> Gathered:
    """Segment and trace the cases; those with fewer than LEAST_FRAMES trusted traces are left out with a note.

    A frame that is one of an earlier case counts once. CalibrationError where no case is left.
    """
    taken, warnings, notes = list[_Taken](), list[str](), list[str]()
    left_out = [f"{case.id}: left out: {PLANNED}" for case in cases if not case.compared]
    for case in (case for case in cases if case.compared):
        run, known = _traced(case, config, store)
        again = _counted_before(known.frames, taken)
        frames = [frame for frame in known.frames if frame.trusted_curve is not None and frame.index not in again]
        notes += [f"{case.id}: {text}" for text in (*run.log.assumptions, *run.log.warnings)]
        copied = f"{counted(len(again), 'frame')} counted already: {_first(again)}" if again else ""
        if known.failure is not None or len(frames) < LEAST_FRAMES:
            why = known.failure or copied or f"{len(frames)} of {len(known.frames)} frames have a trace to be trusted"
            left_out.append(f"{case.id}: left out: {why}; at least {LEAST_FRAMES} are needed")
            continue
        warnings += [f"{case.id}: {copied}; taken once"] * bool(copied)
        warnings += [OWN_CLAMP.format(case.id, case.entry)] * bool(case.entry)
        warnings += [f"{case.id}: {text}" for one in taken for text in _scanned_twice(case, frames, one)]
        say(f"{case.id}: {len(frames)} of {len(known.frames)} frames are fitted")
        warnings += [f"not fitted: {line_of(row)}" for row in alike(failure_rows(case.id, known))]
        taken.append(_taken(run, known, frames))
        warnings += [f"{case.id}: {text}" for text in _doubtful(taken[-1].trial)]
    if not taken:
        for note in notes:
            say(note)
        raise CalibrationError(left_out)
    cases, trials, stated, voxels, traced = zip(*taken, strict=True)
    return Gathered(cases, trials, stated, voxels, traced, tuple(left_out), tuple(warnings), tuple(notes))


class _Taken(NamedTuple):
    """A case that is fitted: the first of ``Gathered``'s fields."""

    case: Case
    trial: Trial
    stated_mm: Array
    voxels: tuple[str, ...]
    traced_mm: tuple[Array, ...]


def _traced(case: Case, config: Config, store: Store) -> tuple[Context, Known]:
    """The case up to its traces; failed where its files changed meanwhile."""
    run = Context(case, config, store, Log(lambda *_: None), until="trace", inputs=Inputs.of(case))
    known = run_stages(run)
    changed = run.inputs.changed()
    return run, known.failed("load", changed) if changed else known


def _taken(run: Context, known: Known, frames: Sequence[Frame]) -> _Taken:
    """The case with what is fitted of it: these of its frames."""
    fitted = {frame.index for frame in frames}
    trial = trial_of(run, known, known.frames, roll_free=run.case.roll_deg == "fit", only=fitted)
    stated = np.array([frame.expected_mm for frame in frames])
    voxels = tuple(frame.voxels for frame in known.frames if frame.voxels)
    return _Taken(run.case, trial, stated, voxels, tuple(map(kept, trusted(frames).values())))


def _doubtful(trial: Trial) -> list[str]:
    """What the solver doubts of a lumen; in a run it is a warning of the case."""
    return [f"the lumen's signed distance: {trial.vessel.doubts}"] * bool(trial.vessel.doubts)


def _counted_before(frames: Sequence[Frame], taken: Sequence[_Taken]) -> dict[int, str]:
    """By number the frames that are one of a case that is taken already, and in words which."""
    found: dict[int, str] = {}
    for one in taken:
        found = copies(frames, one.voxels, one.traced_mm, f"a frame of case {one.case.id!r}") | found
    return found


def _first(again: Mapping[int, str]) -> str:
    return next(f"frame {number} {why}" for number, why in sorted(again.items()))


def _scanned_twice(case: Case, frames: Sequence[Frame], one: _Taken) -> list[str]:
    """A doubt of a case that lies where another does; not of two of one insertion."""
    return scanned_twice(frames, one.traced_mm, one.case.id) if case.group != one.case.group else []


def all_unknowns(cases: Sequence[Case]) -> tuple[Unknown, ...]:
    """The parameters that are fitted to these cases, which state one friction."""
    weighed = any(case.push_force_N is not None or case.wire.weight_N_per_mm > 0 for case in cases)
    return unknowns([case.wall.stiffness_N_mm2 for case in cases], cases[0].wall.friction, weighed=weighed)


def calibrate(found: Gathered, config: Config) -> Calibration:
    """Fit the parameters; CalibrationError where neither what is stated nor what is found can be taken for one.

    At the end of its range it may lie anywhere beyond, and held as stated it would bend the others.
    """
    fit = calibrated(all_unknowns(found.cases), [Evidence(trial) for trial in found.trials], config.solver)
    ends = [e for e in fit.contradicted if e.unknown.at_an_end(e.value)]
    if ends:
        todo = "nothing is saved; state it nearer to that, or correct the wire's profile, the lumen or the rolls"
        each = [(e, e.unknown.end_told(e.value)) for e in ends]
        said = [(e.unknown.name, e.why if e.why.endswith(end) else f"{e.why}; {end}") for e, end in each]
        raise CalibrationError([f"{name}: {why}: {todo}" for name, why in said])
    return fit


def depth_offset(found: Gathered, fit: Calibration) -> tuple[float, float]:
    """Offset to add to stated depths, mm, and its standard deviation; NaN where none is stated."""
    points = fit.fit.problem.points(fit.fit.linear.x)
    off: dict[str, Array] = {}
    for trial, point, stated in zip(found.trials, points, found.stated_mm, strict=True):
        apart = np.array(depths_at(trial, point)) - stated
        off[trial.group] = np.append(off.get(trial.group, []), apart[np.isfinite(apart)])
    each = [apart for apart in off.values() if len(apart)]
    if not each:
        return float("nan"), float("nan")
    # one standard deviation for all: a single depth of an insertion has none of its own
    left = np.concatenate([apart - np.mean(apart) for apart in each])
    free = len(left) - len(each)
    sd = float(np.sqrt(left @ left / free)) if free else SAME_MM
    return over_insertions([float(np.mean(apart)) for apart in each], [sd / len(apart) ** 0.5 for apart in each])


def over_insertions(means_mm: Sequence[float], spread_mm: Sequence[float]) -> tuple[float, float]:
    """Mean of the offsets of insertions, mm, and its standard deviation. spread_mm : standard deviations of their own.

    Depths of one insertion share the error of their scale, so the spread is taken between insertions. That of few is
    itself little known: it is widened as Student's t is over the normal distribution, at 95 %, of two insertions 6.5
    times and of three 2.2.
    """
    count = len(means_mm)
    own = np.sqrt(np.mean(np.square(spread_mm)) / count)
    few = stdtrit(count - 1, 0.975) / ndtri(0.975)
    between = few * np.std(means_mm, ddof=1) / np.sqrt(count) if count > 1 else SAME_MM
    return float(np.mean(means_mm)), float(np.hypot(own, between))


def design(cases: Sequence[Case], config: Config, store: Store) -> tuple[list[Predicted], tuple[str, ...]]:
    """Predicted standard deviations of a planned study; CalibrationError where something is missing."""
    planned, notes = [], []
    for case in cases:
        if case.insertion_mm is None:
            raise CalibrationError([f"case {case.id!r}: insertion_mm is missing: which depths are planned?"])
        run = Context(
            case.model_copy(update={"frames": (), "traces": ()}), config, store, Log(lambda *_: None), until="segment"
        )
        known = run_stages(run)
        if known.failure is not None:
            raise CalibrationError([f"case {case.id!r}: {known.failure}"])
        trial = trial_of(run, known, (), roll_free=case.roll_deg == "fit")
        rolls = each_frame(case.stated_roll_deg, len(case.insertion_mm))
        force = None if case.push_force_N is None else np.zeros(len(case.insertion_mm))
        planned.append(replace(straight_to(trial, case.insertion_mm, rolls), force_N=force))
        notes.append(f"{case.id}: {len(case.insertion_mm)} frames, voxels of {trial.voxel_mm:.2f} mm")
        notes += [f"{case.id}: {text}" for text in _doubtful(trial)]
    try:
        return predicted(all_unknowns(cases), planned, config.solver), tuple(notes)
    except ValueError as error:
        raise CalibrationError([str(error)]) from None
