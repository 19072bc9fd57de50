"""Wires side by side: the arrays that the lock-step kernels work on, and how one wire is copied into a lane and back.

The tips are aligned: node k of each wire is node ``size`` of the block. So the look-up points, whose number depends on
how far behind the tip a node is, are aligned as well. A shorter wire begins with joints of length 0 that do not bend.
The last axis of every array is the lane.
"""

from typing import Any, NamedTuple

import numpy as np

from solver._kernels.algebra import load3, load9, store3, store9
from solver._kernels.data import CURRENT, Problem
from solver._kernels.flags import inlined, kernel
from solver._kernels.records import record

NUMBERS = (
    *("stiffness", "reach", "at_entry", "damping", "fraction", "start", "active", "accepted", "room"),
    *(
        "decrement",
        "definite",
        "pivot",
        "bending",
        "wall",
        "load",
        "jump",
        "moment",
        "largest",
        "still",
        "full",
        "clear",
    ),
)
"""Rows of ``Block.number``. Asked: the wall's stiffness; what is added to a distance; the wall's energy at the entry;
Levenberg's term; the share of Newton's step; the first free joint; whether a trial is wanted, and whether it is
accepted (1 or 0); the energy that it must not exceed, and then what the wall may still take of it. Answered: the fall
foretold; whether all blocks were positive; the least pivot; energies of the trial; whether a joint of it went so far
that a wall may lie between; largest moment left, and in the wire; first joint that the accepted step turned; counts of
look-ups."""
(
    STIFFNESS, REACH, AT_ENTRY, DAMPING, FRACTION, START, ACTIVE, ACCEPTED, ROOM, DECREMENT, DEFINITE, PIVOT, BENDING,
    WALL, LOAD, JUMP, MOMENT, LARGEST, STILL, FULL, CLEAR,
) = range(len(NUMBERS))  # fmt: skip
ALONG, WEIGHT, ANCHOR = 0, 1, 2
"""Columns of ``Block.site``: the last of four."""


class Block(NamedTuple):
    """Arrays of numbers (..., WIDTH); the same memory again as arrays (...) of lanes.

    length, bend, rest, hold : (size,) of the joints: mm, N mm/rad, rest bend in rad, bend over length².
    u, x, r : as in ``data.State``, of the current state and the trial, without twist.     gain : (size, 2, 7).
    site : (p, 6), where on the wire a look-up point is, mm, the mm that it stands for, 0 where there is none, and its
    row of ``data.Scratch.anchor``.     touch : (2, p, 11), penetration, mm, and jet, of both states.
    load : (3,) on the tip, N.     force, torque : as in ``records.REPORT``.     asked : (3, n) int64, lists of
    points to be looked up, each WIDTH times the point, plus its lane: row 0 those that will touch, 1 those that may, 2
    the eight that are looked up now.     found : (11,), see ``field.look_up``.     number : see ``NUMBERS``.
    """

    length: Any
    bend: Any
    rest: Any
    hold: Any
    u: Any
    x: Any
    r: Any
    gain: Any
    site: Any
    touch: Any
    load: Any
    force: Any
    torque: Any
    asked: Any
    found: Any
    number: Any


SHAPES = (
    *("k", "k", "k", "k", "2 k 2", "2 n 3", "2 n 3 3", "k 2 7", "p 6", "2 p 11"),
    *("3", "3", "3", "", "11", str(len(NUMBERS))),
)
"""Shapes of a block's arrays, without the lanes: k joints, n nodes, p points; ``asked`` is not an array of lanes."""
LANE = record(
    *((name, float) for name in ("depth", "roll", "limit", "tolerance", "stiffest", "scale", "noise", "moved")),
    *((name, float) for name in ("accuracy", "pivot")),
    *((name, float) for name in ("fraction", "decrement", "before", "bending", "wall", "load", "energy")),
    *((name, np.int64) for name in ("phase", "goal", "k", "tries", "allowed", "outcome", "iterations", "used")),
    ("aside", np.int64),
)
"""Where a wire is.

depth, roll : that its step leads to.     tolerance : see ``data.Limits``.     stiffest, scale, noise,
moved : see ``energy.scale_of``, ``load_moved``.
fraction : of Newton's step to try.     decrement : the fall that its gains foretell.
before : energy that the iteration began with.     bending, wall, load : energies of the current state.
limit, iterations : of this depth.     phase : see ``relax``.     goal : index of the depth that it is on its way
to.     k : segments.     tries : step lengths that failed.     allowed : iterations of this relaxation.
outcome : how its relaxation ended.     aside : 1 where it relaxes on the other side, see ``forks``.     energy, used :
of the step's own relaxation, and its iterations.
"""
SEAT = record(("wire", np.int64), ("filled", np.int64))
"""wire : the one that a lane works for, POOL for none.     filled : first joint of the block that is valid in this
lane, see ``fill_up``."""


@kernel
def put_in(b: Block, first: Any, lane: int, problem: Problem, k: int) -> None:
    """Put the current state of a wire of k segments into a lane."""
    chain, state, shift = problem.chain, problem.state, b.length.shape[0] - k
    for j in range(k):
        to, length = shift + j, chain.length[j]
        b.length[to, lane], b.bend[to, lane], b.rest[to, lane] = length, chain.bend[j], chain.rest[j]
        b.hold[to, lane] = chain.bend[j] / (length * length)
        b.u[CURRENT, to, 0, lane], b.u[CURRENT, to, 1, lane] = state.u[CURRENT, j, 0], state.u[CURRENT, j, 1]
    for n in range(k + 1):
        put_node(b, lane, shift + n, load3(state.x[CURRENT], n), load9(state.r[CURRENT], n))
    for p in range(chain.first[k + 1]):
        to, d = first[shift + 1] + p, state.penetration[CURRENT, p]
        b.site[to, ALONG, lane], b.site[to, WEIGHT, lane] = chain.offset[p, 2], chain.weight[p]
        for a in range(4):
            b.site[to, ANCHOR + a, lane] = problem.scratch.anchor[p, a]
        b.touch[CURRENT, to, 0, lane] = d
        if d != 0.0:
            for a in range(10):
                b.touch[CURRENT, to, 1 + a, lane] = state.jet[CURRENT, p, a]
    for a in range(3):
        b.load[a, lane] = chain.load[k, a]


@inlined
def put_node(b: Block, lane: int, n: int, x: Any, r: Any) -> None:
    """Put a joint and its frame into a lane."""
    for a in range(3):
        b.x[CURRENT, n, a, lane] = x[a]
        for c in range(3):
            b.r[CURRENT, n, a, c, lane] = r[3 * a + c]


@kernel
def fill_up(b: Block, first: Any, lane: int, start: int, stop: int) -> None:
    """Put joints of length 0 before a wire that begins at joint ``stop``, from joint ``start`` on."""
    x = (b.x[CURRENT, stop, 0, lane], b.x[CURRENT, stop, 1, lane], b.x[CURRENT, stop, 2, lane])
    for j in range(start, stop):
        b.length[j, lane] = b.hold[j, lane] = b.rest[j, lane] = 0.0
        b.bend[j, lane] = 1.0
        b.u[CURRENT, j, 0, lane] = b.u[CURRENT, j, 1, lane] = 0.0
        for a in range(3):
            b.x[CURRENT, j, a, lane] = x[a]
            for c in range(3):
                b.r[CURRENT, j, a, c, lane] = b.r[CURRENT, stop, a, c, lane]
    for p in range(first[start + 1], first[stop + 1]):
        b.site[p, WEIGHT, lane] = b.touch[CURRENT, p, 0, lane] = 0.0


@kernel
def take_out(b: Block, first: Any, lane: int, problem: Problem, k: int) -> None:
    """Copy the current state of a lane back to its wire, of k segments."""
    chain, state, shift = problem.chain, problem.state, b.length.shape[0] - k
    u, x, r, jet = state.u[CURRENT], state.x[CURRENT], state.r[CURRENT], state.jet[CURRENT]
    for n in range(k + 1):
        at = shift + n
        store3(x, n, (b.x[CURRENT, at, 0, lane], b.x[CURRENT, at, 1, lane], b.x[CURRENT, at, 2, lane]))
        one = (b.r[CURRENT, at, 0, 0, lane], b.r[CURRENT, at, 0, 1, lane], b.r[CURRENT, at, 0, 2, lane])
        two = (b.r[CURRENT, at, 1, 0, lane], b.r[CURRENT, at, 1, 1, lane], b.r[CURRENT, at, 1, 2, lane])
        three = (b.r[CURRENT, at, 2, 0, lane], b.r[CURRENT, at, 2, 1, lane], b.r[CURRENT, at, 2, 2, lane])
        store9(r, n, one + two + three)
        if n < k:
            store3(u, n, (b.u[CURRENT, at, 0, lane], b.u[CURRENT, at, 1, lane], 0.0))
    for p in range(chain.first[k + 1]):
        at = first[shift + 1] + p
        d = b.touch[CURRENT, at, 0, lane]
        state.penetration[CURRENT, p] = d
        if d != 0.0:
            for a in range(10):
                jet[p, a] = b.touch[CURRENT, at, 1 + a, lane]
