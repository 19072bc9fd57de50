"""Where the wire gives way: the hand's work in a step is compared with the change of energy of wire and wall.

A wire that follows one minimum takes up all of that work. Where some is missing the wire has found another minimum: it
snapped, or the step was so long that it hopped over a barrier that shorter steps would not have passed.
"""

import math
from typing import Any, NamedTuple

from solver import _tolerances as tol
from solver._kernels.algebra import farthest, load3, store3
from solver._kernels.chain import segments_at
from solver._kernels.data import CONVERGED, CURRENT, LAST_GOOD, ROUGH, Problem
from solver._kernels.energy import energy_of
from solver._kernels.flags import inlined, merged
from solver._kernels.forces import push_force
from solver._kernels.free_body import work_on
from solver._kernels.friction import friction_loss
from solver._kernels.minimise import NEWTON
from solver._kernels.shaft import loss_by_turning
from solver._kernels.sleeve import tip_force


class WorkBalance(NamedTuple):
    """A step's work and energy.

    push, torque, pull : the hand's at its end, see ``records.PLACE``.     way : longest way of a hand, mm.
    share : length over that of the longest step.     lost : work minus the change of energy, N mm.     missing : lost
    less what friction took, N mm.     large : missing work that the error of the trapezium rule may explain, N mm.
    change : change of the hand's forces times their ways, N mm.     gives : whether the hand has less and less to do.
    """

    push: float
    torque: float
    pull: float
    way: float
    share: float
    lost: float
    missing: float
    large: float
    change: float
    gives: bool


@merged
def account(handle: Any, k: int, reached: tuple[float, float, float], used: int, other: float) -> int:
    """Compare the hand's work in a step with the wire's energy; ROUGH where shorter steps may lead elsewhere.

    reached : depth, mm, roll, degrees, and energy, N mm.     used : iterations, of the relaxation that took most.
    other : how far off another side lies, mm.
    """
    problem, at, report, introducer = handle.problem, handle.place[0], handle.report[0], handle.introducer
    balance, pending = balance_work(handle, k, reached), not math.isnan(at.rough_depth)
    ahead, newton = beyond_catheter(handle, k, reached[0], balance), handle.limits.method == NEWTON
    free = problem.scratch.descent[0].sprung != 0
    moved = way_of_joints(problem, at, k, handle.table.segment) if free or used > tol.SWIFT else 0.0
    leapt = moved > tol.SNAP_WAYS * balance.way
    doubtful = newton and (doubt(balance, used, at.shrink, report.pivot, moved) or (leapt and gives_way(ahead)))
    rough = newton and (hops(handle, balance, used) or (ahead.way > 0.0 and astray(handle, ahead, used, moved)))
    # shorter steps do not make a wire more certain if it is free to turn, and in doubt already
    since_doubt = at.rough_since_doubt if pending else at.since_doubt
    already_uncertain = report.pivot < tol.FREE and since_doubt < tol.DOUBT_LASTS_MM
    finer = at.refining_failed == 0.0 and balance.share > (1.0 + 2.0 * tol.OVERSHOOT) * introducer.finest
    if (doubtful or rough) and finer and not already_uncertain:
        if not pending:
            remember(problem, at, k, reached)
        return ROUGH
    # a wire that moved no further than its base did not snap: the missing work is an error of the trapezium rule
    snapped = doubtful and leapt and (gives_way(balance) or gives_way(ahead))
    # a wire that was firm before did not snap, but hopped over a barrier, which still shorter steps may not pass
    if snapped and min(handle.report[1].pivot, report.pivot) > tol.SOFT:
        at.rough_pivot = math.inf
    if snapped or other > 0.0:
        note_snap(problem, at, (moved, other), (reached[0], max(balance.missing, ahead.missing)))
    trust(handle, k, reached, doubtful and (moved > tol.ELSEWHERE_MM or at.refining_failed > 0.0))
    if other > 0.0:
        at.since_doubt = at.rough_since_doubt = tol.DOUBT_LASTS_MM - tol.UNDECIDED_MM
    at.push, at.torque, at.pull = balance.push, balance.torque, balance.pull
    at.dissipated += balance.lost
    return CONVERGED


@merged
def may_fork(handle: Any, k: int, depth: float, used: int) -> bool:
    """Whether the other side of a step to a depth is worth a look.

    Not where the relaxation met no unstable state or was short, where no joint moved by more than the hand, and where
    a soft wire is in doubt already.
    """
    problem, at = handle.problem, handle.place[0]
    if problem.scratch.descent[0].forked == 0 or used <= tol.SWIFT:
        return False
    if handle.report[0].pivot < tol.SOFT and at.since_doubt < tol.DOUBT_LASTS_MM:
        return False
    way = max(abs(depth - at.inserted), abs(at.next - at.catheter))
    return bool(way_of_joints(problem, at, k, handle.table.segment) > tol.FURTHER * way)


@merged
def _least_energy(problem: Problem, k: int) -> float:
    """Energy, N mm, below which all is rounding: where a wire just left the wall that was a snap of 1e-39 N mm."""
    return float(tol.ENERGY_FLOOR_ANGLE**2 * problem.chain.bend[k - 1])


@merged
def balance_work(handle: Any, k: int, reached: tuple[float, float, float]) -> WorkBalance:
    """Work out the hand's work in a step, by the trapezium rule, and what became of it."""
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
    rubbed = friction_loss(problem, k, ahead) if problem.friction.coefficient > 0.0 else 0.0
    if problem.shaft.drag > 0.0:
        rubbed += loss_by_turning(problem, k)
    work = max(abs(push), abs(at.push)) * abs(ahead) + max(abs(torque), abs(at.torque)) * abs(turn)
    work += max(abs(pull), abs(at.pull)) * abs(onwards)
    large = tol.WORK_SHARE * work + tol.ENERGY_SHARE * max(abs(reached[2]), abs(at.energy)) + tol.LOSS_SHARE * rubbed
    large += _least_energy(problem, k) if k > 0 else 0.0
    change = abs((push - at.push) * ahead) + abs((torque - at.torque) * turn)
    way = max(abs(ahead), abs(onwards))
    share = max(way / introducer.step, abs(reached[1] - at.roll) / introducer.turn)
    gives = (push - at.push) * ahead + (torque - at.torque) * turn < 0.0
    return WorkBalance(push, torque, pull, way, share, lost, lost - rubbed, large, change, gives)


@merged
def beyond_catheter(handle: Any, k: int, depth: float, balance: WorkBalance) -> WorkBalance:
    """The same for the wire beyond the catheter's tip, as a free body; a way of 0 where it is not judged by itself.

    A hop of a soft tip is lost in the balance of a stiff pair, whose energy changes with the number of segments, too.
    Not with friction, whose steps are short, nor where the wire is pulled back.
    """
    at, nothing = handle.place[0], WorkBalance(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, False)
    if at.next == 0.0 or at.catheter == 0.0 or handle.problem.friction.coefficient > 0.0:
        return nothing
    segment = handle.table.segment
    back = k - segments_at(at.inserted, segment)[0]
    # the first joint whose cell was bare before the step, and is
    cut = math.ceil(k + 0.5 - min(at.inserted - at.catheter, depth - at.next) / segment)
    if back < 0 or cut < back + 2 or cut > k - 2:
        return nothing
    missing, work, change, energy = work_on(handle.problem, cut, k, back)
    large = tol.WORK_SHARE * work + tol.ENERGY_SHARE * energy + _least_energy(handle.problem, k)
    push, torque, pull = balance.push, balance.torque, balance.pull
    return WorkBalance(push, torque, pull, balance.way, balance.share, missing, missing, large, change, balance.gives)


@merged
def hops(handle: Any, balance: WorkBalance, used: int) -> bool:
    """Whether a wire may have hopped over a barrier, as at the neck of a sac; no reason to doubt shorter steps as well.

    Not where the relaxation began far above: from there it meets unstable states on any way.
    """
    problem, missing, large = handle.problem, balance.missing, balance.large
    if handle.report[0].start > tol.FAR_ABOVE * energy_of(problem, CURRENT):
        return False
    if problem.scratch.descent[0].forked != 0 and abs(missing) > tol.FORKS * large:
        return True
    return used > tol.SWIFT and missing < -large - tol.CHANGE_SHARE * balance.share * balance.change


@merged
def astray(handle: Any, ahead: WorkBalance, used: int, moved: float) -> bool:
    """Whether shorter steps may lead the wire beyond the catheter elsewhere; no reason to doubt these as well."""
    strays = used > tol.SWIFT and (moved > tol.FURTHER * ahead.way or handle.problem.scratch.descent[0].forked != 0)
    strays = strays and abs(ahead.missing) > tol.STRAYS * ahead.large
    return strays or doubt(ahead, used, handle.place[0].shrink, handle.report[0].pivot, moved)


@inlined
def gives_way(balance: WorkBalance) -> bool:
    """Whether more is missing than the trapezium rule explains."""
    return balance.missing > balance.large + tol.CHANGE_SHARE * balance.share * balance.change


@inlined
def doubt(balance: WorkBalance, used: int, shrink: float, pivot: float, moved: float) -> bool:
    """Whether a shorter step may lead elsewhere. used, shrink, pivot : of the step. moved : longest way of a joint."""
    missing, large = balance.missing, balance.large
    # a step that the tip's sight alone keeps short is easier than a long one
    toil = tol.TOIL * max(min(balance.share, 1.0), tol.SIGHT_SHARE) if shrink == 1.0 else tol.TOIL
    some = abs(missing) > (tol.FREE_SHARE if pivot < tol.FREE else tol.SOFT_SHARE) * large
    if (used > toil and (some or pivot < tol.SOFT)) or abs(missing) > tol.STRANGE * large + balance.change:
        return True
    if pivot < tol.SOFT:
        return used > tol.EASY and some
    further = used >= tol.EASY and moved > tol.FURTHER * balance.way
    if further and balance.gives and abs(missing) > tol.GIVES * balance.change:
        return True
    large += tol.CHANGE_SHARE * balance.share * balance.change
    return (used > tol.EASY and missing > large) or (used > tol.SWIFT and missing < -tol.GAINED * large)


@merged
def remember(problem: Problem, at: Any, k: int, reached: tuple[float, float, float]) -> None:
    """Keep the wire that a rough step led to, to compare the one of shorter steps with it."""
    at.rough_depth, at.rough_roll, at.rough_catheter = reached[0], reached[1], at.next
    at.rough_since_doubt = at.since_doubt
    # rounding may decide to which side a straight wire turns that touched nothing: both ways may agree by chance
    at.rough_pivot = tol.LOOSE if at.energy > 0.0 else tol.FREE
    for n in range(k + 1):
        store3(problem.scratch.seen, n, load3(problem.state.x[CURRENT], n))


@merged
def trust(handle: Any, k: int, reached: tuple[float, float, float], doubtful: bool) -> None:
    """Count the way since the wire gave way, or could have: for DOUBT_LASTS_MM it may lie elsewhere.

    A rough step is forgotten where shorter ones lead to the same wire without a snap, unless the wire is about to give
    way: rounding may have decided before to which side such a wire turns.
    """
    problem, at, report = handle.problem, handle.place[0], handle.report[0]
    ahead = abs(reached[0] - at.inserted)
    if problem.friction.coefficient > 0.0:
        ahead *= tol.HELD_SHARE
    if report.pivot > tol.STIFF or at.since_doubt >= tol.DOUBT_LASTS_MM:
        at.since_doubt += ahead
    if doubtful or report.pivot < tol.CRITICAL:
        at.since_doubt = min(at.since_doubt, 0.0)
    left = abs(reached[0] - at.rough_depth) + abs(reached[1] - at.rough_roll) + abs(at.next - at.rough_catheter)
    if left < tol.MATCH_DEPTH_MM:
        same = farthest(problem.scratch.seen, 0, problem.state.x[CURRENT], 0, k + 1) < tol.SAME_MM
        same = same and at.refining_failed == 0.0 and report.pivot > at.rough_pivot
        at.since_doubt = at.rough_since_doubt + ahead if same else min(at.since_doubt, 0.0)
        at.rough_depth, at.refining_failed = math.nan, 0.0


@merged
def way_of_joints(problem: Problem, at: Any, k: int, segment: float) -> float:
    """Largest way of a joint in this step, mm. Joints are counted from the tip: there they stay with the material.

    The one at the entry is no piece of the wire: where their number changes, its partner may lie half a segment further
    on. In a catheter that was a snap of a wire that lay still; elsewhere it only asks for shorter steps, and these find
    where friction lets go.
    """
    x, was = problem.state.x, segments_at(at.inserted, segment)[0]
    common, other = min(k, was), 1 if at.next > 0.0 else 0
    return farthest(x[CURRENT], k - common + other, x[LAST_GOOD], was - common + other, common + 1 - other)


@merged
def note_snap(problem: Problem, at: Any, ways: tuple[float, float], reached: tuple[float, float]) -> None:
    """Write down that a wire snapped, or turned to one of two sides; where there are too many, over the last one.

    ways : the largest of a joint, and how far off the other side is, 0 for none, mm.     reached : the depth, mm, and
    the energy released, N mm.
    """
    snaps = problem.scratch.snaps
    snap = snaps[min(at.snaps, snaps.size - 1)]
    at.snaps = min(at.snaps + 1, snaps.size)
    snap.from_mm, snap.to_mm, snap.released_N_mm = at.inserted, reached[0], max(reached[1], 0.0)
    snap.moved_mm, snap.other_mm = ways
