"""Insertion: the base is pushed and rolled in small steps and the wire relaxed after each of them.

Several minima exist, so a depth is reached by replaying its history, never by jumping to it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver import _tolerances as tol
from solver._kernels.follow import follow
from solver._kernels.forces import copy_state, furthest_outside
from solver._kernels.passage import free_way
from solver._kernels.problem import ROLLS, Switch
from solver.chain import base_frame, unit
from solver.errors import refuse
from solver.relax import Settings, anchor_friction, buffers_for, relax_buffers, solution_of
from solver.solution import Solution
from solver.status import Status
from solver.wall import VesselWall
from solver.wire import GuideWire

Array = NDArray[np.float64]

LAST_GOOD = 2
"""Where the state before a step is kept."""
FINAL = (Status.LEFT_GRID, Status.NON_FINITE)
"""Outcomes that a shorter step cannot help."""


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
        switch: Switch | None = None,
    ) -> None:
        self.settings = Settings(method, tolerance, max_iterations, quadrature, switch or Switch())
        if initial not in ("slide", "translate"):
            refuse("insertion", "initial", initial, "slide, translate", "slide is the default")
        for name, value in (
            ("step_mm", step_mm),
            ("roll_step_deg", roll_step_deg),
            ("max_joints", max_joints),
        ):
            if not (math.isfinite(value) and value > 0):
                refuse("insertion", name, value, "a positive number", "leave it out for the default")
        self.entry = _vector("entry_mm", entry_mm)
        self.tip_load = _vector("tip_load_N", tip_load_N)
        self.wire, self.wall, self.initial = wire, wall, initial
        self.direction = unit(entry_direction, "entry_direction")
        self.material_axis = material_axis
        self.step_mm, self.roll_step_deg, self.max_joints = step_mm, roll_step_deg, max_joints
        self.buffers = buffers_for(wire, wall, self.settings)
        self.depth_mm, self.roll_deg = 0.0, 0.0
        self._rise = max(tol.RISE_RADII * wire.radius_mm, 0.25 * self.buffers.spacing)
        self._shrink, self._energy, self._started = 1.0, 0.0, False
        self.buffers.state.x[:, 0] = self.entry
        self._base_roll, self._base_frame = 0.0, base_frame(self.direction, material_axis, 0.0)
        self.buffers.state.r[:, 0] = self._base_frame
        self._outside = wall is not None and self._entry_is_outside(wall)

    def to_depths(
        self, depths_mm: Iterable[float], roll_deg: float | Sequence[float] = 0.0
    ) -> Iterator[Solution]:
        """Push (or pull) the tip to each depth in turn and yield the wire there.

        depths_mm : arc lengths from the entry to the tip, 0 or more.     roll_deg : of the base, one for all or
        one per depth. A depth that cannot be reached yields the last good state with its own depth and a status.
        """
        depths = [float(d) for d in depths_mm]
        rolls = [float(r) for r in np.broadcast_to(np.asarray(roll_deg, dtype=np.float64), len(depths))]
        for depth, roll in zip(depths, rolls, strict=True):
            if not (math.isfinite(depth) and depth >= 0 and math.isfinite(roll)):
                refuse(
                    "insertion",
                    "to_depths",
                    (depth, roll),
                    "finite depths >= 0 and rolls",
                    "mm from the entry",
                )
        for depth, roll in zip(depths, rolls, strict=True):
            yield self._go(depth, roll)

    def _go(self, depth: float, roll: float) -> Solution:
        """Step until the depth is reached or no step succeeds."""
        self.buffers.counter[:] = 0
        if not self._started:
            # a wire that is not yet in the lumen has no history: it starts at its first roll
            self.roll_deg, self._started = roll, True
        status, iterations, shrink = self._refusal(depth), 0, self._shrink
        budget = self._budget(depth - self.depth_mm, roll - self.roll_deg)
        while status is Status.CONVERGED:
            if self._roll_is_idle and self.roll_deg != roll:
                self.roll_deg = roll
                self.buffers.counter[ROLLS] += 1
            ahead, turn = depth - self.depth_mm, roll - self.roll_deg
            if abs(ahead) < tol.MATCH_DEPTH_MM and turn == 0.0:
                break
            outcome, used = self._try(ahead, turn, min(1.0, shrink * self._allowed(ahead, turn)))
            iterations += used
            if iterations > budget:
                status = Status.MAX_ITERATIONS
            elif outcome is Status.CONVERGED:
                shrink = min(1.0, 2 * shrink)
            elif shrink > tol.SMALLEST_STEP and outcome not in FINAL:
                shrink *= 0.5
            else:
                status = outcome
        self._shrink = max(shrink, 8 * tol.SMALLEST_STEP)
        return solution_of(self.buffers, status, iterations, self._energy, self.depth_mm, self.roll_deg)

    def _budget(self, ahead: float, turn: float) -> float:
        """Iterations that one depth may spend: a cap on the time that a hopeless scene can take."""
        steps = abs(ahead) / self.step_mm + abs(turn) / self.roll_step_deg
        each = self.settings.max_iterations
        if self.settings.method == "closed_form":
            each *= tol.SWEEPS_PER_ITERATION
        return each * (tol.BUDGET_STEPS + 4 * steps)

    def _refusal(self, depth: float) -> Status:
        """A status for depths that need not be tried."""
        if self.wire.segments_at(depth)[0] > self.max_joints:
            return Status.TOO_LONG
        return Status.ENTRY_OUTSIDE if self._outside else Status.CONVERGED

    @property
    def _roll_is_idle(self) -> bool:
        """Rolling a straight wire with one bending stiffness and a round hull changes nothing."""
        round_hull = self.wall is None or self.wall.samples == 0
        return self.wire.straight and round_hull and self.settings.switch.roll

    def _entry_is_outside(self, wall: VesselWall) -> bool:
        """Whether the entry point lies more than a voxel outside the lumen."""
        diagonal = float(np.linalg.norm(wall.distance.spacing_mm))
        return bool(wall.look_up(self.entry)[0][0] > tol.ENTRY_MARGIN_VOXELS * diagonal)

    def _allowed(self, ahead: float, turn: float) -> float:
        """Fraction of the way that one step may take: step_mm, roll_step_deg, and what the tip can see."""
        fraction = 1.0
        if turn:
            fraction = min(fraction, self.roll_step_deg / abs(turn))
        if ahead:
            step = min(self.step_mm, abs(ahead))
            b = self.buffers
            if ahead > 0 and b.stiffness:
                tip, along = b.state.x[0, b.k], b.state.r[0, b.k, :, 2]
                step = free_way(b.field, tip, along, step, b.spacing, self._rise, b.problem.scratch.weights)
            fraction = min(fraction, step / abs(ahead))
        return fraction

    def _try(self, ahead: float, turn: float, fraction: float) -> tuple[Status, int]:
        """Take a step; on failure put everything back. Returns its status and iterations."""
        b = self.buffers
        copy_state(b.problem, 0, LAST_GOOD, b.k)
        report, kept = b.report.copy(), b.k
        depth, roll = self.depth_mm + fraction * ahead, self.roll_deg + fraction * turn
        if fraction == 1.0:
            depth, roll = self.depth_mm + ahead, self.roll_deg + turn
        status, iterations, energy = self._relax_at(depth, roll)
        if status is Status.CONVERGED and b.stiffness:
            beyond = furthest_outside(b.field, b.state.x[0], b.k)
            status = Status.LEFT_GRID if beyond > self.wire.radius_mm else status
        if status is Status.CONVERGED:
            self.depth_mm, self.roll_deg, self._energy = depth, roll, energy
        else:
            b.lay_out(self.depth_mm)
            copy_state(b.problem, LAST_GOOD, 0, kept)
            b.report[:] = report
        return status, iterations

    def _relax_at(self, depth: float, roll: float) -> tuple[Status, int, float]:
        """Lay the wire along its own curve at a new depth and roll, and relax it there."""
        b = self.buffers
        before = b.state.x[0, : b.k + 1].copy()
        curve, was = self._curve(before, depth - self.depth_mm), b.k
        b.lay_out(depth)
        b.state.r[:, 0] = self._base(roll)
        b.state.x[:, 0] = self.entry
        if b.k == 0:
            b.report[:], b.state.parts[:] = 0.0, 0.0
            return Status.CONVERGED, 0, 0.0
        if b.problem.twisting:
            self._keep_twist(was)
        b.chain.load[: b.k] = 0.0
        b.chain.load[b.k] = self.tip_load
        follow(curve, len(curve), b.chain, b.state.u[0], b.state.x[0], b.state.r[0], b.k)
        anchor_friction(b, before, depth - self.depth_mm)
        return relax_buffers(b, self.settings)

    def _base(self, roll: float) -> Array:
        """The base frame at a roll, computed once as long as the roll stays."""
        if roll != self._base_roll:
            self._base_roll, self._base_frame = roll, base_frame(self.direction, self.material_axis, roll)
        return self._base_frame

    def _keep_twist(self, was: int) -> None:
        """Twist stays with the material, which is counted from the tip."""
        b = self.buffers
        twist = b.state.u[0, :was, 2].copy()
        b.state.u[0, : b.k, 2] = 0.0
        common = min(was, b.k)
        if common:
            b.state.u[0, b.k - common : b.k, 2] = twist[was - common :]

    def _curve(self, joints: Array, ahead: float) -> Array:
        """The polyline that the wire is laid along before it relaxes."""
        if len(joints) == 1:
            return np.array([self.entry, self.entry + self.direction])
        if self.initial == "slide" or ahead == 0.0:
            return joints
        moved = joints + ahead * self.direction
        kept = moved if ahead > 0 else moved[self.wire.arcs_at(self.depth_mm) > -ahead]
        return (
            np.vstack([self.entry, kept])
            if len(kept)
            else np.array([self.entry, self.entry + self.direction])
        )


def _vector(name: str, value: ArrayLike) -> Array:
    vector = np.array(value, dtype=np.float64)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)):
        refuse("insertion", name, value, "three finite numbers", "LPS, in the unit of its name")
    return vector
