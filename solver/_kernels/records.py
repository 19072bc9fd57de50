"""What the kernels note: records of named numbers, whose fields they read and write by name.

Units: mm, N, rad unless something else is said.
"""

from typing import Any

import numpy as np


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
    ("moment", float),
    ("decrement", float),
    ("joint", np.int64),
    ("bend", float, 2),
    ("curvature", float),
    ("twist", float),
    ("pivot", float),
)
"""What a relaxation found out.

start : energy at the beginning, N mm.     penetration : deepest of all points, mm.     push : the hand's force, N.
force, torque : gradient of the energy with respect to the entry point, N, and to turning the base frame, N mm.
moment : largest moment left at a joint, N mm.     decrement : fall of the energy that Newton's step predicts, N mm.
joint : the first whose block of the Hessian is not positive.     bend, twist, curvature : its direction of negative
curvature, and that curvature, N mm.
pivot : least over the joints of the stiffness with all beyond free to follow, over its own; 0 where the wire snaps.
Where torsion is finite also that of the whole wire's twist, see ``blocks.pivot_of_shaft``.
"""
DESCENT = record(
    *((name, np.int64) for name in ("slot", "iterations", "first_free", "patience", "released", "next_check")),
    *((name, np.int64) for name in ("forked", "sprung", "rung")),
    *((name, float) for name in ("energy", "damping", "last_damping", "share", "checked_energy")),
)
"""What one iteration of a relaxation hands to the next.

slot : of the current state; the trial is in 1 - slot.     energy : of the current state, N mm.
Newton's method. first_free : joints before it are left alone.     damping : Levenberg's term.     last_damping : the
one that last led down.     patience : steps to take before it is lowered.     released : how often it was dropped.
forked : 1 where it passed an unstable state, see ``forks``.     sprung : 1 where it went back to its rest shape, or
towards it, see ``spring_back``.     rung : see ``forks.softest_way``.
Closed form. share : of its own step.     next_check : iteration at which it is judged.     checked_energy : then.
"""
PLACE = record(
    *((name, float) for name in ("inserted", "roll", "energy", "shrink", "last_step", "last_turn", "rise")),
    *((name, float) for name in ("refining_failed", "rough_depth", "rough_roll", "rough_catheter")),
    *((name, float) for name in ("rough_since_doubt", "rough_pivot")),
    *((name, float) for name in ("push", "torque", "dissipated", "since_doubt", "rubbed")),
    *((name, float) for name in ("catheter", "goal", "next", "pull", "stored", "passed", "hind")),
    ("waits", np.int64),
    ("snaps", np.int64),
)
"""Where an insertion is. inserted, roll, energy : mm beyond the entry, degrees, N mm.     shrink : share of the longest
step that it takes.     last_step, last_turn : its last step, mm and degrees.
rise : energy of the last start that was not foreseen, above that predicted from the hand's push, N mm; it fades.
refining_failed : 1 where short steps to where a rough one led failed: then long ones are taken, whatever they do.

push, torque : the hand's there, N and N mm.     dissipated, rubbed : lost of its work on the way to this depth, in all
and by friction, N mm.     since_doubt : way since the wire snapped or was about to, mm.     snaps : number on the way.
waits : steps to take before a longer one is tried again.
rough_depth, rough_roll, rough_catheter : where a rough step led that is being taken again; nan where there is none.
rough_since_doubt : what since_doubt was before it.     rough_pivot : pivot above which it counts that long and short
steps agree.
catheter, goal, next : where the catheter's tip is, is to go, and goes in this step, mm beyond the entry.     pull : the
force of its hand, N.     stored : energy that it keeps in the wire, N mm, a part of ``energy``.
passed : least depth at which the wire passed through itself, mm, inf where it has not.     hind : wire beyond the hind
strand there, mm, the least of all passages: pulled back further, the wire is free of them.
"""
SNAP = record(*((name, float) for name in ("from_mm", "to_mm", "released_N_mm", "moved_mm", "other_mm")))
"""An event: depths before and after, energy released, largest way of a joint, and result of ``forks.other_side``."""
