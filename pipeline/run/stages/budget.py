"""The budget of a case: its ensemble, what that says of every frame, and the table by source."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.polyline import at_arc, samples
from pipeline.budget import (
    SOURCES,
    Budget,
    FrameSample,
    Nominal,
    Scene,
    Sigmas,
    alone,
    coefficients,
    drawn,
    exact,
    frame_budget,
    rank_of_ends,
    releases,
    replayed,
)
from pipeline.budget.frame import FEWEST
from pipeline.budget.inputs import INSERTION_MM, members_per_lumen, sigmas_of
from pipeline.budget.shapes import DISTAL_MM as SHAPED_MM
from pipeline.budget.verdict import ROUND
from pipeline.compare.metrics import DISTAL_MM, distal, rms, scored
from pipeline.model import Array, arc_length
from pipeline.run.stages.known import Context, Frame, Known
from pipeline.run.stages.way import by_trace, way_of
from pipeline.simulate import altered
from pipeline.simulate.clamp import TIP_VOXELS, ahead_of
from pipeline.simulate.evidence import UNKNOWN_VOXELS, TraceSamples
from pipeline.simulate.resolution import AGREED_MM, lengths_mm
from pipeline.simulate.way import Way
from pipeline.study.manifest import Case
from reports.case_files import frames_named

AT_REST, RARE = 0.9, 0.05
NOT_OURS = (
    "no budget: it is drawn by this project's own solver, and says what inputs do to its wires alone; of wires from "
    "elsewhere it would take their errors for uncertainty"
)
OF_VIEWS = "no budget: it is drawn along wires that were traced in space, and X-ray projections show none"
FEW_ALONE = (
    f"budget.members_alone = {{}}: of fewer than {FEWEST} insertions nothing is said, so that the table by source has "
    f"no values; give {FEWEST} or more, or 0 for no such table"
)
END_MM = DISTAL_MM["distal10_rms_mm"]
"""The wire's end in budget.csv, as in entries.csv beside it."""
Along = tuple[Array, Array]
"""Arc lengths (n,) of a wire, mm, and values there."""


def budgeted(run: Context, known: Known) -> Known:
    """The case with the uncertainty budget of every frame and by source; unchanged where there can be none."""
    frames = [f for f in known.frames if f.ok and f.solved is not None and len(f.solved.joints_mm) > 1]
    settings = run.config.budget
    if settings.members and (why := no_budget(run.case)):
        run.log.assumptions.append(why)
        return known
    if not settings.members or not frames or known.clamp is None or not np.isfinite(known.segment_mm):
        return known
    with run.log.timed("compare"):
        work = Work(run, known, frames)
        try:
            alike = work.alone() if settings.members_alone else {}
            ensemble, *each = work.ensembles([(work.sigmas, settings.members), *alike.values()])
            budgets = _with_releases(_snapped(known, work.way), work.budgets_of(ensemble))
            found = dict(zip(work.numbers, budgets, strict=True))
            rank = work.rank(ensemble, budgets)
            rows = work.by_source(found, dict(zip(alike, each, strict=True))) if settings.members_alone else []
        except ValueError as error:  # an input was drawn that the solver refuses
            run.log.warnings.append(f"case {run.case.id!r} has no budget: {error}; lower that input's uncertainty")
            return known
    run.log.assumptions.append(work.said())
    run.log.warnings += _lost(found, settings.members) + _rare(rank)
    run.log.warnings += [FEW_ALONE.format(settings.members_alone)] * (0 < settings.members_alone < FEWEST)
    done = tuple(replace(frame, budget=found.get(frame.index)) for frame in known.frames)
    return replace(known, frames=done, sources=tuple(rows), ends_rank=rank)


def no_budget(case: Case) -> str:
    """Why a case has no budget though one is asked for; empty where it has."""
    return OF_VIEWS if case.projections else NOT_OURS if case.simulated is not None else ""


def _lost(found: Mapping[int, Budget | None], count: int) -> list[str]:
    """A warning where many members of the ensemble did not come to rest: the spread is then that of the others."""
    few = [n for n, budget in found.items() if budget is None or budget.members < AT_REST * count]
    if not few:
        return []
    return [
        f"{frames_named(few)}: fewer than {100 * AT_REST:.0f} % of the {count} insertions of the budget came to rest, "
        f"or fewer than {FEWEST}, of which nothing is said: u_val is that of the others; raise budget.members, or "
        "state smaller uncertainties"
    ]


def _rare(rank: float) -> list[str]:
    """A warning where hardly any member of the ensemble lies as far off as the real insertion."""
    if not rank <= RARE:
        return []
    return [
        f"the traced wires' last {SHAPED_MM:g} mm, of all frames together, lie as far from the simulated ones as "
        f"1 in {1.0 / rank:.0f} of the budget's insertions (ends_rank): the model is wrong, or an input is "
        "less certain than stated; of right ones one case in twenty has this, too"
    ]


def _snapped(known: Known, way: Way) -> list[bool]:
    """Of each frame that is read, whether the simulated wire let go since the one before, be it in one passed by."""
    found, since = [], False
    for stop, read in zip(way.stops, way.read, strict=True):
        solved = known.frames[stop.frame].solved
        since = since or (solved is not None and bool(solved.snaps))
        if read:
            found.append(since)
            since = False
    return found


def _with_releases(snapped: Sequence[bool], budgets: Sequence[Budget | None]) -> list[Budget | None]:
    """The budgets, each with what became of a release (``budget.shapes.releases``)."""
    told = releases(snapped, [None if budget is None else budget.shapes for budget in budgets])
    return [None if b is None else replace(b, released=word) for b, word in zip(budgets, told, strict=True)]


def _by_traces(stops: Sequence[Frame], read: Collection[int], source: str) -> NDArray[np.bool_]:
    """Which depths on the way are the traces' (stops,): none unless all of the frames that are ``read`` are traced."""
    every = all(frame.traced for frame in stops if frame.index in read)
    return np.array([every and by_trace(frame, source) for frame in stops], dtype=bool)


class Work:
    """What all ensembles of a case share."""

    def __init__(self, run: Context, known: Known, frames: Sequence[Frame]) -> None:
        config, case = run.config, run.case
        self.run, self.frames, self.numbers = run, frames, [frame.index for frame in frames]
        self.voxel = float(np.mean(known.vessel.distance.spacing_mm))
        friction = case.wall.friction if config.simulate.friction is None else config.simulate.friction
        self.way = way_of(run, known.frames, frames)
        stops = [known.frames[stop.frame] for stop in self.way.stops]
        traced = _by_traces(stops, self.numbers, config.simulate.depth)
        depth, roll = np.array(self.way.depths_mm), np.array(self.way.rolls_deg)
        with_friction = replace(config.simulate, friction=friction)
        self.nominal = Nominal(known.held, depth, roll, with_friction, traced, known.roll_sd_deg)
        stated = {"roll_deg": case.roll_sigma_deg, **asdict(case.uncertainty)}
        noise = known.vessel.levels.get("wall_noise_mm")
        longest = float(np.max(known.vessel.distance.spacing_mm))
        known_to = self._depth_sigmas(stops), longest, noise, case.calibrated_sigma
        self.sigmas = sigmas_of(stated, self.nominal, case.wire, *known_to)
        self.seen = [self._seen(frame) for frame in frames]
        wires = [frame.simulated.joints_mm for frame in stops if frame.simulated is not None]
        traces = [frame.curve.points_mm for frame in frames if frame.curve is not None and frame.traced]
        as_simulated = replace(config.solver, segment_mm=known.segment_mm)
        shared = case.wire, case.wall, known.vessel, as_simulated, [*wires, *traces]
        self.scene = Scene(*shared, self.way, case.catheter, config.budget.seed)
        lengths = lengths_mm(config.solver.segment_mm, altered(case.wire, config.simulate).rest_curvature_per_mm)
        segment = lengths[0] if config.solver.segment_mm == "auto" else known.segment_mm
        quick = config.solver.quick(segment)
        self._settle(replace(self.scene, solver=quick))

    def _settle(self, quick: Scene) -> None:
        """Long segments and no repeated steps, for all members, if with these the simulated wire is where it is.

        What is left between the two is common to all members, and num_mm has it: it is taken off each of them.
        Where the wire snaps aside with long segments, so would members, and u would be the distance between two shapes.
        """
        (member,) = drawn(self.nominal, exact(self.sigmas), 1, 1)
        ((*found,),) = replayed(quick, [[member]], [seen.arc_mm for seen in self.seen])
        self.aside = [seen.nominal_mm - wires[0] for seen, wires in zip(self.seen, found, strict=True)]
        if all(rms(np.linalg.norm(away, axis=1)) <= AGREED_MM for away in self.aside):
            self.scene = quick
        else:
            self.aside = [np.zeros_like(away) for away in self.aside]

    def _depth_sigmas(self, stops: Sequence[Frame]) -> Array:
        """Standard deviation (stops,) of the depth of each frame on the way, mm."""
        given = self.run.case.insertion_sigma_mm
        tips = [0.0 if f.curve is None else np.nan_to_num(f.curve.tip_sigma_mm) for f in stops]
        own = np.hypot(tips, TIP_VOXELS * self.voxel)
        return np.where(self.nominal.traced, own, INSERTION_MM if given is None else given)

    def _seen(self, frame: Frame) -> FrameSample:
        """A frame's wires at the points at which it was compared."""
        settings, errors = self.run.config.compare, frame.comparison
        assert frame.simulated is not None
        if errors is None or frame.curve is None:
            arc = scored(samples(frame.depth_mm, settings.sample_mm), settings.skip_mm)
            return FrameSample(arc, at_arc(frame.simulated.joints_mm, arc))
        own = self.trace_mm(frame) ** 2 + self._segments_mm(frame) ** 2
        ahead = ahead_of(self.nominal.clamp, frame.curve)
        return FrameSample(errors.arc_mm, errors.sample_mm, frame.curve.points_mm, errors.foot_arc_mm, own, ahead)

    def trace_mm(self, frame: Frame) -> Array:
        """Standard deviation (n,) of the trace along each axis across it, where a frame was compared."""
        curve, errors = frame.curve, frame.comparison
        if curve is None or errors is None:
            return np.zeros(0)
        sigma = np.interp(errors.foot_arc_mm, arc_length(curve.points_mm), curve.sigma_mm)
        return np.where(np.isfinite(sigma), sigma, UNKNOWN_VOXELS * self.voxel)

    def _segments_mm(self, frame: Frame) -> float:
        """Standard deviation that the segments' length causes, mm: num_mm is a bound, two standard deviations."""
        return 0.5 * float(np.nan_to_num(frame.num_mm))

    def said(self) -> str:
        """What the ensemble was drawn from, for the report."""
        words = ", ".join(f"{name.replace('_', ' ')} {said}" for name, said in self.sigmas.said.items())
        count = self.run.config.budget.members
        own = f"; the traces, which state none, are taken to be known to {self.trace_said}" * bool(self.trace_said)
        return f"the budget rests on {count} insertions drawn from (one standard deviation): {words}{own}"

    @property
    def trace_said(self) -> str:
        """What is assumed of traces that state no standard deviation; empty where all do."""
        curves = [frame.curve for frame in self.frames if frame.curve is not None]
        known = all(np.isfinite(curve.sigma_mm).all() for curve in curves)
        return "" if known else f"{UNKNOWN_VOXELS * self.voxel:.2g} mm ({UNKNOWN_VOXELS:g} voxels, assumed)"

    def budgets_of(self, ensemble: Sequence[Array]) -> list[Budget | None]:
        """The budget of each frame by an ensemble."""
        return [frame_budget(wires, seen) for wires, seen in zip(ensemble, self.seen, strict=True)]

    def rank(self, ensemble: Sequence[Array], budgets: Sequence[Budget | None]) -> float:
        """Rank of the real insertion among the members, by the frames in which the ensemble has one shape."""
        rng = np.random.default_rng(self.run.config.budget.seed)
        each = zip(self.frames, self.seen, ensemble, budgets, strict=True)
        calm = [(frame, seen, wires) for frame, seen, wires, b in each if b is not None and b.shapes is None]
        ends = [coefficients(wires, seen, self.trace(frame, seen), self.voxel, rng) for frame, seen, wires in calm]
        per_lumen = members_per_lumen(self.run.config.budget.members)
        return rank_of_ends([one for one in ends if one is not None], per_lumen)

    def trace(self, frame: Frame, seen: FrameSample) -> TraceSamples:
        """The trace's uncertainty at the points at which a frame was compared."""
        knot = np.nan if frame.curve is None else frame.curve.levels.get("knot_mm", np.nan)
        return TraceSamples(frame.index, seen.arc_mm, seen.nominal_mm, self.trace_mm(frame), knot)

    def alone(self) -> dict[str, tuple[Sigmas, int]]:
        """The ensemble of every input by itself, by its name: standard deviations and number of members."""
        each = {source: alone(self.sigmas, source) for source in SOURCES}
        count = self.run.config.budget.members_alone
        return {source: (sigmas, count) for source, sigmas in each.items() if np.any(getattr(sigmas, source))}

    def ensembles(self, draws: Sequence[tuple[Sigmas, int]]) -> list[list[Array]]:
        """The wires (members, n, 3) of each frame, for each ensemble: its standard deviations and number of members."""
        seed = self.run.config.budget.seed
        members = [drawn(self.nominal, sigmas, count, members_per_lumen(count), seed) for sigmas, count in draws]
        found = replayed(self.scene, members, [seen.arc_mm for seen in self.seen])
        return [[wires + aside for wires, aside in zip(each, self.aside, strict=True)] for each in found]

    def by_source(
        self, found: Mapping[int, Budget | None], each: Mapping[str, Sequence[Array]]
    ) -> list[dict[str, Any]]:
        """Rows of budget.csv: u of every input by itself, of all, of segments and trace, and the error beside them.

        Over the frames in which the ensemble has one shape.
        """
        calm = [i for i, n in enumerate(self.numbers) if (b := found[n]) is not None and b.shapes is None]
        rows = [self._alone(source, ensemble, calm) for source, ensemble in each.items()]
        pairs = [(b, self.frames[i]) for i in calm if (b := found[self.numbers[i]]) is not None]
        compared = [(b, f, f.comparison) for b, f in pairs if f.comparison is not None]
        ends = (
            ("inputs", "all of these", [(b.arc_mm, b.input_mm) for b, _ in pairs]),
            (
                "segments",
                "half of num_mm",
                [(b.arc_mm, ROUND * self._segments_mm(f) + 0.0 * b.arc_mm) for b, f in pairs],
            ),
            ("trace", self.trace_said or "its own", [(b.arc_mm, ROUND * self.trace_mm(f)) for b, f, _ in compared]),
            ("u_val", "inputs, segments, trace", [(b.arc_mm, b.whole_mm) for b, _ in pairs if b.whole_mm is not None]),
            ("error", "simulated to traced", [(b.arc_mm, errors.error_mm) for b, _, errors in compared]),
        )
        return rows + [_row(name, said, values) for name, said, values in ends if calm]

    def _alone(self, source: str, ensemble: Sequence[Array], calm: Sequence[int]) -> dict[str, Any]:
        """The row of one input by its ensemble."""
        budgets = self.budgets_of(ensemble)
        pairs = [(b.arc_mm, b.input_mm) for i in calm if (b := budgets[i]) is not None]
        known = [(arc, values) for arc, values in pairs if np.isfinite(values).all()]
        return _row(source, self.sigmas.said[source], known)


def _row(name: str, said: str, frames: Sequence[Along]) -> dict[str, Any]:
    """A row of budget.csv from values of frames along the wire."""
    whole = [values for _, values in frames], [distal(values, arc, END_MM) for arc, values in frames]
    every, ends = (rms(np.concatenate([np.zeros(0), *part])) for part in whole)
    return {"source": name, "sigma": said, "u_mm": every, "distal_u_mm": ends}
