"""The chain laid out from its controls: as they are, or after a fraction of Newton's step with feedback."""

from __future__ import annotations

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.algebra import Nine, Three, apply_transposed, cross, load3, load9, store9, times
from solver._kernels.chain import Chain
from solver._kernels.data import Problem, State
from solver._kernels.flags import inlined, kernel
from solver._kernels.rotation import turn

STEP_ANGLE = tol.STEP_ANGLE
CONTROL_ANGLE = tol.CONTROL_ANGLE


@kernel
def place(chain: Chain, state: State, which: int, k: int) -> None:
    """Joints and frames of the controls u, from the base frame and entry point of the same state."""
    u, x, r = state.u[which], state.x[which], state.r[which]
    frame = load9(r[0])
    for j in range(k):
        frame = times(frame, turn(chain.rest[j], u[j, 0], u[j, 1], u[j, 2]))
        store9(r[j + 1], frame)
        length = chain.length[j]
        for a in range(3):
            x[j + 1, a] = x[j, a] + length * r[j + 1, a, 2]


@inlined
def copy_base(state: State, source: int, target: int) -> None:
    """Copy the entry point and the base frame of one state to another."""
    for a in range(3):
        state.x[target, 0, a] = state.x[source, 0, a]
        for b in range(3):
            state.r[target, 0, a, b] = state.r[source, 0, a, b]


@kernel
def rollout(problem: Problem, which: int, k: int, near: int, fraction: float) -> None:
    """Take a fraction of Newton's step forward with feedback, from joint ``near`` on: the trial state.

    Feedback answers the true displacement of each node, so the trial stays close to the plan even where the
    second-order model of a thousand rotations would not.
    """
    chain, state = problem.chain, problem.state
    old_u, old_x, old_r = state.u[which], state.x[which], state.r[which]
    u, x, r = state.u[1 - which], state.x[1 - which], state.r[1 - which]
    for n in range(near + 1):
        x[n, 0], x[n, 1], x[n, 2] = old_x[n, 0], old_x[n, 1], old_x[n, 2]
        store9(r[n], load9(old_r[n]))
        if n < near:
            u[n, 0], u[n, 1], u[n, 2] = old_u[n, 0], old_u[n, 1], old_u[n, 2]
    frame = load9(old_r[near])
    at = load3(x[near])
    for j in range(near, k):
        moved = (at[0] - old_x[j, 0], at[1] - old_x[j, 1], at[2] - old_x[j, 2])
        turned = relative(load9(old_r[j]), frame)
        ahead = load9(old_r[j + 1])
        s = answer(
            problem.scratch.gain[j], fraction, apply_transposed(ahead, moved), apply_transposed(ahead, turned)
        )
        v = limited(old_u[j, 0], old_u[j, 1], old_u[j, 2], s[0], s[1], s[2])
        u[j, 0], u[j, 1], u[j, 2] = v
        frame = times(frame, turn(chain.rest[j], v[0], v[1], v[2]))
        store9(r[j + 1], frame)
        length = chain.length[j]
        at = (at[0] + length * frame[2], at[1] + length * frame[5], at[2] + length * frame[8])
        x[j + 1, 0], x[j + 1, 1], x[j + 1, 2] = at


@inlined
def answer(gain: Any, fraction: float, dp: Three, dr: Three) -> Three:
    """Change of a joint's control: a fraction of its own step, plus feedback to where its node came to be."""
    s = (fraction * gain[0, 0], fraction * gain[1, 0], fraction * gain[2, 0])
    out = (
        s[0] + gain[0, 1] * dp[0] + gain[0, 2] * dp[1] + gain[0, 3] * dp[2],
        s[1] + gain[1, 1] * dp[0] + gain[1, 2] * dp[1] + gain[1, 3] * dp[2],
        s[2] + gain[2, 1] * dp[0] + gain[2, 2] * dp[1] + gain[2, 3] * dp[2],
    )
    return (
        out[0] + gain[0, 4] * dr[0] + gain[0, 5] * dr[1] + gain[0, 6] * dr[2],
        out[1] + gain[1, 4] * dr[0] + gain[1, 5] * dr[1] + gain[1, 6] * dr[2],
        out[2] + gain[2, 4] * dr[0] + gain[2, 5] * dr[1] + gain[2, 6] * dr[2],
    )


@inlined
def relative(old: Nine, new: Nine) -> Three:
    """Rotation vector (world) from an old frame to a new one, to first order: sin of the angle times the axis."""
    a = cross((old[0], old[3], old[6]), (new[0], new[3], new[6]))
    b = cross((old[1], old[4], old[7]), (new[1], new[4], new[7]))
    c = cross((old[2], old[5], old[8]), (new[2], new[5], new[8]))
    return 0.5 * (a[0] + b[0] + c[0]), 0.5 * (a[1] + b[1] + c[1]), 0.5 * (a[2] + b[2] + c[2])


@inlined
def limited(u0: float, u1: float, u2: float, s0: float, s1: float, s2: float) -> Three:
    """u + s with the step kept below STEP_ANGLE and the result below CONTROL_ANGLE."""
    size = s0 * s0 + s1 * s1 + s2 * s2
    if size > STEP_ANGLE * STEP_ANGLE:
        scale = STEP_ANGLE / math.sqrt(size)
        s0, s1, s2 = s0 * scale, s1 * scale, s2 * scale
    v0, v1, v2 = u0 + s0, u1 + s1, u2 + s2
    size = v0 * v0 + v1 * v1 + v2 * v2
    if size > CONTROL_ANGLE * CONTROL_ANGLE:
        scale = CONTROL_ANGLE / math.sqrt(size)
        v0, v1, v2 = v0 * scale, v1 * scale, v2 * scale
    return v0, v1, v2
