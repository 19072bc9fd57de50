"""Eq. 1-7: the total energy of a wire in a wall, the one place that defines it.

U = Σ ½ c_j (u_0² + u_1²) + ½ t_j u_2²  +  Σ wall(w_p, φ(x_p) + ρ)  -  Σ F_n · (x_n - x_0)  +  friction
"""

from typing import Any

from solver import _tolerances as tol
from solver._kernels import wall_law
from solver._kernels.algebra import Three, dot, load3, minus, store3
from solver._kernels.data import Chain, Problem
from solver._kernels.field import depth_in_grid, indices, jet_at, locate, store_jet, trilinear, value
from solver._kernels.flags import inlined, kernel, merged
from solver._kernels.friction import friction_energy
from solver._kernels.shaft import shaft_energy

FLOOR = tol.ENERGY_FLOOR_ANGLE**2


@kernel
def total_energy(problem: Problem, slot: int, first_free: int, k: int) -> float:
    """Total energy of a state, N mm; its parts go to the state.

    Up to node ``first_free`` (0 for none) both states agree, and the other one's look-ups of the wall are taken over.
    """
    state, parts = problem.state, problem.state.energies[slot]
    parts.bending = bending_energy(problem.chain, state.u[slot], k)
    parts.wall = at_entry(problem)
    if problem.stiffness > 0.0:
        parts.wall += wall_energy(problem, slot, first_free, k)
    parts.load = load_energy(problem.chain, state.x[slot], k)
    parts.friction = friction_energy(problem, slot, k) if problem.friction.coefficient > 0.0 else 0.0
    if problem.shaft.drag > 0.0:
        parts.friction += shaft_energy(problem, slot)
    return energy_of(problem, slot)


@inlined
def at_entry(problem: Problem) -> float:
    """Energy of the wall at the entry, N mm: the same in every state of a wire that is laid out."""
    return float(problem.pressed * problem.chain.held[0])


@inlined
def energy_of(problem: Problem, slot: int) -> float:
    """Total energy of a state whose parts are known, N mm."""
    parts = problem.state.energies[slot]
    return float(parts.bending + parts.wall + parts.load + parts.friction)


@kernel
def bending_energy(chain: Chain, u: Any, k: int) -> float:
    """Eq. 1, 2 and 5: the sum over the joints, N mm."""
    total = 0.0
    for j in range(k):
        total += 0.5 * chain.bend[j] * (u[j, 0] * u[j, 0] + u[j, 1] * u[j, 1])
        if u[j, 2] != 0.0:
            total += 0.5 * chain.twist[j] * u[j, 2] * u[j, 2]
    return total


@kernel
def load_energy(chain: Chain, x: Any, k: int) -> float:
    """Potential of the dead loads, N mm, counted from the entry: wire that comes in there adds none.

    Counted from the scan's origin, 4 mN at 1 m were 4 N mm beside the 0.06 of a bent wire, and all that is judged by a
    share of the energy (``snaps.balance``, ``forks.back_again``) saw nothing.
    """
    total = 0.0
    for n in range(1, k + 1):
        for a in range(3):
            total -= chain.load[n, a] * (x[n, a] - x[0, a])
    return total


@kernel
def load_moved(chain: Chain, x: Any, k: int) -> float:
    """Size of what cancels in ``load_energy``, N mm: rounding is a share of it."""
    total = 0.0
    for n in range(1, k + 1):
        for a in range(3):
            total += abs(chain.load[n, a] * x[0, a])
    return total


@kernel
def wall_energy(problem: Problem, slot: int, first_free: int, k: int) -> float:
    """Eq. 6 and 7: look every point beyond node ``first_free`` up and add its share, N mm; take over the others."""
    total = taken_over(problem, slot, first_free) if first_free > 0 else 0.0
    # bound once: inside the loop every member would be taken out of the tuple again, with its reference count
    field, skips, chain, state = problem.field, problem.skips, problem.chain, problem.state
    c, m, o, slope = field.coefficients, field.to_index, field.origin, field.slope
    first, offset, weight, reach = chain.first, chain.offset, chain.weight, chain.reach
    x, r, penetration, jet = state.x[slot], state.r[slot], state.penetration[slot], state.jet[slot]
    anchor, clear, cheap = problem.scratch.anchor, 0, 0
    for n in range(first_free + 1, k + 1):
        for p in range(first[n], first[n + 1]):
            q = load3(x, n)
            if offset[p, 0] != 0.0 or offset[p, 1] != 0.0 or offset[p, 2] != 0.0:
                q = placed(q, r, n, load3(offset, p))
            penetration[p] = 0.0
            clearance = -anchor[p, 3] - reach
            if skips.clearance and still_clear(anchor, p, q, slope, clearance):
                clear += 1
                continue
            at = indices(m, o, q)
            # beyond the grid the slope has no bound: no point counts as clearer of the wall than of the grid's border
            border = -field.spacing * depth_in_grid(c, at)
            touched = clearance < 0.0  # it probably still does: its jet is looked up without asking its value first
            store3(anchor, p, q)
            cell = locate(c, at)
            if skips.cheap and border <= 0.0 and not touched:
                phi = trilinear(c, cell) + field.gap
                if phi + reach <= 0.0:
                    cheap += 1
                    anchor[p, 3] = max(phi, border)
                    continue
            d = -1.0 if touched else value(c, cell) + reach
            if touched or d > 0.0:
                d = store_jet(jet, p, jet_at(c, m, cell)) + reach
            anchor[p, 3] = max(d - reach, border) if border <= 0.0 else 1.0
            if d > 0.0:
                penetration[p] = d
                total += wall_law.energy(problem.stiffness, weight[p], d)
    count(problem, clear, cheap, first[k + 1] - first[first_free + 1] - clear - cheap)
    return total


@inlined
def placed(q: Three, r: Any, n: int, o: Three) -> Three:
    """Position, mm, of a point with offset o, mm, in the frame of node n, which lies at q."""
    return (
        q[0] + (r[n, 0, 0] * o[0] + r[n, 0, 1] * o[1] + r[n, 0, 2] * o[2]),
        q[1] + (r[n, 1, 0] * o[0] + r[n, 1, 1] * o[1] + r[n, 1, 2] * o[2]),
        q[2] + (r[n, 2, 0] * o[0] + r[n, 2, 1] * o[1] + r[n, 2, 2] * o[2]),
    )


@merged
def still_clear(anchor: Any, p: int, q: Three, slope: float, clearance: float) -> bool:
    """Whether a point moved less since its last look-up than its clearance from the wall then: so it cannot touch."""
    way = minus(q, load3(anchor, p))
    return bool(clearance >= 0.0 and slope * slope * dot(way, way) <= clearance * clearance)


@merged
def count(problem: Problem, clear: int, cheap: int, full: int) -> None:
    """Add up how the points were looked up."""
    counters = problem.scratch.counters[0]
    counters.wall_look_ups_proven_unnecessary += clear
    counters.wall_look_ups_cheap += cheap
    counters.wall_look_ups += full


@kernel
def taken_over(problem: Problem, slot: int, first_free: int) -> float:
    """Wall energy of nodes 1 to ``first_free``, as the other state has it, N mm."""
    chain, state, total = problem.chain, problem.state, 0.0
    for p in range(chain.first[1], chain.first[first_free + 1]):
        d = state.penetration[1 - slot, p]
        state.penetration[slot, p] = d
        if d > 0.0:
            total += wall_law.energy(problem.stiffness, chain.weight[p], d)
            for a in range(10):
                state.jet[slot, p, a] = state.jet[1 - slot, p, a]
    return total


@kernel
def scale_of(problem: Problem, slot: int, k: int) -> float:
    """The energy that tolerances are relative to, N mm."""
    parts = problem.state.energies[slot]
    return float(parts.bending + parts.wall + parts.friction + FLOOR * stiffest(problem.chain, k))


@kernel
def noise_of(problem: Problem, slot: int, k: int, scale: float) -> float:
    """Energy below which a difference is rounding, N mm. scale : see ``scale_of``."""
    moved = load_moved(problem.chain, problem.state.x[slot], k)
    return float(tol.ROUND_OFF * (scale + abs(problem.state.energies[slot].load) + moved))


@kernel
def stiffest(chain: Chain, k: int) -> float:
    """Largest joint stiffness, N mm/rad."""
    largest = 0.0
    for j in range(k):
        largest = max(largest, chain.bend[j])
    return largest
