"""The seed's relaxation (its eq. 8-10) in the form that its own model leads to.

Segment i is turned by a_i = |G⊥ - Υ_i| λ / (ρ_i - G^P), away from the gradient, all segments at once; later
segments move along without turning (eq. 9). Deviations from the printed eq. 10, slot moves uphill:
- α_i keeps the segment's length, so its longitudinal part is -a_i²/(2λ) and the denominator has the sign shown;
- Υ_i and ρ_i hold the sum of the two joints that α_i bends, c_i b̂_i and c_{i+1} n̂, divided by λ;
- the numerator is the exact gradient of the total energy: θ of eq. 1 instead of sin θ, the roll that turning a
  segment hands on to every rest bend behind it, and the wall under a segment;
- a step counts only where the total energy falls, is limited, and the loop stops on Newton's decrement and on the
  moments left, never on a_i: at 40 segments a_i/λ < 1e-3 leaves the tip wrong by 16 % of the length.
"""

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.algebra import (
    ZERO3,
    Nine,
    Three,
    add3,
    apply,
    apply_transposed,
    load3,
    load9,
    store3,
    store9,
    times,
)
from solver._kernels.blocks import node_gradient
from solver._kernels.crossing import admissible
from solver._kernels.data import CONVERGED, STALLED, UNFINISHED, Problem
from solver._kernels.energy import noise_of, scale_of, stiffest, total_energy
from solver._kernels.flags import cached, inlined, kernel, merged
from solver._kernels.forces import largest_moment
from solver._kernels.newton import costate, sweep
from solver._kernels.rollout import copy_base
from solver._kernels.rotation import bend_to, bent, jacobian, with_rest


@inlined
def keep_direction(jac: Nine, incoming: Three) -> tuple[float, float, float]:
    """Change (δu0, δu1) of a control that undoes an incoming rotation's turn, and the roll that is left."""
    det = jac[0] * jac[4] - jac[1] * jac[3]
    v0 = -(jac[4] * incoming[0] - jac[1] * incoming[1]) / det
    v1 = -(jac[0] * incoming[1] - jac[3] * incoming[0]) / det
    return v0, v1, incoming[2] + jac[6] * v0 + jac[7] * v1


@merged
def gradients(problem: Problem, slot: int, k: int) -> None:
    """Fill gain[i, 0:2, 0] with minus the gradient and gain[i, 2, 0] with ρ_i - G^P of turning segment i alone.

    Backward over the segments: f is the wall's G in the frame of segment i; ``roll`` is what rolling the frame
    that enters joint i + 1 costs while all directions behind it stay, gain[i, 0, 1] the same for segment i.
    """
    chain, gain = problem.chain, problem.scratch.gain
    controls, frames = problem.state.u[slot], problem.state.r[slot]
    f, roll = ZERO3, 0.0
    for i in range(k - 1, -1, -1):
        frame = load9(frames, i + 1)
        df, dg = node_gradient(problem, slot, i + 1, frame)
        f = add3(f, df)
        u = load3(controls, i)
        bend, length = chain.bend[i], chain.length[i]
        turn = with_rest(chain.rest[i], u)
        jac = jacobian(turn)
        rho = bend * math.cos(math.sqrt(u[0] * u[0] + u[1] * u[1])) - length * f[2]
        if i < k - 1:
            w = load3(controls, i + 1)
            rho += chain.bend[i + 1] * math.cos(math.sqrt(w[0] * w[0] + w[1] * w[1]))
        gain[i, 2, 0] = rho
        gain[i, 0, 1] = dg[2] + roll
        for a in range(2):
            # turn segment i by a unit rotation about its own axis a
            back = (-1.0, 0.0, 0.0) if a == 0 else (0.0, -1.0, 0.0)
            v0, v1, twist = keep_direction(jac, back)
            slope = bend * (u[0] * v0 + u[1] * v1) + dg[a] + dg[2] * twist
            slope += -length * f[1] if a == 0 else length * f[0]
            slope += after(problem, slot, k, i + 1, a) + roll * twist
            gain[i, a, 0] = -slope
        e = bent(turn)
        v0, v1, twist = keep_direction(jac, (e[6], e[7], e[8]))
        roll = bend * (u[0] * v0 + u[1] * v1) + gain[i, 0, 1] * twist
        f = apply(e, f)


@inlined
def after(problem: Problem, slot: int, k: int, j: int, axis: int) -> float:
    """What turning the segment before joint j, without rolling it, costs at that joint and behind it."""
    if j >= k:
        return 0.0
    u = load3(problem.state.u[slot], j)
    turn = with_rest(problem.chain.rest[j], u)
    e = bent(turn)
    incoming = apply_transposed(e, (1.0, 0.0, 0.0) if axis == 0 else (0.0, 1.0, 0.0))
    v0, v1, left = keep_direction(jacobian(turn), incoming)
    return float(problem.chain.bend[j] * (u[0] * v0 + u[1] * v1) + problem.scratch.gain[j, 0, 1] * left)


@merged
def propose(problem: Problem, slot: int, k: int, share: float) -> None:
    """Turn every segment by a share of its a_i, none by more than CLOSED_FORM_ANGLE: the trial state."""
    chain, state, gain = problem.chain, problem.state, problem.scratch.gain
    new = 1 - slot
    u, x, r = state.u[new], state.x[new], state.r[new]
    frames = state.r[slot]
    copy_base(state, slot, new)
    frame = load9(r, 0)
    for i in range(k):
        rho = gain[i, 2, 0]
        if rho <= 0.0:
            # beyond the validity of eq. 10 (the wire is compressed past its own buckling load)
            rho = chain.bend[i]
        d0, d1 = share * gain[i, 0, 0] / rho, share * gain[i, 1, 0] / rho
        size = math.sqrt(d0 * d0 + d1 * d1)
        if size > tol.CLOSED_FORM_ANGLE:
            d0, d1 = d0 * tol.CLOSED_FORM_ANGLE / size, d1 * tol.CLOSED_FORM_ANGLE / size
        old = load9(frames, i + 1)
        size = math.sqrt(1.0 + d0 * d0 + d1 * d1)
        # directions, never differences of joints: far from the origin their last place would bend the wire
        t = apply_transposed(frame, apply(old, (d1 / size, -d0 / size, 1.0 / size)))
        turn0, turn1 = bend_to(t)
        store3(u, i, (turn0, turn1 - chain.rest[i], 0.0))
        frame = times(frame, bent((turn0, turn1, 0.0)))
        store9(r, i + 1, frame)
        for a in range(3):
            x[i + 1, a] = x[i, a] + chain.length[i] * r[i + 1, a, 2]


@kernel
def settled(problem: Problem, slot: int, k: int, tolerance: float, report: Any) -> bool:
    """Whether a state is a minimum: Newton's decrement and the residual moments are negligible."""
    minimal = sweep(problem, slot, 0, k, 0.0, report)
    problem.scratch.counters[0].sweeps += 1
    costate(problem, slot, k, report)
    scale = scale_of(problem, slot, k)
    if not (minimal and report.decrement <= max(tolerance, tol.ROUND_OFF) * scale):
        return False
    # the decrement is quadratic in the moments
    share = max(tol.MOMENT, math.sqrt(tolerance))
    nothing = tol.CLOSED_FORM_IDLE_ANGLE * stiffest(problem.chain, k)
    return bool(report.moment <= max(share * largest_moment(problem.chain, problem.state.u[slot], k), nothing))


@cached
def iterate(problem: Problem, k: int, now: Any, tolerance: float, report: Any) -> int:
    """Do one sweep; return how the relaxation ended, or UNFINISHED. now is the record ``records.DESCENT``."""
    if now.iterations == now.next_check or now.iterations == 0:
        now.next_check += now.next_check // 4
        if settled(problem, now.slot, k, tolerance, report):
            return CONVERGED
        noise = noise_of(problem, now.slot, k, scale_of(problem, now.slot, k))
        if not now.checked_energy - now.energy > noise:
            # a fifth of all sweeps so far lowered the energy by rounding alone
            return STALLED
        now.checked_energy = now.energy
    gradients(problem, now.slot, k)
    while now.share > tol.CLOSED_FORM_SMALLEST:
        propose(problem, now.slot, k, now.share)
        problem.scratch.counters[0].rollouts += 1
        trial = total_energy(problem, 1 - now.slot, 0, k)
        if trial <= now.energy and admissible(problem, now.slot, k):
            now.slot, now.energy = 1 - now.slot, trial
            now.share = min(1.0, 1.1 * now.share)
            return UNFINISHED
        now.share *= 0.5
    return CONVERGED if settled(problem, now.slot, k, tolerance, report) else STALLED
