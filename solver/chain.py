"""A wire in memory: the arrays that the kernels work on, grown as the wire goes in."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver import _tolerances as tol
from solver._kernels.chain import Chain, Cut, Rule, empty_chain, lay_out, tabulate
from solver._kernels.data import COUNTERS, REPORT, Friction, Problem, Scratch, State, Switch
from solver._kernels.field import Field
from solver.errors import refuse
from solver.wall import VesselWall
from solver.wire import GuideWire

Array = NDArray[np.float64]


def unit(vector: ArrayLike, name: str) -> Array:
    """The direction of a 3-vector; ValueError where it has none."""
    v = np.asarray(vector, dtype=np.float64)
    size = float(np.linalg.norm(v)) if v.shape == (3,) else 0.0
    if not (np.isfinite(size) and size > 0):
        refuse("insertion", name, np.asarray(vector).tolist(), "three finite numbers, not all 0", "give LPS")
    return v / size


def base_frame(direction: Array, material_axis: ArrayLike | None, roll_deg: float) -> Array:
    """Columns: material axes 1 and 2 and the direction of the wire at the entry, rolled right-handed about it."""
    if material_axis is None:
        axis = np.zeros(3)
        axis[int(np.argmin(np.abs(direction)))] = 1.0
    else:
        axis = unit(material_axis, "material_axis")
    across = axis - direction * float(axis @ direction)
    if float(np.linalg.norm(across)) < tol.PARALLEL:
        refuse(
            "insertion",
            "material_axis",
            axis.tolist(),
            "not along entry_direction",
            "leave it out for the default",
        )
    one = across / float(np.linalg.norm(across))
    two = _cross(direction, one)
    roll = np.deg2rad(roll_deg)
    first = np.cos(roll) * one + np.sin(roll) * two
    return np.column_stack([first, _cross(direction, first), direction])


def _cross(a: Array, b: Array) -> Array:
    """A x b: numpy's own costs 30 µs for three numbers."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def no_field() -> Field:
    """A stand-in where there is no wall; it is never looked up."""
    return Field(np.zeros((4, 4, 4), dtype=np.float32), np.eye(3), np.zeros(3), 0.0, 0.0)


def empty_state(k: int, points: int) -> State:
    """Three states with room for k segments."""
    return State(
        u=np.zeros((3, k, 3)),
        x=np.zeros((3, k + 1, 3)),
        r=np.zeros((3, k + 1, 3, 3)),
        depth=np.zeros((3, points)),
        jet=np.zeros((3, points, 10)),
        parts=np.zeros((3, 4)),
    )


class Buffers:
    """Room for a chain of up to ``capacity`` segments, and the chain of the moment, in state 0."""

    problem: Problem
    cut: Cut
    force: Array

    def __init__(self, wire: GuideWire, wall: VesselWall | None, rule: Rule, switch: Switch) -> None:
        self.wire, self.wall, self.rule, self.switch = wire, wall, rule, switch
        self.field = wall.field if wall is not None else no_field()
        self.stiffness = wall.stiffness_N_mm2 if wall is not None else 0.0
        self.friction = wall.friction if wall is not None else 0.0
        if wall is not None and not switch.friction:
            self.friction = max(self.friction, tol.NO_FRICTION)
        self.twisting = wire.twists or not switch.twist
        self.profile = wire.profile
        if self.twisting and not wire.twists:
            self.profile = wire.profile._replace(twist=tol.RIGID * float(wire.profile.stiffness.max()))
        self.spacing = float(wall.distance.spacing_mm.min()) if wall is not None else 1.0
        self.k, self.capacity = 0, 0
        self.counter = np.zeros(COUNTERS, dtype=np.int64)
        self.report = np.zeros(REPORT)
        self.grow(16)

    def grow(self, capacity: int) -> None:
        """Make room for more segments, keeping joints, frames and controls of the current state."""
        points = len(self.rule.hull) * (2 * capacity + len(self.rule.tip_at))
        state, change = empty_state(capacity, points), np.zeros((capacity, 3))
        if self.capacity:
            old = self.problem.state
            change[: self.capacity] = self.problem.scratch.change
            for new, was in ((state.u, old.u), (state.x, old.x), (state.r, old.r)):
                new[:, : was.shape[1]] = was
        scratch = Scratch(
            gain=np.zeros((capacity, 3, 7)),
            anchor=np.ones((points, 4)),
            counter=self.counter,
            slide=np.zeros(3),
            weights=np.zeros((3, 3, 4)),
            start=np.zeros((capacity, 3)),
            change=change,
            keep=np.zeros((capacity, 3)),
        )
        rubbing = points if self.friction else 0
        friction = Friction(
            float(self.friction),
            tol.SLIP_MM,
            np.zeros((rubbing, 3)),
            np.zeros((rubbing, 3)),
            np.zeros(rubbing),
        )
        chain = empty_chain(capacity, points, self.rule.reach)
        self.problem = Problem(
            field=self.field,
            stiffness=float(self.stiffness),
            spacing=self.spacing,
            friction=friction,
            chain=chain,
            state=state,
            scratch=scratch,
            switch=self.switch,
            twisting=self.twisting,
            straight=self.rollable and self.switch.direction and not self.twisting,
        )
        table = np.zeros((capacity + 1, 2))
        tabulate(self.profile, self.wire.segment_mm, table)
        self.cut = Cut(self.profile, self.rule, table, float(self.wire.segment_mm), self.switch.profile)
        self.force = np.zeros((capacity + 1, 3))
        self.capacity = capacity

    @property
    def chain(self) -> Chain:
        """Segments, joints and look-up points."""
        return self.problem.chain

    @property
    def state(self) -> State:
        """Controls, joints and frames."""
        return self.problem.state

    @property
    def rollable(self) -> bool:
        """Rolling a straight wire with one bending stiffness and a round hull changes nothing."""
        return self.wire.straight and (self.wall is None or self.wall.samples == 0)

    def reserve(self, depth_mm: float) -> bool:
        """Make sure that there is room for the wire at a depth and one point more; whether that took new arrays."""
        if depth_mm < (self.capacity - 1) * self.wire.segment_mm:
            return False
        self.grow(max(2 * self.capacity, self.wire.segments_at(depth_mm)[0] + 2))
        return True

    def lay_out(self, depth_mm: float) -> None:
        """Cut the wire at a depth into segments."""
        self.reserve(depth_mm)
        self.k, first = self.wire.segments_at(depth_mm)
        if self.k:
            lay_out(self.chain, self.cut, self.k, first)
