"""Where a wire could have turned to the other side as well, so that the side it took means nothing.

A wire that buckles, or is pushed on to the carina of a fork, turns to one of two sides. Where these are equal, rounding
decides; where they are nearly equal, the length of the steps does.
"""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.algebra import dot, farthest, load3, minus, scaled, store3
from solver._kernels.data import CONVERGED, CURRENT, SPARE, TRIAL, Problem
from solver._kernels.energy import bending_energy, energy_of, total_energy
from solver._kernels.flags import cached, inlined, kernel, merged
from solver._kernels.forces import copy_state
from solver._kernels.friction import take_loads
from solver._kernels.minimise import relax_with_friction
from solver._kernels.newton import sweep
from solver._kernels.rollout import copy_base, place, rollout, stepped
from solver._kernels.saddle import hold_all_but, turn_joint
from solver._kernels.septum import through_wall


@merged
def other_side(handle: Any, k: int) -> float:
    """Largest distance, mm, of a joint from a second rest shape of equal energy, on the other side; 0 if there is none.

    What the step changed is mirrored, and relaxed from there: that leads back, unless there are two sides. State,
    report and friction are left as they were, and so is LAST_GOOD, for a step that is taken back.
    """
    problem, report = handle.problem, handle.report[0]
    energy = energy_of(problem, CURRENT)
    if not turned_aside(handle, k):
        return 0.0
    outcome, _, _, other = relax_with_friction(problem, CURRENT, k, handle.limits, report)
    return back_again(handle, k, outcome, energy, other)


@cached
def turned_aside(handle: Any, k: int) -> bool:
    """Mirror what the step changed, and keep what it led to; False where that is not worth a relaxation."""
    report = handle.report[0]
    handle.report[2] = report
    worth = mirrored(handle.problem, k, report)
    if worth:
        total_energy(handle.problem, CURRENT, 0, k)
    handle.report[0] = handle.report[2]
    return worth


@kernel
def back_again(handle: Any, k: int, outcome: int, energy: float, other: float) -> float:
    """Put back what the step led to; return the result of ``other_side``.

    outcome : of the relaxation on the other side, which led to the energy ``other``; ``energy`` : the step's own, N mm.
    """
    problem, state, apart = handle.problem, handle.problem.state, 0.0
    if outcome == CONVERGED and abs(other - energy) < tol.AS_LOW * abs(energy):
        apart = farthest(state.x[CURRENT], 0, state.x[SPARE], 0, k + 1)
    if apart > tol.APART_MM and through_wall(problem.field, state.x[CURRENT], k, handle.introducer.margin):
        apart = 0.0
    copy_state(problem, SPARE, CURRENT, k)
    if problem.friction.coefficient > 0.0:
        take_loads(problem, CURRENT, k, 1.0)
    if problem.shaft.drag > 0.0:
        total_energy(problem, CURRENT, 0, k)
    handle.report[0] = handle.report[2]
    # the step's own relaxation met an unstable state, or there would have been no look to the other side
    problem.scratch.descent[0].forked = 1
    return apart if apart > tol.APART_MM else 0.0


@merged
def mirrored(problem: Problem, k: int, report: Any) -> bool:
    """Copy the wire to SPARE and mirror in CURRENT what the step changed; return False instead where that is little.

    A wire that was straight before the step is mirrored as a whole, one that was bent or is soft in its softest mode.
    """
    state, start = problem.state, problem.scratch.start
    bent, back = bending_energy(problem.chain, start, k) > tol.AS_LOW * state.energies[CURRENT].bending, 0.0
    # a soft one that began to bend may turn to a whole ring of sides, as in a sphere: long and short steps judge that
    bent = bent or report.pivot < tol.SOFT
    if bent:
        back = along_softest_way(problem, k, report)
        if back == 0.0:
            return False
    copy_state(problem, CURRENT, SPARE, k)
    u, aside = state.u[CURRENT], state.u[TRIAL]
    for i in range(k):
        now = load3(u, i)
        change = scaled(back, minus(load3(aside, i), now)) if bent else scaled(2.0, minus(load3(start, i), now))
        store3(u, i, stepped(problem.chain, i, now, change))
    place(problem.chain, state, CURRENT, k)
    return True


@merged
def along_softest_way(problem: Problem, k: int, report: Any) -> float:
    """Factor on the softest mode that mirrors what the step changed along it; 0 where that is little.

    Lays the wire displaced by that mode out in TRIAL, and the start of the step in SPARE.
    """
    chain, state = problem.chain, problem.state
    if not softest_way(problem, k, report):
        return 0.0
    j, gain = int(report.joint), problem.scratch.gain
    hold_all_but(gain, j, k)
    turn_joint(gain, tol.SLIGHT, report)
    rollout(problem, CURRENT, j, k, 1.0)
    for i in range(k):
        store3(state.u[SPARE], i, load3(problem.scratch.start, i))
    copy_base(state, CURRENT, SPARE)
    place(chain, state, SPARE, k)
    along, square, most = 0.0, 0.0, 0.0
    for n in range(1, k + 1):
        at, hold = load3(state.x[CURRENT], n), chain.bend[n - 1] / (chain.length[n - 1] * chain.length[n - 1])
        way, change = minus(load3(state.x[TRIAL], n), at), minus(at, load3(state.x[SPARE], n))
        along, square = along + hold * dot(way, change), square + hold * dot(way, way)
        most = max(most, dot(way, way))
    back = -2.0 * along / square
    # written so that NaN, of a direction that leads nowhere, is little too
    return back if abs(back) * math.sqrt(most) > tol.ELSEWHERE_MM else 0.0


@kernel
def softest_way(problem: Problem, k: int, report: Any) -> bool:
    """Put the wire's softest mode into the report; False where none is found.

    Under the least of the negative Levenberg terms (``newton.sweep``) that make the wire give way, the direction that
    is found is the least stiff one for how far the joints move. The search begins at the wire's last term: mostly that
    one still makes it give way and the next smaller one does not, which takes 2 sweeps instead of 10.
    """
    now = problem.scratch.descent[0]
    firm, gives, stride, swept, term = -1, tol.RUNGS, 1, -1, max(now.rung - 1, 0)
    while gives - firm > 1:
        swept = term
        if sweep(problem, CURRENT, 0, k, -term_at(term), report):
            firm = term
        else:
            gives = term
        if gives == tol.RUNGS:
            term = min(term + stride, gives - 1)
        elif firm == -1:
            term = max(term - stride, 0)
        else:
            term = (firm + gives) // 2
        stride *= 2
    now.rung = gives
    # the gains must be those of the term under which it gives way
    return swept == gives or not sweep(problem, CURRENT, 0, k, -term_at(gives), report)


@inlined
def term_at(rung: int) -> float:
    """Size of a negative Levenberg term."""
    return tol.SOFTEST * 10.0 ** (0.25 * rung)  # type: ignore[no-any-return]
