"""Insertion: the base is pushed and rolled in small steps and the wire relaxed after each of them.

Several minima exist, so a depth is reached by replaying its history, never by jumping to it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver import _tolerances as tol
from solver._kernels.energy import Switch
from solver._kernels.follow import follow
from solver._kernels.minimise import blocked
from solver.chain import ALL_SKIPS, base_frame, unit
from solver.relax import Settings, buffers_for, minimise_buffers, solution_of
from solver.solution import Solution
from solver.status import Status
from solver.wall import VesselWall
from solver.wire import GuideWire

Array = NDArray[np.float64]


class Insertion:
    """A wire, clamped at the entry and tangent to entry_direction, pushed into a lumen step after step.

    entry_mm : (3,) LPS mm.     entry_direction, material_axis : (3,) LPS, any length; at roll 0 material axis 1
    points along material_axis (default: the world axis least aligned with entry_direction, made orthogonal).
    method : "newton" or "closed_form".     initial : "slide" (material moves along the wire's own curve) or
    "translate" (the seed's section 4.1).     step_mm, roll_step_deg : longest step.
    tolerance, max_iterations : of one relaxation.     max_joints : longest wire accepted.
    tip : "integrated" (the wall under the last segment is integrated) or "joint" (its tip joint alone).
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
        tip: str = "integrated",
        switch: Switch = ALL_SKIPS,
    ) -> None:
        self.settings = Settings(method, tolerance, max_iterations, tip, switch)
        if initial not in ("slide", "translate"):
            msg = f"insertion: initial: got {initial!r}; allowed: 'slide', 'translate'; slide is the default"
            raise ValueError(msg)
        for name, value in (
            ("step_mm", step_mm),
            ("roll_step_deg", roll_step_deg),
            ("max_joints", max_joints),
        ):
            if not (math.isfinite(value) and value > 0):
                msg = f"insertion: {name}: got {value!r}; allowed: a positive number; leave it out for the default"
                raise ValueError(msg)
        self.entry = np.array(entry_mm, dtype=np.float64)
        if self.entry.shape != (3,) or not np.all(np.isfinite(self.entry)):
            msg = f"insertion: entry_mm: got {entry_mm!r}; allowed: three finite numbers; give LPS mm"
            raise ValueError(msg)
        self.wire, self.wall, self.initial = wire, wall, initial
        self.direction = unit(entry_direction, "entry_direction")
        self.material_axis = material_axis
        base_frame(self.direction, material_axis, 0.0)
        self.step_mm, self.roll_step_deg, self.max_joints = step_mm, roll_step_deg, max_joints
        self.buffers = buffers_for(wire, wall, self.settings)
        self.depth_mm, self.roll_deg = 0.0, 0.0
        self._shrink = 1.0
        self._energy = 0.0
        self._started = False
        self.buffers.state.x[:, 0] = self.entry
        self.buffers.state.r[:, 0] = base_frame(self.direction, material_axis, 0.0)

    def to_depths(
        self, depths_mm: Iterable[float], roll_deg: float | Sequence[float] = 0.0
    ) -> Iterator[Solution]:
        """Push (or pull) the tip to each depth in turn and yield the wire there.

        depths_mm : arc lengths from the entry to the tip, 0 or more.     roll_deg : of the base, one for all or
        one per depth. A depth that cannot be reached yields the last good state with its own depth and a status.
        """
        depths = [float(d) for d in depths_mm]
        rolls = np.broadcast_to(np.asarray(roll_deg, dtype=np.float64), len(depths))
        for depth, roll in zip(depths, rolls, strict=True):
            if not (math.isfinite(depth) and depth >= 0 and math.isfinite(roll)):
                msg = f"insertion: to_depths: got depth {depth!r} mm, roll {roll!r} deg; allowed: finite, depth >= 0; "
                raise ValueError(msg + "depths count from the entry")
        for depth, roll in zip(depths, rolls, strict=True):
            yield self._go(depth, float(roll))

    def _go(self, depth: float, roll: float) -> Solution:
        self.buffers.counter[:] = 0
        if not self._started:
            # a wire that is not yet in the lumen has no history: it starts at its first roll
            self.roll_deg, self._started = roll, True
        status = self._refusal(depth)
        iterations = 0
        shrink = self._shrink
        while status is Status.CONVERGED:
            ahead, turn = depth - self.depth_mm, roll - self.roll_deg
            if abs(ahead) < tol.MATCH_DEPTH_MM and turn == 0.0:
                break
            fraction = min(1.0, shrink * self._allowed(ahead, turn))
            outcome, used = self._try(ahead, turn, fraction)
            iterations += used
            if outcome is Status.CONVERGED:
                shrink = min(1.0, 2 * shrink)
            elif shrink > tol.SMALLEST_STEP and outcome is not Status.LEFT_GRID:
                shrink *= 0.5
            else:
                status = outcome
        self._shrink = max(shrink, 8 * tol.SMALLEST_STEP)
        return solution_of(self.buffers, status, iterations, self._energy, self.depth_mm, self.roll_deg)

    def _refusal(self, depth: float) -> Status:
        """A status for depths that need not be tried."""
        if self.wire.segments_at(depth)[0] > self.max_joints:
            return Status.TOO_LONG
        if self.wall is not None:
            diagonal = float(np.linalg.norm(self.wall.distance.spacing_mm))
            if self.wall.look_up(self.entry)[0][0] > tol.ENTRY_MARGIN_VOXELS * diagonal:
                return Status.ENTRY_OUTSIDE
        return Status.CONVERGED

    def _allowed(self, ahead: float, turn: float) -> float:
        """Fraction of the way that one step may take: step_mm, roll_step_deg, and what the tip can see."""
        fraction = 1.0
        if turn and not self.wire.straight:
            fraction = min(fraction, self.roll_step_deg / abs(turn))
        if ahead:
            step = min(self.step_mm, abs(ahead))
            if ahead > 0:
                step = self._free_way(step)
            fraction = min(fraction, step / abs(ahead))
        return fraction

    def _free_way(self, step: float) -> float:
        """How far the tip may go straight on: until it is half a radius deeper in the wall than it is now."""
        b = self.buffers
        if self.wall is None:
            return step
        tip, along = b.state.x[0, b.k], b.state.r[0, b.k, :, 2]
        count = 1 + math.ceil(2 * step / b.spacing)
        at = np.linspace(0.0, step, count + 1)
        phi = self.wall.look_up(tip + at[:, None] * along)[0]
        rise = max(0.5 * self.wire.radius_mm, 0.25 * b.spacing)
        limit = max(0.0, float(phi[0]) + rise)
        free = step
        over = np.flatnonzero(phi > limit)
        if over.size:
            i = int(over[0])
            free = float(np.interp(limit, phi[i - 1 : i + 1], at[i - 1 : i + 1])) if i else rise
        end = tip + free * along
        free *= blocked(b.field, tip, end, free, b.spacing, b.scratch)
        return max(free, min(step, 0.5 * rise))

    def _try(self, ahead: float, turn: float, fraction: float) -> tuple[Status, int]:
        """Take a step; on failure put everything back. Returns its status and iterations."""
        b = self.buffers
        before = (b.k, b.first_mm, b.parts.copy(), b.report.copy(), self._energy)
        n = b.k + 1
        kept = [
            a[0, :m].copy()
            for a, m in zip(b.state, (b.k, n, n, *(2 * (len(b.state.depth[0]),))), strict=True)
        ]
        depth = self.depth_mm + fraction * ahead if fraction < 1.0 else self.depth_mm + ahead
        roll = self.roll_deg + fraction * turn if fraction < 1.0 else self.roll_deg + turn
        curve = self._curve(depth - self.depth_mm)
        b.lay_out(depth)
        b.state.r[:, 0] = base_frame(self.direction, self.material_axis, roll)
        b.state.x[:, 0] = self.entry
        if b.k:
            follow(curve, len(curve), b.chain, b.state.u[0], b.state.x[0], b.state.r[0], b.k)
            status, iterations, energy = minimise_buffers(b, self.settings)
        else:
            status, iterations, energy = Status.CONVERGED, 0, 0.0
        if status is Status.CONVERGED and self._left_grid():
            status = Status.LEFT_GRID
        if status is Status.CONVERGED:
            self.depth_mm, self.roll_deg, self._energy = depth, roll, energy
            return status, iterations
        b.lay_out(self.depth_mm)
        for a, was in zip(b.state, kept, strict=True):
            a[0, : len(was)] = was
        b.parts[:], b.report[:], self._energy = before[2], before[3], before[4]
        return status, iterations

    def _curve(self, ahead: float) -> Array:
        """The polyline that the wire is laid along before it relaxes."""
        b = self.buffers
        joints: Array = b.state.x[0, : b.k + 1].copy()
        if b.k == 0:
            return np.array([self.entry, self.entry + self.direction])
        if self.initial == "translate":
            moved = joints + ahead * self.direction
            if ahead >= 0:
                return np.vstack([self.entry, moved]) if ahead > 0 else moved
            arcs = self.wire.arcs_at(self.depth_mm)
            return np.vstack([self.entry, moved[arcs > -ahead]])
        return joints

    def _left_grid(self) -> bool:
        if self.wall is None:
            return False
        b = self.buffers
        beyond = self.wall.beyond_grid(b.state.x[0, 1 : b.k + 1])
        return bool(beyond.size and beyond.max() > self.wire.radius_mm)
