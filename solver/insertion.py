"""Insertion: the base is pushed and rolled in small steps and the wire relaxed after each of them.

Several minima exist, so a depth is reached by replaying its history, never by jumping to it.
"""

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from solver import _tolerances as tol
from solver.errors import refuse
from solver.relax import Settings, base_frame, unit, vector
from solver.solution import Solution, Status
from solver.wall import VesselWall
from solver.wire import GuideWire
from solver.workspace import Workspace


def _check(numbers: dict[str, float], allowed: str, zero: bool = False) -> None:
    """Refuse the first number that is negative or not finite, or 0 unless ``zero`` is allowed."""
    for name, value in numbers.items():
        if not (math.isfinite(value) and (value > 0 or (zero and value == 0))):
            refuse("insertion", name, value, allowed, "leave it out for the default")


class Insertion:
    """A wire, clamped at the entry and tangent to entry_direction, pushed into a lumen step after step.

    entry_mm : (3,) LPS mm.     entry_direction, material_axis : (3,) LPS, any length; at roll 0 material axis 1
    points along material_axis (default: the world axis least aligned with entry_direction, made orthogonal).
    method : "newton" or "closed_form".     initial : "slide" (material moves along the wire's own curve) or
    "translate" (the seed's section 4.1).     step_mm, roll_step_deg : longest step.
    tolerance, max_iterations, quadrature : see ``solver.relax.Settings``.     max_joints : longest wire accepted.
    tip_load_N : (3,) dead force on the tip.
    shaft_mm : length of wire between the hand and the entry, the same at every depth: it twists by GJ, and the tip is
    behind the hand.     shaft_friction_N : what it takes to slide or turn that shaft, force at its surface.
    Raises ValueError for arguments that cannot be used; whatever happens on the way is a Status.
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
        max_joints: int = 20_000,
        quadrature: str = "tip",
        tip_load_N: ArrayLike = (0.0, 0.0, 0.0),
        shaft_mm: float = 0.0,
        shaft_friction_N: float = 0.0,
    ) -> None:
        settings = Settings(method, tolerance, max_iterations, quadrature)
        if initial not in ("slide", "translate"):
            refuse("insertion", "initial", initial, "slide, translate", "slide is the default")
        _check({"step_mm": step_mm, "roll_step_deg": roll_step_deg, "max_joints": max_joints}, "a positive number")
        _check({"shaft_mm": shaft_mm, "shaft_friction_N": shaft_friction_N}, "0 or more", zero=True)
        self.wire, self.wall, self.max_joints = wire, wall, max_joints
        self._work = Workspace(wire, wall, settings.quadrature, settings.limits, shaft_mm, shaft_friction_N)
        frame = base_frame(unit(entry_direction, "entry_direction"), material_axis, 0.0)
        entry, load = vector("entry_mm", entry_mm), vector("tip_load_N", tip_load_N)
        self._work.clamp(entry, frame, load, initial == "translate", step_mm, roll_step_deg)
        self._started = False
        # the depth at which ``segments_at`` counts one joint too many
        self._too_long = (max_joints + 0.5 - 1e-12) * wire.segment_mm
        self._outside = False
        if wall is not None:
            margin = tol.ENTRY_MARGIN_VOXELS * float(np.linalg.norm(wall.distance.spacing_mm))
            self._outside = bool(wall.look_up(entry)[0][0] > margin)

    @property
    def depth_mm(self) -> float:
        """Where the tip is, mm of wire beyond the entry."""
        return float(self._work.place["inserted"][0])

    @property
    def roll_deg(self) -> float:
        """Where the base is turned to."""
        return float(self._work.place["roll"][0])

    def to_depths(self, depths_mm: Iterable[float], roll_deg: float | Sequence[float] = 0.0) -> Iterator[Solution]:
        """Push (or pull) the tip to each depth in turn and yield the wire there.

        depths_mm : arc lengths from the entry to the tip, 0 or more.     roll_deg : of the base, one for all or
        one per depth. A depth that cannot be reached yields the last good state with its own depth and a status.
        """
        depths = [float(d) for d in depths_mm]
        rolls = [float(r) for r in np.broadcast_to(np.asarray(roll_deg, dtype=np.float64), len(depths))]
        for depth, roll in zip(depths, rolls, strict=True):
            if not (math.isfinite(depth) and depth >= 0 and math.isfinite(roll)):
                allowed = "finite depths >= 0 and rolls"
                refuse("insertion", "to_depths", (depth, roll), allowed, "mm from the entry")
        # room for all of it at once
        self._work.reserve(max((d for d in depths if d < self._too_long), default=0.0))
        for depth, roll in zip(depths, rolls, strict=True):
            yield self._go(depth, roll)

    def _go(self, depth: float, roll: float) -> Solution:
        """Step until the depth is reached or no step succeeds."""
        work = self._work
        work.counts.fill(0)
        if not self._started:
            # a wire that is not yet in the lumen has no history: it starts at its first roll
            work.place["roll"], self._started = roll, True
        if depth >= self._too_long:
            status, iterations = Status.TOO_LONG, 0
        elif self._outside:
            status, iterations = Status.ENTRY_OUTSIDE, 0
        else:
            status, iterations = work.advance(depth, roll)
        return work.solution(status, iterations, self.depth_mm, self.roll_deg)
