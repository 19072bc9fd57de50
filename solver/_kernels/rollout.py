"""The chain laid out from its controls: as they are, or after a fraction of Newton's step with feedback."""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.algebra import (
    Nine,
    Three,
    add3,
    apply_transposed,
    cross,
    load3,
    load9,
    minus,
    scaled,
    store3,
    store9,
    times,
)
from solver._kernels.data import Chain, Problem, State
from solver._kernels.flags import inlined, kernel
from solver._kernels.joint import turn_of
from solver._kernels.lanes.vectors import anywhere, select


@kernel
def place(chain: Chain, state: State, slot: int, k: int) -> None:
    """Joints and frames of the controls u, from the base frame and entry point of the same state."""
    u, x, r = state.u[slot], state.x[slot], state.r[slot]
    frame = load9(r, 0)
    for j in range(k):
        frame = times(frame, turn_of(chain, j, load3(u, j)))
        store9(r, j + 1, frame)
        for a in range(3):
            x[j + 1, a] = x[j, a] + chain.length[j] * r[j + 1, a, 2]


@inlined
def copy_base(state: State, source: int, target: int) -> None:
    """Copy the entry point and the base frame of one state to another."""
    store3(state.x[target], 0, load3(state.x[source], 0))
    store9(state.r[target], 0, load9(state.r[source], 0))


@kernel
def rollout(problem: Problem, slot: int, first_free: int, k: int, fraction: float) -> None:
    """Take a fraction of Newton's step forward with feedback, from joint ``first_free`` on: the trial state.

    Feedback answers the true displacement of each node, so the trial stays close to the plan even where the
    second-order model of a thousand rotations would not.
    """
    chain, state, gain = problem.chain, problem.state, problem.scratch.gain
    old_u, old_x, old_r = state.u[slot], state.x[slot], state.r[slot]
    u, x, r = state.u[1 - slot], state.x[1 - slot], state.r[1 - slot]
    for n in range(first_free + 1):
        store3(x, n, load3(old_x, n))
        store9(r, n, load9(old_r, n))
        if n < first_free:
            store3(u, n, load3(old_u, n))
    frame, at = load9(old_r, first_free), load3(x, first_free)
    for j in range(first_free, k):
        ahead = load9(old_r, j + 1)
        moved = apply_transposed(ahead, minus(at, load3(old_x, j)))
        turned = apply_transposed(ahead, relative(load9(old_r, j), frame))
        v = stepped(chain, j, load3(old_u, j), answer(gain, j, fraction, moved, turned))
        store3(u, j, v)
        frame = times(frame, turn_of(chain, j, v))
        store9(r, j + 1, frame)
        length = chain.length[j]
        at = (at[0] + length * frame[2], at[1] + length * frame[5], at[2] + length * frame[8])
        store3(x, j + 1, at)


@inlined
def answer(gain: Any, j: int, fraction: float, dp: Three, dr: Three) -> Three:
    """Change of joint j's control: a fraction of its own step, plus feedback to where its node came to be."""
    s = (fraction * gain[j, 0, 0], fraction * gain[j, 1, 0], fraction * gain[j, 2, 0])
    out = (
        s[0] + gain[j, 0, 1] * dp[0] + gain[j, 0, 2] * dp[1] + gain[j, 0, 3] * dp[2],
        s[1] + gain[j, 1, 1] * dp[0] + gain[j, 1, 2] * dp[1] + gain[j, 1, 3] * dp[2],
        s[2] + gain[j, 2, 1] * dp[0] + gain[j, 2, 2] * dp[1] + gain[j, 2, 3] * dp[2],
    )
    return (
        out[0] + gain[j, 0, 4] * dr[0] + gain[j, 0, 5] * dr[1] + gain[j, 0, 6] * dr[2],
        out[1] + gain[j, 1, 4] * dr[0] + gain[j, 1, 5] * dr[1] + gain[j, 1, 6] * dr[2],
        out[2] + gain[j, 2, 4] * dr[0] + gain[j, 2, 5] * dr[1] + gain[j, 2, 6] * dr[2],
    )


@inlined
def relative(old: Nine, new: Nine) -> Three:
    """Rotation vector (world) from an old frame to a new one, to first order: sin of the angle times the axis."""
    a = cross((old[0], old[3], old[6]), (new[0], new[3], new[6]))
    b = cross((old[1], old[4], old[7]), (new[1], new[4], new[7]))
    c = cross((old[2], old[5], old[8]), (new[2], new[5], new[8]))
    return scaled(0.5, add3(add3(a, b), c))


@inlined
def stepped(chain: Chain, j: int, u: Three, s: Three) -> Three:
    """``limited`` of joint j; the twist of a shaft has no limit."""
    if j > 0 or chain.early[0] == 0.0:
        return limited(u, s)
    s = shortened(s, tol.STEP_ANGLE)
    v = shortened((u[0] + s[0], u[1] + s[1], 0.0), tol.CONTROL_ANGLE)
    return v[0], v[1], u[2] + s[2]


@inlined
def limited(u: Three, s: Three) -> Three:
    """u + s with the step kept below STEP_ANGLE and the result below CONTROL_ANGLE."""
    s = shortened(s, tol.STEP_ANGLE)
    return shortened((u[0] + s[0], u[1] + s[1], u[2] + s[2]), tol.CONTROL_ANGLE)


@inlined
def shortened(v: Three, longest: float) -> Three:
    """V, scaled down to the length ``longest`` where it is longer."""
    size = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    beyond = size > longest * longest
    if anywhere(beyond):
        scale = select(beyond, longest / math.sqrt(size), 1.0)
        return v[0] * scale, v[1] * scale, v[2] * scale
    return v
