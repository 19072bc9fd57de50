"""Where a step starts: laid along a curve with exact segment lengths, and bent as the last step was.

A wire pushed on goes straight ahead of its tip into the wall and has to be bent there, much as in the step before: what
relaxing the last step changed will change again, counted from the tip.
"""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.algebra import apply_transposed, dot, load9, minus, scaled, store3, store9, times
from solver._kernels.chain import lay_out
from solver._kernels.crossing import crossed
from solver._kernels.data import CURRENT, LAST_GOOD, TRIAL, Chain, Introducer, Problem, WireTable
from solver._kernels.energy import total_energy
from solver._kernels.flags import cached, entry_point, inlined, kernel, merged
from solver._kernels.friction import anchor_friction
from solver._kernels.joint import spin
from solver._kernels.rollout import copy_base, place
from solver._kernels.rotation import bend_to, bent, bent_to, with_twist
from solver._kernels.sleeve import put_over, uncover


@inlined
def leaving(a: Any, b: Any, centre: Any, radius: float) -> float:
    """Where, between 0 and 1, the segment a -> b leaves the sphere around ``centre``; above 1 if it does not."""
    q = minus(b, centre)
    # a segment that ends inside does not leave: no root to take
    if dot(q, q) < radius * radius:
        return 2.0
    p, d = minus(a, centre), minus(b, a)
    aa, ab, bb = dot(p, p), dot(p, d), dot(d, d)
    if bb <= 0.0:
        return 2.0
    root = ab * ab - bb * (aa - radius * radius)
    if root < 0.0:
        return 2.0
    return float((-ab + math.sqrt(root)) / bb)


@entry_point
def follow(curve: Any, m: int, chain: Chain, u: Any, x: Any, r: Any, joints: tuple[int, int]) -> None:
    """Lay segments along a polyline (m, 3) from x[0], which lies on its start; fill u, x and frames r.

    Each joint is the first place on the curve at its segment's length from the joint before; past the end the
    last direction continues. r[0] must hold the base frame.
    joints : the first one to bend, up to which the wire lies on the polyline's own joints, and the number of segments.
    """
    at, start = joints[0], 0.0
    for j in range(joints[0], joints[1]):
        length = chain.length[j]
        while at < m - 1:
            t = leaving(curve[at], curve[at + 1], x[j], length)
            if start <= t <= 1.0:
                for a in range(3):
                    x[j + 1, a] = curve[at, a] + t * (curve[at + 1, a] - curve[at, a])
                start = t
                break
            at += 1
            start = 0.0
        if at >= m - 1:
            extend(curve[m - 2], curve[m - 1], x, j, length)
        aim(chain, u, x, r, j)


@kernel
def extend(before: Any, end: Any, x: Any, j: int, length: float) -> None:
    """Place joint j + 1 beyond the end of a curve, along its last direction."""
    d = minus(end, before)
    size = math.sqrt(dot(d, d))
    d = (d[0] / size, d[1] / size, d[2] / size)
    p = minus(x[j], end)
    along = dot(p, d)
    across = dot(p, p) - along * along
    t = along + math.sqrt(max(length * length - max(across, 0.0), 0.0))
    for a in range(3):
        x[j + 1, a] = end[a] + t * d[a]


@inlined
def aim(chain: Chain, u: Any, x: Any, r: Any, j: int) -> None:
    """Bend joint j towards x[j + 1], keeping the twist it has; then put that joint at its exact distance."""
    d = minus(x[j + 1], x[j])
    size = math.sqrt(dot(d, d))
    frame, length = load9(r, j), chain.length[j]
    # a joint on top of the one before has no direction: it keeps the one before
    way = scaled(1.0 / size, d) if size > 0.0 else (frame[2], frame[5], frame[8])
    twist, early = u[j, 2], chain.early[0] if j == 0 else 0.0
    if early > 0.0:
        frame = times(frame, spin(early * twist))
    p = apply_transposed(frame, way)
    # of length 1 to the last digit: what a frame's columns lack would double from joint to joint
    p = scaled(1.5 - 0.5 * dot(p, p), p)
    turn0, turn1 = bend_to(p)
    turn = with_twist(turn0, turn1, (1.0 - early) * twist)
    store3(u, j, (turn[0], turn[1] - chain.rest[j], twist if early > 0.0 else turn[2]))
    if turn[2] == 0.0 and p[2] > 0.0:
        # the turn and the joint straight from the direction: the next joint need not wait for the control
        frame = times(frame, bent_to(p))
    else:
        frame = times(frame, bent(turn))
        way = (frame[2], frame[5], frame[8])
    store9(r, j + 1, frame)
    for a in range(3):
        x[j + 1, a] = x[j, a] + length * way[a]


@cached
def extrapolate_start(problem: Problem, at: Any, k: int, share: float) -> int:
    """``chosen``, with the wall looked up at one point after the other."""
    return chosen(problem, at, k, share, energy_of_start, problem)


@kernel
def energy_of_start(problem: Problem, _: Problem, slot: int, k: int) -> float:
    """Energy of a start, N mm."""
    return total_energy(problem, slot, 0, k)


@merged
def chosen(problem: Problem, at: Any, k: int, share: float, energy: Any, desk: Any) -> int:
    """Return the slot to start from: CURRENT, or TRIAL with a share of the last change where that is clearly lower.

    TRIAL must lie in the same lumen (no wall between them). Compared are both energies above the one that the hand's
    push leads to; where TRIAL's is a small part of what CURRENT's was when last computed (``at.rise``), CURRENT's is
    not computed. The energy of the slot that is returned is known then.     at : the record ``records.PLACE``.
    energy : of a slot, from (problem, desk, slot, k).
    """
    goal = at.energy - at.stored + at.push * share * at.last_step
    change_again(problem, k, share)
    rise, asked = math.inf, share != 0.0 and at.rise > 0.0
    if asked:
        foresee(problem, k)
        rise = energy(problem, desk, TRIAL, k) - goal
    if not (rise < tol.SURELY_FORESEEN * at.rise and not crossed(problem, CURRENT, k)):
        at.rise = energy(problem, desk, CURRENT, k) - goal
        if share == 0.0 or problem.state.energies[CURRENT].wall == 0.0:
            at.rise = 0.0
            return CURRENT
        if not asked:
            foresee(problem, k)
            rise = energy(problem, desk, TRIAL, k) - goal
        if not (rise < tol.WORTH_FORESEEING * at.rise and not crossed(problem, CURRENT, k)):
            return CURRENT
    else:
        at.rise *= tol.STILL_RISES
    problem.scratch.counters[0].starts_foreseen += 1
    return TRIAL


@inlined
def change_again(problem: Problem, k: int, share: float) -> None:
    """Store CURRENT's controls as the start of the step; set TRIAL's to them plus a share of the last change."""
    scratch, u, tried = problem.scratch, problem.state.u[CURRENT], problem.state.u[TRIAL]
    for j in range(k):
        for a in range(3):
            scratch.start[j, a] = u[j, a]
            tried[j, a] = u[j, a] + share * scratch.change[k - 1 - j, a]


@kernel
def foresee(problem: Problem, k: int) -> None:
    """Lay the TRIAL state out from its controls."""
    copy_base(problem.state, CURRENT, TRIAL)
    place(problem.chain, problem.state, TRIAL, k)


@merged
def note_change(problem: Problem, slot: int, k: int) -> None:
    """Remember how relaxing changed the start of this step."""
    u, scratch = problem.state.u[slot], problem.scratch
    for j in range(k):
        for a in range(3):
            scratch.change[k - 1 - j, a] = u[j, a] - scratch.start[j, a]
    for m in range(k, scratch.change.shape[0]):
        scratch.change[m, 0] = scratch.change[m, 1] = scratch.change[m, 2] = 0.0


@cached
def lay_along(
    problem: Problem, table: WireTable, introducer: Introducer, was: int, k: int, first: float, ahead: float
) -> None:
    """Lay the wire of the last good state, pushed on by ``ahead`` mm, along its own curve: the start of a step."""
    chain, state = problem.chain, problem.state
    before = chain.length[0]
    lay_out(chain, table, k, first)
    put_over(chain, table, k)
    if problem.twisting:
        # twist stays with the material, which is counted from the tip
        for j in range(k):
            # the first joint twists with the shaft outside, wherever the material is
            common = j >= k - min(was, k) and (table.shaft == 0.0 or (j > 0 and was - k + j > 0))
            state.u[CURRENT, j, 2] = state.u[LAST_GOOD, was - k + j, 2] if common else 0.0
        if table.shaft > 0.0 and was > 0:
            state.u[CURRENT, 0, 2] = state.u[LAST_GOOD, 0, 2]
    put_load(chain, introducer, k)
    source, count = LAST_GOOD, was + 1
    if was == 0:
        source, count = TRIAL, begin(introducer, state.x[TRIAL])
    elif introducer.translate and ahead != 0.0:
        source, count = TRIAL, moved(introducer, table, state.x, was, before, ahead)
    # moved on by whole segments, the joints of a straight wire lie where joints lay, and are there already
    lies = problem.straight and source == LAST_GOOD and abs(chain.length[0] - before) < tol.SAME_LENGTH_MM
    joints = (min(was, k) if lies and same_base(state.r) else 0, k)
    follow(state.x[source], count, chain, state.u[CURRENT], state.x[CURRENT], state.r[CURRENT], joints)
    if problem.friction.coefficient > 0.0:
        uncover(problem.friction, chain, table, k)
        anchor_friction(problem, was, k, ahead, table.shaft)


@inlined
def same_base(r: Any) -> bool:
    """Whether the base is turned as in the last good state."""
    same = True
    for a in range(3):
        for b in range(3):
            same = same and r[CURRENT, 0, a, b] == r[LAST_GOOD, 0, a, b]
    return same


@kernel
def put_load(chain: Chain, introducer: Introducer, k: int) -> None:
    """Put the dead load on the tip and none elsewhere."""
    for n in range(k + 1):
        for a in range(3):
            chain.load[n, a] = introducer.load[a] if n == k else 0.0


@merged
def begin(introducer: Introducer, curve: Any) -> int:
    """Fill a curve with two points straight on from the entry; return their number."""
    for a in range(3):
        curve[0, a] = introducer.entry[a]
        curve[1, a] = introducer.entry[a] + introducer.frame[a, 2]
    return 2


@kernel
def moved(introducer: Introducer, table: WireTable, x: Any, was: int, first: float, ahead: float) -> int:
    """Section 4.1 of the seed: fill x[TRIAL] with the last good wire moved by ``ahead`` mm along the entry direction.

    The curve begins at the entry. Returns the number of its points.
    """
    curve, count = x[TRIAL], begin(introducer, x[TRIAL]) - 1
    for n in range(was + 1):
        arc = first + (n - 1) * table.segment if n > 0 else 0.0
        if ahead > 0.0 or arc > -ahead:
            for a in range(3):
                curve[count, a] = x[LAST_GOOD, n, a] + ahead * introducer.frame[a, 2]
            count += 1
    return max(count, 2)
