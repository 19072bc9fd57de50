"""Insertions in lock-step: each lane goes its own way from depth to depth, and all that relax do so together.

Before and after the relaxation of a step, each wire does by itself what ``insertion`` says.
"""

import math
from typing import Any, NamedTuple

from solver import _tolerances as tol
from solver._kernels import data
from solver._kernels.bare import bare
from solver._kernels.data import CURRENT, Problem
from solver._kernels.energy import energy_of, load_moved, stiffest
from solver._kernels.flags import kernel, merged, released
from solver._kernels.forces import copy_state, forget_forces
from solver._kernels.forks import back_again, turned_aside
from solver._kernels.insertion import accept_or_revert, begin_step, collect, extrapolation_factor
from solver._kernels.lanes.block import Block
from solver._kernels.lanes.decide import ALONE, DONE, IDLE, NEW, READY, RESTED, STOPPED, SWEEP, WAITING
from solver._kernels.lanes.relax import POOL, Team, do_round, hand_over, take_over
from solver._kernels.lanes.start import Desk, chosen_start
from solver._kernels.lanes.vectors import WIDTH, in_lanes
from solver._kernels.minimise import begin, shape_of
from solver._kernels.pace import adapt_step, at_goal, next_target, prepare
from solver._kernels.snaps import may_fork
from solver._kernels.spring_back import rests


class Plan(NamedTuple):
    """Where the wires go, and room for what they find there; the first axis is the wire, the second the depth.

    goal : (POOL, d, 2) depth, mm, and roll, degrees.     count : (POOL,) how many of them.
    row : (POOL, d) where a solution's joints begin in x, r and force, (POOL, rows, ...).
    ended : (POOL, d, 3) outcome, iterations, segments.     place, report, energies, counters : (POOL, d) records.
    snaps : (POOL, d, n) records.     blank : (1,), counters at 0.
    """

    goal: Any
    count: Any
    row: Any
    x: Any
    r: Any
    force: Any
    ended: Any
    place: Any
    report: Any
    energies: Any
    counters: Any
    snaps: Any
    blank: Any


@released
def advance_together(wires: Any, plan: Plan, records: Any, raw: Block, first: Any) -> None:
    """Lead each wire that is NEW through all its depths."""
    block = Block(
        in_lanes(raw.length), in_lanes(raw.bend), in_lanes(raw.rest), in_lanes(raw.hold), in_lanes(raw.u),
        in_lanes(raw.x), in_lanes(raw.r), in_lanes(raw.gain), in_lanes(raw.site), in_lanes(raw.touch),
        in_lanes(raw.load), in_lanes(raw.force), in_lanes(raw.torque),
        raw.asked, in_lanes(raw.found), in_lanes(raw.number),
    )  # fmt: skip
    plan, raw, (lanes, nows, counts, seats) = bare(plan), bare(raw), bare(records)
    desk = Desk(raw.asked, raw.found, in_lanes(raw.found))
    team = Team(wires, lanes, nows, counts, seats, bare(first), desk, wires[0].problem.field)
    for w in range(POOL):
        if lanes[w].phase == NEW:
            lanes[w].goal, lanes[w].tolerance = -1, wires[w].limits.tolerance
            next_goal(team, plan, w)
            proceed(team, plan, w)
    working = 0
    for lane in range(WIDTH):
        working += take_next(team, raw, lane)
    while working > 0:
        do_round(team, block, raw, raw.number)
        for lane in range(WIDTH):
            w = seats[lane].wire
            if lanes[w].phase == DONE or lanes[w].phase == RESTED:
                finish(team, plan, raw, lane)
                working += take_next(team, raw, lane) - 1


@kernel
def next_goal(team: Team, plan: Plan, w: int) -> None:
    """Set the next depth as the goal of a wire, or let it idle where there is none."""
    me, wire = team.lanes[w], team.wires[w]
    me.goal += 1
    me.phase, me.k, team.nows[w].first_free = IDLE, 0, 0
    if me.goal < plan.count[w]:
        wire.problem.scratch.counters[0] = plan.blank[0]
        me.limit = prepare(wire, plan.goal[w, me.goal, 0], plan.goal[w, me.goal, 1])
        me.outcome, me.iterations, me.phase = data.CONVERGED, 0, READY


@kernel
def take_next(team: Team, raw: Block, lane: int) -> int:
    """Give a lane the shortest wire that waits for one; return 0 where none does.

    So all go in at the same pace: the gains of eight wires take as long as those of the longest.
    """
    best = POOL
    for w in range(POOL):
        if team.lanes[w].phase == WAITING and (best == POOL or team.lanes[w].k < team.lanes[best].k):
            best = w
    team.seats[lane].wire, team.seats[lane].filled = best, 0
    if best == POOL:
        return 0
    me, wire = team.lanes[best], team.wires[best]
    take_over(team, raw, lane, wire.problem, wire.report[0])
    me.phase = SWEEP if me.allowed > 0 else ALONE
    return 1


@kernel
def finish(team: Team, plan: Plan, raw: Block, lane: int) -> None:
    """End the relaxation in a lane, and lead its wire to the start of the next one."""
    w = team.seats[lane].wire
    me, wire = team.lanes[w], team.wires[w]
    problem = wire.problem
    now = problem.scratch.descent[0]
    if me.phase == RESTED:
        hand_over(team, raw, lane, problem, wire.report[0])
    if not end_step(me, now, wire, problem):
        proceed(team, plan, w)


@kernel
def proceed(team: Team, plan: Plan, w: int) -> None:
    """Lead a wire on until the next step has to be relaxed or nothing is left to do."""
    me, wire = team.lanes[w], team.wires[w]
    problem, report, at = wire.problem, wire.report[0], wire.place[0]
    now = problem.scratch.descent[0]
    while me.phase != IDLE:
        depth, roll = plan.goal[w, me.goal, 0], plan.goal[w, me.goal, 1]
        if me.phase == STOPPED or at_goal(at, depth, roll):
            write_down(team, plan, w)
            next_goal(team, plan, w)
            continue
        me.depth, me.roll = next_target(wire, depth, roll)
        me.k = begin_step(wire, me.depth, me.roll)
        me.outcome, now.iterations, now.energy = data.CONVERGED, 0, 0.0
        if (me.k > 0 and start_relaxing(me, now, wire, team.desk, report)) or end_step(me, now, wire, problem):
            return


@merged
def start_relaxing(me: Any, now: Any, wire: Any, desk: Desk, report: Any) -> bool:
    """Choose the start of a step's relaxation; False where it rests as it is, or cannot be relaxed."""
    at, problem = wire.place[0], wire.problem
    start = chosen_start(problem, desk, at, me.k, extrapolation_factor(problem, at, me.depth, me.roll))
    return begin_relaxing(me, now, wire, start, report)


@kernel
def begin_relaxing(me: Any, now: Any, wire: Any, start: int, report: Any) -> bool:
    """Let a wire wait for a lane that relaxes the state in a slot, whose energy is known; False as above."""
    k, limits, problem = me.k, wire.limits, wire.problem
    counters = problem.scratch.counters[0]
    counters.relaxations_without_friction += 1
    counters.relaxations_without_twist += 1
    me.allowed = min(limits.max_iterations, max(limits.work - counters.passed, 0) // (k + problem.chain.first[k + 1]))
    begin(now, start, energy_of(problem, start))
    now.forked = now.sprung = 0
    report.start, report.pivot = now.energy, 1.0
    resting = rests(problem, k, now)
    if resting:
        forget_forces(report)
    if now.slot != CURRENT:
        copy_state(problem, now.slot, CURRENT, k)
        now.slot = CURRENT
    finite = math.isfinite(now.energy)
    me.outcome = data.CONVERGED if finite else data.NON_FINITE
    me.stiffest, me.phase = stiffest(problem.chain, k), WAITING
    me.moved = load_moved(problem.chain, problem.state.x[CURRENT], k)
    return finite and not resting


@kernel
def end_step(me: Any, now: Any, wire: Any, problem: Problem) -> bool:
    """End a relaxation as ``minimise.relax_with_friction`` and ``insertion.step`` do; True where another one follows.

    That is the one on the other side. Without it the step is kept or taken back, as in ``insertion.step_until``.
    """
    problem.scratch.counters[0].passed += now.iterations * (me.k + problem.chain.first[me.k + 1])
    if me.k > 0 and me.outcome == data.CONVERGED:
        me.outcome = shape_of(problem, CURRENT, me.k)
    if not me.aside:
        me.energy, me.used = now.energy, now.iterations
        me.iterations += me.used
        forks = me.k > 0 and me.outcome == data.CONVERGED and may_fork(wire, me.k, me.depth, me.used)
        me.aside = forks and turned_aside(wire, me.k)
        if me.aside and begin_relaxing(me, now, wire, CURRENT, wire.report[0]):
            return True
    other = 0.0
    if me.aside:
        other = back_again(wire, me.k, me.outcome, me.energy, now.energy)
        me.aside, me.outcome = 0, data.CONVERGED
    outcome = accept_or_revert(wire, (me.depth, me.roll, me.energy), me.k, me.outcome, 0, me.used, other)
    goes_on, me.outcome = adapt_step(wire, outcome, me.iterations, me.limit)
    me.phase = READY if goes_on else STOPPED
    return False


@kernel
def write_down(team: Team, plan: Plan, w: int) -> None:
    """Write a wire at its depth, with what was counted on the way, into the plan."""
    me, wire = team.lanes[w], team.wires[w]
    state, counters, goal = wire.problem.state, wire.problem.scratch.counters[0], me.goal
    wire.place[0].shrink = max(wire.place[0].shrink, 8 * tol.SMALLEST_STEP)
    k = collect(wire, 0)
    counted = team.counts[w]
    counters.sweeps += counted.sweeps
    counters.rollouts += counted.rollouts
    counters.levenberg += counted.levenberg
    counters.joints_left_still += counted.joints_left_still
    counters.starts_at_rest += counted.starts_at_rest
    counters.wall_look_ups += counted.wall_look_ups
    counters.wall_look_ups_proven_unnecessary += counted.wall_look_ups_proven_unnecessary
    team.counts[w] = plan.blank[0]
    plan.ended[w, goal, 0], plan.ended[w, goal, 1], plan.ended[w, goal, 2] = me.outcome, me.iterations, k
    plan.place[w, goal], plan.report[w, goal] = wire.place[0], wire.report[0]
    plan.energies[w, goal], plan.counters[w, goal] = state.energies[CURRENT], counters
    for n in range(wire.place[0].snaps):
        plan.snaps[w, goal, n] = wire.problem.scratch.snaps[n]
    x, r, row = state.x[CURRENT], state.r[CURRENT], plan.row[w, goal]
    for n in range(k + 1):
        for a in range(3):
            plan.x[w, row + n, a], plan.force[w, row + n, a] = x[n, a], wire.force[n, a]
            for c in range(3):
                plan.r[w, row + n, a, c] = r[n, a, c]
