"""Friction, judged from what is published: Coulomb's bound at each joint, and the hand's work over many small steps."""

from collections.abc import Sequence

import numpy as np

from pipeline.benchmark.stress.plan import ScenePlan
from pipeline.benchmark.stress.statics import Array, StaticChain
from solver import Solution

RUBBING_MM = 0.25 * np.arange(8.0)
"""Depths on the way in, beyond the first one; the way out is the same."""
SETTLED = 2e-3
"""Tolerance beyond Coulomb's bound, over the largest contact force: loads are settled to 1e-4, the normals that they
turn to less well, and a stiff wall's last place is lost in a second look-up."""
MADE = 0.02
"""Tolerated energy from nowhere, over the hand's work, beside the error of the trapezium rule."""
SPRING_MM = 1e-3
"""Slip of the springs by which friction holds a point: such a spring stores the work of its load over half of this."""


def rubbed(plan: ScenePlan, chain: StaticChain, solution: Solution) -> tuple[str, Array]:
    """A sentence where friction breaks its law, and the places (k + 1, 3), mm, at which the wall holds the wire.

    Each place is a radius from the axis, along the wall's normal. Valid for a smooth hull looked up at the joints.
    """
    nodes, contact = np.asarray(solution.joints_mm), np.asarray(solution.contact_force_N)
    pressed = chain.contact(nodes, np.asarray(solution.frames))[0]
    load = np.linalg.norm(pressed, axis=1, keepdims=True)
    normal = -pressed / np.where(load > 0.0, load, 1.0)
    rub = contact - pressed
    floor = SETTLED * max(float(load.max()), 1e-12)
    over = float(np.max(np.linalg.norm(rub, axis=1) - plan.friction * load[:, 0]))
    lifts = float(np.max(np.abs(np.sum(rub * normal, axis=1))))
    text = ""
    if over > floor:
        text = f"{over:.3g} N beyond mu N, of loads up to {load.max():.3g} N"
    elif lifts > floor:
        text = f"{lifts:.3g} N along the wall's normal, of loads up to {load.max():.3g} N"
    return text, nodes + chain.wire.radius_mm * normal


def made_energy(plan: ScenePlan, solutions: Sequence[Solution]) -> str:
    """A sentence where the wire and friction got more energy than the hand gave on a way in and out again.

    Work is the trapezium rule over the published push forces; its error is estimated from every second one. The jumps
    that come with a new joint, or where the wire's profile jumps at the entry, cancel on the way in and out. The turn
    is left out: there the force jumps.
    """
    count = len(RUBBING_MM)
    if plan.friction == 0.0 or len(plan.depths) != 2 * count - 1 or len(set(plan.rolls)) > 1:
        return ""
    taken = [*solutions[2 : count - 1], *solutions[count : 2 * count - 3]]
    rubs = np.array([s.friction_energy_N_mm for s in taken])
    if float(rubs.min()) < 0.0:
        return f"friction took {rubs.min():.3g} N mm"
    if not all(s.converged for s in solutions[1:]):
        return ""
    work, error, size, spent, largest, load = [0.0] * 6
    for way in (taken[: len(taken) // 2], taken[len(taken) // 2 :]):
        s, push, energy = np.array([(w.depth_mm, w.push_force_N, w.energy_N_mm) for w in way]).T
        fine = float(np.trapezoid(push, s))
        work, error = work + fine, error + 2.0 * abs(fine - float(np.trapezoid(push[::2], s[::2])))
        size += abs(float(np.trapezoid(np.abs(push), s)))
        spent += energy[-1] - energy[0] + sum(w.friction_energy_N_mm for w in way[1:])
        largest = max(largest, float(np.abs(energy).max()))
        load = max(load, *(float(np.abs(w.contact_force_N).sum()) for w in way))
    kept = SPRING_MM * plan.friction * load + 1e-9 * largest + 1e-15 * max(value for _, value in plan.stiffness)
    if spent > work + MADE * size + error + kept:
        return f"the hand gave {work:.3g} N mm in and out, wire and friction took {spent:.3g}"
    return ""
