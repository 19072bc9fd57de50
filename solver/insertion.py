"""Insertion: the base is pushed and rolled in small steps and the wire relaxed after each of them.

Several minima exist, so a depth is reached by replaying its history, never by jumping to it.
"""

import copy
import math
import threading
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from solver import _tolerances as tol
from solver.catheter import Catheter
from solver.doors import ANGLE_DEG, FORCE_N, LENGTH_MM, Range, choice, listed, number, numbers, unit, vector, whole
from solver.entry import refused_at
from solver.errors import refuse
from solver.long_way import Goal, advance, check_way, nearby
from solver.relax import Settings, base_frame, check_scene, weight_of
from solver.solution import Solution, Status
from solver.wall import VesselWall
from solver.wire import GuideWire
from solver.workspace import Workspace

ROLL_STEP_DEG = Range(1e-6, 1e6)
RUBBING_STEP_MM = 0.1
"""Longest step with friction, whose error is of first order: against steps of 0.05 mm 24 of 1,804 depths of 100 random
vessels are more than 0.03 mm off without a flag with steps of 1 mm, none with 0.1, in 2.2 times the time
(``tests.studies.rubbing``)."""
RUBBING_TURN_DEG = 1.0
"""Longest roll with friction, whose direction is that at a step's end for all of its way: against rolls of 0.1 degrees
a curved tip is 0.26 mm off with 15, 0.09 with 5 and 0.015 with 1. A shaft that rubs and twists lags its hand by an
equation of the same kind: with steps of 1 mm and 15 degrees the tip was up to 3 degrees off (0.28 mm)."""
FINEST_MM = Range(LENGTH_MM.least, math.inf, "step_mm or more: no step is taken again")
SHAFT_MM, SHAFT_N = Range(0.0, 1e6, "0 is a shaft that does not twist"), Range(0.0, 1e6, "0 is no friction")
ONE_AT_A_TIME = "finish one call before the next, or go on with insertion.clone()"


class Insertion:
    """A wire that is held at the entry in a given direction and pushed into a lumen in small steps.

    entry_mm : (3,) LPS mm, where the wire is clamped.     entry_direction : (3,) LPS, any length; the wire leaves the
    entry along it.     material_axis : (3,) LPS, where material axis 1 points at roll 0, made orthogonal to
    entry_direction; the default is the world axis that is least aligned with entry_direction.
    method : "newton" or "closed_form".     initial : the shape from which a step's relaxation starts: "slide" moves the
    material along the wire's own curve, "translate" is the paper's section 4.1.
    step_mm, roll_step_deg : the longest step. With friction on the wall, or on a shaft that twists, no step is longer
    than 0.1 mm and no roll larger than 1 degree.
    finest_mm : where the change of energy in a step does not match the work of the hand, the step is repeated in
    shorter ones, down to this length. With step_mm or more no step is repeated.
    tolerance, max_iterations, quadrature : see ``solver.relax.Settings``.     max_joints : longest wire accepted.
    tip_load_N : (3,) a force on the tip that keeps its direction.     down : (3,) LPS, the direction of gravity; needed
    if the wire has a weight.     catheter : a tube over the wire, see ``to_depths``.
    shaft_mm : length of wire between the hand and the entry, the same at every depth. It twists with stiffness GJ, so
    the tip lags behind the hand; one of 0 mm does not twist.
    shaft_friction_N : force at its surface that it takes to slide or turn that shaft, whatever its length.

    Raises ValueError for arguments that cannot be used. What goes wrong while the wire is pushed is a ``Status`` of the
    solution. An insertion has one state and does one thing at a time (see ``to_depths``): use ``clone`` to try several
    ways from one state, and ``pickle`` to save a state.
    """

    def __init__(
        self,
        wire: GuideWire,
        wall: VesselWall | None,
        entry_mm: ArrayLike,
        entry_direction: ArrayLike,
        method: str = "newton",
        initial: str = "slide",
        material_axis: ArrayLike | None = None,
        *,
        tolerance: float = tol.DECREMENT,
        max_iterations: int = 200,
        step_mm: float = 1.0,
        roll_step_deg: float = 15.0,
        finest_mm: float = 0.05,
        max_joints: int = 20_000,
        quadrature: str = "tip",
        tip_load_N: ArrayLike = (0.0, 0.0, 0.0),
        down: ArrayLike | None = None,
        shaft_mm: float = 0.0,
        shaft_friction_N: float = 0.0,
        catheter: Catheter | None = None,
    ) -> None:
        settings = Settings(method, tolerance, max_iterations, quadrature)
        check_scene("insertion", wire, wall)
        choice("insertion", "initial", initial, ("slide", "translate"))
        shaft = number("insertion", "shaft_mm", shaft_mm, SHAFT_MM)
        drag = number("insertion", "shaft_friction_N", shaft_friction_N, SHAFT_N)
        twists = math.isfinite(wire.torsional_stiffness_N_mm2) and shaft * drag > 0.0
        steps = _steps(step_mm, roll_step_deg, finest_mm, rubs=twists or (wall is not None and wall.friction > 0.0))
        self.wire, self.wall, self._near = wire, wall, nearby(*steps[:2], wire.segment_mm)
        self.max_joints = most = whole("insertion", "max_joints", max_joints, tol.MOST_JOINTS)
        frame = base_frame(unit("insertion", "entry_direction", entry_direction), material_axis, 0.0)
        entry, load = vector("insertion", "entry_mm", entry_mm), vector("insertion", "tip_load_N", tip_load_N, FORCE_N)
        self._work = Workspace(wire, wall, settings.quadrature, settings.limits, shaft, drag, catheter)
        weight = weight_of("insertion", wire, down)
        self._work.clamp(entry, frame, load, initial == "translate", steps, weight)
        self._started, self._way, self._lock = False, object(), threading.Lock()
        self._too_long = (most + 0.5 - 1e-12) * wire.segment_mm  # there ``segments_at`` counts one joint too many
        self._refused = None if wall is None else refused_at(wall, entry)

    @property
    def depth_mm(self) -> float:
        """Where the tip is, mm of wire beyond the entry."""
        return float(self._work.place["inserted"][0])

    @property
    def roll_deg(self) -> float:
        """Roll of the base, degrees."""
        return float(self._work.place["roll"][0])

    @property
    def catheter_mm(self) -> float:
        """Where the tip of the catheter is, mm beyond the entry."""
        return float(self._work.place["catheter"][0])

    def __repr__(self) -> str:
        """Where it is."""
        stiffness = "no wall" if self.wall is None else f"wall of {self.wall.stiffness_N_mm2:g} N/mm2"
        return f"Insertion(at {self.depth_mm:g} mm, roll {self.roll_deg:g} degrees, {stiffness}, {self.wire!r})"

    def to_depths(
        self,
        depths_mm: Iterable[float],
        roll_deg: float | Sequence[float] = 0.0,
        catheter_mm: float | Sequence[float] = 0.0,
    ) -> Iterator[Solution]:
        """Push (or pull) the tip to each depth in turn and yield the wire there.

        depths_mm : arc lengths from the entry to the tip, 0 to 1e7 mm and at most 1e6 segments. Beyond ``max_joints``
        segments the status is TOO_LONG.
        roll_deg : roll of the base.     catheter_mm : how far the catheter's tip is beyond the entry, at most the
        wire's depth. Each is one number for all depths or one per depth; if left out, the base is turned back to 0 and
        the catheter pulled back to 0, whatever an earlier call set. Between two depths wire, roll and catheter advance
        in proportion. push_force_N is the force on the wire while the catheter is held.

        A depth that cannot be reached yields the last good state, with the depth of that state and a status that says
        why.
        Arguments are checked when this is called, not when the first depth is asked for. Only the latest call moves the
        wire: once its first depth is asked for, going on with an earlier call raises RuntimeError. So does a call while
        another thread moves this wire.
        """
        return self._each(*self._goals(depths_mm, roll_deg, catheter_mm))

    def _goals(
        self, depths_mm: Iterable[float], roll_deg: float | Sequence[float], catheter_mm: float | Sequence[float] = 0.0
    ) -> tuple[list[float], list[float], list[float]]:
        """Depths, mm, and for each a roll, degrees, and the catheter's tip, mm; ValueError where one is refused."""
        if not listed(depths_mm):
            refuse("insertion", "depths_mm", depths_mm, "a list of numbers of 0 or more", "write [10.0, 20.0]")
        allowed = _reach(self.wire)
        depths = _list("depths_mm", depths_mm, allowed)
        rolls = _each_of("roll_deg", roll_deg, ANGLE_DEG, len(depths))
        tips = _each_of("catheter_mm", catheter_mm, allowed, len(depths))
        if any(tips) and self._work.catheter is None:
            refuse("insertion", "catheter_mm", catheter_mm, "0 without a catheter", "Insertion(..., catheter=...)")
        for depth, tip in zip(depths, tips, strict=True):
            if tip > depth:
                advice = "a wire whose tip lies inside the catheter is not modelled: push it out or pull the tube back"
                refuse("insertion", "catheter_mm", tip, f"{depth:g}, the wire's depth, or less", advice)
        if depths and not (self._near[0] > max(depths) and self._near[1] > max(max(rolls), -min(rolls))):
            self._look_ahead(depths, rolls, tips)
        return depths, rolls, tips

    def _look_ahead(self, depths: list[float], rolls: list[float], tips: list[float]) -> None:
        """Refuse ways that would take too long; from now on Ctrl-C can interrupt a long way."""
        here = Goal(self.depth_mm, self.roll_deg if self._started else rolls[0], self.catheter_mm)
        for goal in map(Goal, depths, rolls, tips):
            if self._reaches(goal.depth):
                check_way(self._work, here, goal)
                here = goal
        self._near = 0.0, 0.0

    def _each(self, depths: list[float], rolls: list[float], tips: list[float]) -> Iterator[Solution]:
        """Go to each depth, for as long as no later call has begun."""
        way = None
        for depth, roll, tip in zip(depths, rolls, tips, strict=True):
            self._hold()
            try:
                way = way or self._begin(depths, rolls)
                if self._way is not way:
                    raise RuntimeError(f"insertion: to_depths: a later call has begun since; {ONE_AT_A_TIME}")
                self._work.place["goal"] = tip
                solution = self._go(depth, roll)
            finally:
                self._release()
            yield solution

    def _hold(self) -> None:
        """Take the lock, or refuse to touch the wire while another thread does."""
        if not self._lock.acquire(blocking=False):
            raise RuntimeError(f"insertion: another thread is moving this wire; {ONE_AT_A_TIME}")

    def _release(self) -> None:
        """Give the lock back."""
        self._lock.release()

    def _begin(self, depths: list[float], rolls: list[float]) -> object:
        """Make room for all depths of a call and end the calls before it; return an object that stands for this one."""
        self._work.reserve(max((d for d in depths if d < self._too_long), default=0.0))
        if not self._started and rolls:
            # a wire that is not yet in the lumen has no history: it starts at its first roll
            self._work.place["roll"], self._started = rolls[0], True
        self._way = object()
        return self._way

    def _reaches(self, depth_mm: float) -> bool:
        """Whether the wire can be tried at a depth at all."""
        return depth_mm < self._too_long and self._refused is None

    def clone(self) -> Self:
        """A copy of this insertion in its present state, to the last bit. The two go on independently."""
        twin = object.__new__(type(self))
        twin.__setstate__(self.__getstate__())
        return twin

    def __getstate__(self) -> dict[str, Any]:
        """A copy of all but the lock, which belongs to a process; wire and wall never change, and are shared."""
        state = {name: value for name, value in vars(self).items() if name not in ("_lock", "_way")}
        self._hold()
        try:
            return copy.deepcopy(state, {id(shared): shared for shared in (self.wire, self.wall)})
        finally:
            self._release()

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Go on from a checkpoint."""
        vars(self).update(state, _lock=threading.Lock(), _way=object())

    def _go(self, depth: float, roll: float) -> Solution:
        """Step until the depth is reached or no step succeeds."""
        work = self._work
        work.counts.fill(0)
        refused = Status.TOO_LONG if depth >= self._too_long else self._refused
        if refused is not None:
            # nothing moves: what the last depth took is not this one's, too
            work.place["rubbed"] = work.place["dissipated"] = work.place["snaps"] = 0
            return work.solution(refused, 0, self.depth_mm, self.roll_deg)
        status, iterations = work.advance(depth, roll) if self._near[0] else self._advance_far(depth, roll)
        return work.solution(status, iterations, self.depth_mm, self.roll_deg)

    def _advance_far(self, depth: float, roll: float) -> tuple[Status, int]:
        """Go to a depth and roll that may be far from here."""
        here = Goal(self.depth_mm, self.roll_deg, self.catheter_mm)
        return advance(self._work, here, Goal(depth, roll, float(self._work.place["goal"][0])))


def _reach(wire: GuideWire) -> Range:
    """Depths that may be asked for: beyond them no memory holds the wire."""
    deepest = min(tol.MOST_JOINTS * wire.segment_mm, LENGTH_MM.largest)
    return Range(0.0, deepest, "arc lengths from the entry, in mm; longer segments for a longer wire")


def _steps(step_mm: float, roll_step_deg: float, finest_mm: float, *, rubs: bool) -> tuple[float, float, float]:
    """The longest step and roll, and the finest step, each a number that can be used. rubs : friction moves the tip."""
    step = number("insertion", "step_mm", step_mm, LENGTH_MM)
    turn = number("insertion", "roll_step_deg", roll_step_deg, ROLL_STEP_DEG)
    finest = number("insertion", "finest_mm", finest_mm, FINEST_MM)
    if rubs:
        # steps that may be taken again in shorter ones still may
        finest = finest if finest >= step else min(finest, 0.5 * RUBBING_STEP_MM)
        step, turn = min(step, RUBBING_STEP_MM), min(turn, RUBBING_TURN_DEG)
    return step, turn, finest


def _each_of(name: str, values: float | Sequence[float], allowed: Range, count: int) -> list[float]:
    """A list of ``count`` numbers, one per depth, from one number for all or from a list of them."""
    if not listed(values):
        return [number("insertion", name, values, allowed)] * count
    each = _list(name, values, allowed)
    if len(each) != count:
        refuse("insertion", name, each, f"one number, or {count} as there are depths", "one per depth")
    return each


def _list(name: str, values: Iterable[float], allowed: Range) -> list[float]:
    """A list of numbers, each checked by itself: numpy would turn a truth value among them into 1.0."""
    if isinstance(values, np.ndarray):
        return [float(v) for v in numbers("insertion", name, values, (None,), allowed)]
    return [number("insertion", name, value, allowed) for value in values]
