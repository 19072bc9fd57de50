"""A wire in memory: the arrays that the kernels work on, grown as the wire goes in, and the way into the kernels."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solver import _tolerances as tol
from solver import skips
from solver._compile import hash_of
from solver._kernels import data, records
from solver._kernels.chain import lay_out, tabulate
from solver._kernels.data import CURRENT, Introducer, Limits, Problem, Rule, WireTable
from solver._kernels.handle import Contents, handle_of
from solver._kernels.insertion import advance
from solver._kernels.minimise import CLOSED_FORM
from solver._kernels.shaft import shaft_forces
from solver.at_entry import EntryContact
from solver.catheter import Catheter, sleeve_of
from solver.doors import FORCE_N, Array, numbers
from solver.errors import refuse
from solver.solution import Solution, Status
from solver.wall import VesselWall
from solver.wire import GuideWire

QUADRATURES = ("tip", "joints", "segments")
TIP_PANELS = 5
"""Panels of the last segment, each half as long as the one before: the last is 1/16 of it."""
SAME_ROLL = 1e-12  # rad
TIP_ZONE = 4
"""Segments before the last with two Gauss points each: they cover the tip's contact run where segments are short."""


def look_up_rule(wire: GuideWire, wall: VesselWall | None, quadrature: str) -> Rule:
    """Where a wire's segments look the wall up.

    The last segment has two Gauss points on each of a few panels that shrink towards the tip, so that a contact
    run much shorter than the segment is still seen.
    """
    hull, reach = wall.hull_points(wire.radius_mm) if wall is not None else (np.zeros((0, 2)), 0.0)
    if quadrature == "joints":
        return Rule(hull, reach, np.zeros(1), np.ones(1), 0)
    edges = np.concatenate([[0.0], 0.5 ** np.arange(TIP_PANELS - 1, -1, -1)])
    width, centre = np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
    offset = width / (2 * np.sqrt(3.0))
    at, weight = np.concatenate([centre - offset, centre + offset]), np.concatenate([width, width]) / 2
    return Rule(hull, reach, at, weight, TIP_ZONE if quadrature == "tip" else 2**62)


_VERSION = hash_of(Path(__file__))
NO_FIELD = data.Field(
    np.zeros((4, 4, 4), dtype=np.float32), np.eye(3), np.zeros(3), 0.0, 0.0, 1.0, np.zeros((1, 1, 1), np.uint8)
)
"""A stand-in where there is no wall; it is never looked up."""

SNAPS_KEPT = 16
"""Snaps that are kept of one depth."""


class Workspace:
    """Memory for a chain of up to ``capacity`` segments; slot CURRENT holds the present chain, of k segments.

    problem, table, limits, place, report, force : see ``_kernels.handle.Contents``.
    """

    problem: Problem
    introducer: Introducer | None = None
    at_entry: EntryContact | None = None

    def __init__(
        self,
        wire: GuideWire,
        wall: VesselWall | None,
        quadrature: str,
        limits: Limits,
        shaft_mm: float = 0.0,
        drag_N: float = 0.0,
        catheter: Catheter | None = None,
    ) -> None:
        if limits.method == CLOSED_FORM and wire.twists:
            name, got = "torsional_stiffness_N_mm2", wire.torsional_stiffness_N_mm2
            refuse("solver", name, got, "inf with method closed_form", "use method newton")
        self.wire, self.wall, self.limits, self.skips = wire, wall, limits, skips.current()
        self.shaft_mm = float(shaft_mm)
        springs = np.zeros((1, 3, 3)), np.zeros(2), np.zeros((2, 2))
        self.shaft = data.Shaft(float(drag_N), float(wire.radius_mm), *springs)
        self.catheter, self.sleeve = catheter, sleeve_of(wire, catheter)
        self.rule = look_up_rule(wire, wall, quadrature)
        self.field = wall.field if wall is not None else NO_FIELD
        # rolling a straight wire with one bending stiffness and a round, smooth hull changes nothing
        smooth = wall is None or (wall.samples == 0 and wall.friction == 0)
        self.round = wire.straight and smooth and drag_N == 0
        self.k, self.capacity = 0, 0
        self.counters, self.place = np.zeros(1, records.COUNTERS), np.zeros(1, records.PLACE)
        # the same memory without names: to clear a record field by field takes 6 µs
        self.counts = self.counters.view(np.int64)
        self.place["shrink"], self.place["since_doubt"] = 1.0, np.inf
        self.place["rough_depth"] = np.nan
        self.place["passed"] = self.place["hind"] = np.inf
        self.snaps, self.held_load = np.zeros(SNAPS_KEPT, records.SNAP), np.zeros(3)
        self.report = np.zeros(3, records.REPORT)
        self._grow(16)

    @property
    def middle_mm(self) -> Array:
        """(3,) LPS mm, from which kernels count places."""
        return self.wall.middle_mm if self.wall is not None else np.zeros(3)

    def _grow(self, capacity: int) -> None:
        """Make room for more segments, keeping the wire that lies there."""
        points = len(self.rule.hull) * (2 * capacity + len(self.rule.tip_at))
        state, scratch = self._empty_state(capacity, points), self._empty_scratch(capacity, points)
        friction, chain = self._empty_friction(capacity, points), self._empty_chain(capacity, points)
        if self.capacity:
            old = self.problem
            news, olds = (*state, *chain[:-1], *friction[2:]), (*old.state, *old.chain[:-1], *old.friction[2:])
            for new, was in zip((*news, scratch.change), (*olds, old.scratch.change), strict=True):
                new[tuple(slice(0, size) for size in was.shape)] = was
        self.problem = Problem(
            field=self.field,
            stiffness=float(self.wall.stiffness_N_mm2) if self.wall is not None else 0.0,
            pressed=self.at_entry.energy if self.at_entry is not None else 0.0,
            friction=friction,
            shaft=self.shaft,
            chain=chain,
            state=state,
            scratch=scratch,
            skips=self.skips,
            twisting=self.wire.twists,
            straight=self.round and self.skips.direction and not self.wire.twists,
        )
        segment = float(self.wire.segment_mm)
        cells = np.zeros((capacity + 1, 2))
        tabulate(self.wire.profile, segment, cells)
        if self.sleeve.there:
            self.sleeve = self.sleeve._replace(cells=np.zeros((capacity + 1, 2)))
            tabulate(self.sleeve.profile, segment, self.sleeve.cells)
        rest = self.skips.profile, self.shaft_mm, self.sleeve
        self.table = WireTable(self.wire.profile, self.rule, cells, segment, *rest)
        self.force = np.zeros((capacity + 1, 3))
        self.capacity = capacity

    def _empty_state(self, k: int, points: int) -> data.State:
        u, x, r = np.zeros((4, k, 3)), np.zeros((4, k + 1, 3)), np.zeros((4, k + 1, 3, 3))
        penetration, jet = np.zeros((4, points)), np.zeros((4, points, 10))
        return data.State(u, x, r, penetration, jet, np.zeros(4, records.ENERGIES), np.zeros((4, 3, 3)))

    def _empty_scratch(self, k: int, points: int) -> data.Scratch:
        gain, anchor = np.zeros((k, 3, 7)), np.ones((points, 4))
        start, change, keep = np.zeros((3, k, 3))
        descent, seen = np.zeros(1, records.DESCENT), np.zeros((k + 1, 3))
        return data.Scratch(gain, anchor, self.counters, descent, start, change, keep, seen, self.snaps)

    def _empty_friction(self, k: int, points: int) -> data.Friction:
        coefficient = float(self.wall.friction) if self.wall is not None else 0.0
        k, points = (k, points) if coefficient else (-1, 0)
        held, arm, start, normal, stretch = np.zeros((5, points, 3))
        load, pressed = np.zeros((2, points))
        exposed, frame = np.ones(points), np.zeros((k + 1, 3, 3))
        springs = held, frame, arm, start, normal, load, stretch, pressed
        return data.Friction(coefficient, self.rule.reach, exposed, *springs)

    def _empty_chain(self, k: int, points: int) -> data.Chain:
        length, bend, twist, rest = np.zeros((4, k))
        load, first = np.zeros((k + 1, 3)), np.zeros(k + 2, dtype=np.int64)
        offset, weight, (held, early) = np.zeros((points, 3)), np.zeros(points), np.zeros((2, 1))
        return data.Chain(length, bend, twist, rest, load, first, offset, weight, held, early, self.rule.reach)

    def clamp(
        self,
        entry: Array,
        frame: Array,
        tip_load: ArrayLike = (0.0, 0.0, 0.0),
        translate: bool = False,
        steps: tuple[float, float, float] = (1.0, 1.0, 1.0),
        weight: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        """Put the base of the wire into the introducer, see ``_kernels.data.Introducer``.

        steps : longest step, mm, and roll, degrees; the finest step, mm.
        """
        step, turn, finest = map(float, steps)
        self.introducer = Introducer(
            entry=entry - self.middle_mm,
            frame=np.ascontiguousarray(frame),
            load=np.array(tip_load, dtype=np.float64),
            translate=translate,
            idle_roll=self.round and self.skips.roll,
            step=step,
            turn=turn,
            rise=max(tol.RISE_RADII * self.wire.radius_mm, 0.25 * self.field.spacing),
            margin=float(self.wire.radius_mm),
            weight=np.array(weight, dtype=np.float64),
            finest=min(finest / step, 1.0),
        )
        self.problem.state.x[:, 0], self.problem.state.r[:, 0] = self.introducer.entry, frame
        if self.wall is not None:
            self.at_entry = EntryContact(self.wall, self.rule, self.wire.radius_mm, entry, frame)
            self.problem = self.problem._replace(pressed=self.at_entry.energy)
        self._bind()

    def load(self, load_N: ArrayLike) -> None:
        """Put dead loads on the joints, or one on the tip."""
        k, loads = self.k, self.problem.chain.load
        load = numbers("relax", "load_N", load_N, (..., 3), FORCE_N)
        if load.shape not in ((3,), (k + 1, 3)):
            allowed = f"(3,) on the tip or ({k + 1}, 3)"
            refuse("relax", "load_N", load.shape, allowed, "see GuideWire.segments_at")
        loads[:] = 0.0
        loads[k if load.ndim == 1 else slice(0, k + 1)] = load
        self.held_load = loads[0].copy()

    def _bind(self) -> None:
        """Take a handle of the arrays, wherever in memory they are now."""
        settings = self.introducer, self.limits
        self.handle = handle_of(Contents(self.problem, self.table, *settings, self.place, self.report, self.force))

    def __getstate__(self) -> dict[str, Any]:
        """What a checkpoint holds: not the field, which the wall has, nor the handle, valid in this process only."""
        state = vars(self) | {"problem": self.problem._replace(field=NO_FIELD), "version": _VERSION}
        return {name: value for name, value in state.items() if name not in ("handle", "counts", "field")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore a checkpoint; ValueError where another version of the solver made it, with other arrays perhaps."""
        if state.pop("version") != _VERSION:
            raise ValueError("insertion: checkpoint: made by another version of the solver; insert the wire anew")
        vars(self).update(state)
        # the wire's and the wall's own arrays, which are read-only: numba's types tell that apart
        self.field = self.wall.field if self.wall is not None else NO_FIELD
        self.problem = self.problem._replace(field=self.field)
        made = sleeve_of(self.wire, self.catheter)
        self.sleeve = made._replace(tip=self.sleeve.tip, cells=self.sleeve.cells)
        self.table = self.table._replace(profile=self.wire.profile, sleeve=self.sleeve)
        self.counts = self.counters.view(np.int64)
        self._bind()

    def reserve(self, depth_mm: float) -> None:
        """Make sure that there is room for the wire at a depth and one point more."""
        if depth_mm >= (self.capacity - 1) * self.wire.segment_mm:
            self._grow(max(2 * self.capacity, self.wire.segments_at(depth_mm)[0] + 2))
            if self.introducer is not None:
                self._bind()

    def lay_out(self, depth_mm: float) -> None:
        """Cut the wire at a depth into segments."""
        self.reserve(depth_mm)
        self.k, first = self.wire.segments_at(depth_mm)
        if self.k:
            lay_out(self.problem.chain, self.table, self.k, first)

    def advance(self, depth_mm: float, roll_deg: float, laid: int = 0) -> tuple[Status, int]:
        """Go to a depth and roll, see ``_kernels.insertion.advance``; return the status and the iterations."""
        outcome, iterations, self.k = advance(self.handle, depth_mm, roll_deg, laid)
        return Status[data.OUTCOMES[outcome]], iterations

    def rolled(self, frames: Array, roll_deg: float) -> Array:
        """A copy of the frames (n, 3, 3); where a roll moved nothing, and so was not carried out, turned by it.

        That is one of a straight wire, or at depth 0.
        """
        if self.introducer is None or not (self.introducer.idle_roll or len(frames) == 1):
            return frames.copy()
        angle = math.radians(roll_deg)
        one, two, _ = self.introducer.frame.T
        first = math.cos(angle) * one + math.sin(angle) * two
        c, d = float(frames[0, :, 0] @ first), float(frames[0, :, 1] @ first)
        if abs(d) < SAME_ROLL and c > 0.0:
            return frames.copy()
        return np.asarray(frames @ np.array([[c, -d, 0.0], [d, c, 0.0], [0.0, 0.0, 1.0]]))

    def solution(self, status: Status, iterations: int, depth_mm: float, roll_deg: float) -> Solution:
        """The wire as it lies now."""
        n, state = self.k + 1, self.problem.state
        arrays = [
            state.x[CURRENT, :n] + self.middle_mm,
            self.rolled(state.r[CURRENT, :n], float(self.place["roll"][0])),
            self.force[:n].copy(),
        ]
        notes = self.place.item(0), self.report.item(0), state.energies.item(CURRENT), self.counters.item(0)
        ended = status, iterations, depth_mm, roll_deg, self.wire.radius_mm
        solution = Solution.assembled(arrays, notes, self.snaps, ended)
        if self.at_entry is not None:
            self.at_entry.add(solution)
        if self.shaft.drag:
            sliding, turning = shaft_forces(self.shaft)
            push, torque = solution.push_force_N + sliding, solution.reaction_torque_N_mm + turning
            vars(solution).update(push_force_N=push, reaction_torque_N_mm=torque)
        if self.k and self.introducer is not None and (self.wire.weight_N_per_mm > 0.0 or self.held_load.any()):
            # half of the first segment's weight hangs at the entry, where no joint can move, and what loads that joint
            held = 0.5 * self.problem.chain.length[0] * self.introducer.weight + self.held_load
            force = solution.reaction_force_N - held
            force.setflags(write=False)
            vars(solution).update(reaction_force_N=force)
        return solution
