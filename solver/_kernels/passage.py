"""Whether a wire passes through itself on its way: between two steps, in which it need not overlap itself at all.

The energy has no contact between parts of the wire. A soft tip in a sac passes through a strand within 0.2 mm of the
hand's way, and is free of itself before and after.
"""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.algebra import Three, cross, dot, farthest, load3, minus, mix
from solver._kernels.chain import segments_at
from solver._kernels.data import CURRENT, LAST_GOOD, Problem
from solver._kernels.flags import inlined, kernel, merged


@merged
def note_passage(problem: Problem, at: Any, k: int, depth: float, segment: float) -> None:
    """Note where a wire has passed through itself in the step to a depth, mm; forget it once its hind strand is out."""
    if depth < at.hind:
        at.passed = at.hind = math.inf
    hind = passage(problem, k, segments_at(at.inserted, segment)[0], segment)
    if hind > 0.0:
        at.hind, at.passed = min(at.hind, hind), min(at.passed, depth)


@kernel
def passage(problem: Problem, k: int, was: int, segment: float) -> float:
    """Length of wire beyond the hind one of two strands that passed through each other in a step, mm; 0 where none did.

    Two strands can only meet where the wire between them turns by half a circle: segments between which it turns less
    are skipped. So are those too far apart in space for the step to bring them together.
    """
    x, r, common = problem.state.x, problem.state.r[CURRENT], min(k, was)
    reach = -1.0
    turned, far = 0.0, k - common
    for i in range(k - common, k - 2):
        while far < k - 1 and (turned < tol.TURNS_BACK or far < i + 2):
            far += 1
            turned += turn_at(r, far)
        if turned < tol.TURNS_BACK:
            return 0.0
        if reach < 0.0:
            moved = farthest(x[CURRENT], k - common, x[LAST_GOOD], was - common, common + 1)
            reach = 2.0 * (segment + moved)
        j = far
        while j < k:
            apart = minus(load3(x[CURRENT], i), load3(x[CURRENT], j))
            away = math.sqrt(dot(apart, apart)) - reach
            if away > 0.0:
                # the next joints are no further on than a segment each
                j += max(int(away / segment), 1)
                continue
            if swap_sides(problem, i, j, was - k):
                return (k - i - 1) * segment
            j += 1
        turned -= turn_at(r, i + 1)
    return 0.0


@inlined
def turn_at(r: Any, n: int) -> float:
    """Turn of the wire at the end of segment n - 1, rad, by its chord."""
    turn = minus((r[n + 1, 0, 2], r[n + 1, 1, 2], r[n + 1, 2, 2]), (r[n, 0, 2], r[n, 1, 2], r[n, 2, 2]))
    return math.sqrt(dot(turn, turn))


@kernel
def swap_sides(problem: Problem, i: int, j: int, back: int) -> bool:
    """Whether segments that begin at joints i and j pass through each other, all joints going straight on.

    Their four ends lie in a plane then. back : what is added to the number of a joint for that before the step.
    """
    before, after = side(problem, i, j, back, 0.0), side(problem, i, j, back, 1.0)
    if before * after >= 0.0:
        return False
    early, late = 0.0, 1.0
    for _ in range(tol.PASSAGE_HALVINGS):
        middle = 0.5 * (early + late)
        if side(problem, i, j, back, middle) * before > 0.0:
            early = middle
        else:
            late = middle
    u, v, gap = pair_at(problem, i, j, back, early)
    normal = cross(u, v)
    size = dot(normal, normal)
    s, t = dot(cross(gap, v), normal), dot(cross(gap, u), normal)
    return 0.0 <= s <= size and 0.0 <= t <= size and size > 0.0


@inlined
def side(problem: Problem, i: int, j: int, back: int, share: float) -> float:
    """On which side of each other two segments lie: the volume that their ends span, by its sign."""
    u, v, gap = pair_at(problem, i, j, back, share)
    return dot(cross(u, v), gap)


@inlined
def pair_at(problem: Problem, i: int, j: int, back: int, share: float) -> tuple[Three, Three, Three]:
    """Two segments and the way from the first joint of one to that of the other, a share of the step on."""
    p, q = joint_at(problem, i, back, share), joint_at(problem, j, back, share)
    u, v = minus(joint_at(problem, i + 1, back, share), p), minus(joint_at(problem, j + 1, back, share), q)
    return u, v, minus(q, p)


@inlined
def joint_at(problem: Problem, n: int, back: int, share: float) -> Three:
    """Joint n, a share of the step on."""
    x = problem.state.x
    return mix(1.0 - share, load3(x[LAST_GOOD], n + back), share, load3(x[CURRENT], n))
