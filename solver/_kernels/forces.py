"""Forces of a wire at rest, as derivatives of the total energy; and whether the residual moments are negligible."""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels import wall_law
from solver._kernels.algebra import load3, load9, store3, store9
from solver._kernels.chain import profile_at
from solver._kernels.data import CURRENT, Chain, Field, Problem, WireTable
from solver._kernels.flags import cached, kernel, merged
from solver._kernels.friction import friction_force


@cached
def contact_forces(problem: Problem, k: int, force: Any) -> float:
    """Add the wall's force on the wire to each joint, force (k + 1, 3), N; return the deepest penetration, mm.

    A point inside a segment belongs to its two ends in proportion. Friction is that of the last step.
    """
    chain, state, rubs = problem.chain, problem.state, problem.friction.coefficient > 0.0
    deepest, end = 0.0, chain.first[k + 1] - 1
    for n in range(1, k + 1):
        for p in range(chain.first[n], chain.first[n + 1]):
            share = -chain.offset[p, 2] / chain.length[n - 1]
            d = state.penetration[CURRENT, p]
            deepest = max(deepest, d)
            if d != 0.0:
                size = -wall_law.force(problem.stiffness, chain.weight[p], d)
                for a in range(3):
                    force[n, a] += (1 - share) * size * state.jet[CURRENT, p, 1 + a]
                    force[n - 1, a] += share * size * state.jet[CURRENT, p, 1 + a]
            if rubs:
                rub = friction_force(problem, end - p)
                for a in range(3):
                    force[n, a] += (1 - share) * rub[a]
                    force[n - 1, a] += share * rub[a]
    return deepest


@kernel
def bends(table: WireTable, depth: float, s: float) -> tuple[float, float]:
    """Compliance per mm, 1/(N mm²), and rest curvature, 1/mm, at a distance from the tip of a wire at a depth."""
    sleeve = table.sleeve
    if sleeve.there and s >= depth - sleeve.tip[0]:
        pair = sleeve.profile
        return 1.0 / profile_at(pair.stiffness_at, pair.stiffness, s), profile_at(pair.rest_at, pair.rest, s)
    own = table.profile
    return 1.0 / profile_at(own.stiffness_at, own.stiffness, s), profile_at(own.rest_at, own.rest, s)


@cached
def push_force(problem: Problem, table: WireTable, weight: Any, k: int, report: Any) -> float:
    """dU/d(depth) at the minimum, N: the hand's axial force where the introducer guides without friction.

    The depth grows by the first segment alone: all joints move along it, and compliance, rest bend and wall
    share of the first two cells change. The first cell is [depth - l/2, depth], the second ends where it begins.
    weight : (3,) N per mm of wire, of which the first segment gains. A catheter goes in with the wire.
    """
    chain, u = problem.chain, problem.state.u[CURRENT]
    depth = 0.0
    for j in range(k):
        depth += chain.length[j]
    ahead = problem.state.r[CURRENT, 1]
    force = report.force[0] * ahead[0, 2] + report.force[1] * ahead[1, 2] + report.force[2] * ahead[2, 2]
    force -= 0.5 * chain.length[0] * (weight[0] * ahead[0, 2] + weight[1] * ahead[1, 2] + weight[2] * ahead[2, 2])
    inner = depth - 0.5 * chain.length[0]
    flexible, rest = bends(table, depth, inner)
    flexible_in, rest_in = bends(table, depth, depth)
    if table.sleeve.there:
        force += profile_at(table.sleeve.stored_at, table.sleeve.stored, depth)
    for j in range(min(k, 2)):
        compliance, bend = 0.5 * flexible, 0.5 * rest
        if j == 0:
            compliance, bend = flexible_in - compliance, rest_in - bend
        square = chain.bend[j] ** 2 * (u[j, 0] ** 2 + u[j, 1] ** 2)
        # at the minimum the moment about axis 2 is what turning that joint more would take
        force -= 0.5 * square * compliance + bend * chain.bend[j] * u[j, 1]
        if problem.twisting:
            force -= 0.25 * (chain.twist[j] * u[j, 2]) ** 2 / table.profile.twist
    return float(force + wall_gained(problem, table))


@kernel
def wall_gained(problem: Problem, table: WireTable) -> float:
    """What the wall under the first segment adds to the push force, N: more wire lies there, and moves less."""
    chain, state = problem.chain, problem.state
    force = 0.5 * problem.pressed if chain.held[0] > 0.0 else 0.0
    for p in range(chain.first[1], chain.first[2]):
        d, back = state.penetration[CURRENT, p], -chain.offset[p, 2] / chain.length[0]
        if d == 0.0:
            continue
        # half of node 1's cell lies on the first segment, and all that a point inside it stands for
        gains = chain.weight[p] / chain.length[0] if back != 0.0 else 0.5 / table.rule.hull.shape[0]
        force += gains * wall_law.energy_per_mm(problem.stiffness, d)
        jet, ahead = state.jet[CURRENT, p], state.r[CURRENT, 1]
        slope = jet[1] * ahead[0, 2] + jet[2] * ahead[1, 2] + jet[3] * ahead[2, 2]
        # such a point stays behind, in proportion
        force -= back * wall_law.force(problem.stiffness, chain.weight[p], d) * slope
    return float(force)


@kernel
def furthest_outside(field: Field, x: Any, k: int) -> float:
    """How far joints 1 to k are outside the grid's voxels (half a voxel beyond their centres) at most, mm."""
    m, o, shape = field.to_index, field.origin, field.coefficients.shape
    furthest = 0.0
    for n in range(1, k + 1):
        d0, d1, d2 = x[n, 0] - o[0], x[n, 1] - o[1], x[n, 2] - o[2]
        square = 0.0
        for a in range(3):
            f = m[a, 0] * d0 + m[a, 1] * d1 + m[a, 2] * d2
            per_mm = m[a, 0] * m[a, 0] + m[a, 1] * m[a, 1] + m[a, 2] * m[a, 2]
            beyond = max(-0.5 - f, f - (shape[a] - 2.5), 0.0)
            square += beyond * beyond / per_mm
        furthest = max(furthest, square)
    return math.sqrt(furthest)


@kernel
def least_turn_cosine(r: Any, k: int) -> float:
    """Cosine of the sharpest turn between consecutive segments."""
    least = 1.0
    for n in range(1, k + 1):
        cosine = r[n, 0, 2] * r[n - 1, 0, 2] + r[n, 1, 2] * r[n - 1, 1, 2] + r[n, 2, 2] * r[n - 1, 2, 2]
        least = min(least, cosine)
    return least


@kernel
def copy_state(problem: Problem, source: int, target: int, k: int) -> None:
    """Copy one of the states over another."""
    s = problem.state
    u, x, r, penetration, jet = s.u[source], s.x[source], s.r[source], s.penetration[source], s.jet[source]
    to_u, to_x, to_r, to_jet = s.u[target], s.x[target], s.r[target], s.jet[target]
    for n in range(k + 1):
        store3(to_x, n, load3(x, n))
        store9(to_r, n, load9(r, n))
        if n < k:
            store3(to_u, n, load3(u, n))
    s.energies[target] = s.energies[source]
    for p in range(problem.chain.first[k + 1]):
        s.penetration[target, p] = penetration[p]
        if penetration[p] != 0.0:
            for a in range(10):
                to_jet[p, a] = jet[p, a]


@merged
def forget_forces(report: Any) -> None:
    """Set the report's gradient to 0: that of a wire without a force or a bend."""
    for a in range(3):
        report.force[a] = report.torque[a] = 0.0


@kernel
def largest_moment(chain: Chain, u: Any, k: int) -> float:
    """Largest bending moment in the wire, N mm, with a floor."""
    largest = 0.0
    for j in range(k):
        angle = max(abs(u[j, 0]), abs(u[j, 1]), tol.ENERGY_FLOOR_ANGLE)
        largest = max(largest, chain.bend[j] * angle)
    return largest


@kernel
def at_rest(problem: Problem, slot: int, k: int, report: Any) -> bool:
    """Whether the residual moment that ``costate`` reports is negligible beside the largest moment in the wire."""
    return bool(report.moment <= tol.MOMENT * largest_moment(problem.chain, problem.state.u[slot], k))


@kernel
def rounding_moment(problem: Problem, slot: int, k: int) -> float:
    """Rounding error of a moment, N mm: that of all wall forces and loads, with the whole wire as the lever."""
    chain, penetration = problem.chain, problem.state.penetration[slot]
    force, lever = 0.0, 0.0
    for n in range(1, k + 1):
        lever += chain.length[n - 1]
        for a in range(3):
            force += abs(chain.load[n, a])
        for p in range(chain.first[n], chain.first[n + 1]):
            force += wall_law.force(problem.stiffness, chain.weight[p], penetration[p])
    return tol.ROUND_OFF * force * lever


@kernel
def unloaded(chain: Chain, k: int) -> bool:
    """No dead load on any joint."""
    for n in range(k + 1):
        if chain.load[n, 0] != 0.0 or chain.load[n, 1] != 0.0 or chain.load[n, 2] != 0.0:
            return False
    return True
