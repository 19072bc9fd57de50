"""A wire in memory: the arrays that the kernels work on, grown as the wire goes in."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver._kernels.energy import COUNTERS, Scratch, State, Switch
from solver._kernels.layout import Chain, Rule, empty_chain, lay_out, tabulate
from solver._kernels.spline import Field
from solver.wall import VesselWall
from solver.wire import GuideWire

Array = NDArray[np.float64]

ALL_SKIPS = Switch(clearance=True, cheap=True, idle=True, window=True)


def unit(vector: ArrayLike, name: str) -> Array:
    """The direction of a 3-vector; ValueError where it has none."""
    v = np.asarray(vector, dtype=np.float64)
    size = float(np.linalg.norm(v)) if v.shape == (3,) else 0.0
    if not (np.isfinite(size) and size > 0):
        msg = f"insertion: {name}: got {np.asarray(vector).tolist()}; allowed: three finite numbers, not all 0; "
        raise ValueError(msg + "give a direction in LPS, e.g. [0.0, 0.0, 1.0]")
    return v / size


def base_frame(direction: Array, material_axis: ArrayLike | None, roll_deg: float) -> Array:
    """Columns: material axes 1 and 2 and the direction of the wire at the entry, rolled right-handed about it."""
    if material_axis is None:
        axis = np.zeros(3)
        axis[int(np.argmin(np.abs(direction)))] = 1.0
    else:
        axis = unit(material_axis, "material_axis")
    across = axis - direction * float(axis @ direction)
    if float(np.linalg.norm(across)) < 1e-6:
        msg = f"insertion: material_axis: got {axis.tolist()}, parallel to entry_direction {direction.tolist()}; "
        raise ValueError(msg + "allowed: any other direction; leave it out for the default")
    one = unit(across, "material_axis")
    two = np.cross(direction, one)
    roll = np.deg2rad(roll_deg)
    first = np.cos(roll) * one + np.sin(roll) * two
    return np.column_stack([first, np.cross(direction, first), direction])


def no_field() -> Field:
    """A stand-in where there is no wall; it is never looked up."""
    return Field(np.zeros((4, 4, 4), dtype=np.float32), np.eye(3), np.zeros(3), 0.0, 0.0)


class Buffers:
    """Room for a chain of up to ``capacity`` segments, and the chain of the moment."""

    def __init__(self, wire: GuideWire, wall: VesselWall | None, rule: Rule) -> None:
        self.wire = wire
        self.rule = rule
        self.field = wall.field if wall is not None else no_field()
        self.stiffness = wall.stiffness_N_mm2 if wall is not None else 0.0
        self.spacing = float(wall.distance.spacing_mm.min()) if wall is not None else 1.0
        self.k = 0
        self.first_mm = 0.0
        self.counter = np.zeros(COUNTERS, dtype=np.int64)
        self.report = np.zeros(12)
        self.parts = np.zeros(3)
        self.capacity = 0
        self.grow(16)

    def grow(self, capacity: int) -> None:
        """Make room for more segments, keeping the current state."""
        points = len(self.rule.hull) * (capacity + len(self.rule.tip_at))
        chain = empty_chain(capacity, points, self.rule.reach)
        state = State(
            u=np.zeros((2, capacity, 3)),
            x=np.zeros((2, capacity + 1, 3)),
            r=np.zeros((2, capacity + 1, 3, 3)),
            depth=np.zeros((2, points)),
            jet=np.zeros((2, points, 10)),
        )
        scratch = Scratch(
            gain=np.zeros((capacity, 3, 7)),
            anchor=np.ones((points, 4)),
            counter=self.counter,
            fraction=np.zeros(6),
            weights=np.zeros((3, 3, 4)),
        )
        if self.capacity:
            k, old = self.k, self.state
            for new, was in ((state.u, old.u), (state.x, old.x), (state.r, old.r)):
                new[:, : was.shape[1]] = was
            del k
        self.chain: Chain = chain
        self.state: State = state
        self.scratch: Scratch = scratch
        self.table = np.zeros((capacity + 1, 2))
        tabulate(self.wire.profile, self.wire.segment_mm, self.table)
        self.capacity = capacity

    def lay_out(self, depth_mm: float) -> None:
        """Cut the wire at a depth into segments."""
        k, first = self.wire.segments_at(depth_mm)
        if k > self.capacity:
            self.grow(max(2 * self.capacity, k))
        self.k, self.first_mm = k, first
        if k:
            lay_out(self.chain, self.wire.profile, self.rule, self.table, k, first, self.wire.segment_mm)
