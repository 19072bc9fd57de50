"""Where the wire gives way: the hand's work in a step is held against the energy of wire and wall.

A wire that follows one minimum takes up all of that work. Where some is missing the wire has found another minimum: it
snapped, or the step was so long that it hopped over a barrier that shorter steps would not have passed.
"""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.algebra import dot, load3, minus, store3
from solver._kernels.chain import segments_at
from solver._kernels.data import CONVERGED, CURRENT, LAST_GOOD, ROUGH, Problem
from solver._kernels.flags import merged
from solver._kernels.forces import push_force
from solver._kernels.minimise import NEWTON
from solver._kernels.sleeve import tip_force


@merged
def account(handle: Any, k: int, reached: tuple[float, float, float], used: int) -> int:
    """Hold the hand's work in a step against the wire's energy; ROUGH where a shorter step may lead elsewhere.

    reached : depth, mm, roll, degrees, and energy, N mm.     used : iterations.
    """
    problem, at, report, introducer = handle.problem, handle.place[0], handle.report[0], handle.introducer
    ahead, turn = reached[0] - at.inserted, math.radians(reached[1] - at.roll)
    push = push_force(problem, handle.table, introducer.weight, k, report) if k > 0 else 0.0
    torque = report.torque[2] if k > 0 else 0.0
    pull, onwards = 0.0, at.next - at.catheter
    if handle.table.sleeve.there and k > 0:
        pull = tip_force(problem, handle.table, k)
        # the wire's hand pushes it through a catheter that stays
        push -= pull
    lost = 0.5 * ((push + at.push) * ahead + (torque + at.torque) * turn + (pull + at.pull) * onwards)
    lost -= reached[2] - at.energy
    work = max(abs(push), abs(at.push)) * abs(ahead) + max(abs(torque), abs(at.torque)) * abs(turn)
    work += max(abs(pull), abs(at.pull)) * abs(onwards)
    large = tol.WORK_SHARE * work + tol.ENERGY_SHARE * max(abs(reached[2]), abs(at.energy))
    share = max(abs(ahead), abs(onwards)) / introducer.step
    share = max(share, abs(reached[1] - at.roll) / introducer.turn)
    soft, pending = report.pivot < tol.SOFT, not math.isnan(at.seen_depth)
    if soft:
        doubtful = used > tol.TOIL or (used > tol.EASY and abs(lost) > tol.SOFT_SHARE * large)
    else:
        large += tol.CHANGE_SHARE * share * (abs((push - at.push) * ahead) + abs((torque - at.torque) * turn))
        doubtful = used > tol.EASY and (lost > large or lost < -tol.GAINED * large)
    doubtful = doubtful and handle.limits.method == NEWTON and problem.friction.coefficient == 0.0
    # shorter steps do not make a wire any more certain that is free to turn, and in doubt already
    told = report.pivot < tol.FREE and (at.seen_calm if pending else at.calm) < tol.CALM_MM
    if doubtful and not told and share > (1.0 + tol.OVERSHOOT) * introducer.finest:
        if not pending:
            remember(problem, at, k, reached)
        return ROUGH
    if doubtful and lost > large:
        note_snap(problem, at, k, segments_at(at.inserted, handle.table.segment)[0], (reached[0], lost))
    trust(handle, k, reached, doubtful)
    at.push, at.torque, at.pull, at.dissipated = push, torque, pull, at.dissipated + lost
    return CONVERGED


@merged
def remember(problem: Problem, at: Any, k: int, reached: tuple[float, float, float]) -> None:
    """Keep the wire that a rough step led to, for that of shorter steps to be held against it."""
    at.seen_depth, at.seen_roll, at.seen_catheter, at.seen_calm = reached[0], reached[1], at.next, at.calm
    for n in range(k + 1):
        store3(problem.scratch.seen, n, load3(problem.state.x[CURRENT], n))


@merged
def trust(handle: Any, k: int, reached: tuple[float, float, float], doubtful: bool) -> None:
    """Keep count of the way since the wire gave way, or could have: until then it may lie otherwise elsewhere.

    A rough step is forgotten where shorter ones lead to the same wire without a snap, unless it is about to give way:
    to which side such a wire turns may have been decided before, by less than anyone can tell.
    """
    problem, at, report = handle.problem, handle.place[0], handle.report[0]
    ahead = abs(reached[0] - at.inserted)
    if report.pivot > tol.STIFF or at.calm >= tol.CALM_MM:
        at.calm += ahead
    if doubtful or report.pivot < tol.CRITICAL:
        at.calm = 0.0
    left = abs(reached[0] - at.seen_depth) + abs(reached[1] - at.seen_roll) + abs(at.next - at.seen_catheter)
    if left < tol.MATCH_DEPTH_MM:
        same = farthest(problem.scratch.seen, 0, problem.state.x[CURRENT], 0, k + 1) < tol.SAME_MM
        at.calm = at.seen_calm + ahead if same and report.pivot > tol.LOOSE else 0.0
        at.seen_depth = math.nan


@merged
def farthest(a: Any, at: int, b: Any, to: int, count: int) -> float:
    """Largest distance of ``count`` joints of two wires, mm, from joint ``at`` of one and ``to`` of the other on."""
    most = 0.0
    for m in range(count):
        way = minus(load3(a, at + m), load3(b, to + m))
        most = max(most, dot(way, way))
    return math.sqrt(most)


@merged
def note_snap(problem: Problem, at: Any, k: int, was: int, reached: tuple[float, float]) -> None:
    """Write down that a wire of ``was`` segments snapped on its way to k segments.

    reached : the depth, mm, and the energy released, N mm. Where there are too many the last place is taken again. A
    wire that went no further than its base was pushed did not snap: that is what the trapezium rule leaves of its work.
    """
    snaps, x = problem.scratch.snaps, problem.state.x
    common = min(k, was)
    at.seen_calm = 0.0
    # joints are counted from the tip: there they stay with the material
    moved = farthest(x[CURRENT], k - common, x[LAST_GOOD], was - common, common + 1)
    if moved < tol.SNAP_WAYS * abs(reached[0] - at.inserted):
        return
    snap = snaps[min(at.snaps, snaps.size - 1)]
    at.snaps = min(at.snaps + 1, snaps.size)
    snap.from_mm, snap.to_mm, snap.released_N_mm, snap.moved_mm = at.inserted, reached[0], reached[1], moved
