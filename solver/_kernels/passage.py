"""Whether a way through the grid passes through a wall: what makes tunnelling impossible."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from solver import _tolerances as tol
from solver._kernels.flags import kernel
from solver._kernels.problem import Problem
from solver._kernels.spline import Field, locate, set_basis, value

HOP = tol.HOP_VOXELS
LOOK_AHEAD = tol.LOOK_AHEAD_MM


@kernel
def crossed(problem: Problem, which: int, k: int) -> bool:
    """Whether a joint, moving straight from one state to the other, would pass through wall.

    Passing through means that the distance on the way is positive and above both ends. Moves below half a
    voxel cannot hop over a wall that the grid resolves, so they are not looked up.
    """
    x, limit = problem.state.x, 0.25 * problem.spacing * problem.spacing
    old, new = x[which], x[1 - which]
    for n in range(1, k + 1):
        d0, d1, d2 = new[n, 0] - old[n, 0], new[n, 1] - old[n, 1], new[n, 2] - old[n, 2]
        square = d0 * d0 + d1 * d1 + d2 * d2
        if square > limit and hops(problem, old[n], new[n], math.sqrt(square)):
            return True
    return False


@kernel
def hops(problem: Problem, a: Any, b: Any, way: float) -> bool:
    """Whether the straight way from a to b passes through wall."""
    return free_fraction(problem.field, a, b, way, problem.spacing, problem.scratch.weights) < 1.0


@kernel
def free_fraction(field: Field, a: Any, b: Any, way: float, spacing: float, weights: Any) -> float:
    """Fraction of the way from a to b that is free of a wall to pass through; 1 if all of it is."""
    last = distance_at(field, a, 1.0, b, weights)
    limit = max(distance_at(field, a, 0.0, b, weights), last, 0.0) + HOP * spacing
    steps = math.ceil(2 * way / spacing)
    for i in range(1, steps):
        if distance_at(field, a, i / steps, b, weights) > limit:
            return (i - 1) / steps
    return 1.0


@kernel
def distance_at(field: Field, a: Any, t: float, b: Any, weights: Any) -> float:
    """Signed distance, mm, at a + t (b - a)."""
    x, y, z = a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])
    i, j, k, u, v, w = locate(field.coefficients, field.to_index, field.origin, x, y, z)
    set_basis(u, v, w, weights)
    return float(value(field.coefficients, i, j, k, weights))


@kernel
def free_way(
    field: Field, tip: Any, along: Any, step: float, spacing: float, rise: float, weights: Any
) -> float:
    """How far the tip may go straight on, mm: until its axis is ``rise`` mm deeper in the wall (or beyond it).

    Never less than a quarter of that, so that a jammed tip still presses on.
    """
    end = np.empty(3)
    for a in range(3):
        end[a] = tip[a] + step * along[a]
    before = distance_at(field, tip, 0.0, end, weights)
    steps = 1 + math.ceil(2 * step / spacing)
    # where no other vessel lies ahead there is nothing to tunnel into, and four times as deep is allowed
    ease = 1.0 if ridge_ahead(field, tip, end, step, spacing, weights) else 4.0
    limit = max(0.0, before) + ease * rise
    free = 1.0
    for i in range(1, steps + 1):
        here = distance_at(field, tip, i / steps, end, weights)
        if here > limit:
            free = (i - 1 + max(limit - before, 0.0) / (here - before)) / steps
            break
        before = here
    for a in range(3):
        end[a] = tip[a] + free * step * along[a]
    free *= step * free_fraction(field, tip, end, free * step, spacing, weights)
    return max(free, min(step, 0.25 * rise))


@kernel
def ridge_ahead(field: Field, a: Any, b: Any, step: float, spacing: float, weights: Any) -> bool:
    """Whether the distance on the ray from a through b rises above the surface and falls again, 2 mm past b."""
    top = 0.0
    for i in range(1, 2 + math.ceil(2 * (step + LOOK_AHEAD) / spacing)):
        here = distance_at(field, a, 0.5 * i * spacing / step, b, weights)
        if top > 0.0 and here < top - HOP * spacing:
            return True
        top = max(top, here)
    return False
