"""Whether a way through the grid passes through a wall: what makes tunnelling impossible."""

import math

from solver import _tolerances as tol
from solver._kernels.algebra import Three, dot, load3, minus, mix
from solver._kernels.data import Field, Problem
from solver._kernels.field import indices, locate, value
from solver._kernels.flags import inlined, kernel


@kernel
def crossed(problem: Problem, slot: int, k: int) -> bool:
    """Whether a joint, moving straight from a state to the other one, would pass through wall.

    Passing through means that the distance on the way is positive and above both ends. Moves below half a
    voxel cannot hop over a wall that the grid resolves, so they are not looked up.
    """
    field, old, new = problem.field, problem.state.x[slot], problem.state.x[1 - slot]
    limit = 0.25 * field.spacing * field.spacing
    for n in range(1, k + 1):
        a, b = load3(old, n), load3(new, n)
        d = minus(b, a)
        square = dot(d, d)
        if square > limit and free_fraction(field, a, b, math.sqrt(square)) < 1.0:
            return True
    return False


@kernel
def free_fraction(field: Field, a: Three, b: Three, way: float) -> float:
    """Fraction of the straight way from a to b, ``way`` mm long, up to a wall that it passes through; 1 if none."""
    here, last = distance_at(field, a, 0.0, b), distance_at(field, a, 1.0, b)
    limit = max(here, last, 0.0) + tol.HOP_VOXELS * field.spacing
    steps = math.ceil(2 * way / field.spacing)
    i = 1 + proven(field, here, way / steps) if steps > 0 else 1
    while i < steps:
        here = distance_at(field, a, i / steps, b)
        if here > limit:
            return (i - 1) / steps
        i += 1 + proven(field, here, way / steps)
    return 1.0


@kernel
def distance_at(field: Field, a: Three, t: float, b: Three) -> float:
    """Signed distance, mm, at a + t (b - a)."""
    q = (a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2]))
    c = field.coefficients
    return float(value(c, locate(c, indices(field.to_index, field.origin, q))))


@kernel
def free_way(field: Field, tip: Three, along: Three, step: float, rise: float) -> float:
    """How far the tip may go straight on, mm: until its axis is ``rise`` mm deeper in the wall, or passes through it.

    Never less than a quarter of ``rise`` (or the whole step), so that a jammed tip still presses on.
    """
    end = mix(1.0, tip, step, along)
    free = way_below(field, tip, end, step, rise)
    # where no other vessel lies ahead there is nothing to tunnel into, and four times as deep is allowed
    if free < 1.0 and not ridge_ahead(field, tip, end, step):
        free = way_below(field, tip, end, step, 4 * rise)
    free *= step * free_fraction(field, tip, mix(1.0, tip, free * step, along), free * step)
    return max(free, min(step, 0.25 * rise))


@kernel
def way_below(field: Field, a: Three, b: Three, way: float, rise: float) -> float:
    """Fraction of the way from a to b until it is ``rise`` mm deeper in the wall than it began."""
    before = distance_at(field, a, 0.0, b)
    steps = 1 + math.ceil(2 * way / field.spacing)
    limit = max(0.0, before) + rise
    i = 1 + proven(field, before, way / steps)
    while i <= steps:
        here = distance_at(field, a, i / steps, b)
        if here > limit:
            before = distance_at(field, a, (i - 1) / steps, b)
            return (i - 1 + max(limit - before, 0.0) / (here - before)) / steps
        i += 1 + proven(field, here, way / steps)
    return 1.0


@kernel
def ridge_ahead(field: Field, a: Three, b: Three, step: float) -> bool:
    """Whether the distance on the ray from a through b rises above the surface and falls again, 2 mm past b."""
    top, i, last = 0.0, 1, 1 + math.ceil(2 * (step + tol.LOOK_AHEAD_MM) / field.spacing)
    while i <= last:
        here = distance_at(field, a, 0.5 * i * field.spacing / step, b)
        if top > 0.0 and here < top - tol.HOP_VOXELS * field.spacing:
            return True
        top = max(top, here)
        i += 1 + proven(field, here, 0.5 * field.spacing)
    return False


@inlined
def proven(field: Field, here: float, apart: float) -> int:
    """How many of the next places, ``apart`` mm apart, must be inside the lumen as well: the slope is bounded."""
    # written so that NaN proves nothing
    if not (here < 0.0 and field.slope > 0.0):
        return 0
    return int(min(-here / (field.slope * apart), 1e6))


@kernel
def admissible(problem: Problem, slot: int, k: int) -> bool:
    """Whether the trial state can be reached from the current one without passing through a wall."""
    return problem.stiffness == 0.0 or not crossed(problem, slot, k)
