"""The way to a depth: steps of the base, each laid along the wire's own curve, relaxed, and taken back if it fails.

One compiled loop, because a step costs a few microseconds per joint.
"""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels import data
from solver._kernels.chain import lay_out, segments_at, weigh
from solver._kernels.data import Introducer, Problem
from solver._kernels.flags import cached, inlined, merged, uncounted
from solver._kernels.forces import contact_forces, copy_state, forget_forces, furthest_outside, push_force
from solver._kernels.forks import other_side
from solver._kernels.friction import anchor_friction, friction_loss, settle_friction
from solver._kernels.minimise import relax_with_friction
from solver._kernels.pace import adapt_step, at_goal, next_target, prepare
from solver._kernels.passage import note_passage
from solver._kernels.septum import through_wall
from solver._kernels.shaft import anchor_shaft, loss_by_turning, settle_shaft
from solver._kernels.sleeve import put_over, stored_energy
from solver._kernels.snaps import account, may_fork
from solver._kernels.start import extrapolate_start, lay_along, note_change, put_load


@uncounted
def advance(handle: Any, to_depth: float, to_roll: float, laid: int) -> tuple[int, int, int]:
    """Step to a depth (mm) and roll (degrees); return the outcome, the iterations and the number of segments.

    Place, report, force and state 0 of the handle are those of the wire reached.
    laid : number of segments that are laid out already, to be relaxed where they are; 0 to step there.
    """
    outcome, iterations = step_until(handle, to_depth, to_roll, laid)
    return outcome, iterations, collect(handle, laid)


@cached
def collect(handle: Any, laid: int) -> int:
    """Fill force and report of the wire reached; return its number of segments."""
    k, _ = segments_at(handle.place[0].inserted, handle.table.segment)
    problem, report, force = handle.problem, handle.report[0], handle.force
    for n in range(k + 1):
        force[n, 0] = force[n, 1] = force[n, 2] = 0.0
    report.penetration = report.push = 0.0
    if k > 0 and problem.stiffness > 0.0:
        report.penetration = contact_forces(problem, k, force)
    if k > 0:
        weight = handle.introducer.weight
        report.push = push_force(problem, handle.table, weight, k, report) if laid > 0 else handle.place[0].push
    return k


@merged
def step_until(handle: Any, to_depth: float, to_roll: float, laid: int) -> tuple[int, int]:
    """Step until the goal is reached or no step succeeds; return the outcome and the iterations."""
    limit = prepare(handle, to_depth, to_roll)
    outcome, iterations = data.CONVERGED, 0
    while laid > 0 or not at_goal(handle.place[0], to_depth, to_roll):
        outcome, used = step(handle, to_depth, to_roll, laid)
        iterations += used
        if laid > 0:
            break
        goes_on, outcome = adapt_step(handle, outcome, iterations, limit)
        if not goes_on:
            break
    handle.place[0].shrink = max(handle.place[0].shrink, 8 * tol.SMALLEST_STEP)
    return outcome, iterations


@merged
def step(handle: Any, to_depth: float, to_roll: float, laid: int) -> tuple[int, int]:
    """Take one step towards a depth and roll, or take it back where it fails; return outcome and iterations.

    A wire that is laid out already is relaxed as it lies, and stays where that leads it.
    """
    problem, at = handle.problem, handle.place[0]
    depth, roll, k = to_depth, to_roll, laid
    if laid > 0:
        if problem.friction.coefficient > 0.0:
            copy_state(problem, data.CURRENT, data.LAST_GOOD, k)
            anchor_friction(problem, k, k, 0.0, 0.0)
    else:
        depth, roll = next_target(handle, to_depth, to_roll)
        k = begin_step(handle, depth, roll)
    outcome, used, most, energy, other = data.CONVERGED, 0, 0, 0.0, 0.0
    if k > 0:
        weigh(problem.chain, handle.introducer.weight, k)
        start = extrapolate_start(problem, at, k, extrapolation_factor(problem, at, depth, roll))
        outcome, used, most, energy = relax_with_friction(problem, start, k, handle.limits, handle.report[0])
        if start != data.CURRENT:
            copy_state(problem, start, data.CURRENT, k)
        if outcome == data.CONVERGED and laid == 0 and may_fork(handle, k, depth, most):
            other = other_side(handle, k)
    return accept_or_revert(handle, (depth, roll, energy), k, outcome, laid, most, other), used


@cached
def accept_or_revert(
    handle: Any, reached: tuple[float, float, float], k: int, outcome: int, laid: int, used: int, other: float
) -> int:
    """Keep the wire where a step led it, or take the step back where it failed; return the outcome.

    reached : depth, mm, roll, degrees, and energy, N mm.     used : iterations, of the relaxation that took most.
    other : see ``forks.other_side``.
    """
    problem, at, (depth, roll, energy) = handle.problem, handle.place[0], reached
    energy -= problem.state.energies[data.CURRENT].friction
    if outcome == data.CONVERGED and problem.stiffness > 0.0:
        outcome = classify(problem, handle.introducer.margin, k, laid)
    # without a catheter its table is not asked for: to take it out of the handle costs 3 % of a step
    stored = stored_energy(handle.table, depth) if at.next != 0.0 else 0.0
    energy += stored
    if outcome == data.CONVERGED and laid == 0:
        outcome = account(handle, k, (depth, roll, energy), used, other)
    elif outcome == data.CONVERGED and handle.report[0].pivot < tol.CRITICAL:
        at.since_doubt = 0.0
    if laid > 0 or outcome == data.CONVERGED:
        if laid == 0:
            note_passage(problem, at, k, depth, handle.table.segment)
        note_change(problem, data.CURRENT, k)
        at.last_step, at.last_turn = depth - at.inserted, roll - at.roll
        at.inserted, at.roll, at.energy = depth, roll, energy
        at.catheter, at.stored = at.next, stored
        if problem.friction.coefficient > 0.0:
            at.rubbed += friction_loss(problem, k, at.last_step)
            settle_friction(problem, k)
        if problem.shaft.drag > 0.0:
            # what turned the wire at the entry took is in the work of the hand's torque already
            at.dissipated -= loss_by_turning(problem, k)
            slid = settle_shaft(problem, k)
            at.rubbed += slid
            at.dissipated += slid
    else:
        revert(handle)
    return outcome


@merged
def classify(problem: Problem, margin: float, k: int, laid: int) -> int:
    """Judge where a wire at rest lies: LEFT_GRID, THROUGH_WALL, or CONVERGED where it may lie there."""
    field, x = problem.field, problem.state.x[data.CURRENT]
    if laid == 0 and furthest_outside(field, x, k) > margin:
        return data.LEFT_GRID
    return data.THROUGH_WALL if through_wall(field, x, k, margin) else data.CONVERGED


@inlined
def extrapolation_factor(problem: Problem, at: Any, depth: float, roll: float) -> float:
    """Share of the last step's change to start with: this step's length over its, MOST_FORESEEN at most; 0 where it is
    of another kind.
    """
    if not problem.skips.foresight or at.last_step == 0.0 or at.last_turn != 0.0 or roll != at.roll:
        return 0.0
    return float(min(max((depth - at.inserted) / at.last_step, 0.0), tol.MOST_FORESEEN))


@cached
def begin_step(handle: Any, depth: float, roll: float) -> int:
    """Keep the last good state and lay the wire out at a new depth and roll; return its number of segments."""
    problem, table, introducer = handle.problem, handle.table, handle.introducer
    inserted, report = handle.place[0].inserted, handle.report[0]
    was, _ = segments_at(inserted, table.segment)
    copy_state(problem, data.CURRENT, data.LAST_GOOD, was)
    handle.report[1] = report
    k, first = segments_at(depth, table.segment)
    clamp(problem, introducer, roll)
    table.sleeve.tip[0] = handle.place[0].next
    if problem.shaft.drag > 0.0:
        anchor_shaft(problem, was, depth - inserted, math.radians(roll - handle.place[0].roll))
    if k > 2 and table.tabled:
        problem.scratch.counters[0].joints_without_profile_look_up += k - 2
    if k > 0:
        lay_along(problem, table, introducer, was, k, first, depth - inserted)
        return k
    forget_forces(report)
    parts = problem.state.energies[data.CURRENT]
    report.start = parts.bending = parts.wall = parts.load = parts.friction = 0.0
    return k


@merged
def revert(handle: Any) -> None:
    """Put the last good state back."""
    was, first = segments_at(handle.place[0].inserted, handle.table.segment)
    handle.table.sleeve.tip[0] = handle.place[0].catheter
    if was > 0:
        lay_out(handle.problem.chain, handle.table, was, first)
        put_over(handle.problem.chain, handle.table, was)
        put_load(handle.problem.chain, handle.introducer, was)
    copy_state(handle.problem, data.LAST_GOOD, data.CURRENT, was)
    handle.report[0] = handle.report[1]


@merged
def clamp(problem: Problem, introducer: Introducer, roll: float) -> None:
    """Put the base frame, rolled right-handed about the wire by ``roll`` degrees, at the entry."""
    angle = math.radians(roll)
    c, s = math.cos(angle), math.sin(angle)
    x, r = problem.state.x[data.CURRENT], problem.state.r[data.CURRENT]
    for a in range(3):
        x[0, a] = introducer.entry[a]
        one, two = introducer.frame[a, 0], introducer.frame[a, 1]
        r[0, a, 0], r[0, a, 1], r[0, a, 2] = c * one + s * two, c * two - s * one, introducer.frame[a, 2]
