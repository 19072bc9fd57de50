"""The true wire: an insertion replayed quasi-statically, millimetre by millimetre, against a wall given as a function.

Nothing here comes from the simulator that is judged: node positions and edge angles instead of joint rotations,
stretch and twist as stiff springs instead of constraints, an assembled banded system instead of a sweep, and the
wall as an analytic distance instead of voxels. What is shared is the physics: bending stiffness and rest curvature
as functions of the distance from the tip, a wall energy of half k d squared per mm, a clamp at the entry.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from data_synthetic._tolerances import NEWTON_FORCE_N, REPLAY_FORCE_N
from data_synthetic.rod.contact import Wall
from data_synthetic.rod.friction import Held, by_tip, relax_held
from data_synthetic.rod.rod import (
    TIP_EDGES,
    Rod,
    Shape,
    edge_lengths,
    make_rod,
    relax,
    shape_from_points,
)
from data_synthetic.rod.wire import TrueWire

Array = NDArray[np.float64]

ROLL_STEP_DEG = 5.0
"""Largest roll between two equilibria of the replay."""


@dataclass(frozen=True, eq=False)
class Insertion:
    """What is done to the wire: where it enters, what it meets, and how finely that is computed.

    step_mm : node spacing.     advance_mm : insertion between two equilibria (defaults to the node spacing).
    friction : Coulomb's coefficient at the wall; 0 computes nothing.     tip_load_N : a dead load, for closed forms.
    """

    wire: TrueWire
    wall: Wall | None
    stiffness_N_mm2: float
    entry_mm: Array
    direction: Array
    material_axis: Array
    step_mm: float = 0.2
    advance_mm: float | None = None
    friction: float = 0.0
    tip_load_N: Array | None = None


@dataclass(frozen=True, eq=False)
class TrueFrame:
    """The wire at one depth. points_mm (n + 1, 3) from the entry to the tip, contact_N (n + 1, 3).

    anchor_mm (n + 1, 3) : the points of the wall that friction holds the nodes by (the nodes themselves without it).
    residual_N : largest unbalanced nodal force.     jump_mm : largest sideways move of the tip in one advance since the
    last frame, which tells a quiet insertion from one that snapped.
    """

    depth_mm: float
    roll_deg: float
    points_mm: Array
    contact_N: Array
    anchor_mm: Array
    residual_N: float
    jump_mm: float
    iterations: int


def unit(vector: ArrayLike) -> Array:
    """The vector at length one."""
    v = np.asarray(vector, dtype=np.float64)
    return np.asarray(v / np.linalg.norm(v))


def rotate(vector: ArrayLike, axis: ArrayLike, angle_rad: float) -> Array:
    """Right-handed rotation of a vector about an axis (Rodrigues)."""
    v, k = np.asarray(vector, dtype=np.float64), unit(axis)
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.asarray(c * v + s * np.cross(k, v) + (1.0 - c) * float(k @ v) * k)


def normal_to(axis: ArrayLike, direction: ArrayLike) -> Array:
    """The unit part of ``axis`` that is normal to ``direction``."""
    a, d = np.asarray(axis, dtype=np.float64), unit(direction)
    return unit(a - float(a @ d) * d)


def replay(
    insertion: Insertion, depths_mm: Iterable[float], roll_deg: float | Iterable[float] = 0.0
) -> Iterator[TrueFrame]:
    """The wire at each depth, in order: pushed and rolled there in small steps from where it was.

    The roll of a frame is reached linearly on the way to its depth; before the first frame it is that frame's roll.
    """
    depths = [float(d) for d in depths_mm]
    rolls = (
        [float(roll_deg)] * len(depths) if isinstance(roll_deg, int | float) else [float(r) for r in roll_deg]
    )
    depth, roll = min((TIP_EDGES + 2) * insertion.step_mm, depths[0]), rolls[0]
    held = _begin(insertion, depth, roll)
    for target, target_roll in zip(depths, rolls, strict=True):
        jump, effort = 0.0, 0
        for depth_next, roll_next in _path(insertion, depth, target, roll, target_roll):
            before = held.equilibrium.shape.points[-1]
            held = _advance(insertion, held, depth, depth_next, roll_next)
            moved = held.equilibrium.shape.points[-1] - before
            jump = max(jump, float(np.linalg.norm(moved)) - abs(depth_next - depth))
            depth, roll, effort = depth_next, roll_next, effort + held.equilibrium.iterations
        state = held.equilibrium
        held = _settle(
            insertion, _rod(insertion, depth, roll), state.shape, held.anchor, state.contact_N, NEWTON_FORCE_N
        )
        state = held.equilibrium
        yield TrueFrame(
            depth,
            roll,
            state.shape.points,
            state.contact_N,
            held.anchor if insertion.friction else state.shape.points,
            state.residual_N,
            jump,
            effort + state.iterations,
        )


def _begin(insertion: Insertion, depth: float, roll: float) -> Held:
    """The first few edges, straight, relaxed."""
    rod = _rod(insertion, depth, roll)
    straight = np.concatenate([[0.0], np.cumsum(rod.lengths)])
    points = insertion.entry_mm + straight[:, None] * rod.direction
    state = relax(rod, shape_from_points(rod, points), REPLAY_FORCE_N)
    return Held(state, state.shape.points, 0.0)


def _path(
    insertion: Insertion, depth: float, target: float, roll: float, target_roll: float
) -> Iterator[tuple[float, float]]:
    """Depths and rolls on the way from one frame to the next, the last being the target itself."""
    advance = insertion.advance_mm or insertion.step_mm
    count = max(
        int(np.ceil(abs(target - depth) / advance)), int(np.ceil(abs(target_roll - roll) / ROLL_STEP_DEG)), 1
    )
    for i in range(1, count + 1):
        yield depth + (target - depth) * i / count, roll + (target_roll - roll) * i / count


def _rod(insertion: Insertion, depth: float, roll_deg: float) -> Rod:
    direction = unit(insertion.direction)
    director = rotate(normal_to(insertion.material_axis, direction), direction, np.radians(roll_deg))
    rod = make_rod(
        insertion.wire,
        np.asarray(insertion.entry_mm, dtype=np.float64),
        direction,
        director,
        depth,
        insertion.step_mm,
        wall=insertion.wall,
        stiffness_N_mm2=insertion.stiffness_N_mm2,
    )
    if insertion.tip_load_N is None:
        return rod
    loads = np.zeros((len(rod.lengths) + 1, 3))
    loads[-1] = insertion.tip_load_N
    return replace(rod, loads_N=loads)


def _advance(insertion: Insertion, held: Held, old: float, new: float, roll_deg: float) -> Held:
    """Push (or pull) and roll a little, then relax: the guess is the wire slid along its own curve."""
    rod = _rod(insertion, new, roll_deg)
    shape = held.equilibrium.shape
    ends = np.concatenate([[0.0], np.cumsum(edge_lengths(old, insertion.step_mm))])
    arcs = np.concatenate([[0.0], np.cumsum(rod.lengths)])
    start = _slide(rod, shape, ends, arcs)
    if not insertion.friction:
        return _settle(insertion, rod, start, start.points, np.zeros_like(start.points), REPLAY_FORCE_N)
    # where the same material was before, and what it held on to there
    was = _slide(rod, shape, ends, arcs - (new - old)).points
    anchor = was - by_tip(held.offsets(insertion.friction), len(was))
    contact = by_tip(held.equilibrium.contact_N, len(was))
    return _settle(insertion, rod, start, anchor, contact, REPLAY_FORCE_N)


def _settle(
    insertion: Insertion, rod: Rod, start: Shape, anchor: Array, contact_N: Array, force_N: float
) -> Held:
    """The equilibrium under the anchors' friction, where there is any."""
    if insertion.friction:
        return relax_held(rod, start, anchor, contact_N, insertion.friction, force_N)
    return Held(relax(rod, start, force_N), anchor, 0.0)


def _slide(rod: Rod, shape: Shape, ends: Array, arcs: Array) -> Shape:
    """Nodes at new arc lengths on the present curve; beyond its tip straight on."""
    curve = CubicSpline(ends, shape.points, bc_type=((1, rod.direction), (2, np.zeros(3))))
    inside = np.clip(arcs, 0.0, ends[-1])
    tip = unit(curve(ends[-1], 1))
    straight = np.where(arcs[:, None] > 0, tip, rod.direction)  # before the entry it lies in the introducer
    return shape_from_points(rod, curve(inside) + (arcs - inside)[:, None] * straight)


def halving_moves(insertion: Insertion, frame: TrueFrame) -> float:
    """How far a frame's wire moves, mm at equal arc length, when relaxed again on nodes half as far apart."""
    fine = replace(insertion, step_mm=0.5 * insertion.step_mm)
    rod = _rod(fine, frame.depth_mm, frame.roll_deg)
    ends = np.concatenate([[0.0], np.cumsum(edge_lengths(frame.depth_mm, insertion.step_mm))])
    arcs = np.concatenate([[0.0], np.cumsum(rod.lengths)])
    coarse = _slide(rod, shape_from_points(rod, frame.points_mm), ends, arcs)
    # forces belong to cells: half the spacing, half the force
    anchor = coarse.points + _between(arcs, ends, frame.anchor_mm - frame.points_mm)
    contact = 0.5 * _between(arcs, ends, frame.contact_N)
    again = _settle(fine, rod, coarse, anchor, contact, NEWTON_FORCE_N).equilibrium
    return float(np.max(np.linalg.norm(again.shape.points - coarse.points, axis=1)))


def _between(arcs: Array, ends: Array, values: Array) -> Array:
    """Values (n, 3) given at ``ends``, linear between, at ``arcs``."""
    return np.column_stack([np.interp(arcs, ends, values[:, a]) for a in range(3)])
