"""What the kernels hand to each other: named tuples of arrays and scalars, nothing else."""

from __future__ import annotations

from typing import Any, NamedTuple

from solver._kernels.chain import Chain
from solver._kernels.field import Field

# places in the work counters
FULL, CHEAP, CLEAR, SWEEPS, ROLLOUTS, LEVENBERG, IDLE, ROLLS, STRAIGHT, FORESEEN, STILL, SPENT = range(12)
RESTED, SMOOTH, TWISTLESS, TABLED = range(12, 16)
COUNTERS = 16
# places in the list of energies
BENDING, WALL, LOAD, RUBBING = range(4)
# places in the report of a relaxation, see ``newton.sweep``, ``newton.costate`` and ``settle.measure``
START, DEEPEST, PUSH = 18, 20, 21
REPORT = 22


class State(NamedTuple):
    """Three states of a chain side by side (axis 0): the current one, the trial, and the last good one.

    u : (3, k, 3) rad.   x : (3, k + 1, 3) mm.   r : (3, k + 1, 3, 3), columns are material axes 1, 2 and e3.
    depth : (3, p) penetration mm.   jet : (3, p, 10), see ``spline``, per mm.   parts : (3, 4) energies, N mm.
    """

    u: Any
    x: Any
    r: Any
    depth: Any
    jet: Any
    parts: Any


class Scratch(NamedTuple):
    """Work space: gains (k, 3, 7), anchors (p, 4) for the clearance skip, counters, spline weights, a 3-vector.

    start : (k, 3) controls that the step began with, rad.     change : (k, 3) what relaxing them added in the last
    step, from the tip inwards, rad.     keep : (k, 3) controls to come back to, rad.
    """

    gain: Any
    anchor: Any
    counter: Any
    slide: Any
    weights: Any
    start: Any
    change: Any
    keep: Any


class Switch(NamedTuple):
    """Skips, all on except in tests.

    clearance : no look-up for a point that moved less than its clearance.     cheap : trilinear look-up first.
    idle : the rest shape is the answer where it touches nothing.     roll : of a straight round wire is no step.
    direction : of a straight round wire is its state, without the roll of its frames.     foresight : begin a step
    with the change that the last one made.     window : leave the part near the base that no longer moves.
    rest : a start within tolerance is the answer.     friction, twist : carry none where there is none.     profile :
    stiffness and rest bend of all joints but two from a table made once.
    """

    clearance: bool = True
    cheap: bool = True
    idle: bool = True
    roll: bool = True
    direction: bool = True
    foresight: bool = True
    window: bool = True
    rest: bool = True
    friction: bool = True
    twist: bool = True
    profile: bool = True


class Friction(NamedTuple):
    """Coulomb friction of one step as a potential, load and direction taken from the last relaxation.

    coefficient : 0 is no friction at all.     slip : length below which a point still sticks, mm.
    start : (p, 3) where each point was before the step, mm.     normal : (p, 3).     load : (p,) N.
    """

    coefficient: float
    slip: float
    start: Any
    normal: Any
    load: Any


class Problem(NamedTuple):
    """A wire in a wall. stiffness : wall, N/mm per mm, 0 is no wall.  spacing : of the grid, mm.

    straight : no rest bend, one bending stiffness, a round hull and no twist: a direction is all of a frame.
    """

    field: Field
    stiffness: float
    spacing: float
    friction: Friction
    chain: Chain
    state: State
    scratch: Scratch
    switch: Switch
    twisting: bool
    straight: bool
