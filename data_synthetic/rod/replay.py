"""The true wire: an insertion replayed quasi-statically, millimetre by millimetre, against a wall given as a function.

Nothing here comes from the simulator that is judged: node positions and edge angles instead of joint rotations,
stretch and twist as stiff springs instead of constraints, an assembled banded system instead of a sweep, and the
wall as an analytic distance instead of voxels. What is shared is the physics: bending stiffness and rest curvature
as functions of the distance from the tip, a wall energy of half k d squared per mm, a clamp at the entry.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from data_synthetic.geometry import Array, at_arc, ends_of, normal_to, rotate, unit
from data_synthetic.rod._kernels import Shape
from data_synthetic.rod.friction import by_tip, held_back, relax_with_friction
from data_synthetic.rod.relax import Equilibrium, relax
from data_synthetic.rod.rod import TIP_EDGES, Rod, TrueWire, Wall, edge_lengths, make_rod, shape_from_points

ROLL_STEP_DEG = 5.0
"""Largest roll between two equilibria of the replay."""
NEWTON_FORCE_N = 1e-7
"""Largest unbalanced nodal force of a recorded wire; rounding leaves about 1e-9 N at 2e4 N of axial stiffness."""
REPLAY_FORCE_N = 1e-5
"""Largest unbalanced nodal force between recorded depths: it only has to follow the branch."""


@dataclass(frozen=True, eq=False)
class TrueInsertion:
    """What is done to the wire: where it enters, what it meets, and how finely that is computed.

    step_mm : node spacing.     advance_mm : insertion between two equilibria (defaults to the node spacing).
    friction : Coulomb's coefficient at the wall; 0 computes nothing.
    """

    wire: TrueWire
    wall: Wall
    stiffness_N_mm2: float
    entry_mm: Array
    direction: Array
    material_axis: Array
    step_mm: float = 0.2
    advance_mm: float | None = None
    friction: float = 0.0


@dataclass(frozen=True, eq=False)
class TrueFrame:
    """The wire at one depth. points_mm (n + 1, 3) from the entry to the tip, contact_N (n + 1, 3).

    anchor_mm (n + 1, 3) : the points of the wall that friction holds the nodes by (the nodes themselves without it).
    residual_N : largest unbalanced nodal force.     jump_mm : how much further than the push the tip moved in one
    advance, at most, since the last frame: this tells a quiet insertion from one that snapped.
    """

    depth_mm: float
    roll_deg: float
    points_mm: Array
    contact_N: Array
    anchor_mm: Array
    residual_N: float
    jump_mm: float
    iterations: int


def replay(
    insertion: TrueInsertion, depths_mm: Sequence[float], roll_deg: float | Sequence[float] = 0.0
) -> Iterator[TrueFrame]:
    """The wire at each depth, in order: pushed and rolled there in small steps from where it was.

    The roll of a frame is reached linearly on the way to its depth; before the first frame it is that frame's roll.
    """
    depths, advance = [float(d) for d in depths_mm], insertion.advance_mm or insertion.step_mm
    rolls = np.broadcast_to(np.array(roll_deg, dtype=np.float64), len(depths)).tolist()
    depth, roll = min((TIP_EDGES + 2) * insertion.step_mm, depths[0]), rolls[0]
    rod = _rod(insertion, depth, roll)
    straight = insertion.entry_mm + ends_of(rod.lengths)[:, None] * rod.elastic.introducer
    state = relax(rod, shape_from_points(rod, straight), REPLAY_FORCE_N)
    for target, target_roll in zip(depths, rolls, strict=True):
        jump, effort = 0.0, 0
        way, turn = target - depth, target_roll - roll
        count = max(int(np.ceil(max(abs(way) / advance, abs(turn) / ROLL_STEP_DEG))), 1)
        pushes = [(depth + way * i / count, roll + turn * i / count) for i in range(1, count + 1)]
        for depth_next, roll_next in pushes:
            before = state.shape.points[-1]
            state = _advance(insertion, state, depth, depth_next, roll_next)
            moved = state.shape.points[-1] - before
            jump = max(jump, float(np.linalg.norm(moved)) - abs(depth_next - depth))
            depth, roll, effort = depth_next, roll_next, effort + state.iterations
        rod = _rod(insertion, depth, roll)
        state = relax_with_friction(rod, state.shape, state.anchor, state.contact_N, insertion.friction, NEWTON_FORCE_N)
        yield TrueFrame(
            depth_mm=depth,
            roll_deg=roll,
            points_mm=state.shape.points,
            contact_N=state.contact_N,
            anchor_mm=state.anchor,
            residual_N=state.residual_N,
            jump_mm=jump,
            iterations=effort + state.iterations,
        )


def _rod(insertion: TrueInsertion, depth: float, roll_deg: float) -> Rod:
    """The wire inserted to a depth and rolled about the entry's direction."""
    direction = unit(insertion.direction)
    director = rotate(normal_to(insertion.material_axis, direction), direction, np.radians(roll_deg))
    rod = make_rod(insertion.wire, direction, director, depth, insertion.step_mm)
    return replace(rod, wall=insertion.wall, stiffness_N_mm2=insertion.stiffness_N_mm2)


def _advance(insertion: TrueInsertion, state: Equilibrium, old: float, new: float, roll_deg: float) -> Equilibrium:
    """Push (or pull) and roll a little, then relax: the guess is the wire slid along its own curve."""
    rod = _rod(insertion, new, roll_deg)
    ends, arcs = ends_of(edge_lengths(old, insertion.step_mm)), ends_of(rod.lengths)
    start = _slide(rod, state.shape, ends, arcs)
    if not insertion.friction:
        return relax(rod, start, REPLAY_FORCE_N)
    # where the same material was before, and what it held on to there
    was = _slide(rod, state.shape, ends, arcs - (new - old)).points
    anchor = was - by_tip(held_back(state, insertion.friction), len(was))
    contact = by_tip(state.contact_N, len(was))
    return relax_with_friction(rod, start, anchor, contact, insertion.friction, REPLAY_FORCE_N)


def _slide(rod: Rod, shape: Shape, ends: Array, arcs: Array) -> Shape:
    """Nodes at new arc lengths on the present curve; beyond its tip straight on."""
    introducer = rod.elastic.introducer
    curve = CubicSpline(ends, shape.points, bc_type=((1, introducer), (2, np.zeros(3))))
    inside = np.clip(arcs, 0.0, ends[-1])
    tip = unit(curve(ends[-1], 1))
    straight = np.where(arcs[:, None] > 0, tip, introducer)  # before the entry it lies in the introducer
    return shape_from_points(rod, curve(inside) + (arcs - inside)[:, None] * straight)


def halving_moves(insertion: TrueInsertion, frame: TrueFrame) -> float:
    """How far a frame's wire moves, mm at equal arc length, when relaxed again on nodes half as far apart."""
    fine = replace(insertion, step_mm=0.5 * insertion.step_mm)
    rod = _rod(fine, frame.depth_mm, frame.roll_deg)
    ends, arcs = ends_of(edge_lengths(frame.depth_mm, insertion.step_mm)), ends_of(rod.lengths)
    coarse = _slide(rod, shape_from_points(rod, frame.points_mm), ends, arcs)
    # forces belong to cells: half the spacing, half the force
    anchor = coarse.points + at_arc(arcs, ends, frame.anchor_mm - frame.points_mm)
    contact = 0.5 * at_arc(arcs, ends, frame.contact_N)
    again = relax_with_friction(rod, coarse, anchor, contact, insertion.friction, NEWTON_FORCE_N)
    return float(np.max(np.linalg.norm(again.shape.points - coarse.points, axis=1)))
