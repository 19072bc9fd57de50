"""Whether a way through the grid passes through a wall: what makes tunnelling impossible."""

from __future__ import annotations

import math
from typing import Any

from solver import _tolerances as tol
from solver._kernels.flags import kernel
from solver._kernels.problem import Problem, Scratch
from solver._kernels.spline import Field, basis, locate, value

HOP = tol.HOP_VOXELS


@kernel
def crossed(problem: Problem, which: int, k: int) -> bool:
    """Whether a joint, moving straight from one state to the other, would pass through wall.

    Passing through means that the distance on the way is positive and above both ends. Moves below half a
    voxel cannot hop over a wall that the grid resolves, so they are not looked up.
    """
    state = problem.state
    for n in range(1, k + 1):
        a, b = state.x[which, n], state.x[1 - which, n]
        d0, d1, d2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        way = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
        if way > 0.5 * problem.spacing:
            free = free_fraction(problem.field, a, b, way, problem.spacing, problem.scratch)
            if free < 1.0:
                return True
    return False


@kernel
def free_fraction(field: Field, a: Any, b: Any, way: float, spacing: float, scratch: Scratch) -> float:
    """Fraction of the way from a to b that is free of a wall to pass through; 1 if all of it is."""
    last = distance_at(field, b, 0.0, b, scratch)
    limit = max(distance_at(field, a, 0.0, b, scratch), last, 0.0) + HOP * spacing
    steps = math.ceil(2 * way / spacing)
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
