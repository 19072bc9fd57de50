"""Coulomb friction as a potential within one step of the wire, and what of it is kept from step to step.

A point in contact holds on to a point of the wall by a spring that slips at μ N: the return mapping of
elastoplasticity (Simo and Laursen, Comput. Struct. 42 (1992) 97). Where the hull is smooth the contact is on the hull,
a radius from the axis along the wall's normal: rolling slips there and meets a torque. Load, normal and place of a
contact are those of the last relaxation; ``minimise`` repeats until they no longer change.

Where a catheter covers the wire the wall rubs on the catheter, which its own hand holds, and the wire slides in it: a
contact there has no load (``exposed``), as one that left the wall. Covered, it lets go of its spring; uncovered, it
holds on anew where it is.
"""

import math

from solver import _tolerances as tol
from solver._kernels import wall_law
from solver._kernels.algebra import (
    ZERO3,
    Nine,
    Six,
    Three,
    add3,
    apply,
    apply_transposed,
    cross,
    dot,
    load3,
    load9,
    minus,
    mix,
    scaled,
    store3,
    store9,
)
from solver._kernels.data import CURRENT, LAST_GOOD, Problem
from solver._kernels.flags import inlined, kernel, merged
from solver._kernels.rollout import relative


@inlined
def lever_of(problem: Problem, p: int) -> Three:
    """Where point p rubs, mm from its node, in the frame of that node."""
    return add3(load3(problem.chain.offset, p), load3(problem.friction.arm, p))


@inlined
def way_of(problem: Problem, slot: int, n: int, p: int) -> Three:
    """How far point p of node n is from what it held on to when the step began, along the wall, mm."""
    friction, state = problem.friction, problem.state
    at = add3(load3(state.x[slot], n), apply(load9(state.r[slot], n), lever_of(problem, p)))
    way, normal = minus(at, load3(friction.start, p)), load3(friction.normal, p)
    return mix(1.0, way, -dot(way, normal), normal)


@kernel
def friction_energy(problem: Problem, slot: int, k: int) -> float:
    """Friction's potential of all points, N mm."""
    friction, chain = problem.friction, problem.chain
    total = 0.0
    for n in range(1, k + 1):
        for p in range(chain.first[n], chain.first[n + 1]):
            if friction.load[p] > 0.0:
                way = way_of(problem, slot, n, p)
                square = dot(way, way)
                if square <= tol.SLIP_MM * tol.SLIP_MM:
                    size = 0.5 * square / tol.SLIP_MM
                else:
                    size = math.sqrt(square) - 0.5 * tol.SLIP_MM
                total += friction.coefficient * friction.load[p] * size
    return total


@inlined
def friction_derivatives(problem: Problem, slot: int, n: int, p: int, frame: Nine) -> tuple[Three, Six]:
    """Gradient and Hessian of a point's energy with respect to its place, in the frame of its node."""
    way = way_of(problem, slot, n, p)
    square = dot(way, way)
    s, m = apply_transposed(frame, way), apply_transposed(frame, load3(problem.friction.normal, p))
    w, q = problem.friction.coefficient * problem.friction.load[p] / tol.SLIP_MM, 0.0
    if square > tol.SLIP_MM * tol.SLIP_MM:
        w *= tol.SLIP_MM / math.sqrt(square)
        q = w / square
    hessian = (
        w * (1 - m[0] * m[0]) - q * s[0] * s[0],
        w * (1 - m[1] * m[1]) - q * s[1] * s[1],
        w * (1 - m[2] * m[2]) - q * s[2] * s[2],
        -w * m[0] * m[1] - q * s[0] * s[1],
        -w * m[0] * m[2] - q * s[0] * s[2],
        -w * m[1] * m[2] - q * s[1] * s[2],
    )
    return scaled(w, s), hessian


@kernel
def take_loads(problem: Problem, slot: int, k: int, share: float) -> tuple[float, float]:
    """Take loads, normals and places of the contacts from a state; return how much that changes the friction.

    That is the largest change of a load, or of a load's lever for the torque, over the largest load; and the change of
    all loads together, N.     share : of the change of a load that is taken.
    """
    friction, chain, state = problem.friction, problem.chain, problem.state
    change, largest, total = 0.0, 0.0, 0.0
    for n in range(1, k + 1):
        frame = load9(state.r[slot], n)
        for p in range(chain.first[n], chain.first[n + 1]):
            d, load = state.penetration[slot, p], 0.0
            if d != 0.0:
                jet = state.jet[slot, p]
                slope = math.sqrt(jet[1] * jet[1] + jet[2] * jet[2] + jet[3] * jet[3])
                load = wall_law.force(problem.stiffness, chain.weight[p], d) * slope * friction.exposed[p]
                turned = hold(problem, frame, p, scaled(1.0 / max(slope, 1e-12), (jet[1], jet[2], jet[3])))
                change = max(change, load * turned)
            change = max(change, abs(load - friction.load[p]))
            largest = max(largest, load)
            total += load - friction.load[p]
            friction.load[p] = max(friction.load[p] + share * (load - friction.load[p]), 0.0)
        store_start(problem, n)
    if largest > 0.0:
        return change / largest, total
    # a wire that friction has lifted off the wall is not at rest without it
    return (1.0 if change > 0.0 else 0.0), total


@kernel
def hold_on(problem: Problem, k: int) -> None:
    """Let each contact hold with no less than the load of the step before, until the shape has told its load."""
    friction, chain = problem.friction, problem.chain
    end = chain.first[k + 1] - 1
    for p in range(chain.first[1], end + 1):
        if friction.load[p] > 0.0:
            friction.load[p] = max(friction.load[p], friction.pressed[end - p])


@inlined
def hold(problem: Problem, frame: Nine, p: int, normal: Three) -> float:
    """Store normal and place of a contact; return the angle, rad, by which the place moved around the wire.

    On a wire thicker than TURN_RADIUS_MM the angle is scaled up by the ratio of the radii; a sampled hull gives 0.
    """
    friction = problem.friction
    store3(friction.normal, p, normal)
    if friction.radius == 0.0:
        return 0.0
    arm = scaled(friction.radius, apply_transposed(frame, normal))
    change = minus(arm, load3(friction.arm, p))
    store3(friction.arm, p, arm)
    return math.sqrt(dot(change, change)) / min(friction.radius, tol.TURN_RADIUS_MM)


@inlined
def store_start(problem: Problem, n: int) -> None:
    """Find what each point of a node holds on to: its place before the step, less what its spring is stretched by."""
    friction, chain = problem.friction, problem.chain
    frame = load9(friction.frame, n)
    for p in range(chain.first[n], chain.first[n + 1]):
        store3(friction.start, p, add3(load3(friction.held, p), apply(frame, lever_of(problem, p))))


@kernel
def anchor_friction(problem: Problem, was: int, k: int, ahead: float, shaft_mm: float) -> None:
    """Note where each point's material was before a step, to measure sliding from: in LAST_GOOD, of ``was`` segments.

    Joints are fixed to the wire and counted from the tip. What is now within ``ahead`` mm of the entry was in the
    introducer.
    """
    chain, friction = problem.chain, problem.friction
    x, r = problem.state.x[LAST_GOOD], problem.state.r[LAST_GOOD]
    base, arc, end = load9(problem.state.r[CURRENT], 0), 0.0, chain.first[k + 1] - 1
    for n in range(1, k + 1):
        arc += chain.length[n - 1]
        m = n - k + was
        frame, at = base, load3(x, max(m, 0))
        if was > 0:
            # a shaft that is twisted outside comes in as it is turned at the entry, not in the hand
            frame = load9(r, m if m > 0 else (1 if arc > ahead or shaft_mm > 0.0 else 0))
        if m <= 0:
            along = frame if arc > ahead else base
            at = mix(1.0, at, arc - ahead, (along[2], along[5], along[8]))
        store9(friction.frame, n, frame)
        for p in range(chain.first[n], chain.first[n + 1]):
            store3(friction.held, p, minus(at, load3(friction.stretch, end - p)))
            store3(friction.arm, p, ZERO3)
            friction.load[p] = 0.0


@kernel
def friction_loss(problem: Problem, k: int, ahead: float) -> float:
    """Work that was lost by slipping in the step that is ending, by ``ahead`` mm, N mm."""
    friction, chain = problem.friction, problem.chain
    end, work = chain.first[k + 1] - 1, 0.0
    # points that slid back into the introducer: of the step's two ends they are loaded at the first alone, and where
    # they went on straight behind the entry, as those that come in came
    for back in range(end + 1, friction.pressed.size):
        work += 0.5 * friction.coefficient * friction.pressed[back] * max(-ahead - tol.SLIP_MM, 0.0)
    for n in range(1, k + 1):
        for p in range(chain.first[n], chain.first[n + 1]):
            load, before = friction.load[p], friction.pressed[end - p]
            if load + before > 0.0:
                arc = arc_of(problem, n, p, way_in(problem, n, p, load))
                # the load of the step is the mean of its two ends: with the last one alone the error is of first order
                slid = max(math.sqrt(dot(arc, arc)) - tol.SLIP_MM, 0.0)
                work += 0.5 * friction.coefficient * (load + before) * slid
    return work


@inlined
def way_in(problem: Problem, n: int, p: int, load: float) -> Three:
    """How far a point is from what it held on to, mm: along the wall, or in any direction where it has left it."""
    if load > 0.0:
        return way_of(problem, CURRENT, n, p)
    state = problem.state
    at = add3(load3(state.x[CURRENT], n), apply(load9(state.r[CURRENT], n), lever_of(problem, p)))
    return minus(at, load3(problem.friction.start, p))


@kernel
def settle_friction(problem: Problem, k: int) -> None:
    """Store the stretch and the load of each spring after a step, counted from the tip: they stay with the material."""
    friction, chain = problem.friction, problem.chain
    end = chain.first[k + 1] - 1
    for n in range(1, k + 1):
        for p in range(chain.first[n], chain.first[n + 1]):
            way = way_of(problem, CURRENT, n, p) if friction.load[p] > 0.0 else ZERO3
            size = math.sqrt(dot(way, way))
            store3(friction.stretch, end - p, scaled(tol.SLIP_MM / size if size > tol.SLIP_MM else 1.0, way))
            friction.pressed[end - p] = friction.load[p]
    for back in range(end + 1, friction.pressed.size):
        store3(friction.stretch, back, ZERO3)
        friction.pressed[back] = 0.0


@inlined
def arc_of(problem: Problem, n: int, p: int, way: Three) -> Three:
    """A way slid, with the arc that the hull rolled: ``way`` holds its sine, 1.1 % less in a step of 15 degrees."""
    friction, frame = problem.friction, load9(problem.state.r[CURRENT], n)
    along = (frame[2], frame[5], frame[8])
    sine = dot(relative(load9(friction.frame, n), frame), along)
    more = math.asin(min(max(sine, -1.0), 1.0)) - sine
    arm = apply(frame, load3(friction.arm, p))
    return add3(way, scaled(more, cross(along, arm)))


@merged
def friction_force(problem: Problem, back: int) -> Three:
    """Friction on the wire at a point after the last step, N; back : its place counted from the tip's last point."""
    friction = problem.friction
    return scaled(-friction.coefficient * friction.pressed[back] / tol.SLIP_MM, load3(friction.stretch, back))
