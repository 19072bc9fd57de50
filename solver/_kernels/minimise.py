"""The one loop: a method proposes, the total energy decides, and a state that is no minimum is never called one."""

from __future__ import annotations

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.energy import (
    LEVENBERG,
    ROLLOUTS,
    SWEEPS,
    Scratch,
    State,
    Switch,
    bending_energy,
    load_energy,
    wall_energy,
)
from solver._kernels.flags import kernel
from solver._kernels.layout import Chain
from solver._kernels.newton import costate, rollout, sweep
from solver._kernels.spline import Field, basis, locate, value

# how a relaxation ends
CONVERGED, EXHAUSTED, STALLED, BROKEN = range(4)

ROUND_OFF = tol.ROUND_OFF
SUFFICIENT = tol.SUFFICIENT
FLOOR = tol.ENERGY_FLOOR_ANGLE**2
MOMENT = tol.MOMENT
HOP = tol.HOP_VOXELS


@kernel
def total_energy(
    field: Field,
    stiffness: float,
    chain: Chain,
    state: State,
    which: int,
    k: int,
    scratch: Scratch,
    switch: Switch,
    parts: Any,
) -> float:
    """Total energy of a state, N mm; parts (3,): bending, wall, loads. The wall is not asked where it has none."""
    parts[0] = bending_energy(chain, state.u[which], k)
    parts[1] = 0.0
    if stiffness > 0.0:
        parts[1] = wall_energy(field, stiffness, chain, state, which, k, scratch, switch)
    parts[2] = load_energy(chain, state.x[which], k)
    return float(parts[0] + parts[1] + parts[2])


@kernel
def scale_of(chain: Chain, k: int, parts: Any) -> float:
    """The energy that tolerances are relative to, N mm."""
    stiffest = 0.0
    for j in range(k):
        stiffest = max(stiffest, chain.bend[j])
    return float(parts[0] + parts[1] + FLOOR * stiffest)


@kernel
def largest_moment(chain: Chain, u: Any, k: int) -> float:
    """Largest bending moment in the wire, N mm, with a floor of a thousandth of a degree."""
    largest = 0.0
    for j in range(k):
        largest = max(largest, chain.bend[j] * max(abs(u[j, 0]), abs(u[j, 1]), 1e-7))
    return largest


@kernel
def crossed(field: Field, state: State, which: int, k: int, spacing: float, scratch: Scratch) -> bool:
    """Whether a joint, moving straight from one state to the other, would pass through wall.

    Passing through means that the distance on the way is positive and above both ends. Moves below half a
    voxel cannot hop over a wall that the grid resolves, so they are not looked up.
    """
    for n in range(1, k + 1):
        a, b = state.x[which, n], state.x[1 - which, n]
        d0, d1, d2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        way = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
        if way > 0.5 * spacing and blocked(field, a, b, way, spacing, scratch) < 1.0:
            return True
    return False


@kernel
def blocked(field: Field, a: Any, b: Any, way: float, spacing: float, scratch: Scratch) -> float:
    """Fraction of the way from a to b that is free of a wall to pass through; 1 if all of it is."""
    steps = math.ceil(2 * way / spacing)
    last = distance_at(field, b, 0.0, b, scratch)
    limit = max(distance_at(field, a, 0.0, b, scratch), last, 0.0) + HOP * spacing
    for i in range(1, steps):
        if distance_at(field, a, i / steps, b, scratch) > limit:
            return (i - 1) / steps
    return 1.0


@kernel
def distance_at(field: Field, a: Any, t: float, b: Any, scratch: Scratch) -> float:
    """Signed distance, mm, at a + t (b - a)."""
    f, w = scratch.fraction, scratch.weights
    x, y, z = a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])
    i, j, k, _ = locate(field, x, y, z, f)
    for axis in range(3):
        basis(f[axis], w[axis])
    return value(field, i, j, k, w)


@kernel
def descend_saddle(
    field: Field,
    stiffness: float,
    spacing: float,
    chain: Chain,
    state: State,
    which: int,
    k: int,
    scratch: Scratch,
    switch: Switch,
    twisting: bool,
    report: Any,
    energy: float,
    parts: Any,
) -> float:
    """Leave a stationary point along its direction of negative curvature; return the new energy, or the old one."""
    j = int(report[2])
    gain = scratch.gain
    for i in range(k):
        gain[i, 0, 0] = gain[i, 1, 0] = gain[i, 2, 0] = 0.0
    size = 0.3
    while size > 1e-6:
        for side in (1.0, -1.0):
            gain[j, 0, 0], gain[j, 1, 0] = side * size * report[3], side * size * report[4]
            rollout(chain, state, which, k, gain, 1.0, twisting)
            scratch.counter[ROLLOUTS] += 1
            trial = total_energy(field, stiffness, chain, state, 1 - which, k, scratch, switch, parts)
            if trial < energy - 0.1 * abs(report[5]) * size * size:
                return trial
        size *= 0.25
    return energy


@kernel
def search(
    field: Field,
    stiffness: float,
    spacing: float,
    chain: Chain,
    state: State,
    which: int,
    k: int,
    scratch: Scratch,
    switch: Switch,
    twisting: bool,
    energy: float,
    decrement: float,
    noise: float,
    parts: Any,
) -> float:
    """Halve Newton's step until the energy falls enough; return the new energy, or inf when it never does."""
    fraction = 1.0
    for _ in range(12):
        rollout(chain, state, which, k, scratch.gain, fraction, twisting)
        scratch.counter[ROLLOUTS] += 1
        trial = total_energy(field, stiffness, chain, state, 1 - which, k, scratch, switch, parts)
        fall = trial <= energy - SUFFICIENT * fraction * decrement
        if fall and not (stiffness > 0.0 and crossed(field, state, which, k, spacing, scratch)):
            return trial
        if decrement <= noise and trial <= energy:
            return trial
        fraction *= 0.4
    return math.inf


@kernel
def minimise(
    field: Field,
    stiffness: float,
    spacing: float,
    chain: Chain,
    state: State,
    k: int,
    scratch: Scratch,
    switch: Switch,
    twisting: bool,
    tolerance: float,
    max_iterations: int,
    report: Any,
    parts: Any,
) -> tuple[int, int, int, float]:
    """Relax the current state (0) with Newton's method.

    Returns (outcome, iterations, which of the two states holds the result, energy); report as in ``sweep`` at
    the result, parts (3,) its energies.
    """
    which = 0
    energy = total_energy(field, stiffness, chain, state, which, k, scratch, switch, parts)
    levenberg = 0.0
    project = False
    if not math.isfinite(energy):
        return BROKEN, 0, which, energy
    for iteration in range(max_iterations):
        sweep(chain, stiffness, state, which, k, scratch, twisting, project, levenberg, report)
        scratch.counter[SWEEPS] += 1
        decrement = report[0]
        if not math.isfinite(decrement):
            return BROKEN, iteration, which, energy
        scale = scale_of(chain, k, parts)
        noise = ROUND_OFF * (scale + abs(parts[2]))
        small = decrement <= max(tolerance * scale, noise)
        level = report[1] <= MOMENT * largest_moment(chain, state.u[which], k) or decrement <= noise
        exact = levenberg == 0.0 and not project
        if small and level and exact and report[2] < 0.0:
            # one more step costs a rollout and squares the error
            rollout(chain, state, which, k, scratch.gain, 1.0, twisting)
            scratch.counter[ROLLOUTS] += 1
            trial = total_energy(field, stiffness, chain, state, 1 - which, k, scratch, switch, parts)
            if trial <= energy:
                which, energy = 1 - which, trial
                costate(chain, stiffness, state, which, k, twisting, report)
            else:
                energy = total_energy(field, stiffness, chain, state, which, k, scratch, switch, parts)
            return CONVERGED, iteration, which, energy
        if small and report[2] >= 0.0 and exact:
            trial = descend_saddle(
                field,
                stiffness,
                spacing,
                chain,
                state,
                which,
                k,
                scratch,
                switch,
                twisting,
                report,
                energy,
                parts,
            )
            if trial >= energy:
                return STALLED, iteration, which, energy
            which, energy = 1 - which, trial
            continue
        trial = search(
            field,
            stiffness,
            spacing,
            chain,
            state,
            which,
            k,
            scratch,
            switch,
            twisting,
            energy,
            decrement,
            noise,
            parts,
        )
        if trial <= energy:
            which, energy = 1 - which, trial
            levenberg = 0.0 if levenberg < 1e-3 else levenberg * 0.1
            project = False
            continue
        # restore the parts and the look-ups of the current state before trying a shorter step
        energy = total_energy(field, stiffness, chain, state, which, k, scratch, switch, parts)
        if decrement <= noise and exact:
            return STALLED, iteration, which, energy
        project = not project and levenberg == 0.0
        if not project:
            scratch.counter[LEVENBERG] += 1
            levenberg = max(10 * levenberg, 1e-2)
        if levenberg > 1e9:
            return STALLED, iteration, which, energy
    return EXHAUSTED, max_iterations, which, energy
