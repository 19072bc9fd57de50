"""Where the wire gives way: the hand's work in a step is held against the energy of wire and wall.

A wire that follows one minimum takes up all of that work. Where some is missing the wire has found another minimum: it
snapped, or the step was so long that it hopped over a barrier that shorter steps would not have passed.
"""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.algebra import dot, load3, minus
from solver._kernels.chain import segments_at
from solver._kernels.data import CONVERGED, CURRENT, LAST_GOOD, ROUGH, Problem
from solver._kernels.flags import merged
from solver._kernels.forces import push_force
from solver._kernels.minimise import NEWTON


@merged
def account(handle: Any, k: int, reached: tuple[float, float, float], hard: bool) -> int:
    """Hold the hand's work in a step against the wire's energy; ROUGH where a shorter step may lead elsewhere.

    reached : depth, mm, roll, degrees, and energy, N mm.     hard : the wire did not come to rest in a few iterations.
    """
    problem, at, report, introducer = handle.problem, handle.place[0], handle.report[0], handle.introducer
    ahead, turn = reached[0] - at.inserted, math.radians(reached[1] - at.roll)
    push = push_force(problem, handle.table, introducer.weight, k, report) if k > 0 else 0.0
    torque = report.torque[2] if k > 0 else 0.0
    lost = 0.5 * ((push + at.push) * ahead + (torque + at.torque) * turn) - (reached[2] - at.energy)
    work = max(abs(push), abs(at.push)) * abs(ahead) + max(abs(torque), abs(at.torque)) * abs(turn)
    large = tol.WORK_SHARE * work + tol.ENERGY_SHARE * max(abs(reached[2]), abs(at.energy))
    judged = hard and handle.limits.method == NEWTON and problem.friction.coefficient == 0.0
    share = max(abs(ahead) / introducer.step, abs(reached[1] - at.roll) / introducer.turn)
    if judged and abs(lost) > large and share > (1.0 + tol.OVERSHOOT) * introducer.finest:
        return ROUGH
    if report.pivot > tol.STIFF or at.calm >= tol.CALM_MM:
        at.calm += abs(ahead)
    if judged and lost > large:
        note_snap(problem, at, k, segments_at(at.inserted, handle.table.segment)[0], (reached[0], lost))
    # a wire that is soft after a hard step may have given way without a loss, to a side that rounding chose
    if report.pivot < (tol.TURNED if hard else tol.NEUTRAL):
        at.calm = 0.0
    at.push, at.torque, at.dissipated = push, torque, at.dissipated + lost
    return CONVERGED


@merged
def note_snap(problem: Problem, at: Any, k: int, was: int, reached: tuple[float, float]) -> None:
    """Write down that a wire of ``was`` segments snapped on its way to k segments.

    reached : the depth, mm, and the energy released, N mm. Where there are too many the last place is taken again.
    """
    snaps, x = problem.scratch.snaps, problem.state.x
    snap = snaps[min(at.snaps, snaps.size - 1)]
    at.snaps = min(at.snaps + 1, snaps.size)
    farthest = 0.0
    for m in range(min(k, was)):
        # joints are counted from the tip: there they stay with the material
        way = minus(load3(x[CURRENT], k - m), load3(x[LAST_GOOD], was - m))
        farthest = max(farthest, dot(way, way))
    snap.from_mm, snap.to_mm = at.inserted, reached[0]
    snap.released_N_mm, snap.moved_mm = reached[1], math.sqrt(farthest)
    at.calm = 0.0
