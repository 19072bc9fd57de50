"""What the kernels hand to each other: named tuples of arrays and scalars, and records of named numbers.

Units: mm, N, rad unless something else is said. k is the number of segments, p the number of look-up points.
"""

from typing import Any, NamedTuple

import numpy as np

from solver.skips import Skips

# how a relaxation or a step ends, by the names of ``solution.Status``
OUTCOMES = ("CONVERGED", "MAX_ITERATIONS", "STALLED", "NON_FINITE", "FRICTION", "FOLDED", "LEFT_GRID")
CONVERGED, MAX_ITERATIONS, STALLED, NON_FINITE, FRICTION, FOLDED, LEFT_GRID = range(7)
UNFINISHED = -1
"""It goes on."""
CURRENT, TRIAL, LAST_GOOD = range(3)
"""Slots of a ``State``. While a relaxation runs, the first two change places with every step that it takes."""


def record(*fields: tuple[Any, ...]) -> np.dtype[Any]:
    """The type of a record: kernels read and write its fields by name."""
    return np.dtype((np.record, list(fields)))


ENERGIES = record(*((name, float) for name in ("bending", "wall", "load", "friction")))
"""The parts of a state's energy, N mm."""
WORK = (
    "wall_look_ups",
    "wall_look_ups_cheap",
    "wall_look_ups_proven_unnecessary",
    "sweeps",
    "rollouts",
    "levenberg",
    "rest_shapes",
    "rolls_proven_idle",
    "sweeps_without_roll",
    "starts_foreseen",
    "joints_left_still",
    "starts_at_rest",
    "relaxations_without_friction",
    "relaxations_without_twist",
    "joints_without_profile_look_up",
)
"""What is counted, by the keys of ``Solution.work``."""
COUNTERS = record(*((name, np.int64) for name in (*WORK, "passed")))
"""passed : joints and look-up points that the iterations of a depth have gone through, see ``tol.WORK``."""
REPORT = record(
    ("start", float),
    ("penetration", float),
    ("push", float),
    ("force", float, 3),
    ("torque", float, 3),
    ("turned", float, (2, 3)),
    ("moment", float),
    ("decrement", float),
    ("joint", np.int64),
    ("bend", float, 2),
    ("curvature", float),
    ("twist", float),
)
"""What a relaxation found out.

start : energy at the beginning, N mm.     penetration : deepest of all points, mm.     push : the hand's force, N.
force, torque : gradient of the energy with respect to the entry point, N, and to turning the base frame, N mm.
turned : the same to turning segments 0 and 1, in their own frames.     moment : largest moment left at a joint, N mm.
decrement : fall of the energy that Newton's step foretells, N mm.     joint, bend, twist, curvature : of the first
joint whose block of the Hessian is not positive, its direction of negative curvature and that curvature, N mm.
"""
DESCENT = record(
    *((name, np.int64) for name in ("slot", "iterations", "first_free", "patience", "released", "next_check")),
    *((name, float) for name in ("energy", "damping", "last_damping", "share", "checked_energy")),
)
"""What one iteration of a relaxation hands to the next.

slot : of the current state; the trial is in 1 - slot.     energy : of the current state, N mm.
Newton's method. first_free : joints before it are left alone.     damping : Levenberg's term.     last_damping : the
one that last led down.     patience : steps to take before it is lowered.     released : how often it was dropped.
Closed form. share : of its own step.     next_check : iteration at which it is judged.     checked_energy : then.
"""
PLACE = record(*((name, float) for name in ("inserted", "roll", "energy", "shrink", "last_step")))
"""Where an insertion is: mm beyond the entry, degrees, N mm; share of the longest step that it takes, and its last
step, mm (0 after a roll)."""


class Field(NamedTuple):
    """An interpolated signed distance, mm.

    coefficients : (nx + 2, ny + 2, nz + 2) float32.     to_index : (3, 3), index per mm.     origin : (3,) mm.
    gap : bound on |trilinear look-up - spline|, mm.     slope : bound on |gradient|.     spacing : the least, mm.
    """

    coefficients: Any
    to_index: Any
    origin: Any
    gap: float
    slope: float
    spacing: float


class Profile(NamedTuple):
    """Piecewise linear functions of the distance from the tip; two equal abscissae make a jump."""

    stiffness_at: Any
    stiffness: Any
    rest_at: Any
    rest: Any
    twist: float


class Rule(NamedTuple):
    """Where a segment's wall energy is looked up.

    hull : (h, 2), offsets across the wire in the material frame, mm; one zero row is the smooth limit, no row no wall.
    reach : added to the distance at each look-up, mm (the wire's radius in the smooth limit, else 0).
    tip_at, tip_weight : (q,), places along the last segment as a fraction from its tip, and weights (sum 1).
    zone : number of segments before the last one that have two Gauss points each.
    """

    hull: Any
    reach: float
    tip_at: Any
    tip_weight: Any
    zone: int


class WireTable(NamedTuple):
    """What a wire of any depth is cut from.

    cells : (m, 2), see ``chain.tabulate``.     segment : length of one, mm.     tabled : whether ``cells`` is used.
    """

    profile: Profile
    rule: Rule
    cells: Any
    segment: float
    tabled: bool


class Chain(NamedTuple):
    """A wire of k segments; arrays may be longer than k.

    length, bend, twist, rest : (k,) segment mm, joint stiffness N mm/rad, rest bend rad.
    load : (k + 1, 3) dead force on each node, N.     first : (k + 2,) first look-up point of each node.
    offset : (p, 3) mm in the frame of the segment that ends at the node.     weight : (p,) mm of wire.
    reach : see ``Rule``.
    """

    length: Any
    bend: Any
    twist: Any
    rest: Any
    load: Any
    first: Any
    offset: Any
    weight: Any
    reach: float


class State(NamedTuple):
    """Three states of a chain side by side (axis 0), see ``CURRENT``.

    u : (3, k, 3) controls, rad.   x : (3, k + 1, 3) joints, mm.   r : (3, k + 1, 3, 3) frames, whose columns are
    material axes 1, 2 and the direction.   penetration : (3, p) mm.   jet : (3, p, 10), see ``field``, per mm.
    energies : (3,) of ``ENERGIES``.
    """

    u: Any
    x: Any
    r: Any
    penetration: Any
    jet: Any
    energies: Any


class Scratch(NamedTuple):
    """Work space.

    gain : (k, 3, 7), see ``blocks.store_gains``.     anchor : (p, 4), where a point was looked up last, and the
    distance there.     counters, descent : (1,), see ``COUNTERS`` and ``DESCENT``.     start : (k, 3) controls that the
    step began with.     change : (k, 3) what relaxing them added in the last step, from the tip inwards.
    keep : (k, 3) controls to come back to.
    """

    gain: Any
    anchor: Any
    counters: Any
    descent: Any
    start: Any
    change: Any
    keep: Any


class Friction(NamedTuple):
    """Coulomb friction of one step as a potential, load and direction taken from the last relaxation.

    coefficient : 0 is no friction at all.
    start : (p, 3) where each point was before the step, mm.     normal : (p, 3).     load : (p,) N.
    """

    coefficient: float
    start: Any
    normal: Any
    load: Any


class Problem(NamedTuple):
    """A wire in a wall.

    stiffness : of the wall, N/mm per mm of wire, 0 is no wall.     twisting : the torsional stiffness is finite.
    straight : no rest bend, one bending stiffness, a round hull and no twist: a direction is all of a frame.
    """

    field: Field
    stiffness: float
    friction: Friction
    chain: Chain
    state: State
    scratch: Scratch
    skips: Skips
    twisting: bool
    straight: bool


class Introducer(NamedTuple):
    """Where the wire is clamped, and how far one step may go.

    entry : (3,) mm.     frame : (3, 3) at roll 0, columns are material axes 1, 2 and the direction.
    load : (3,) dead force on the tip, N.     translate : the seed's start shape instead of sliding.
    idle_roll : rolling changes nothing.     step, turn : longest step, mm and degrees.     rise : how much deeper in
    the wall a step may lead the tip, mm.     margin : how far a joint may leave the grid, mm.
    """

    entry: Any
    frame: Any
    load: Any
    translate: bool
    idle_roll: bool
    step: float
    turn: float
    rise: float
    margin: float


class Limits(NamedTuple):
    """How to relax.

    method : see ``minimise.METHODS``.     tolerance : Newton decrement relative to the energy.
    max_iterations : of one relaxation.     work : joints and look-up points that the iterations of one depth may pass.
    """

    method: int
    tolerance: float
    max_iterations: int
    work: int
