"""Eq. 1-7: the total energy of a wire in a wall, the one place that defines it.

U = Σ ½ c_j (u_0² + u_1²) + ½ t_j u_2²  +  Σ ½ k w_p max(0, φ(x_p) + ρ)²  -  Σ F_n · x_n
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from solver._kernels.flags import kernel
from solver._kernels.layout import Chain
from solver._kernels.spline import Field, basis, locate, spline, to_world, trilinear

# places in the work counters
FULL, CHEAP, CLEAR, SWEEPS, ROLLOUTS, LEVENBERG = range(6)
COUNTERS = 6


class State(NamedTuple):
    """Two states of a chain side by side (axis 0), the current one and the trial.

    u : (2, k, 3) rad.   x : (2, k + 1, 3) mm.   r : (2, k + 1, 3, 3), columns are material axes 1, 2 and e3.
    depth : (2, p) penetration mm.   jet : (2, p, 10), see ``spline``, per mm.
    """

    u: Any
    x: Any
    r: Any
    depth: Any
    jet: Any


class Scratch(NamedTuple):
    """Work space: gains (k, 3, 7), anchors (p, 4) for the clearance skip, counters, spline weights."""

    gain: Any
    anchor: Any
    counter: Any
    fraction: Any
    weights: Any


class Switch(NamedTuple):
    """Skips, all on except in tests."""

    clearance: bool
    cheap: bool
    idle: bool
    window: bool


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
    """Potential of the dead loads, N mm."""
    total = 0.0
    for n in range(k + 1):
        for a in range(3):
            total -= chain.load[n, a] * x[n, a]
    return total


@kernel
def penetration(
    field: Field, reach: float, q: Any, anchor: Any, jet: Any, scratch: Scratch, switch: Switch
) -> float:
    """How far the wire's hull is beyond the lumen at q, mm; fills the jet where it is.

    An anchor holds the place of the last look-up and an upper bound of the distance there: a point that has
    moved less than its clearance since then cannot touch.
    """
    i, j, k, inside = locate(field, q[0], q[1], q[2], scratch.fraction)
    if switch.clearance and inside and anchor[3] < 0.0:
        d0, d1, d2 = q[0] - anchor[0], q[1] - anchor[1], q[2] - anchor[2]
        if anchor[3] + field.slope * np.sqrt(d0 * d0 + d1 * d1 + d2 * d2) + reach <= 0.0:
            scratch.counter[CLEAR] += 1
            return 0.0
    if switch.cheap and inside:
        phi = trilinear(field, i, j, k, scratch.fraction) + field.gap
        if phi + reach <= 0.0:
            scratch.counter[CHEAP] += 1
            anchor[0], anchor[1], anchor[2], anchor[3] = q[0], q[1], q[2], phi
            return 0.0
    scratch.counter[FULL] += 1
    for a in range(3):
        basis(scratch.fraction[a], scratch.weights[a])
    spline(field, i, j, k, scratch.weights, jet)
    anchor[0], anchor[1], anchor[2] = q[0], q[1], q[2]
    anchor[3] = jet[0] if inside else 1.0
    if jet[0] + reach <= 0.0:
        return 0.0
    to_world(field, jet)
    return float(jet[0] + reach)


@kernel
def wall_energy(
    field: Field,
    stiffness: float,
    chain: Chain,
    state: State,
    which: int,
    k: int,
    scratch: Scratch,
    switch: Switch,
) -> float:
    """Eq. 6 and 7: look every point up and add its share, N mm."""
    total = 0.0
    x, r = state.x[which], state.r[which]
    depth, jet = state.depth[which], state.jet[which]
    q = scratch.fraction[3:]
    for n in range(1, k + 1):
        for p in range(chain.first[n], chain.first[n + 1]):
            o = chain.offset[p]
            for a in range(3):
                q[a] = x[n, a] + r[n, a, 0] * o[0] + r[n, a, 1] * o[1] + r[n, a, 2] * o[2]
            d = penetration(field, chain.reach, q, scratch.anchor[p], jet[p], scratch, switch)
            depth[p] = d
            if d != 0.0:
                total += 0.5 * stiffness * chain.weight[p] * d * d
    return total
