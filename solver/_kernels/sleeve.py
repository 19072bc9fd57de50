"""The catheter over the wire: the stiffness of the pair up to its tip, and the force on its tip.

Its tip is counted from the entry, the material from the wire's tip: pushing either moves the jump of stiffness along
the wire. Where a cell has the jump inside, its compliance is the sum of both parts', as for springs in series.
"""

from solver._kernels.algebra import load3
from solver._kernels.chain import cell, integral, profile_at
from solver._kernels.data import CURRENT, Chain, Friction, Problem, WireTable
from solver._kernels.flags import kernel


@kernel
def depth_of(chain: Chain, k: int) -> float:
    """Arc length from the entry to the tip, mm."""
    return float(chain.length[0] + (chain.length[k - 1] * (k - 1) if k > 1 else 0.0))


@kernel
def inner_end(table: WireTable, chain: Chain, k: int, j: int) -> float:
    """Where the cell of joint j ends, mm from the tip: in the middle of the segment after it; the next begins there."""
    return float((k - j - 0.5) * table.segment if j > 0 else depth_of(chain, k) - 0.5 * chain.length[0])


@kernel
def put_over(chain: Chain, table: WireTable, k: int) -> None:
    """Give the joints of a chain that is laid out the stiffness and rest bend of the pair where the catheter is."""
    sleeve = table.sleeve
    if sleeve.tip[0] == 0.0:
        return
    depth = depth_of(chain, k)
    edge = depth - sleeve.tip[0]
    inner = depth
    for j in range(k):
        outer, inner = inner, inner_end(table, chain, k, j)
        if outer <= edge:
            break
        if inner < edge:
            bare, covered = cell(table.profile, inner, edge), cell(sleeve.profile, edge, outer)
            compliance, chain.rest[j] = bare[0] + covered[0], bare[1] + covered[1]
        elif j < 2 or not table.tabled:
            compliance, chain.rest[j] = cell(sleeve.profile, inner, outer)
        else:
            compliance, chain.rest[j] = sleeve.cells[k - j, 0], sleeve.cells[k - j, 1]
        chain.bend[j] = 1.0 / compliance


@kernel
def uncover(friction: Friction, chain: Chain, table: WireTable, k: int) -> None:
    """Find the share of the wire at each look-up point that is beyond the catheter's tip: there alone it rubs.

    By shares, since a point that stands for a whole segment would let go at once as the tip passes it.
    """
    if not table.sleeve.there:
        return
    tip, around, arc, depth = table.sleeve.tip[0], table.rule.hull.shape[0], 0.0, depth_of(chain, k)
    for n in range(1, k + 1):
        arc += chain.length[n - 1]
        for p in range(chain.first[n], chain.first[n + 1]):
            stands_for = around * chain.weight[p]
            beyond = min(arc + chain.offset[p, 2] + 0.5 * stands_for, depth) - tip
            friction.exposed[p] = min(max(beyond / stands_for, 0.0), 1.0)


@kernel
def stored_energy(table: WireTable, depth: float) -> float:
    """Energy of the pair at its rest, N mm: the wire is bent less there than it would be alone, the catheter more."""
    sleeve = table.sleeve
    if sleeve.tip[0] == 0.0:
        return 0.0
    whole = integral(sleeve.stored_at, sleeve.stored, depth, False)
    return float(whole - integral(sleeve.stored_at, sleeve.stored, depth - sleeve.tip[0], False))


@kernel
def tip_force(problem: Problem, table: WireTable, k: int) -> float:
    """The hand's force on a catheter, dU/d(its tip) at the minimum, N, of a wire of k > 0 segments.

    Moving its tip moves the jump of stiffness within one cell, whose compliance and rest bend change.
    """
    chain, sleeve = problem.chain, table.sleeve
    depth = depth_of(chain, k)
    edge = depth - sleeve.tip[0]
    force = profile_at(sleeve.stored_at, sleeve.stored, edge)
    for j in range(k):
        if inner_end(table, chain, k, j) < edge:
            u, own, pair = load3(problem.state.u[CURRENT], j), table.profile, sleeve.profile
            less = 1.0 / profile_at(own.stiffness_at, own.stiffness, edge)
            less -= 1.0 / profile_at(pair.stiffness_at, pair.stiffness, edge)
            straighter = profile_at(own.rest_at, own.rest, edge) - profile_at(pair.rest_at, pair.rest, edge)
            bend = chain.bend[j]
            force += 0.5 * bend * bend * (u[0] * u[0] + u[1] * u[1]) * less + straighter * bend * u[1]
            break
    return float(force)
