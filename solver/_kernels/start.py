"""Where a step starts: laid along a curve with exact segment lengths, and bent as the last step was.

A wire pushed on goes straight ahead of its tip into the wall and has to be bent there, much as in the step before: what
relaxing the last step changed will change again, counted from the tip.
"""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.algebra import apply_transposed, dot, load9, minus, scaled, store3, store9, times
from solver._kernels.crossing import crossed
from solver._kernels.data import Chain, Problem
from solver._kernels.energy import total_energy
from solver._kernels.flags import entry_point, inlined, kernel, merged
from solver._kernels.rollout import copy_base, place
from solver._kernels.rotation import bend_towards, turn, with_twist


@inlined
def leaving(a: Any, b: Any, centre: Any, radius: float) -> float:
    """Where, between 0 and 1, the segment a -> b leaves the sphere around ``centre``; above 1 if it does not."""
    q = minus(b, centre)
    # a segment that ends inside does not leave: no root to take
    if dot(q, q) < radius * radius:
        return 2.0
    p, d = minus(a, centre), minus(b, a)
    aa, ab, bb = dot(p, p), dot(p, d), dot(d, d)
    if bb <= 0.0:
        return 2.0
    root = ab * ab - bb * (aa - radius * radius)
    if root < 0.0:
        return 2.0
    return float((-ab + math.sqrt(root)) / bb)


@entry_point
def follow(curve: Any, m: int, chain: Chain, u: Any, x: Any, r: Any, joints: tuple[int, int]) -> None:
    """Lay segments along a polyline (m, 3) from x[0], which lies on its start; fill u, x and frames r.

    Each joint is the first place on the curve at its segment's length from the joint before; past the end the
    last direction continues. r[0] must hold the base frame.
    joints : the first one to bend, up to which the wire lies on the polyline's own joints, and the number of segments.
    """
    at, start = joints[0], 0.0
    for j in range(joints[0], joints[1]):
        length = chain.length[j]
        while at < m - 1:
            t = leaving(curve[at], curve[at + 1], x[j], length)
            if start <= t <= 1.0:
                for a in range(3):
                    x[j + 1, a] = curve[at, a] + t * (curve[at + 1, a] - curve[at, a])
                start = t
                break
            at += 1
            start = 0.0
        if at >= m - 1:
            extend(curve[m - 2], curve[m - 1], x, j, length)
        aim(chain, u, x, r, j)


@kernel
def extend(before: Any, end: Any, x: Any, j: int, length: float) -> None:
    """Place joint j + 1 beyond the end of a curve, along its last direction."""
    d = minus(end, before)
    size = math.sqrt(dot(d, d))
    d = (d[0] / size, d[1] / size, d[2] / size)
    p = minus(x[j], end)
    along = dot(p, d)
    across = dot(p, p) - along * along
    t = along + math.sqrt(max(length * length - max(across, 0.0), 0.0))
    for a in range(3):
        x[j + 1, a] = end[a] + t * d[a]


@inlined
def aim(chain: Chain, u: Any, x: Any, r: Any, j: int) -> None:
    """Bend joint j towards x[j + 1], keeping the twist it has; then put that joint at its exact distance."""
    d = minus(x[j + 1], x[j])
    size = math.sqrt(dot(d, d))
    frame = load9(r, j)
    # a joint on top of the one before has no direction: it keeps the one before
    per_size = 1.0 / size if size > 0.0 else 0.0
    t = apply_transposed(frame, scaled(per_size, d)) if size > 0.0 else (0.0, 0.0, 1.0)
    u0, u1 = bend_towards(chain.rest[j], t)
    v = with_twist(u0, u1, u[j, 2])
    store3(u, j, v)
    frame = times(frame, turn(chain.rest[j], v))
    store9(r, j + 1, frame)
    length = chain.length[j]
    for a in range(3):
        x[j + 1, a] = x[j, a] + length * r[j + 1, a, 2]


@kernel
def extrapolate_start(problem: Problem, slot: int, k: int, share: float, last: float) -> int:
    """Return the slot to start from: ``slot``, or the other one, with a share of the last change, if it is lower.

    Both lie in the same lumen (no wall between them), and their energies decide; that of the answer is known then.
    last : energy of the wire before the step, N mm; what ``slot`` has more must at least be halved.
    """
    state, scratch = problem.state, problem.scratch
    u, tried = state.u[slot], state.u[1 - slot]
    for j in range(k):
        for a in range(3):
            scratch.start[j, a] = u[j, a]
            tried[j, a] = u[j, a] + share * scratch.change[k - 1 - j, a]
    energy = total_energy(problem, slot, 0, k)
    if share == 0.0 or state.energies[slot].wall == 0.0:
        return slot
    copy_base(state, slot, 1 - slot)
    place(problem.chain, state, 1 - slot, k)
    better = total_energy(problem, 1 - slot, 0, k) - last < tol.WORTH_FORESEEING * (energy - last)
    if better and not crossed(problem, slot, k):
        scratch.counters[0].starts_foreseen += 1
        return 1 - slot
    return slot


@merged
def note_change(problem: Problem, slot: int, k: int) -> None:
    """Remember how relaxing changed the start of this step."""
    u, scratch = problem.state.u[slot], problem.scratch
    for j in range(k):
        for a in range(3):
            scratch.change[k - 1 - j, a] = u[j, a] - scratch.start[j, a]
    for m in range(k, scratch.change.shape[0]):
        scratch.change[m, 0] = scratch.change[m, 1] = scratch.change[m, 2] = 0.0
