"""Where a wire could have turned to the other side as well: a decision that is made by less than anyone can tell.

A wire pushed beyond what it bears straight, or on to the carina of a fork, leaves its way for one of two sides. Where
they are equal rounding decides, and where they are nearly so the length of the steps.
"""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.algebra import dot, load3, minus, scaled, store3
from solver._kernels.data import CONVERGED, CURRENT, SPARE, TRIAL, Problem
from solver._kernels.energy import bending_energy, energy_of, total_energy
from solver._kernels.flags import kernel, merged
from solver._kernels.forces import copy_state
from solver._kernels.friction import take_loads
from solver._kernels.minimise import relax_with_friction
from solver._kernels.newton import sweep
from solver._kernels.rollout import copy_base, limited, place, rollout
from solver._kernels.saddle import hold_all_but, turn_joint
from solver._kernels.septum import through_wall


@merged
def other_side(handle: Any, k: int) -> float:
    """How far from the wire at rest another one lies that is as low, on the other side, mm; 0 where there is none.

    What the step changed is mirrored, and relaxed from there: that leads back, unless there are two sides. State,
    report and friction are left as they were found, and what a step needs that is taken back.
    """
    problem, state, report = handle.problem, handle.problem.state, handle.report[0]
    energy, apart = energy_of(problem, CURRENT), 0.0
    handle.report[2] = report
    if mirrored(problem, k, report):
        total_energy(problem, CURRENT, 0, k)
        outcome, _, _, other = relax_with_friction(problem, CURRENT, k, handle.limits, report)
        if outcome == CONVERGED and abs(other - energy) < tol.AS_LOW * abs(energy):
            apart = farthest(state.x[CURRENT], 0, state.x[SPARE], 0, k + 1)
        if apart > tol.APART_MM and through_wall(problem.field, state.x[CURRENT], k, handle.introducer.margin):
            apart = 0.0
        copy_state(problem, SPARE, CURRENT, k)
        if problem.friction.coefficient > 0.0:
            take_loads(problem, CURRENT, k)
        if problem.shaft.drag > 0.0:
            total_energy(problem, CURRENT, 0, k)
    handle.report[0] = handle.report[2]
    return apart if apart > tol.APART_MM else 0.0


@merged
def mirrored(problem: Problem, k: int, report: Any) -> bool:
    """Keep the wire in SPARE, and mirror what the step changed; False, and nothing done, where that is little.

    A wire that the step began to bend is mirrored as a whole; one that was bent before where it yields most easily.
    """
    state, start = problem.state, problem.scratch.start
    bent, back = bending_energy(problem.chain, start, k) > tol.AS_LOW * state.energies[CURRENT].bending, 0.0
    # a soft one that began to bend has a ring of sides, as in a sphere, and is judged by what long and short steps say
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
        store3(u, i, limited(now, change))
    place(problem.chain, state, CURRENT, k)
    return True


@merged
def along_softest_way(problem: Problem, k: int, report: Any) -> float:
    """How many times the way from CURRENT to TRIAL, the softest, mirrors what the step changed along it; 0 if little.

    The start of the step comes to lie in SPARE.
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
    """Describe in the report the way in which the wire yields most easily; False where it yields to no push.

    That is to the bath of ``newton.sweep`` with its sign turned round, hard enough for the wire to give way, but only
    just: the direction found then is the one that is least stiff for how far the joints move.
    """
    firm, push = 0.0, tol.SOFTEST
    while push < tol.WORST_DAMPING and sweep(problem, CURRENT, 0, k, -push, report):
        firm, push = push, 10.0 * push
    for _ in range(2):
        between = math.sqrt(firm * push)
        if sweep(problem, CURRENT, 0, k, -between, report):
            firm = between
        else:
            push = between
    return not sweep(problem, CURRENT, 0, k, -push, report)


@merged
def farthest(a: Any, at: int, b: Any, to: int, count: int) -> float:
    """Largest distance of ``count`` joints of two wires, mm, from joint ``at`` of one and ``to`` of the other on."""
    most = 0.0
    for m in range(count):
        way = minus(load3(a, at + m), load3(b, to + m))
        most = max(most, dot(way, way))
    return math.sqrt(most)
