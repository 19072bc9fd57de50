"""Coulomb friction, as a potential that one step of the wire has: load times coefficient times the way slid.

Load and direction of a contact are those of the last relaxation; ``minimise`` repeats until they no longer change.
"""

import math
from typing import Any

import numpy as np

from solver import _tolerances as tol
from solver._kernels import wall_law
from solver._kernels.algebra import Six, Three, apply_transposed, load3, minus, scaled, store3
from solver._kernels.data import CURRENT, Problem
from solver._kernels.flags import inlined, kernel, merged

SLIP_SQUARED = tol.SLIP_MM * tol.SLIP_MM


@inlined
def point_at(problem: Problem, slot: int, n: int, p: int) -> Three:
    """Where look-up point p of node n is, mm."""
    x, r, o = problem.state.x[slot, n], problem.state.r[slot, n], problem.chain.offset[p]
    return (
        x[0] + r[0, 0] * o[0] + r[0, 1] * o[1] + r[0, 2] * o[2],
        x[1] + r[1, 0] * o[0] + r[1, 1] * o[1] + r[1, 2] * o[2],
        x[2] + r[2, 0] * o[0] + r[2, 1] * o[1] + r[2, 2] * o[2],
    )


@inlined
def slide(problem: Problem, slot: int, n: int, p: int) -> tuple[float, Three]:
    """How far a point slid along the wall in this step: smoothed length, at least SLIP_MM, and the way, mm."""
    friction = problem.friction
    way, normal = minus(point_at(problem, slot, n, p), load3(friction.start, p)), load3(friction.normal, p)
    across = 0.0 + way[0] * normal[0] + way[1] * normal[1] + way[2] * normal[2]
    way = minus(way, scaled(across, normal))
    return math.sqrt(SLIP_SQUARED + way[0] * way[0] + way[1] * way[1] + way[2] * way[2]), way


@kernel
def friction_energy(problem: Problem, slot: int, k: int) -> float:
    """Energy of all points, N mm."""
    friction, chain = problem.friction, problem.chain
    total = 0.0
    for n in range(1, k + 1):
        for p in range(chain.first[n], chain.first[n + 1]):
            if friction.load[p] > 0.0:
                size, _ = slide(problem, slot, n, p)
                total += friction.coefficient * friction.load[p] * (size - tol.SLIP_MM)
    return total


@inlined
def friction_derivatives(problem: Problem, slot: int, n: int, p: int, frame: Any) -> tuple[Three, Six]:
    """Gradient and Hessian of a point's energy with respect to its place, in the frame of its node."""
    size, way = slide(problem, slot, n, p)
    s = apply_transposed(frame, way)
    m = apply_transposed(frame, load3(problem.friction.normal, p))
    w = problem.friction.coefficient * problem.friction.load[p] / size
    q = w / (size * size)
    hessian = (
        w * (1 - m[0] * m[0]) - q * s[0] * s[0],
        w * (1 - m[1] * m[1]) - q * s[1] * s[1],
        w * (1 - m[2] * m[2]) - q * s[2] * s[2],
        -w * m[0] * m[1] - q * s[0] * s[1],
        -w * m[0] * m[2] - q * s[0] * s[2],
        -w * m[1] * m[2] - q * s[1] * s[2],
    )
    return scaled(w, s), hessian


@kernel
def take_loads(problem: Problem, slot: int, k: int) -> float:
    """Take loads and normals of the contacts from a state; return the largest change of a load over the largest."""
    friction, chain, state = problem.friction, problem.chain, problem.state
    change, largest = 0.0, 0.0
    for p in range(chain.first[1], chain.first[k + 1]):
        d, load = state.penetration[slot, p], 0.0
        if d != 0.0:
            jet = state.jet[slot, p]
            slope = math.sqrt(jet[1] * jet[1] + jet[2] * jet[2] + jet[3] * jet[3])
            load = wall_law.force(problem.stiffness, chain.weight[p], d) * slope
            for a in range(3):
                friction.normal[p, a] = jet[1 + a] / max(slope, 1e-12)
        change = max(change, abs(load - friction.load[p]))
        largest = max(largest, load)
        friction.load[p] = load
    return change / largest if largest > 0.0 else 0.0


@merged
def anchor_friction(problem: Problem, k: int) -> None:
    """Measure the ways slid from where the points are now."""
    if problem.friction.coefficient == 0.0:
        return
    for n in range(1, k + 1):
        for p in range(problem.chain.first[n], problem.chain.first[n + 1]):
            store3(problem.friction.start, p, point_at(problem, CURRENT, n, p))


@kernel
def anchor_friction_behind(problem: Problem, curve: Any, was: int, k: int, ahead: float) -> None:
    """Measure the ways slid from where the points were before a step: ``ahead`` mm further back on the wire.

    curve : (was + 1, 3), the wire before the step, which continues straight back into the introducer.
    """
    chain, start, back = problem.chain, problem.friction.start, problem.state.r[CURRENT, 0, :, 2]
    arcs = np.empty(was + 1)
    arcs[0] = 0.0
    for n in range(was):
        square = 0.0
        for a in range(3):
            square += (curve[n + 1, a] - curve[n, a]) ** 2
        arcs[n + 1] = arcs[n] + math.sqrt(square)
    arc, m = 0.0, 0
    for n in range(1, k + 1):
        arc += chain.length[n - 1]
        for p in range(chain.first[n], chain.first[n + 1]):
            s = arc + chain.offset[p, 2] - ahead
            while m + 1 < was and arcs[m + 1] <= s:
                m += 1
            while m > 0 and arcs[m] > s:
                m -= 1
            span = arcs[m + 1] - arcs[m] if was > 0 else 0.0
            t = min(max((s - arcs[m]) / span, 0.0), 1.0) if span > 0.0 else 0.0
            for a in range(3):
                along = t * (curve[m + 1, a] - curve[m, a]) if was > 0 else 0.0
                start[p, a] = curve[m, a] + along + min(s, 0.0) * back[a]
