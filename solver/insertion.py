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


class Insertion:
    """A wire, clamped at the entry and tangent to entry_direction, pushed into a lumen step after step.

    entry_mm : (3,) LPS mm.     entry_direction, material_axis : (3,) LPS, any length; at roll 0 material axis 1
    points along material_axis (default: the world axis least aligned with entry_direction, made orthogonal).
    method : "newton" or "closed_form".     initial : "slide" (material moves along the wire's own curve) or
    "translate" (the seed's section 4.1).     step_mm, roll_step_deg : longest step.
    tolerance, max_iterations, quadrature : see ``solver.relax.Settings``.     max_joints : longest wire accepted.
    tip_load_N : (3,) dead force on the tip.
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
    ) -> None:
        settings = Settings(method, tolerance, max_iterations, quadrature)
        if initial not in ("slide", "translate"):
            refuse("insertion", "initial", initial, "slide, translate", "slide is the default")
        positive = {"step_mm": step_mm, "roll_step_deg": roll_step_deg, "max_joints": max_joints}
        for name, value in positive.items():
            if not (math.isfinite(value) and value > 0):
                refuse("insertion", name, value, "a positive number", "leave it out for the default")
        self.wire, self.wall, self.max_joints = wire, wall, max_joints
        self.work = Workspace(wire, wall, settings.quadrature, settings.limits)
        frame = base_frame(unit(entry_direction, "entry_direction"), material_axis, 0.0)
        entry, load = vector("entry_mm", entry_mm), vector("tip_load_N", tip_load_N)
        self.work.clamp(entry, frame, load, initial == "translate", step_mm, roll_step_deg)
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
        return float(self.work.place["inserted"][0])

    @property
    def roll_deg(self) -> float:
        """Where the base is turned to."""
        return float(self.work.place["roll"][0])

    def to_depths(self, depths_mm: Iterable[float], roll_deg: float | Sequence[float] = 0.0) -> Iterator[Solution]:
        """Push (or pull) the tip to each depth in turn and yield the wire there.

        depths_mm : arc lengths from the entry to the tip, 0 or more.     roll_deg : of the base, one for all or
        one per depth. A depth that cannot be reached yields the last good state with its own depth and a status.
        """
        goals = self.goals(depths_mm, roll_deg)
        self.get_ready(*goals)
        for depth, roll in zip(*goals, strict=True):
            yield self._go(depth, roll)

    def goals(self, depths_mm: Iterable[float], roll_deg: float | Sequence[float]) -> tuple[list[float], list[float]]:
        """Depths and a roll for each, or a refusal of what cannot be reached."""
        depths = [float(d) for d in depths_mm]
        if isinstance(roll_deg, float | int):
            # as most ask; to broadcast it takes 5 µs of the 100 of a step
            rolls = [float(roll_deg)] * len(depths)
        else:
            rolls = [float(r) for r in np.broadcast_to(np.asarray(roll_deg, dtype=np.float64), len(depths))]
        for depth, roll in zip(depths, rolls, strict=True):
            if not (math.isfinite(depth) and depth >= 0 and math.isfinite(roll)):
                allowed = "finite depths >= 0 and rolls"
                refuse("insertion", "to_depths", (depth, roll), allowed, "mm from the entry")
        return depths, rolls

    def get_ready(self, depths: Sequence[float], rolls: Sequence[float]) -> None:
        """Make room for all of the way at once."""
        self.work.reserve(max((d for d in depths if d < self._too_long), default=0.0))
        if rolls and not self._started:
            # a wire that is not yet in the lumen has no history: it starts at its first roll
            self.work.place["roll"], self._started = rolls[0], True

    def reaches(self, depth_mm: float) -> bool:
        """Whether the wire can be tried at a depth at all."""
        return depth_mm < self._too_long and not self._outside

    def _go(self, depth: float, roll: float) -> Solution:
        """Step until the depth is reached or no step succeeds."""
        work = self.work
        work.counts.fill(0)
        if self.reaches(depth):
            status, iterations = work.advance(depth, roll)
        else:
            status, iterations = Status.ENTRY_OUTSIDE if self._outside else Status.TOO_LONG, 0
        return work.solution(status, iterations)
