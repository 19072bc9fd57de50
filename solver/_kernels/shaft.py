"""The shaft outside the body: straight and guided between hand and entry, it twists, and friction holds it.

Its twist is part of the first joint's, whose cell is longer by the shaft (``chain.lay_out``). Friction D is uniform
along it: half of D at the entry and half in the hand twist a turning shaft of length L by the same D r L/2GJ. As at the
wall, a spring that slips resists sliding and turning together: while the shaft is pushed it turns freely.
"""

import math

from solver import _tolerances as tol
from solver._kernels.algebra import Nine, Three, dot, dyad, load9, scaled, store3, store9
from solver._kernels.data import CURRENT, LAST_GOOD, Problem, Shaft
from solver._kernels.flags import inlined, kernel

ENTRY, HAND = 0, 1


@kernel
def anchor_shaft(problem: Problem, was: int, ahead: float, turn: float) -> None:
    """Store the hand's move in a step, mm and rad, and the frame at the entry before it (wire of ``was`` segments)."""
    shaft = problem.shaft
    shaft.step[0], shaft.step[1] = ahead, shaft.radius * turn
    store9(shaft.frame, 0, load9(problem.state.r[LAST_GOOD], 1) if was > 0 else load9(problem.state.r[CURRENT], 0))


@inlined
def turned(problem: Problem, frame: Nine) -> tuple[float, Three]:
    """Angle, rad, by which the wire turned at the entry in this step, and its gradient in the frame there."""
    old = load9(problem.shaft.frame, 0)
    one, two = (old[0], old[3], old[6]), (old[1], old[4], old[7])
    x, y = (frame[0], frame[3], frame[6]), (frame[1], frame[4], frame[7])
    z = (frame[2], frame[5], frame[8])
    c, s = dot(x, one), dot(x, two)
    square = c * c + s * s
    # material axis 1 moves by δr_3 y - δr_2 z
    over_2, over_3 = s * dot(z, one) - c * dot(z, two), c * dot(y, two) - s * dot(y, one)
    return math.atan2(s, c), (0.0, over_2 / square, over_3 / square)


@inlined
def ways(problem: Problem, turn: float) -> tuple[float, float]:
    """How far the spring at the entry is stretched, mm along and around the shaft, once the wire turned there."""
    shaft = problem.shaft
    return shaft.stretch[ENTRY, 0] + shaft.step[0], shaft.stretch[ENTRY, 1] + shaft.radius * turn


@kernel
def shaft_energy(problem: Problem, slot: int) -> float:
    """Energy of the spring at the entry, N mm; its derivatives by turning the first segment go to the state.

    held[slot] : its gradient and the six numbers of its Gauss-Newton Hessian, in the frame of that segment. They are
    kept there because reading the shaft in the loop over the joints, for its arrays' reference counts, takes four times
    as long as all the rest.
    """
    shaft, held = problem.shaft, problem.state.held[slot]
    turn, slope = turned(problem, load9(problem.state.r[slot], 1))
    along, around = ways(problem, turn)
    size, radius = math.sqrt(along * along + around * around), shaft.radius
    force = 0.5 * shaft.drag / max(size, tol.SLIP_MM)
    stiffness = force if size <= tol.SLIP_MM else force * along * along / (size * size)
    h = dyad(scaled(stiffness * radius * radius, slope), slope)
    store3(held, 0, scaled(force * around * radius, slope))
    store3(held, 1, h[:3])
    store3(held, 2, h[3:])
    if size <= tol.SLIP_MM:
        return 0.25 * shaft.drag * size * size / tol.SLIP_MM
    return 0.5 * shaft.drag * (size - 0.5 * tol.SLIP_MM)


def shaft_forces(shaft: Shaft) -> tuple[float, float]:
    """The hand's force against friction of the shaft, N, and its torque, N mm, against the half of it in the hand.

    The torque against the half at the entry is transmitted by twist, and counted already.
    """
    held = 0.5 * shaft.drag / tol.SLIP_MM * shaft.stretch
    return float(held[ENTRY, 0] + held[HAND, 0]), float(held[HAND, 1] * shaft.radius)


@kernel
def loss_by_turning(problem: Problem, k: int) -> float:
    """Work that friction at the entry takes from the wire turning there in this step, N mm, done by the hand's torque.

    The work of pushing the shaft is left out, as that force is not in the hand's push here, see ``shaft_forces``.
    """
    turn = turned(problem, load9(problem.state.r[CURRENT], min(k, 1)))[0]
    along, around = ways(problem, turn)
    size = math.sqrt(along * along + around * around)
    return 0.5 * problem.shaft.drag * around * around / size * (1.0 - tol.SLIP_MM / size) if size > tol.SLIP_MM else 0.0


@kernel
def settle_shaft(problem: Problem, k: int) -> float:
    """Remember the springs after a step; return the work that was lost by slipping, N mm."""
    shaft, work = problem.shaft, 0.0
    turn = turned(problem, load9(problem.state.r[CURRENT], min(k, 1)))[0]
    along, around = ways(problem, turn)
    work = slipped(shaft, ENTRY, along, around)
    return work + slipped(shaft, HAND, shaft.stretch[HAND, 0] + shaft.step[0], shaft.stretch[HAND, 1] + shaft.step[1])


@inlined
def slipped(shaft: Shaft, place: int, along: float, around: float) -> float:
    """Let a spring slip where it is stretched by more than SLIP_MM, and store the rest; return the work lost, N mm."""
    size = math.sqrt(along * along + around * around)
    kept = tol.SLIP_MM / size if size > tol.SLIP_MM else 1.0
    shaft.stretch[place, 0], shaft.stretch[place, 1] = kept * along, kept * around
    return 0.5 * shaft.drag * max(size - tol.SLIP_MM, 0.0)
