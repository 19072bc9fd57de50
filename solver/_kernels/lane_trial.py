"""A trial state of wires in lanes: laid out as by ``rollout``, its energy, and its acceptance."""

from typing import Any

from solver import _tolerances as tol
from solver._kernels import wall_law
from solver._kernels.algebra import Three, apply_transposed, dot, load3, load9, minus, store3, store9, times
from solver._kernels.data import CURRENT, TRIAL, Field
from solver._kernels.field import Cell, depth_in_grid, indices, jet_at, locate, trilinear, value
from solver._kernels.flags import inlined, kernel
from solver._kernels.lane_block import (
    ACCEPTED,
    ACTIVE,
    ALONG,
    ANCHOR,
    BENDING,
    CHEAP,
    CLEAR,
    FRACTION,
    FULL,
    JUMP,
    LOAD,
    REACH,
    START,
    STIFFNESS,
    STILL,
    WALL,
    WEIGHT,
    Block,
)
from solver._kernels.lane_newton import turn_of
from solver._kernels.lanes import WIDTH, anywhere, bits, greater, select, select3, size, spread
from solver._kernels.rollout import limited, relative

NO_JET = (0.0,) * 10


@kernel
def rollout(b: Block, base: int, spacing: float) -> None:
    """``rollout.rollout`` of every lane from joint ``base`` on, and what of the energy comes with it.

    spacing : of the field, mm; see ``crossing.crossed``.
    """
    old_u, old_x, old_r, u, x, r = b.u[CURRENT], b.x[CURRENT], b.r[CURRENT], b.u[TRIAL], b.x[TRIAL], b.r[TRIAL]
    fraction, start, zero = b.number[FRACTION], b.number[START], spread(0.0)
    frame, at = load9(old_r, base), load3(old_x, base)
    store9(r, base, frame)
    store3(x, base, at)
    energy, furthest = zero, zero
    for j in range(base, b.length.shape[0]):
        ahead, there, before = load9(old_r, j + 1), load3(old_x, j + 1), (old_u[j, 0], old_u[j, 1], zero)
        moved = apply_transposed(ahead, minus(at, load3(old_x, j)))
        turned = apply_transposed(ahead, relative(load9(old_r, j), frame))
        v = limited(before, answer(b.gain, j, fraction, moved, turned))
        length, held = b.length[j], start > float(j)
        if anywhere(held):
            v = select3(held, before, v)
        frame = times(frame, turn_of(b, j, v))
        at = (at[0] + length * frame[2], at[1] + length * frame[5], at[2] + length * frame[8])
        if anywhere(held):
            frame, at = select9(held, ahead, frame), select3(held, there, at)
        u[j, 0], u[j, 1] = v[0], v[1]
        store9(r, j + 1, frame)
        store3(x, j + 1, at)
        energy = energy + 0.5 * b.bend[j] * (v[0] * v[0] + v[1] * v[1])
        way = minus(at, there)
        furthest = greater(furthest, dot(way, way))
    b.number[BENDING], b.number[LOAD] = energy, -(b.load[0] * at[0] + b.load[1] * at[1] + b.load[2] * at[2])
    b.number[JUMP] = select(furthest > 0.25 * spacing * spacing, 1.0, zero)


@inlined
def answer(gain: Any, j: int, fraction: Any, dp: Three, dr: Three) -> Three:
    """``rollout.answer`` with two controls."""
    one = fraction * gain[j, 0, 0]
    two = fraction * gain[j, 1, 0]
    one += gain[j, 0, 1] * dp[0] + gain[j, 0, 2] * dp[1] + gain[j, 0, 3] * dp[2]
    two += gain[j, 1, 1] * dp[0] + gain[j, 1, 2] * dp[1] + gain[j, 1, 3] * dp[2]
    one += gain[j, 0, 4] * dr[0] + gain[j, 0, 5] * dr[1] + gain[j, 0, 6] * dr[2]
    two += gain[j, 1, 4] * dr[0] + gain[j, 1, 5] * dr[1] + gain[j, 1, 6] * dr[2]
    return one, two, spread(0.0)


@inlined
def select9(condition: Any, one: Any, other: Any) -> Any:
    """``select`` of nine numbers."""
    head = select3(condition, one[:3], other[:3])
    return head + select3(condition, one[3:6], other[3:6]) + select3(condition, one[6:], other[6:])


@kernel
def wall_energy(b: Block, raw: Block, field: Field, first: Any, base: int) -> None:
    """``energy.wall_energy`` of the trial in every active lane.

    The way from a point's last look-up decides for all lanes at once; those that need a look-up get one each.
    raw : the numbers of b.
    """
    c, m, o, gap, square = field.coefficients, field.to_index, field.origin, field.gap, field.slope * field.slope
    spacing = field.spacing
    x, r, site, touch, number, asked = b.x[TRIAL], b.r[TRIAL], b.site, b.touch[TRIAL], b.number, b.asked
    sites, touches, numbers, asks = raw.site, raw.touch[TRIAL], raw.number, raw.asked
    reach, zero = number[REACH], spread(0.0)
    total, clear = zero, number[CLEAR]
    for n in range(base + 1, b.length.shape[0] + 1):
        for p in range(first[n], first[n + 1]):
            along = site[p, ALONG]
            q = (x[n, 0] + along * r[n, 0, 2], x[n, 1] + along * r[n, 1, 2], x[n, 2] + along * r[n, 2, 2])
            room = -site[p, ANCHOR + 3] - reach
            way = minus(q, (site[p, ANCHOR], site[p, ANCHOR + 1], site[p, ANCHOR + 2]))
            still = (room >= 0.0) & (square * dot(way, way) <= room * room)
            here = (number[ACTIVE] > 0.0) & (site[p, WEIGHT] > 0.0)
            clear = clear + select(here & still, 1.0, zero)
            touch[p, 0] = zero
            wanted = bits(here & ~still)
            if wanted != 0:
                asked[0], asked[1], asked[2], asked[3] = q[0], q[1], q[2], room
                for lane in range(WIDTH):
                    if wanted >> lane & 1:
                        at = (asks[0, lane], asks[1, lane], asks[2, lane])
                        f = indices(m, o, at)
                        how = numbers[REACH, lane], gap, asks[3, lane] < 0.0, -spacing * depth_in_grid(c, f)
                        found = look(c, m, locate(c, f), how)
                        numbers[CHEAP if found[0] < 0.0 else FULL, lane] += 1.0
                        keep(sites, touches, p, lane, at, found)
                total = total + wall_law.energy(number[STIFFNESS], site[p, WEIGHT], touch[p, 0])
    number[WALL], number[CLEAR] = total, clear


@inlined
def keep(sites: Any, touches: Any, p: int, lane: int, at: Three, found: tuple[float, float, Any]) -> None:
    """Keep what the look-up of a point said."""
    d, known, jet = found
    sites[p, ANCHOR, lane], sites[p, ANCHOR + 1, lane], sites[p, ANCHOR + 2, lane] = at
    sites[p, ANCHOR + 3, lane] = known
    if d > 0.0:
        touches[p, 0, lane] = d
        for a in range(10):
            touches[p, 1 + a, lane] = jet[a]


@kernel
def look(c: Any, m: Any, cell: Cell, how: tuple[float, float, bool, float]) -> tuple[float, float, Any]:
    """Look a point up as ``energy.wall_energy`` does: penetration, what is known of the distance, and the jet.

    how : reach, the field's gap, whether it touched when it was looked up last, and how far outside the grid it is, mm.
    The penetration is 0 off contact, and -1 where the first, cheap look was enough.
    """
    reach, gap, touched, border = how
    d, jet, cheap = -1.0, NO_JET, False
    if not touched:
        phi = trilinear(c, cell)
        cheap = border <= 0.0 and phi + gap + reach <= 0.0
        # as good as certain to touch: its value alone is not asked first
        touched = phi - gap + reach > 0.0
        if cheap:
            d = phi + gap + reach
        elif not touched:
            d = value(c, cell) + reach
    if touched or d > 0.0:
        first, second = jet_at(c, m, cell)
        jet = first + second
        d = first[0] + reach
    return -1.0 if cheap else max(d, 0.0), max(d - reach, border) if border <= 0.0 else 1.0, jet


@kernel
def accept(b: Block, first: Any, base: int) -> None:
    """Make the trial the current state in the lanes that accept it; say which joint is the first that it turned.

    Turned: by more than ``tol.UNMOVED`` of the joint that it turned most.
    """
    accepted, k, zero = b.number[ACCEPTED] > 0.0, b.length.shape[0], spread(0.0)
    u, x, r, touch = b.u[CURRENT], b.x[CURRENT], b.r[CURRENT], b.touch[CURRENT]
    new_u, new_x, new_r, new_touch = b.u[TRIAL], b.x[TRIAL], b.r[TRIAL], b.touch[TRIAL]
    largest, still = zero, spread(float(k))
    for j in range(base, k):
        largest = greater(largest, greater(size(new_u[j, 0] - u[j, 0]), size(new_u[j, 1] - u[j, 1])))
    for j in range(k - 1, base - 1, -1):
        change = greater(size(new_u[j, 0] - u[j, 0]), size(new_u[j, 1] - u[j, 1]))
        still = select(change > tol.UNMOVED * largest, float(j), still)
        u[j, 0], u[j, 1] = select(accepted, new_u[j, 0], u[j, 0]), select(accepted, new_u[j, 1], u[j, 1])
    b.number[STILL] = still
    for n in range(base + 1, k + 1):
        store3(x, n, select3(accepted, load3(new_x, n), load3(x, n)))
        store9(r, n, select9(accepted, load9(new_r, n), load9(r, n)))
        for p in range(first[n], first[n + 1]):
            touches = anywhere(new_touch[p, 0] > 0.0)
            for a in range(11 if touches else 1):
                touch[p, a] = select(accepted, new_touch[p, a], touch[p, a])
