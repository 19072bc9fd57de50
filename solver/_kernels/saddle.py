"""Off a saddle: a stationary point that is no minimum is left along a direction of negative curvature.

A straight wire under a load beyond its critical one has no moment anywhere, and lies on top of its energy.
"""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.algebra import load3, store3
from solver._kernels.crossing import admissible
from solver._kernels.data import Problem
from solver._kernels.energy import total_energy
from solver._kernels.flags import inlined, kernel, merged
from solver._kernels.newton import sweep
from solver._kernels.rollout import copy_base, place
from solver._kernels.trial import step


@merged
def off_saddle(problem: Problem, k: int, now: Any, noise: float, report: Any) -> float:
    """Lead the trial state off a stationary point that the report describes; return its energy, or inf."""
    trial = leave_saddle(problem, k, now, noise, report)
    if trial == math.inf:
        trial = swing(problem, k, now)
    if trial == math.inf:
        steepest_way(problem, now.slot, k, report)
        trial = leave_saddle(problem, k, now, noise, report)
    return trial


@kernel
def leave_saddle(problem: Problem, k: int, now: Any, noise: float, report: Any) -> float:
    """Leave a stationary point along its direction of negative curvature; return the new energy, or inf."""
    j, slot, gain = int(report.joint), now.slot, problem.scratch.gain
    hold_all_but(gain, j, k)
    size, least = tol.SWING, 0.1 * abs(report.curvature)
    # joints further on may turn a thousand times as far: nothing but rounding ends the search
    while least * size * size > noise:
        for side in (1.0, -1.0):
            turn_joint(gain, side * size, report)
            trial = step(problem, slot, j, k, 1.0)
            if trial < now.energy - least * size * size and admissible(problem, slot, k):
                return trial
        size *= 0.25
    return math.inf


@kernel
def hold_all_but(gain: Any, j: int, k: int) -> None:
    """Set the own steps of joint j and all beyond it in the gains to 0: those beyond then only respond to j's turn."""
    for a in range(3):
        for b in range(7):
            gain[j, a, b] = 0.0
    for i in range(j + 1, k):
        gain[i, 0, 0] = gain[i, 1, 0] = gain[i, 2, 0] = 0.0


@inlined
def turn_joint(gain: Any, size: float, report: Any) -> None:
    """Set the step of the report's joint to a turn by ``size``, rad, in the report's direction."""
    j = report.joint
    for a in range(2):
        gain[j, a, 0] = size * report.bend[a]
    gain[j, 2, 0] = size * report.twist


@merged
def steepest_way(problem: Problem, slot: int, k: int, report: Any) -> None:
    """Put into the report the direction of negative curvature that is left at the largest Levenberg term with one.

    To the direction that was found without that term, neutral joints further on respond with a million times as much,
    far beyond what they can turn; with it, no joint is neutral.
    """
    damping, last = tol.LEAST_DAMPING, 0.0
    while damping < tol.WORST_DAMPING and not sweep(problem, slot, 0, k, damping, report):
        last, damping = damping, 6 * damping
    sweep(problem, slot, 0, k, last, report)


@merged
def swing(problem: Problem, k: int, now: Any) -> float:
    """Turn the whole wire, rigid, at its base; return the new energy, or inf where it is not lower.

    A free wire far beyond its critical load is down after half the iterations that a curl from its tip takes.
    """
    state, slot = problem.state, now.slot
    u = state.u[1 - slot]
    for j in range(k):
        store3(u, j, load3(state.u[slot], j))
    u[0, 0] += tol.SWING
    copy_base(state, slot, 1 - slot)
    place(problem.chain, state, 1 - slot, k)
    trial = total_energy(problem, 1 - slot, 0, k)
    enough = trial < now.energy - tol.SWING * tol.SWING * problem.chain.bend[0]
    return trial if enough and admissible(problem, slot, k) else math.inf
