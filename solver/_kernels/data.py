"""What the kernels hand to each other: named tuples of arrays and scalars. What they note: see ``records``.

Units: mm, N, rad unless something else is said. k is the number of segments, p the number of look-up points.
"""

from typing import Any, NamedTuple

from solver.skips import Skips

# how a relaxation or a step ends, by the names of ``solution.Status``
OUTCOMES = ("CONVERGED", "MAX_ITERATIONS", "STALLED", "NON_FINITE", "FRICTION", "FOLDED", "LEFT_GRID", "THROUGH_WALL")
CONVERGED, MAX_ITERATIONS, STALLED, NON_FINITE, FRICTION, FOLDED, LEFT_GRID, THROUGH_WALL = range(8)
UNFINISHED, ROUGH = -1, -2
"""A relaxation goes on; a step is to be taken again in shorter ones."""
CURRENT, TRIAL, LAST_GOOD, SPARE = range(4)
"""Slots of a ``State``. While a relaxation runs, the first two change places with every step that it takes;
the last keeps the relaxed wire while ``forks`` looks for another one."""


class Field(NamedTuple):
    """An interpolated signed distance, mm.

    coefficients : (nx + 2, ny + 2, nz + 2) float32.     to_index : (3, 3), index per mm.     origin : (3,) mm.
    gap : bound on |trilinear look-up - spline|, mm.     slope : bound on |gradient|.     spacing : the least, mm.
    creases : uint8, for each block of the grid whether the distance has a crease near it, see ``solver.creases``.
    """

    coefficients: Any
    to_index: Any
    origin: Any
    gap: float
    slope: float
    spacing: float
    creases: Any


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


class Sleeve(NamedTuple):
    """A catheter over the wire, see ``sleeve``.

    there : whether there is one.     tip : (1,), mm beyond the entry.
    profile, cells : as in ``WireTable``, of the pair.
    stored_at, stored : (n,) energy of the pair at its rest, N mm per mm, by the distance from the wire's tip.
    """

    there: bool
    tip: Any
    profile: Profile
    cells: Any
    stored_at: Any
    stored: Any


class WireTable(NamedTuple):
    """What a wire of any depth is cut from.

    cells : (m, 2), see ``chain.tabulate``.     segment : length of one, mm.     tabled : whether ``cells`` is used.
    shaft : length of the wire between hand and entry, mm: it twists with the first joint.
    """

    profile: Profile
    rule: Rule
    cells: Any
    segment: float
    tabled: bool
    shaft: float
    sleeve: Sleeve


class Chain(NamedTuple):
    """A wire of k segments; arrays may be longer than k.

    length, bend, twist, rest : (k,) segment mm, joint stiffness N mm/rad, rest bend rad.
    load : (k + 1, 3) dead force on each node, N.     first : (k + 2,) first look-up point of each node.
    offset : (p, 3) mm in the frame of the segment that ends at the node.     weight : (p,) mm of wire.
    held : (1,) mm of wire that the node at the entry stands for.     early : (1,) share of the first joint's twist that
    lies before it, in the shaft.     reach : see ``Rule``.
    """

    length: Any
    bend: Any
    twist: Any
    rest: Any
    load: Any
    first: Any
    offset: Any
    weight: Any
    held: Any
    early: Any
    reach: float


class State(NamedTuple):
    """Four states of a chain side by side (axis 0), see ``CURRENT``.

    u : (4, k, 3) controls, rad.   x : (4, k + 1, 3) joints, mm.   r : (4, k + 1, 3, 3) frames, whose columns are
    material axes 1, 2 and the direction.   penetration : (4, p) mm.   jet : (4, p, 10), see ``field``, per mm.
    energies : (4,) of ``records.ENERGIES``.   held : (4, 3, 3), see ``shaft.shaft_energy``; 0 where the shaft
    does not rub.
    """

    u: Any
    x: Any
    r: Any
    penetration: Any
    jet: Any
    energies: Any
    held: Any


class Scratch(NamedTuple):
    """Work space.

    gain : (k, 3, 7), see ``blocks.store_gains``.     anchor : (p, 4), where a point was looked up last, and the
    distance there.     counters, descent : (1,), see ``records``.     start : (k, 3) controls that the step began
    with.     change : (k, 3) what relaxing them added in the last step, from the tip inwards.
    keep : (k, 3) controls to come back to.     seen : (k + 1, 3) joints after a rough step, mm.
    snaps : (n,) of ``records.SNAP``.
    """

    gain: Any
    anchor: Any
    counters: Any
    descent: Any
    start: Any
    change: Any
    keep: Any
    seen: Any
    snaps: Any


class Friction(NamedTuple):
    """Coulomb friction of one step as a potential, load and direction taken from the last relaxation.

    coefficient : 0 is no friction at all.     radius : of a smooth hull, mm, else 0.
    exposed : (p,), share of the wire at each point that no catheter covers: what the wall bears beside it rubs.
    Before the step: held : (p, 3), where each point's spring is fixed to the wall, moved to the wire's axis, mm.
    frame : (k + 1, 3, 3) of the same material.     In the step: arm : (p, 3), from the point to where it rubs, mm, in
    the frame of its node.     start : (p, 3), where its spring is fixed, mm.     normal : (p, 3).     load : (p,) N.
    After the step, counted from the tip's last point: stretch : (p, 3) of the spring, mm.     pressed : (p,) load, N.
    """

    coefficient: float
    radius: float
    exposed: Any
    held: Any
    frame: Any
    arm: Any
    start: Any
    normal: Any
    load: Any
    stretch: Any
    pressed: Any


class Shaft(NamedTuple):
    """The wire between the hand and the entry, straight and guided; its length is in ``WireTable``.

    drag : friction force that resists sliding and turning, N, half of it at the entry, half in the hand.
    radius : mm.     frame : (1, 3, 3) of the wire at the entry before the step.     step : (2,), mm that the hand moves
    it in the step, along it and around its surface.     stretch : (2, 2) of the springs that hold it after the step,
    mm: at the entry and in the hand, along and around it.
    """

    drag: float
    radius: float
    frame: Any
    step: Any
    stretch: Any


class Problem(NamedTuple):
    """A wire in a wall.

    stiffness : of the wall, N/mm per mm of wire, 0 is no wall.     pressed : energy of the wall at the entry, whose
    node cannot move, N mm per mm of wire.     twisting : the torsional stiffness is finite.
    straight : no rest bend, one bending stiffness, a round hull, no twist, no friction: the roll of frames is left out.
    """

    field: Field
    stiffness: float
    pressed: float
    friction: Friction
    shaft: Shaft
    chain: Chain
    state: State
    scratch: Scratch
    skips: Skips
    twisting: bool
    straight: bool


class Introducer(NamedTuple):
    """Where the wire is clamped, and how far one step may go.

    entry : (3,) mm.     frame : (3, 3) at roll 0, columns are material axes 1, 2 and the direction.
    load : (3,) dead force on the tip, N.     translate : the paper's start shape instead of sliding.
    idle_roll : rolling changes nothing.     step, turn : longest step, mm and degrees.     rise : how much deeper in
    the wall a step may lead the tip, mm.     margin : how far a joint may leave the grid, mm.
    weight : (3,) of the wire, N per mm of it.
    finest : share of the longest step down to which a rough one is taken again.
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
    weight: Any
    finest: float


class Limits(NamedTuple):
    """How to relax.

    method : see ``minimise.METHODS``.     tolerance : Newton decrement relative to the energy.
    max_iterations : of one relaxation.     work : joints and look-up points that the iterations of one depth may pass.
    """

    method: int
    tolerance: float
    max_iterations: int
    work: int
